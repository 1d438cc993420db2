"""Captures of tcpdump and Wireshark, made by hand here, byte by byte."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from xplane_bridge.wire_log.capture import Capture, CaptureError, Packet, write_pcapng
from xplane_bridge.wire_log.datagrams import datagram_in

PAYLOAD = b"RREF,\x01\x00\x00\x00\x00\x00\x80\x3f"
# 10.0.0.1:49000 -> 10.0.0.2:51000, IPv4 without options, no checksum of UDP.
UDP = struct.pack(">HHHH", 49000, 51000, 8 + len(PAYLOAD), 0) + PAYLOAD
IP = bytes([0x45, 0]) + struct.pack(">HHHBBH", 20 + len(UDP), 7, 0, 64, 17, 0) + bytes([10, 0, 0, 1, 10, 0, 0, 2]) + UDP
MACS = bytes(range(12))


def classic(order: str, magic: int, link_type: int, *packets: tuple[int, int, bytes]) -> bytes:
    """A file of tcpdump: packets as seconds, fractions, data."""
    out = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, link_type)
    for seconds, fraction, data in packets:
        out += struct.pack(order + "IIII", seconds, fraction, len(data), len(data)) + data
    return out


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("magic", "time_ns"), [(0xA1B2C3D4, 5_000_123_000), (0xA1B23C4D, 5_000_000_123)])
def test_classic_files_of_either_byte_order_and_resolution(order, magic, time_ns):
    capture = Capture(classic(order, magic, 1, (5, 123, MACS + b"\x08\x00" + IP)), "x.pcap")
    (packet,) = capture.packets()
    assert packet.time_ns == time_ns
    assert packet.data.endswith(IP)
    assert capture.interfaces[0].link_type == 1
    assert not capture.cut


@pytest.mark.parametrize(
    ("link_type", "head"),
    [
        (1, MACS + b"\x08\x00"),
        (1, MACS + b"\x81\x00\x00\x05\x08\x00"),  # in a virtual network
        (101, b""),
        (228, b""),
        (113, b"\x00\x00\x00\x01\x00\x06" + bytes(8) + b"\x08\x00"),
        (276, b"\x08\x00" + bytes(18)),
        (0, b"\x02\x00\x00\x00"),  # Windows: Npcap's loopback
        (0, b"\x00\x00\x00\x02"),
        (108, b"\x00\x00\x00\x02"),
    ],
)
def test_link_types_of_all_systems(link_type, head):
    datagram = datagram_in(link_type, head + IP + b"\x00\x00")  # padded, as short frames of Ethernet are
    assert datagram == (("10.0.0.1", 49000), ("10.0.0.2", 51000), PAYLOAD)


def test_what_is_no_whole_udp_datagram_is_left_out():
    arp = MACS + b"\x08\x06" + bytes(28)
    assert datagram_in(1, arp) is None
    assert datagram_in(101, IP[:9] + b"\x06" + IP[10:]) is None  # TCP
    assert datagram_in(101, IP[:6] + b"\x20\x00" + IP[8:]) is None  # the first of several fragments
    assert datagram_in(101, b"\x60" + IP[1:]) is None  # IPv6
    assert datagram_in(0, b"\x18\x00\x00\x00" + IP) is None
    with pytest.raises(CaptureError, match="link type 105 are not understood; expected Ethernet"):
        datagram_in(105, IP)


def block(order: str, kind: int, body: bytes) -> bytes:
    size = len(body) + 12
    return struct.pack(order + "II", kind, size) + body + struct.pack(order + "I", size)


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcapng_of_either_byte_order_with_options(order):
    section = block(order, 0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    # A name, microseconds by default; then nanoseconds and an offset of 100 s.
    first = block(order, 1, struct.pack(order + "HHI", 1, 0, 0) + struct.pack(order + "HH", 2, 3) + b"eth\x00")
    options = struct.pack(order + "HH", 9, 1) + b"\x09\x00\x00\x00" + struct.pack(order + "HHq", 14, 8, 100)
    second = block(order, 1, struct.pack(order + "HHI", 101, 0, 0) + options)
    unknown = block(order, 0x80001234, b"whatever")

    def packet(number: int, stamp: int, data: bytes, options: bytes = b"") -> bytes:
        head = struct.pack(order + "IIIII", number, stamp >> 32, stamp & 0xFFFFFFFF, len(data), len(data))
        return block(order, 6, head + data + b"\0" * (-len(data) % 4) + options)

    comment = struct.pack(order + "HH", 1, 2) + b"hi\0\0" + struct.pack(order + "HHI", 2, 4, 2)
    data = section + first + second + unknown + packet(0, 7, b"abc") + packet(1, 9, b"defg", comment)
    capture = Capture(data + section + first + packet(0, 1, b"z"), "x.pcapng")
    packets = list(capture.packets())
    assert [each.data for each in packets] == [b"abc", b"defg", b"z"]
    assert [each.time_ns for each in packets] == [7000, 100_000_000_009, 1000]
    assert [each.interface for each in packets] == [0, 1, 2]  # a further section numbers its own
    assert (packets[1].comment, packets[1].outbound) == ("hi", True)
    assert capture.interfaces[0].name == "eth"


def test_a_file_is_read_to_its_last_whole_packet_wherever_it_is_cut():
    data = b"".join(
        write_pcapng(
            [(101, "rx/flight", "port 5")],
            iter([Packet(0, 10**18 + k, b"x" * 9, f"n={k}", dropped=k) for k in range(3)]),
            "about",
            "a test",
        )
    )
    whole = Capture(data, "x")
    packets = list(whole.packets())
    assert [(each.time_ns, each.comment, each.dropped) for each in packets] == [
        (10**18 + k, f"n={k}", k) for k in range(3)
    ]
    assert (whole.comment, whole.interfaces[0].port) == ("about", 5)
    last = len(packets)
    for size in range(len(data) - 1, 12, -1):
        capture = Capture(data[:size], "x")
        read = len(list(capture.packets()))
        assert read <= last
        last = read
    assert last == 0


def test_what_is_no_capture_is_refused_in_words(tmp_path: Path):
    with pytest.raises(CaptureError, match=r"is no capture \(it begins with 23212f62\); expected pcapng or pcap"):
        Capture(b"#!/bin/sh", "a script")
    with pytest.raises(CaptureError, match="cannot be read: No such file"):
        Capture.open(tmp_path / "nothing")
    damaged = b"".join(write_pcapng([(1, "", "")], iter([]), "", "")) + struct.pack("<II", 6, 7) + bytes(20)
    with pytest.raises(CaptureError, match="is damaged at byte"):
        list(Capture(damaged, "x").packets())
