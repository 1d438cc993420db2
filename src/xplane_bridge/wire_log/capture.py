"""Files of captured packets: pcapng and classic pcap, of either byte order, in micro- or nanoseconds."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Tuple

from xplane_bridge.errors import XplaneBridgeError

_SECTION, _INTERFACE, _SIMPLE, _PACKET = 0x0A0D0D0A, 1, 3, 6
_BYTE_ORDER = 0x1A2B3C4D
#: First four bytes of a classic file: byte order, and fractions in a second.
_CLASSIC = {
    b"\xd4\xc3\xb2\xa1": ("<", 1_000_000),
    b"\xa1\xb2\xc3\xd4": (">", 1_000_000),
    b"\x4d\x3c\xb2\xa1": ("<", 1_000_000_000),
    b"\xa1\xb2\x3c\x4d": (">", 1_000_000_000),
}
_COMMENT = 1
_FLAGS, _DROPS = 2, 4  # of a packet
_NAME, _DESCRIPTION, _RESOLUTION, _OFFSET = 2, 3, 9, 14  # of an interface
_LONGEST = 1 << 28  # [bytes] of a block: beyond it the file is damaged
_LONGEST_OPTION = 0xFFFC  # [bytes] its length has 16 bits


class CaptureError(XplaneBridgeError):
    """A file is no capture, or not one that can be used; the text says why."""


class Interface(NamedTuple):
    """Where packets were captured."""

    link_type: int
    name: str
    ticks: int  #: in a second
    offset: int  #: [s] added to times
    description: str = ""

    @property
    def port(self) -> int:
        """Of a wire log: the socket's own; 0: not said."""
        word, _, number = self.description.partition(" ")
        return int(number) if word == "port" and number.isdecimal() else 0


class Packet(NamedTuple):
    """One captured packet."""

    interface: int
    time_ns: int  #: [ns] since 1970
    data: bytes
    comment: str = ""
    outbound: bool = False
    dropped: int = 0  #: by the kernel, since the packet before
    whole: bool = True  #: not cut by the capture's limit


class Capture:
    """A capture, whole in memory.

    Args:
        data: the file's content.
        name: the file's, for errors.

    Raises:
        CaptureError: It is none.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self.name = name
        self.interfaces: List[Interface] = []
        self.comment = ""  #: of the first section; several in one
        self.cut = False  #: the file ends within a block; known once packets() is through
        self._data = data
        self._order = "<"
        start = data[:4]
        self._is_classic = start in _CLASSIC
        if not self._is_classic and start != struct.pack("<I", _SECTION):
            msg = (
                f"{name} is no capture (it begins with {start.hex() or 'nothing'}); expected pcapng or pcap, as "
                "Wireshark, tcpdump and wire_log write them"
            )
            raise CaptureError(msg)

    @staticmethod
    def open(path: Path) -> Capture:
        """Reads a file.

        Raises:
            CaptureError: It cannot be read, or is no capture.
        """
        try:
            data = path.read_bytes()
        except OSError as error:
            msg = f"{path} cannot be read: {error.strerror}"
            raise CaptureError(msg) from None
        return Capture(data, str(path))

    def packets(self) -> Iterator[Packet]:
        """The packets in the order of the file, up to its last whole one.

        Raises:
            CaptureError: The file is damaged.
        """
        return self._classic() if self._is_classic else self._blocks()

    def _classic(self) -> Iterator[Packet]:
        order, ticks = _CLASSIC[self._data[:4]]
        if len(self._data) < 24:
            self.cut = True
            return
        link_type = struct.unpack_from(order + "I", self._data, 20)[0] & 0x0FFFFFFF
        self.interfaces.append(Interface(link_type, "", ticks, 0))
        head = struct.Struct(order + "IIII")
        at = 24
        while at < len(self._data):
            if at + head.size > len(self._data):
                self.cut = True
                return
            seconds, fraction, size, original = head.unpack_from(self._data, at)
            if size > _LONGEST:
                raise self._damaged(at)
            at += head.size
            if at + size > len(self._data):
                self.cut = True
                return
            time_ns = seconds * 1_000_000_000 + fraction * (1_000_000_000 // ticks)
            yield Packet(0, time_ns, self._data[at : at + size], whole=size == original)
            at += size

    def _blocks(self) -> Iterator[Packet]:
        at, first = 0, 0  # of this section: where its interfaces begin
        while at < len(self._data):
            if at + 12 > len(self._data):
                self.cut = True
                return
            if struct.unpack_from("<I", self._data, at)[0] == _SECTION:
                little = struct.unpack_from("<I", self._data, at + 8)[0] == _BYTE_ORDER
                self._order = "<" if little else ">"
                first = len(self.interfaces)
            kind, size = struct.unpack_from(self._order + "II", self._data, at)
            if size < 12 or size % 4 or size > _LONGEST:
                raise self._damaged(at)
            if at + size > len(self._data):
                self.cut = True
                return
            body = self._data[at + 8 : at + size - 4]
            if kind == _SECTION and not self.comment:
                self.comment = b"".join(self._options(body, 16).get(_COMMENT, [])).decode("utf-8", "replace")
            elif kind == _INTERFACE:
                self.interfaces.append(self._interface(body))
            elif kind == _PACKET:
                yield self._packet(body, first, at)
            elif kind == _SIMPLE and len(self.interfaces) > first:
                original = struct.unpack_from(self._order + "I", body)[0]
                yield Packet(first, 0, body[4 : 4 + original], whole=len(body) - 4 >= original)
            at += size

    def _interface(self, body: bytes) -> Interface:
        options = self._options(body, 8)
        resolution = options.get(_RESOLUTION, [b"\x06"])[0][0]
        ticks = 1 << (resolution & 0x7F) if resolution & 0x80 else 10**resolution
        offset = options.get(_OFFSET, [b"\0" * 8])[0]
        link_type = struct.unpack_from(self._order + "H", body)[0]
        seconds = struct.unpack(self._order + "q", offset)[0]
        return Interface(link_type, self._text(options, _NAME), ticks, seconds, self._text(options, _DESCRIPTION))

    def _packet(self, body: bytes, first: int, at: int) -> Packet:
        if len(body) < 20:
            raise self._damaged(at)
        number, high, low, size, original = struct.unpack_from(self._order + "IIIII", body)
        if 20 + size > len(body) or first + number >= len(self.interfaces):
            raise self._damaged(at)
        interface = self.interfaces[first + number]
        stamp = (high << 32) | low
        time_ns = stamp * 1_000_000_000 // interface.ticks + interface.offset * 1_000_000_000
        options = self._options(body, 20 + size + (-size % 4))
        flags = struct.unpack(self._order + "I", options.get(_FLAGS, [b"\0" * 4])[0])[0]
        drops = struct.unpack(self._order + "Q", options.get(_DROPS, [b"\0" * 8])[0])[0]
        return Packet(
            first + number,
            time_ns,
            body[20 : 20 + size],
            self._text(options, _COMMENT),
            outbound=flags & 3 == 2,
            dropped=drops,
            whole=size == original,
        )

    def _options(self, body: bytes, at: int) -> Dict[int, List[bytes]]:
        out: Dict[int, List[bytes]] = {}
        while at + 4 <= len(body):
            code, size = struct.unpack_from(self._order + "HH", body, at)
            if code == 0:
                break
            out.setdefault(code, []).append(body[at + 4 : at + 4 + size])
            at += 4 + size + (-size % 4)
        return out

    @staticmethod
    def _text(options: Dict[int, List[bytes]], code: int) -> str:
        return options.get(code, [b""])[0].decode("utf-8", "replace")

    def _damaged(self, at: int) -> CaptureError:
        return CaptureError(f"{self.name} is damaged at byte {at}: expected the beginning of a block")


def write_pcapng(
    interfaces: List[Tuple[int, str, str]], packets: Iterator[Packet], comment: str, application: str
) -> Iterator[bytes]:
    """The blocks of a pcapng file, times in nanoseconds.

    Args:
        interfaces: link type, name and description of each.
        packets: in the order of the file.
        comment: of the section, of any length.
        application: that wrote it.
    """
    head = struct.pack("<IHHq", _BYTE_ORDER, 1, 0, -1)
    yield _block(_SECTION, head + _option(4, application.encode()) + b"".join(_comments(comment)) + b"\0" * 4)
    for link_type, name, description in interfaces:
        options = (
            _option(_NAME, name.encode()) + _option(_DESCRIPTION, description.encode()) + _option(_RESOLUTION, b"\x09")
        )
        yield _block(_INTERFACE, struct.pack("<HHI", link_type, 0, 0) + options + b"\0" * 4)
    for packet in packets:
        size = len(packet.data)
        head = struct.pack("<IIIII", packet.interface, packet.time_ns >> 32, packet.time_ns & 0xFFFFFFFF, size, size)
        options = _option(_FLAGS, struct.pack("<I", 2 if packet.outbound else 1))
        if packet.dropped:
            options += _option(_DROPS, struct.pack("<Q", packet.dropped))
        options += _option(_COMMENT, packet.comment.encode())
        yield _block(_PACKET, head + packet.data + b"\0" * (-size % 4) + options + b"\0" * 4)


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4) if value else b""


def _comments(text: str) -> Iterator[bytes]:
    """As many as the text needs, whole characters in each."""
    data = text.encode()
    while data:
        end = min(len(data), _LONGEST_OPTION)
        while end < len(data) and data[end] & 0xC0 == 0x80:
            end -= 1
        yield _option(_COMMENT, data[:end])
        data = data[end:]


def _block(kind: int, body: bytes) -> bytes:
    size = len(body) + 12
    return struct.pack("<II", kind, size) + body + struct.pack("<I", size)
