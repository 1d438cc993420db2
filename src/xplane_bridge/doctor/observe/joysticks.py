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
    """

    device: str
    name: str
    readable: bool


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
    names = _names(proc)
    found = tuple(
        Joystick(str(device), names.get(device.name, ""), os.access(device, os.R_OK))
        for device in sorted(devices.glob("js*"))
    )
    return Joysticks(found, supported=proc.is_dir())


def _names(proc: Path) -> Dict[str, str]:
    """The name of each device by its handlers (`js0`, `event5`)."""
    try:
        text = (proc / "bus" / "input" / "devices").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    names: Dict[str, str] = {}
    for block in text.split("\n\n"):
        name = re.search(r'^N: Name="(.*)"$', block, re.MULTILINE)
        handlers = re.search(r"^H: Handlers=(.*)$", block, re.MULTILINE)
        if name and handlers:
            names.update((handler, name.group(1)) for handler in handlers.group(1).split())
    return names
