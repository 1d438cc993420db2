"""Reads what the bridge has noted of changes in X-Plane that it has not undone yet (docs/nodes/journal.md)."""

from __future__ import annotations

import contextlib
import enum
import importlib
import json
import os
import re
import socket
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

#: What a file says of itself.
HEAD = {"format": "xplane_bridge journal", "version": 1}
#: Beside the journals: each owner has a byte of it locked while it runs, which is seen from other containers as well.
_OWNERS = "owners.lock"
#: The system's F_OFD_GETLK and F_OFD_SETLK, which Python names from 3.9 on: locks of the open file. Those of F_SETLK,
#: which are the process's, would go with any closing of the file.
_GET_LOCK, _SET_LOCK = 36, 37
#: The system's struct flock: type, whence, start, length, process.
_LOCK = struct.Struct("@hhqqi4x")
_PID_BITS = 22


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
            entries = tuple(_entry(entry, folder, proc) for entry in load(file))
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


def _entry(entry: Any, folder: Path, proc: Path) -> Entry:
    owner = entry["owner"]
    return Entry(
        id=str(entry["id"]),
        purpose=str(entry["purpose"]),
        node=str(owner["node"]),
        pid=int(owner["pid"]),
        computer=str(owner["computer"]),
        owner=judge_owner(owner, folder, proc),
    )


def judge_owner(owner: Any, folder: Path, proc: Path) -> Owner:
    """How the owner's process is, as the bridge itself judges it: by boot, process number and start time, and lock.

    Args:
        owner: As in a journal of the folder.
        folder: Of the journals.
        proc: Folder of Linux's process file system.
    """
    if owner["boot_id"] != boot_id(proc):
        return Owner.GONE if owner["computer"] == socket.gethostname() else Owner.ELSEWHERE
    try:
        state, start_ticks = process_status(proc, str(owner["pid"]))
    except OSError:
        state, start_ticks = "X", 0
    if start_ticks == int(owner["start_ticks"]) and state not in "ZX":
        return Owner.STOPPED if state in "Tt" else Owner.RUNS
    return Owner.RUNS if _is_shown_alive(owner, folder) else Owner.GONE  # RUNS: in another container


def show_alive(owner: Any, folder: Path) -> None:
    """Lets judge_owner() of other containers see this process, which is the owner, until it ends, however it ends."""
    if _is_shown_alive(owner, folder):
        return
    fcntl = importlib.import_module("fcntl")
    with contextlib.suppress(OSError):  # no container but this one's sees it then
        file = os.open(folder / _OWNERS, os.O_RDONLY | os.O_CREAT, 0o644)
        fcntl.fcntl(file, _SET_LOCK, _byte_of(owner, fcntl.F_RDLCK))  # which stays open: its lock is the file's


def _is_shown_alive(owner: Any, folder: Path) -> bool:
    fcntl = importlib.import_module("fcntl")  # the doctor starts without it, as on Windows
    try:
        with open(folder / _OWNERS, "rb") as file:
            found = fcntl.fcntl(file, _GET_LOCK, _byte_of(owner, fcntl.F_WRLCK))  # which every other lock refuses
    except OSError:
        return False
    return bool(_LOCK.unpack(found)[0] != fcntl.F_UNLCK)


def _byte_of(owner: Any, kind: int) -> bytes:
    """The lock of the owner's byte in the file of owners."""
    start = (int(owner["start_ticks"]) << _PID_BITS | int(owner["pid"])) & (2**63 - 1)
    return _LOCK.pack(kind, os.SEEK_SET, start, 1, 0)


def process_status(proc: Path, pid: str) -> Tuple[str, int]:
    """State of a process and when it was started [clock ticks since the boot]; OSError where there is none."""
    # Behind the program's name, which is in parentheses and may hold anything: fields 3 (state) and further.
    fields = (proc / pid / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return fields[0], int(fields[19])


def boot_id(proc: Path) -> str:
    """Which boot of this computer it is."""
    return (proc / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
