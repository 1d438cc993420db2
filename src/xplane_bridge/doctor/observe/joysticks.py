"""Finds joysticks as the kernel lists them."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, Tuple


@dataclass(frozen=True)
class Joystick:
    """A joystick.

    Attributes:
        device: Its file, e.g. `/dev/input/js0`.
        name: As the device calls itself; empty where the kernel does not say.
        readable: Whether this user may read it.
        event: The file of the same device that SDL reads, e.g. `/dev/input/event5`; empty where the kernel names none.
        event_readable: Whether this user may read that; it has permissions of its own.
    """

    device: str
    name: str
    readable: bool
    event: str = ""
    event_readable: bool = True


@dataclass(frozen=True)
class Joysticks:
    """All joysticks.

    Attributes:
        found: Those that are there.
        supported: Whether this system lists them where they are looked for (Linux does).
    """

    found: Tuple[Joystick, ...] = ()
    supported: bool = True


def observe(devices: Path = Path("/dev/input"), proc: Path = Path("/proc")) -> Joysticks:
    """Looks for joysticks."""
    known = _known(proc)
    found = []
    for device in sorted(devices.glob("js*")):
        name, event = known.get(device.name, ("", ""))
        file = devices / event
        event_readable = not event or os.access(file, os.R_OK)
        found.append(
            Joystick(str(device), name, os.access(device, os.R_OK), str(file) if event else "", event_readable)
        )
    return Joysticks(tuple(found), supported=proc.is_dir())


def _known(proc: Path) -> Dict[str, Tuple[str, str]]:
    """The name and the event handler (`event5`) of each device, by its handlers (`js0`, `event5`)."""
    try:
        text = (proc / "bus" / "input" / "devices").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    known: Dict[str, Tuple[str, str]] = {}
    for block in text.split("\n\n"):
        name = re.search(r'^N: Name="(.*)"$', block, re.MULTILINE)
        handlers = re.search(r"^H: Handlers=(.*)$", block, re.MULTILINE)
        if name and handlers:
            all_of_it = handlers.group(1).split()
            event = next((handler for handler in all_of_it if re.fullmatch(r"event\d+", handler)), "")
            known.update((handler, (name.group(1), event)) for handler in all_of_it)
    return known
