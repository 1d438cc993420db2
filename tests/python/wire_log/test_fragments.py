"""Datagrams that IPv4 has divided, made by hand."""

from __future__ import annotations

import struct

import pytest

from xplane_bridge.wire_log.capture import Packet
from xplane_bridge.wire_log.datagrams import RAW
from xplane_bridge.wire_log.fragments import DatagramReader

XPLANE, CLIENT = "192.168.1.5", "192.168.1.9"
SECOND = 10**9


def payload(seed: int = 0) -> bytes:
    """Data Output of 100 rows."""
    return b"DATA*" + bytes((seed + k) % 251 for k in range(3600))


def fragment(body: bytes, offset: int, more: bool, number: int = 7, source: str = XPLANE, protocol: int = 17) -> bytes:
    ends = b"".join(bytes(int(part) for part in address.split(".")) for address in (source, CLIENT))
    field = offset // 8 | (0x2000 if more else 0)
    return struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(body), number, field, 64, protocol, 0) + ends + body


def fragments(data: bytes, number: int = 7, size: int = 1480, source: str = XPLANE) -> list[bytes]:
    body = struct.pack(">HHHH", 49000, 49003, 8 + len(data), 0) + data
    return [
        fragment(body[at : at + size], at, at + size < len(body), number, source) for at in range(0, len(body), size)
    ]


def read(reader: DatagramReader, packets: list[bytes], time_ns: int = 0, whole: bool = True) -> list[bytes]:
    found = [reader.read(RAW, Packet(0, time_ns, data, whole=whole)) for data in packets]
    return [each.payload for each in found if each is not None]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_fragments_become_a_datagram_in_whatever_order(order):
    reader = DatagramReader()
    pieces = fragments(payload())
    assert len(pieces) == 3
    found = [reader.read(RAW, Packet(0, 0, pieces[k] + bytes(5))) for k in order]  # padded
    assert found[:2] == [None, None]
    assert found[2] == ((XPLANE, 49000), (CLIENT, 49003), payload())
    reader.finish()
    assert (reader.incomplete, reader.cut) == ({}, {})


def test_datagrams_differ_by_number_and_ends():
    one, two, other = fragments(payload(1), 7), fragments(payload(2), 8), fragments(payload(3), 7, source="192.168.1.6")
    mixed = [each for three in zip(one, two, other) for each in three]
    assert read(DatagramReader(), mixed) == [payload(1), payload(2), payload(3)]
    tcp = [data[:9] + b"\x06" + data[10:] for data in one]
    assert read(DatagramReader(), tcp) == []


def test_what_is_missing_is_counted_by_its_sender():
    reader = DatagramReader()
    pieces = fragments(payload())
    assert read(reader, [pieces[0], pieces[2]]) == []
    assert read(reader, fragments(payload(), 8, source="192.168.1.6")[1:]) == []
    reader.finish()
    assert reader.incomplete == {XPLANE: 1, "192.168.1.6": 1}


def test_a_number_that_is_used_again_is_another_datagram():
    reader = DatagramReader()
    first, second = fragments(payload(1)), fragments(payload(2))
    assert read(reader, [*first, *second]) == [payload(1), payload(2)]
    assert read(reader, first[:1]) == []  # the rest is lost
    assert read(reader, second) == [payload(2)]
    assert read(reader, first[:2], 2 * SECOND) == []
    # A second later what is left of it is not made whole by another's fragments.
    assert read(reader, second[2:], 4 * SECOND) == []
    reader.finish()
    assert reader.incomplete == {XPLANE: 3}


def test_a_datagram_captured_on_two_interfaces_is_one():
    reader = DatagramReader()
    twice = [each for piece in fragments(payload()) for each in (piece, piece)]
    assert read(reader, twice) == [payload()]
    reader.finish()
    assert reader.incomplete == {}


def test_fragments_that_overlap_or_end_twice_or_are_too_long_are_refused():
    body = bytes(32)
    for pieces in (
        [fragment(body[:24], 0, True), fragment(body[:16], 16, False)],
        [fragment(body[:16], 0, True), fragment(body[:16], 8, True), fragment(body[:16], 32, False)],
        [fragment(body[:8], 16, False), fragment(body[:8], 24, False), fragment(body[:16], 0, True)],
        fragments(bytes(65510), size=8000),
        [fragment(body[:15], 0, True), fragment(body[:16], 16, False)],
        [fragment(b"", 0, True), fragment(body[:8], 8, False)],
    ):
        reader = DatagramReader()
        assert read(reader, pieces) == []
        reader.finish()
        assert reader.incomplete == {XPLANE: 1}


def test_memory_is_bounded():
    reader = DatagramReader()
    for number in range(1000):
        read(reader, fragments(payload(), number)[:1])
    assert reader.incomplete == {XPLANE: 1000 - 256}
    reader.finish()
    assert reader.incomplete == {XPLANE: 1000}


def test_what_the_capture_has_cut_short_is_counted():
    reader = DatagramReader()
    (small,) = fragments(b"RREF,")
    assert read(reader, [small], whole=False) == []
    assert read(reader, [small[:-2]]) == []  # its head says more than there is
    assert reader.cut == {XPLANE: 2}
    pieces = fragments(payload())
    assert read(reader, pieces[:1], whole=False) == []
    assert read(reader, pieces[1:]) == []
    reader.finish()
    assert (reader.incomplete, reader.cut) == ({XPLANE: 1}, {XPLANE: 2})
