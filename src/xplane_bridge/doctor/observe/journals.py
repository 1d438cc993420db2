"""Reads what the bridge has noted of changes in X-Plane that it has not undone yet (docs/nodes/journal.md)."""

from __future__ import annotations

import enum
import json
import re
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

#: What a file says of itself.
HEAD = {"format": "xplane_bridge journal", "version": 1}


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
    for file, host, port in files(folder):
        try:
            entries = tuple(_entry(entry, proc) for entry in load(file))
            found.append(Journal(file, host, port, entries))
        except FileNotFoundError:  # everything was undone just now
            continue
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            found.append(Journal(file, host, port, error=f"{type(error).__name__}: {error}"))
    return tuple(found)


def files(folder: Path) -> Iterator[Tuple[Path, str, int]]:
    """The journals of a folder, those of subscriptions as well, each with address and port of its X-Plane."""
    for file in sorted(folder.glob("*.json")) if folder.is_dir() else []:
        match = re.fullmatch(r"(.+)_(\d+)(?:_subscriptions)?\.json", file.name)
        if match:
            yield file, match.group(1), int(match.group(2))


def load(file: Path) -> List[Dict[str, Any]]:
    """The entries of a file as they stand there.

    Raises:
        FileNotFoundError: There is none: nothing is to be undone.
        ValueError, KeyError, TypeError, AttributeError: It is no journal.
    """
    content = json.loads(file.read_text(encoding="utf-8"))
    if {key: content.get(key) for key in HEAD} != HEAD:
        msg = f"expected format {HEAD['format']!r} of version {HEAD['version']}"
        raise ValueError(msg)
    return list(content["entries"])


def _entry(entry: Any, proc: Path) -> Entry:
    owner = entry["owner"]
    return Entry(
        id=str(entry["id"]),
        purpose=str(entry["purpose"]),
        node=str(owner["node"]),
        pid=int(owner["pid"]),
        computer=str(owner["computer"]),
        owner=judge_owner(owner, proc),
    )


def judge_owner(owner: Any, proc: Path) -> Owner:
    """How the owner's process is, as the bridge itself judges it: by boot, process number and start time."""
    if owner["boot_id"] != boot_id(proc):
        return Owner.GONE if owner["computer"] == socket.gethostname() else Owner.ELSEWHERE
    try:
        state, start_ticks = process_status(proc, str(owner["pid"]))
    except OSError:
        return Owner.GONE
    if start_ticks != int(owner["start_ticks"]) or state == "Z":
        return Owner.GONE
    return Owner.STOPPED if state in "Tt" else Owner.RUNS


def process_status(proc: Path, pid: str) -> Tuple[str, int]:
    """State of a process and when it was started [clock ticks since the boot]; OSError where there is none."""
    # Behind the program's name, which is in parentheses and may hold anything: fields 3 (state) and further.
    fields = (proc / pid / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return fields[0], int(fields[19])


def boot_id(proc: Path) -> str:
    """Which boot of this computer it is."""
    return (proc / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
