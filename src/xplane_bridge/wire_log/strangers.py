"""Captures that the bridge did not write: what X-Plane sent to whatever program, for a node that asks anew.

X-Plane answers with numbers that the asker has chosen; the names of the datarefs stand in the requests only. So a
capture must hold both directions, and begin before the program has asked.
"""

from __future__ import annotations

import logging
import struct
from collections import Counter
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Set, Tuple

from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import Capture, CaptureError
from xplane_bridge.wire_log.datagrams import Address, Datagram
from xplane_bridge.wire_log.fragments import DatagramReader

_LOG = logging.getLogger(__name__)

MAGIC = b"xplane_bridge wire capture 1\n"
#: X-Plane 11 and 12, and 10. Requests have any other fifth byte: a NUL, or of some programs (ArduPilot) the digit 0.
_ANSWER, _ROWS = (b"RREF,", b"RREFO"), b"DATA"
_PAIR = struct.Struct("<if")
_ROW_BYTES = 36
#: Where X-Plane is asked, unless a capture shows another port.
_PORT = 49000
#: Steady time of the first packet [ns]: clocks of a computer do not begin at 0.
_START_NS = 1000 * 1_000_000_000


class Sighting(NamedTuple):
    """A datagram and its time."""

    time_ns: int
    datagram: Datagram


class StrangersCapture:
    """The traffic of one X-Plane in a capture.

    Args:
        path: pcap or pcapng.
        xplane: its address; found by its answers when None.

    Raises:
        CaptureError: There is none, or nothing of it can be read.
    """

    def __init__(self, path: Path, xplane: Optional[str] = None) -> None:
        capture = Capture.open(path)
        self.path = path
        seen = []
        self._reader = DatagramReader()
        for packet in capture.packets():
            datagram = self._reader.read(capture.interfaces[packet.interface].link_type, packet)
            if datagram is not None:
                seen.append(Sighting(packet.time_ns, datagram))
        self._reader.finish()
        self._ends_early = capture.cut
        seen.sort(key=lambda each: each.time_ns)
        self._others: Counter[Address] = Counter()  # of no use, by where they came from
        self._senders: Set[Address] = set()  # from which X-Plane sends
        self.xplane = xplane or ""
        if not xplane:
            self.xplane = self._find(seen)
        #: Where it was asked.
        self.port = next((to[1] for _, (_, to, data) in seen if _is_request(data) and to[0] == self.xplane), _PORT)
        self.paths: List[str] = []  #: of all datarefs, by their numbers
        self.answers = 0  #: datagrams with values that have a name
        self.nameless = 0  #: values whose request is not in the capture
        self.rows = 0  #: datagrams of Data Output
        self._received = 0  # datagrams that a node gets
        self._events = list(self._read(seen))
        if not self._received:
            if self.nameless:
                lacking = "requests for them are not in it: capture from before the program starts"
            elif self.paths:
                lacking = "only requests are in it: capture what X-Plane sends, too"
            else:
                lacking = "expected answers (RREF), Data Output (DATA) or positions (RPOS)"
            msg = f"{path} has no values of X-Plane at {self.xplane} that can be used; {lacking}"
            remedy = [] if xplane else ["where X-Plane is at another address, give it: --xplane ADDRESS"]
            raise CaptureError("; ".join([msg, *remedy, *self.left_out()]))

    def left_out(self) -> List[str]:
        """What X-Plane has sent and no node gets, in words; of all senders as long as it is not found."""
        reader, out = self._reader, []
        incomplete, cut = (
            counts[self.xplane] if self.xplane else sum(counts.values()) for counts in (reader.incomplete, reader.cut)
        )
        if incomplete:
            out.append(
                f"{incomplete} datagrams are not replayed because the capture does not have all fragments of them; "
                "capture with the filter of docs/experiments/wire_log.md, which takes fragments too"
            )
        if cut:
            out.append(f"{cut} datagrams are not replayed because they were cut short; capture whole packets (-s 0)")
        others = sum(count for sender, count in self._others.items() if sender in self._senders)
        if others:
            out.append(f"{others} datagrams of X-Plane are not replayed: they are neither RREF, DATA, RPOS nor BECN")
        if self._ends_early:
            out.append(f"{self.path} is cut off; the replay ends there")
        return out

    def _find(self, seen: List[Sighting]) -> str:
        votes: Counter[str] = Counter()
        ports = {_PORT, *(to[1] for _, (_, to, data) in seen if _is_request(data))}
        for _, (source, to, data) in seen:
            # Rows that are written to X-Plane are like those that it sends.
            if _is_request(data) or (_is_rows(data) and to[1] in ports):
                votes[to[0]] += 1
            elif data.startswith((*_ANSWER, b"BECN", b"RPOS")) or _is_rows(data):
                votes[source[0]] += 1
        if not votes:
            msg = f"{self.path} has no datagrams of X-Plane; expected RREF, DATA, RPOS or BECN over UDP"
            raise CaptureError("; ".join([msg, *self.left_out()]))
        found, *others = (address for address, _ in votes.most_common())
        if others:
            _LOG.warning(
                "%s: X-Plane may be at %s; %s is taken, for which most datagrams speak; --xplane ADDRESS takes another",
                self.path,
                " or ".join([found, *others]),
                found,
            )
        return found

    def _read(self, seen: List[Sighting]) -> Iterator[bytes]:
        clients: Dict[Address, int] = {}
        names: Dict[Tuple[int, int], int] = {}  # client and its number: of the dataref
        numbers: Dict[str, int] = {}
        first: Optional[int] = None
        for time_ns, (source, to, data) in seen:
            if to[0] == self.xplane and _is_request(data):
                rate, index = struct.unpack_from("<ii", data, 5)
                path = data[13:].split(b"\0")[0].decode("ascii", "replace")
                client = clients.setdefault(source, len(clients))
                if rate > 0 and path:
                    number = numbers.setdefault(path, len(numbers))
                    if number == len(self.paths):
                        self.paths.append(path)
                    names[client, index] = number
                    yield records.encode(records.NAMED, path.encode(), client, counted=number)
                continue
            # Where X-Plane runs on the same computer, commands to it come from its own address too.
            if source[0] != self.xplane or to == (self.xplane, self.port):
                continue
            first = time_ns if first is None else first
            kind, client, payload = self._useful(data, clients.get(to, -1), names)
            if kind or data.startswith(_ROWS):
                self._senders.add(source)
            if not kind and not data.startswith(_ANSWER):
                self._others[source] += 1
            if kind:
                self._received += 1
                steady_ns = _START_NS + time_ns - first
                yield records.encode(kind, payload, max(client, 0), time_ns, steady_ns, time_ns, source)

    def _useful(self, data: bytes, client: int, names: Dict[Tuple[int, int], int]) -> Tuple[int, int, bytes]:
        """Kind of the record, client and payload; a kind of 0 where there is nothing of use."""
        if data.startswith(_ANSWER):
            values = b""
            for at in range(5, len(data) - 7, _PAIR.size):
                index, _ = _PAIR.unpack_from(data, at)
                number = names.get((client, index))
                if number is None:
                    self.nameless += 1
                else:
                    values += struct.pack("<I", number) + data[at + 4 : at + 8]
            self.answers += bool(values)
            return (records.VALUES if values else 0, client, values)
        for label, name in ((b"RPOS", b"rpos"), (b"BECN", b"beacon")):
            if data.startswith(label):
                return (records.RECEIVED, client, name + b"\0" + data)
        if _is_rows(data):
            self.rows += 1
            return (records.RECEIVED, client, b"data\0" + data)
        return (0, client, b"")

    def playable(self) -> Iterator[bytes]:
        """The file that a node plays, in pieces."""
        yield MAGIC
        yield from self._events


def _is_request(data: bytes) -> bool:
    return data.startswith(b"RREF") and not data.startswith(_ANSWER) and len(data) > 13


def _is_rows(data: bytes) -> bool:
    return data.startswith(_ROWS) and len(data) > 5 and (len(data) - 5) % _ROW_BYTES == 0
