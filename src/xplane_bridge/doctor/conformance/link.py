"""Reads and writes one X-Plane: what the questions are asked with."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Set, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor import names
from xplane_bridge.doctor.conformance.journal import (
    DATA_OUTPUT,
    OVERRIDE,
    Journal,
    Operation,
    datagram,
    deselect_rows,
    target_off,
    write_dataref,
)
from xplane_bridge.doctor.conformance.verdict import NotTestableError

#: The highest rate in X-Plane's own dialogues, and so taken for sure: a value each frame, or nearly so [1/s].
FAST_HZ = 99
_ANSWER_S = 1.5
#: Requests are sent again after so long without all answers [s].
_REPEAT_S = 0.5
_ATTEMPTS = 5
_SHOWN = 1e-3
#: Entries of which X-Plane confirms nothing are written twice, so long apart [s].
_UNCONFIRMED_AGAIN_S = 1.0
_NETWORK_RATE = "sim/network/dataout/network_data_rate"

Values = Dict[str, float]
Row = Tuple[float, ...]


@dataclass(frozen=True)
class Sample:
    """Values of one frame.

    Attributes:
        time: When they came, monotonic clock [s].
        values: By dataref.
    """

    time: float
    values: Values

    def __getitem__(self, path: str) -> float:
        """The value of a dataref."""
        return self.values[path]


@dataclass(frozen=True)
class RowSample:
    """One datagram of Data Output: when it came, monotonic clock [s], and its rows by index."""

    time: float
    rows: Dict[int, Row]


class Receiver:
    """A socket of its own at X-Plane; a context manager that ends its subscriptions."""

    def __init__(self, address: str, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self._to = (address, port)
        self._paths: List[str] = []
        self._answered: Set[int] = set()

    def __enter__(self) -> Receiver:
        return self

    def __exit__(self, *_: object) -> None:
        for index, path in enumerate(self._paths):
            self.send(protocol.RrefRequest(0, index, path))
        self.socket.close()

    def send(self, message: protocol.Request) -> None:
        """Sends a request."""
        with contextlib.suppress(ConnectionRefusedError):
            self.socket.sendto(message.encode(), self._to)

    def subscribe(self, paths: Sequence[str], rate_hz: int) -> None:
        """Asks for datarefs; they answer with their place in `paths` as index. Again: for those without an answer."""
        self._paths = list(paths)
        for index, path in enumerate(paths):
            if index not in self._answered:
                self.send(protocol.RrefRequest(rate_hz, index, path))

    def datagrams(self, until: float) -> Iterator[Tuple[float, bytes]]:
        """What comes until a point of the monotonic clock [s], each with when it came."""
        while True:
            ready, _, _ = select.select([self.socket], [], [], max(0.0, until - time.monotonic()))
            if not ready:
                return
            with contextlib.suppress(ConnectionRefusedError):
                yield time.monotonic(), self.socket.recv(protocol.MAX_DATAGRAM)
            if time.monotonic() >= until:
                return

    def waiting(self) -> List[bytes]:
        """What has come until now."""
        found = []
        while select.select([self.socket], [], [], 0.0)[0]:
            with contextlib.suppress(ConnectionRefusedError):
                found.append(self.socket.recv(protocol.MAX_DATAGRAM))
        return found

    def values_in(self, packet: bytes) -> Values:
        """Values of a datagram by dataref; none of one that is no answer."""
        if packet[:4] != b"RREF":
            return {}
        pairs = {i: value for i, value in protocol.decode_rref_response(packet) if 0 <= i < len(self._paths)}
        self._answered |= pairs.keys()
        return {self._paths[i]: value for i, value in pairs.items()}

    def samples(self, until: float) -> Iterator[Sample]:
        """Samples until a point of the monotonic clock [s]; datagrams of one frame are put together."""
        partial: Values = {}
        for when, packet in self.datagrams(until):
            values = self.values_in(packet)
            if not values:
                continue
            if partial.keys() & values.keys():  # of the next frame: one was incomplete
                partial = {}
            partial.update(values)
            if len(partial) == len(self._paths):
                yield Sample(when, partial)
                partial = {}


class XPlane:
    """One X-Plane and what has been changed in it.

    Args:
        address: IPv4 address.
        port: UDP port it listens on.
        journal: Where changes are noted.
    """

    def __init__(self, address: str, port: int, journal: Journal) -> None:
        self.address, self.port, self.journal = address, port, journal
        self._out = Receiver(address, port)
        self.version = 0  #: as X-Plane gives it; 0: not known yet

    @property
    def is_12(self) -> bool:
        """Whether it is version 12."""
        return self.version >= 120000

    def close(self) -> None:
        """Closes its socket."""
        self._out.socket.close()

    # --- reading --------------------------------------------------------------------------------------------------

    def receiver(self) -> Receiver:
        """A new socket."""
        return Receiver(self.address, self.port)

    def try_read(self, paths: Sequence[str], patience_s: float = _ANSWER_S) -> Values:
        """Values as of now, of those datarefs that answer."""
        values: Values = {}
        with self.receiver() as receiver:
            end = time.monotonic() + patience_s
            while time.monotonic() < end and len(values) < len(paths):
                receiver.subscribe(paths, FAST_HZ)
                # What came first may have been on its way before a write; of what comes next to it the last counts.
                for _, packet in receiver.datagrams(min(end, time.monotonic() + _REPEAT_S)):
                    values.update(receiver.values_in(packet))
                    if len(values) == len(paths):
                        break
        return values

    def read(self, *paths: str) -> Values:
        """Values as of now.

        Raises:
            NotTestableError: X-Plane does not answer all.
        """
        values = self.try_read(paths)
        missing = [path for path in paths if path not in values]
        if missing:
            msg = f"X-Plane does not answer {', '.join(missing)}"
            raise NotTestableError(msg)
        return values

    def watch(
        self, paths: Sequence[str], duration_s: float, each: Optional[Callable[[Sample], None]] = None
    ) -> List[Sample]:
        """Samples of every frame for some time [s]; `each` is called with them as they come."""
        found = []
        with self.receiver() as receiver:
            receiver.subscribe(paths, FAST_HZ)
            for sample in receiver.samples(time.monotonic() + duration_s):
                found.append(sample)
                if each is not None:
                    each(sample)
        if not found:
            msg = f"X-Plane does not answer all of {', '.join(paths)} in one frame"
            raise NotTestableError(msg)
        return found

    def wait_for(
        self, paths: Sequence[str], condition: Callable[[Sample], bool], patience_s: float
    ) -> Optional[Sample]:
        """The first sample of which the condition is true; None if there is none in time [s]."""
        with self.receiver() as receiver:
            end = time.monotonic() + patience_s
            while time.monotonic() < end:
                receiver.subscribe(paths, FAST_HZ)  # X-Plane reads nothing while it loads: some may be lost
                for sample in receiver.samples(min(end, time.monotonic() + 2.0)):
                    if condition(sample):
                        return sample
        return None

    # --- writing --------------------------------------------------------------------------------------------------

    def send(self, message: protocol.Request) -> None:
        """Sends a request that needs no undoing."""
        self._out.send(message)

    def write(self, path: str, value: float) -> None:
        """Writes a dataref that is undone otherwise, or needs no undoing."""
        self.send(protocol.DrefWrite(path, value))

    @contextlib.contextmanager
    def changed(self, writes: Values, back: Optional[Values] = None) -> Iterator[None]:
        """Gives datarefs other values meanwhile, noted in the journal.

        Args:
            writes: Values by dataref.
            back: What they get afterwards; those that are left out get what they have now.
        """
        back = dict(back or {})
        back.update(self.read(*[path for path in writes if path not in back]) if writes.keys() - back.keys() else {})
        ids = {path: f"{OVERRIDE}:{path}" for path in writes}
        for path in writes:
            self.journal.record(ids[path], OVERRIDE, [write_dataref(path, back[path])])
        try:
            for path, value in writes.items():
                self.write(path, value)
            yield
        finally:
            self.undo([entry for entry in self.journal.own() if entry["id"] in ids.values()])

    def undo(self, entries: Sequence[Dict[str, Any]]) -> List[str]:
        """Undoes entries of the journal, reads back, and takes out what is undone.

        Returns:
            What X-Plane does not show, in words.
        """
        left = []
        again: List[Tuple[Dict[str, Any], List[Operation]]] = []
        for entry in reversed(entries):
            operations, wanted = entry["undo"], _confirmed(entry["undo"])
            unconfirmed = [each for each in operations if each["op"] == "dref" and not _is_confirmed(each)]
            # Where X-Plane has its override back already, levers are those of another flight: they stay.
            if wanted and unconfirmed and _has(self.try_read(list(wanted)), wanted):
                operations = [each for each in operations if each not in unconfirmed]
            if not self._carry_out(operations):
                left.append(entry["id"])
            elif unconfirmed and not wanted:  # levers are not sent again: they are the pilot's after the release
                again.append((entry, unconfirmed))
            else:
                self.journal.remove([entry])
        if again:
            time.sleep(_UNCONFIRMED_AGAIN_S)
            for _, operations in again:
                self._send_all(operations)
            self.journal.remove([entry for entry, _ in again])
        return left

    def _carry_out(self, operations: Sequence[Operation]) -> bool:
        wanted = _confirmed(operations)
        for _ in range(_ATTEMPTS):
            self._send_all(operations)
            if not wanted or self._shows(wanted):
                return True
        return False

    def _send_all(self, operations: Sequence[Operation]) -> None:
        for operation in operations:
            with contextlib.suppress(ConnectionRefusedError):
                self._out.socket.sendto(datagram(operation), (self.address, self.port))

    def _shows(self, wanted: Values) -> bool:
        return self.wait_for(list(wanted), lambda sample: _has(sample.values, wanted), 0.5) is not None

    # --- Data Output ----------------------------------------------------------------------------------------------

    def rows_with(
        self, rows: Sequence[int], paths: Sequence[str], duration_s: float
    ) -> List[Tuple[Dict[int, Row], Sample]]:
        """Rows of Data Output, each with the values of datarefs that came next to it.

        Args:
            rows: Their indices.
            paths: Datarefs.
            duration_s: For so long [s].
        """
        selected = self.read(*map(names.data_row, rows), _NETWORK_RATE)
        if any(selected[names.data_row(row)] for row in rows):
            msg = "these rows of Data Output go to another client, whose target must not be changed"
            raise NotTestableError(msg)
        with self.receiver() as receiver, self._data_to(receiver, rows, selected[_NETWORK_RATE]):
            receiver.subscribe(paths, FAST_HZ)
            end = time.monotonic() + duration_s
            found, samples, partial = [], [], {}
            for when, packet in receiver.datagrams(end):
                if packet[:4] == b"DATA":
                    found.append(RowSample(when, protocol.decode_data(packet).as_dict()))
                else:
                    partial.update(receiver.values_in(packet))
                    if len(partial) == len(paths):
                        samples.append(Sample(when, dict(partial)))
        good = [each for each in found if all(row in each.rows for row in rows)]
        if not good or not samples:
            msg = f"{len(found)} datagrams of Data Output and {len(samples)} of datarefs came: is there a firewall?"
            raise NotTestableError(msg)
        return [(each.rows, min(samples, key=lambda s: abs(s.time - each.time))) for each in good]

    @contextlib.contextmanager
    def _data_to(self, receiver: Receiver, rows: Sequence[int], rate: float) -> Iterator[None]:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((self.address, self.port))
            own = probe.getsockname()[0]
        receiver.socket.bind(("", 0))
        port = receiver.socket.getsockname()[1]
        id_ = f"{DATA_OUTPUT}:conformance"
        undo = [deselect_rows(rows), target_off(own, port), write_dataref(_NETWORK_RATE, rate)]
        self.journal.record(id_, DATA_OUTPUT, undo)
        try:
            self.write(_NETWORK_RATE, 50.0)
            self.send(protocol.NetworkTarget(protocol.DATA_OUTPUT_TARGET, own, port, True))
            self.send(protocol.RowSelection("DSEL", tuple(rows)))
            yield
        finally:
            self.undo([entry for entry in self.journal.own() if entry["id"] == id_])


def _is_confirmed(operation: Operation) -> bool:
    """Whether a write is undone only once X-Plane shows the value."""
    return bool(operation.get("confirm", True))


def _confirmed(operations: Sequence[Operation]) -> Values:
    """What X-Plane is to show once these are carried out."""
    return {each["path"]: each["value"] for each in operations if each["op"] == "dref" and _is_confirmed(each)}


def _has(shown: Values, wanted: Values) -> bool:
    return all(
        path in shown and abs(shown[path] - value) <= _SHOWN * max(1.0, abs(value)) for path, value in wanted.items()
    )
