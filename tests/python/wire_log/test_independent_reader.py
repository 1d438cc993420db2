"""A wire log that tx_node has written, as a reader of pcapng sees it that is not ours: python-pcapng."""

from __future__ import annotations

import gzip
import io
import struct
from pathlib import Path

import pytest
from pcapng import FileScanner
from pcapng.blocks import EnhancedPacket, InterfaceDescription, SectionHeader

from xplane_bridge.wire_log.capture import Capture, write_pcapng
from xplane_bridge.wire_log.datagrams import USER0, datagram_in

RAW_IP, INBOUND, OUTBOUND = 101, 1, 2
LOG = Path(__file__).parents[2] / "data" / "captures" / "tx_node.pcapng.gz"


@pytest.fixture(scope="module")
def blocks():
    """All blocks of the file."""
    return list(FileScanner(io.BytesIO(gzip.decompress(LOG.read_bytes()))))


@pytest.fixture(scope="module")
def ours():
    """The same file, by our own reader."""
    return Capture(gzip.decompress(LOG.read_bytes()), LOG.name)


def udp(packet: bytes) -> tuple[tuple[str, int], tuple[str, int], bytes]:
    """Sender, receiver and payload of an IPv4 packet, whose lengths and checksum must fit."""
    length = struct.unpack_from(">H", packet, 2)[0]
    assert (packet[0], packet[9], length) == (0x45, 17, len(packet))
    total = sum(struct.unpack_from(">10H", packet))
    assert (total & 0xFFFF) + (total >> 16) == 0xFFFF
    source_port, port, size = struct.unpack_from(">HHH", packet, 20)
    assert size == len(packet) - 20
    source, to = (".".join(map(str, packet[at : at + 4])) for at in (12, 16))
    return (source, source_port), (to, port), packet[28:]


def test_the_file_is_one_section_with_an_interface_for_each_socket(blocks):
    assert isinstance(blocks[0], SectionHeader)
    assert (blocks[0].version_major, blocks[0].version_minor) == (1, 0)
    assert "<name>program</name>" in blocks[0].options["opt_comment"]
    assert {type(block) for block in blocks} == {SectionHeader, InterfaceDescription, EnhancedPacket}
    interfaces = [block for block in blocks if isinstance(block, InterfaceDescription)]
    names = [block.options["if_name"] for block in interfaces]
    assert names[:2] == ["tx_node/notes", "tx_node/control"]
    assert "tx_node/flight watch" in names
    assert [block.link_type for block in interfaces] == [USER0, *[RAW_IP] * (len(names) - 1)]
    assert all(block.timestamp_resolution == 1e-9 for block in interfaces)


def test_a_long_head_is_of_comments_that_it_can_read():
    text = "<value>" + "\u00e4" * 70_000 + "</value>"
    data = b"".join(write_pcapng([], iter(()), text, "a test"))
    section = next(iter(FileScanner(io.BytesIO(data))))
    assert "".join(section.options.get_all("opt_comment")) == text


def test_every_packet_has_its_datagram_time_direction_and_number(blocks, ours):
    packets = [block for block in blocks if isinstance(block, EnhancedPacket)]
    mine = list(ours.packets())
    assert len(packets) == len(mine) > 500
    assert not ours.cut
    numbers = []
    directions = {INBOUND: 0, OUTBOUND: 0}
    for theirs, packet in zip(packets, mine):
        assert theirs.packet_data == packet.data
        assert theirs.interface_id == packet.interface
        assert (theirs.timestamp_high << 32) + theirs.timestamp_low == packet.time_ns
        assert theirs.options["opt_comment"] == packet.comment
        notes = dict(note.split("=", 1) for note in packet.comment.split(" "))
        numbers.append(int(notes["n"]))
        if theirs.interface.link_type == USER0:
            continue
        direction = theirs.options["epb_flags"].inout
        directions[{"inbound": INBOUND, "outbound": OUTBOUND}[direction]] += 1
        assert packet.outbound == (direction == "outbound")
        assert theirs.options.get("epb_dropcount", 0) == packet.dropped
        source, to, payload = udp(theirs.packet_data)
        datagram = datagram_in(RAW_IP, packet.data)
        assert datagram is not None
        assert (datagram.source, datagram.destination, datagram.payload) == (source, to, payload)
        port = int(theirs.interface.options["if_description"].split()[1])
        assert (source if packet.outbound else to)[1] == port
    assert numbers == list(range(len(numbers)))
    assert min(directions.values()) > 100


def test_the_notes_are_messages_and_calls(blocks):
    notes = [b.packet_data for b in blocks if isinstance(b, EnhancedPacket) and b.interface.link_type == USER0]
    names = [note.partition(b"\0")[0].decode() for note in notes]
    assert names.count("topic control/manual") == 8
    assert any(name.startswith("service ") and name.endswith("/set_mode") for name in names)
    assert [name for name in names if name != "waited"][-1] == "close"
