"""Notes in the bridge's journal what is to be undone, before it is changed (docs/nodes/journal.md)."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import socket
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Sequence

from xplane_bridge import protocol
from xplane_bridge.doctor.observe.computer import is_same_computer
from xplane_bridge.doctor.observe.journals import (
    HEAD,
    Owner,
    boot_id,
    files,
    judge_owner,
    load,
    process_status,
    show_alive,
)

NODE = "xplane_doctor"
#: Purposes as the nodes have them: tx_node and rx_node undo what a doctor left that was killed.
OVERRIDE, DATA_OUTPUT = "override", "data_output"
#: How long another process may write [s].
_LOCK_TIMEOUT_S = 10.0
_OPERATIONS = ("dref", "data", "usel", "ise4_off")

Operation = Dict[str, Any]
Entry = Dict[str, Any]


class JournalError(Exception):
    """The journal cannot be used; the text says why and what to do."""


def write_dataref(path: str, value: float) -> Operation:
    """The operation that gives a dataref a value."""
    return {"op": "dref", "path": path, "value": value}


def deselect_rows(rows: Sequence[int]) -> Operation:
    """The operation that takes rows out of Data Output."""
    return {"op": "usel", "rows": list(rows)}


def target_off(address: str, port: int) -> Operation:
    """The operation that ends Data Output to an address."""
    return {"op": "ise4_off", "target": protocol.DATA_OUTPUT_TARGET, "address": address, "port": port}


def datagram(operation: Operation) -> bytes:
    """What carries an operation out."""
    kind = operation["op"]
    if kind == "dref":
        return protocol.DrefWrite(operation["path"], operation["value"]).encode()
    if kind == "data":
        return protocol.DataPacket(((operation["row"], tuple(operation["values"])),)).encode()
    if kind == "usel":
        return protocol.RowSelection("USEL", tuple(operation["rows"])).encode()
    if kind == "ise4_off":
        return protocol.NetworkTarget(operation["target"], operation["address"], operation["port"], False).encode()
    msg = f"the journal's operation {kind!r} is not known to this doctor: undo it with what wrote it"
    raise JournalError(msg)


class Journal:
    """The journal of one X-Plane, in the name of this process.

    Args:
        folder: Of the journals.
        address: IPv4 address of X-Plane.
        port: UDP port it listens on.
        proc: Folder of Linux's process file system.
        also: Other addresses of its computer.

    Raises:
        JournalError: This system has not what the journal needs: it is not Linux.
    """

    def __init__(
        self, folder: Path, address: str, port: int, proc: Path = Path("/proc"), also: Sequence[str] = ()
    ) -> None:
        # As the nodes name it: one file whichever of its addresses the X-Plane of this computer is called by.
        name = "127.0.0.1" if is_same_computer(address, "127.0.0.1") else address
        self.file = folder / f"{name}_{port}.json"
        self._proc, self._port, self._addresses = proc, port, (address, *also)
        try:
            self._fcntl = importlib.import_module("fcntl")  # the doctor starts without it, as on Windows
            self._self: Dict[str, Any] = {
                "node": NODE,
                "pid": os.getpid(),
                "start_ticks": process_status(proc, "self")[1],
                "boot_id": boot_id(proc),
                "computer": socket.gethostname(),
            }
        except (ImportError, OSError) as error:
            msg = f"changes can be noted on Linux only ({error}): fly the card from the nodes' computer, with --host"
            raise JournalError(msg) from None

    def holders(self) -> List[str]:
        """Who else has changed this X-Plane, under whichever address of its computer, and still runs, in words."""
        return [
            f"{entry['owner']['node']} (process {entry['owner']['pid']} on {entry['owner']['computer']}) holds {file}"
            for file in (self.file, *self._others())
            for entry in self._load(file)
            if entry["purpose"] in (OVERRIDE, DATA_OUTPUT) and not self._is_gone(entry) and not self._is_own(entry)
        ]

    def orphans(self) -> List[Entry]:
        """What processes that are gone have left: to be undone, then removed. Without what only nodes can undo.

        Earlier versions have noted it under the address that they called an X-Plane of this computer by.
        """
        return [
            entry
            for file in (*self._others(), self.file)
            for entry in self._load(file)
            if self._is_gone(entry) and all(operation["op"] in _OPERATIONS for operation in entry["undo"])
        ]

    def own(self) -> List[Entry]:
        """What this process has noted, in the order in which it did."""
        return [entry for entry in self._load(self.file) if self._is_own(entry)]

    def record(self, id_: str, purpose: str, undo: Sequence[Operation]) -> None:
        """Notes how to undo a change; only when this returns may it be made. The first note of an id counts."""

        def add(entries: List[Entry]) -> List[Entry]:
            show_alive(self._self, self.file.parent)
            same = [entry for entry in entries if entry["id"] == id_]
            if any(self._is_own(entry) for entry in same):
                return entries
            if same and not self._is_gone(same[0]):
                msg = f"{id_} belongs to {same[0]['owner']['node']}, which runs: end it first"
                raise JournalError(msg)
            kept = [entry for entry in entries if entry["id"] != id_]
            return [*kept, {"id": id_, "purpose": purpose, "owner": self._self, "undo": list(undo)}]

        self._change(self.file, add)

    def remove(self, undone: Sequence[Entry]) -> None:
        """Takes entries out that are undone, of own() or orphans(); one that has been noted anew since stays."""
        for file in (self.file, *self._others()):
            if any(entry in undone for entry in self._load(file)):
                self._change(file, lambda entries: [entry for entry in entries if entry not in undone])

    def _others(self) -> List[Path]:
        """The journals of those who call the same X-Plane by another address."""
        return [
            file
            for file, host, port in files(self.file.parent)
            if port == self._port
            and file.name not in (self.file.name, f"{host}_{port}_subscriptions.json")
            and any(is_same_computer(host, address) for address in self._addresses)
        ]

    def _is_own(self, entry: Entry) -> bool:
        return all(entry["owner"].get(key) == self._self[key] for key in ("pid", "start_ticks", "boot_id"))

    def _is_gone(self, entry: Entry) -> bool:
        return judge_owner(entry["owner"], self.file.parent, self._proc) is Owner.GONE

    def _change(self, file: Path, how: Callable[[List[Entry]], List[Entry]]) -> None:
        with self._locked(file):
            before = self._load(file)
            after = how(before)
            if after != before:
                self._store(file, after)

    @contextlib.contextmanager
    def _locked(self, file: Path) -> Iterator[None]:
        file.parent.mkdir(parents=True, exist_ok=True)
        with open(f"{file}.lock", "a", encoding="utf-8") as lock:
            deadline = time.monotonic() + _LOCK_TIMEOUT_S
            while True:
                try:
                    self._fcntl.flock(lock, self._fcntl.LOCK_EX | self._fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    if time.monotonic() > deadline:
                        msg = f"{file}: another process has it locked: it was stopped while it wrote; end it first"
                        raise JournalError(msg) from None
                    time.sleep(0.02)
            yield

    @staticmethod
    def _load(file: Path) -> List[Entry]:
        """Also without the lock, which a hung node may have: the file is replaced as a whole."""
        try:
            return load(file)
        except FileNotFoundError:
            return []
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            msg = f"{file} cannot be understood ({error}): move it away, or restart X-Plane and delete it"
            raise JournalError(msg) from None

    @staticmethod
    def _store(file: Path, entries: List[Entry]) -> None:
        if entries:
            new = Path(f"{file}.new")
            try:
                text = json.dumps({**HEAD, "entries": entries}, indent=2, allow_nan=False)
            except ValueError:
                msg = f"{file}: a value that is no number cannot be noted, so it could not be put back"
                raise JournalError(msg) from None
            with new.open("w", encoding="utf-8") as out:
                out.write(text)
                out.flush()
                os.fsync(out.fileno())
            new.rename(file)
        else:
            file.unlink()
        folder = os.open(file.parent, os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)
