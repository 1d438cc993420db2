"""Reads what the bridge has noted of changes in X-Plane that it has not undone yet (docs/journal.md)."""

from __future__ import annotations

import enum
import json
import re
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Tuple

_FORMAT = "xplane_bridge journal"
_VERSION = 1


class Owner(enum.Enum):
    """How the process is that noted a change."""

    RUNS = "runs"
    #: Stopped by a signal or a debugger: it does nothing.
    STOPPED = "stopped"
    GONE = "gone"
    #: On another computer: not seen from here, taken to run.
    ELSEWHERE = "elsewhere"


@dataclass(frozen=True)
class Entry:
    """One change in X-Plane.

    Attributes:
        id: As in the file, e.g. `override:sim/operation/override/override_joystick`.
        purpose: `override`, `data_output`, `field_of_view`, ...
        node: Name of the node that made it.
        pid: Its process number.
        computer: Name of its computer.
        owner: How that process is.
    """

    id: str
    purpose: str
    node: str
    pid: int
    computer: str
    owner: Owner


@dataclass(frozen=True)
class Journal:
    """One file, for one X-Plane.

    Attributes:
        file: Its path.
        host: IPv4 address of X-Plane.
        port: UDP port X-Plane listens on.
        entries: What is not undone yet.
        error: Why it cannot be understood; empty otherwise.
    """

    file: Path
    host: str
    port: int
    entries: Tuple[Entry, ...] = ()
    error: str = ""


def read(folder: Path, proc: Path = Path("/proc")) -> Tuple[Journal, ...]:
    """All journals of a folder; none where there is no such folder."""
    found = []
    for file in sorted(folder.glob("*.json")) if folder.is_dir() else []:
        match = re.fullmatch(r"(.+)_(\d+)\.json", file.name)
        if not match:
            continue
        host, port = match.group(1), int(match.group(2))
        try:
            found.append(Journal(file, host, port, _entries(file, proc)))
        except FileNotFoundError:  # everything was undone just now
            continue
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            found.append(Journal(file, host, port, error=f"{type(error).__name__}: {error}"))
    return tuple(found)


def _entries(file: Path, proc: Path) -> Tuple[Entry, ...]:
    content = json.loads(file.read_text(encoding="utf-8"))
    if content.get("format") != _FORMAT or content.get("version") != _VERSION:
        msg = f"expected format {_FORMAT!r} of version {_VERSION}"
        raise ValueError(msg)
    return tuple(_entry(entry, proc) for entry in content["entries"])


def _entry(entry: Any, proc: Path) -> Entry:
    owner = entry["owner"]
    return Entry(
        id=str(entry["id"]),
        purpose=str(entry["purpose"]),
        node=str(owner["node"]),
        pid=int(owner["pid"]),
        computer=str(owner["computer"]),
        owner=_owner(owner, proc),
    )


def _owner(owner: Any, proc: Path) -> Owner:
    """As the bridge itself judges it: by boot, process number and start time."""
    boot = (proc / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    if owner["boot_id"] != boot:
        return Owner.GONE if owner["computer"] == socket.gethostname() else Owner.ELSEWHERE
    try:
        # Behind the program's name, which is in parentheses and may hold anything: fields 3 (state) and further.
        fields = (proc / str(owner["pid"]) / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return Owner.GONE
    if int(fields[19]) != int(owner["start_ticks"]) or fields[0] == "Z":
        return Owner.GONE
    return Owner.STOPPED if fields[0] in "Tt" else Owner.RUNS
