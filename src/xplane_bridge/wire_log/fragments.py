"""Datagrams that IPv4 has divided, put together again: Data Output of many rows is larger than a frame of Ethernet."""

from __future__ import annotations

from collections import Counter, OrderedDict
from typing import Dict, Optional, Tuple

from xplane_bridge.wire_log.capture import Packet
from xplane_bridge.wire_log.datagrams import Datagram, UdpPacket, datagram_of, udp_packet_in

_OPEN = 256  #: datagrams at once; where there are more, the oldest is given up
_PATIENCE_NS = 1_000_000_000  #: [ns] from a datagram's first packet: then its number may be another's
_LONGEST = 65_515  #: [bytes] of a datagram's body

#: Source, destination and number; the protocol is always UDP.
_Key = Tuple[str, str, int]


class DatagramReader:
    """Reads datagrams from the packets of a capture, in whatever order their fragments stand there.

    It never holds more than `_OPEN` datagrams of `_LONGEST` bytes, 17 MB.
    """

    def __init__(self) -> None:
        self.incomplete: Counter[str] = Counter()  #: by sender: datagrams whose fragments are not all there, or differ
        self.cut: Counter[str] = Counter()  #: by sender: datagrams of which the capture has only the beginning
        self._open: OrderedDict[_Key, _Pieces] = OrderedDict()

    def read(self, link_type: int, captured: Packet) -> Optional[Datagram]:
        """The datagram that a packet holds or completes; None: there is none.

        Raises:
            CaptureError: The link type is not understood.
        """
        packet = udp_packet_in(link_type, captured.data)
        if packet is None:
            return None
        whole = captured.whole and packet.whole
        if packet.offset or packet.more:
            return self._piece(packet, captured.time_ns, whole)
        if not whole:
            self.cut[packet.source] += 1
            return None
        return datagram_of(packet, packet.body)

    def finish(self) -> None:
        """There are no more packets: what is not complete will not be."""
        while self._open:
            self._give_up_oldest()

    def _piece(self, packet: UdpPacket, time_ns: int, whole: bool) -> Optional[Datagram]:
        while self._open and time_ns - next(iter(self._open.values())).began_ns > _PATIENCE_NS:
            self._give_up_oldest()
        key = (packet.source, packet.destination, packet.number)
        pieces = self._open.get(key)
        if pieces is not None and pieces.contradict(packet):
            self._count(packet.source, pieces)
            del self._open[key]
            pieces = None
        if pieces is None:
            if len(self._open) == _OPEN:
                self._give_up_oldest()
            pieces = self._open[key] = _Pieces(time_ns)
        body = pieces.add(packet, whole)
        return None if body is None else datagram_of(packet, body)

    def _give_up_oldest(self) -> None:
        (source, _, _), pieces = self._open.popitem(last=False)
        self._count(source, pieces)

    def _count(self, source: str, pieces: _Pieces) -> None:
        if not pieces.complete:
            self.incomplete[source] += 1


class _Pieces:
    """The fragments of one datagram that have come."""

    def __init__(self, began_ns: int) -> None:
        self.began_ns = began_ns
        self.complete = False
        self._broken = False  # whatever else comes
        self._bodies: Dict[int, bytes] = {}  # by offset
        self._held = 0  # [bytes]
        self._size: Optional[int] = None  # [bytes] of all

    def contradict(self, packet: UdpPacket) -> bool:
        """Whether a fragment is of another datagram that has got the same number."""
        if self._broken:
            return False
        return self._bodies.get(packet.offset, b"" if self.complete else packet.body) != packet.body

    def add(self, packet: UdpPacket, whole: bool) -> Optional[bytes]:
        """Takes a fragment; returns the datagram's body if that completes it."""
        end = packet.offset + len(packet.body)
        if self._broken or packet.offset in self._bodies:  # a packet that was captured on two interfaces comes twice
            return None
        self._bodies[packet.offset] = packet.body
        self._held += len(packet.body)
        if not packet.more:
            self._broken = self._size is not None
            self._size = end
        if not whole or self._broken or max(end, self._held) > min(self._size or _LONGEST, _LONGEST):
            self._break()
            return None
        if self._held != self._size:
            return None
        at, body = 0, []
        for offset, piece in sorted(self._bodies.items()):
            if offset != at:  # they overlap
                self._break()
                return None
            at += len(piece)
            body.append(piece)
        self.complete = True
        return b"".join(body)

    def _break(self) -> None:
        self._broken = True
        self._bodies.clear()
