"""The bridge's own wire logs, from the bytes of a file to what a node plays."""

from __future__ import annotations

import struct
import xmlrpc.client
from pathlib import Path

import pytest

from support.simulator.udp_packets import udp
from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import Capture, CaptureError, Packet, write_pcapng
from xplane_bridge.wire_log.own_log import OwnLog, about_of, has_input, part_after, replayable

INTERFACES = [(147, "rx_node/notes", ""), (101, "rx_node/control", "port 50001"), (101, "rx_node/flight", "port 50002")]


XPLANE, OURS = ("10.0.0.1", 49000), ("10.0.0.2", 50002)
PACKETS = [
    Packet(2, 1005, udp(XPLANE, OURS, b"RREF,"), "n=0 w=1010 s=10 k=1 t=1000,1;1008,8", dropped=2),
    Packet(1, 1020, udp(OURS, XPLANE, b"asks"), "n=1 w=1020 s=20 e=111", outbound=True),
    Packet(0, 1030, b"service set_origin\0\x01\x02", "n=2 w=1030 s=30 t=1029,29"),
    Packet(0, 1040, b"refused\x004 0", "n=3 w=1040 s=40"),
    Packet(0, 1050, b"waited\0", "n=4 w=1050 s=50 t=1050,50"),
]


def about(**values: object) -> str:
    text = xmlrpc.client.dumps(({"node": "/x/rx_node", "program": "rx_node", "namespace": "/x", **values},))
    return text[text.index("<value>") : text.rindex("</value>") + 8].replace("\n", "")


def write(path: Path, packets: list[Packet], comment: str = "") -> Path:
    path.write_bytes(b"".join(write_pcapng(INTERFACES, iter(packets), comment or about(ordered=True), "a test")))
    return path


def reported(log: OwnLog) -> list[tuple[object, ...]]:
    return [(e.kind, e.source, e.wall_ns, e.steady_ns, e.kernel_ns, e.counted, e.payload) for e in log.events()]


def test_events_in_the_order_of_processing(tmp_path):
    log = OwnLog(write(tmp_path / "w.rx_node.pcapng", PACKETS))
    assert reported(log) == [
        (records.OPENED, 0, 0, 0, 0, 0, b"control"),
        (records.OPENED, 1, 0, 0, 0, 0, b"flight"),
        (records.WAITED, 0, 1000, 1, 0, 0, b""),
        (records.WAITED, 0, 1008, 8, 0, 0, b""),
        (records.RECEIVED, 1, 1010, 10, 1005, 2, b"RREF,"),
        (records.SENT, 0, 1020, 20, 0, 111, b"asks"),
        (records.WAITED, 0, 1029, 29, 0, 0, b""),
        (records.INPUT, 0, 1030, 30, 0, 0, b"service set_origin\0\x01\x02"),
        (records.REFUSED, 0, 1040, 40, 0, 4, b""),
        (records.WAITED, 0, 1050, 50, 0, 0, b""),
    ]
    assert (log.node, log.is_ordered, log.problem) == ("/x/rx_node", True, "")
    sent = next(e for e in log.events() if e.kind == records.SENT)
    assert len(list(log.events())) == 10  # again from the beginning
    assert sent.peer == XPLANE


def test_parts_follow_each_other(tmp_path):
    first = write(tmp_path / "w.rx_node.pcapng", PACKETS[:2])
    second = write(tmp_path / "w.rx_node_part2.pcapng", PACKETS[2:])
    log = OwnLog(first)
    assert log.parts() == [first, second]
    assert [e.kind for e in log.events()] == [1, 1, 4, 4, 2, 3, 4, 5, 6, 4]
    assert OwnLog(second).parts() == [second]
    assert part_after(second, 1) == part_after(first, 2) == tmp_path / "w.rx_node_part3.pcapng"


def test_without_its_first_part_a_log_has_one_source_of_each_name(tmp_path):
    """Which of several was closed before is not known, and a replay opens the first anew."""
    path = tmp_path / "w.rx_node_part2.pcapng"
    flight = (101, "rx_node/flight", "port 50003")
    packets = [
        Packet(2, 1005, udp(XPLANE, OURS, b"before"), "n=7 w=1010 s=10", dropped=2),
        Packet(3, 1006, udp(XPLANE, OURS, b"after"), "n=8 w=1011 s=11", dropped=3),
        Packet(0, 1012, b"refused\x004 2", "n=9 w=1012 s=12"),
    ]
    path.write_bytes(b"".join(write_pcapng([*INTERFACES, flight], iter(packets), about(ordered=True), "a test")))
    log = OwnLog(path)
    assert [(e.kind, e.source, e.counted, e.payload) for e in log.events()] == [
        (records.OPENED, 0, 0, b"control"),
        (records.OPENED, 1, 0, b"flight"),
        (records.RECEIVED, 1, 2, b"before"),
        (records.RECEIVED, 1, 5, b"after"),
        (records.REFUSED, 1, 4, b""),
    ]
    assert log.sources == [("control", 50001), ("flight", 50002)]


def test_a_head_of_any_length_is_read_also_where_others_have_added_to_it(tmp_path):
    datarefs = [f"sim/\u00e4/{i}" for i in range(9000)]
    path = write(tmp_path / "w.rx_node.pcapng", PACKETS, about(ordered=True, own=datarefs))
    data = path.read_bytes()
    assert OwnLog(path).about["own"] == datarefs
    (size,) = struct.unpack_from("<I", data, 4)
    remark = struct.pack("<HH", 1, 8) + b"a remark"
    head = data[8 : size - 8] + remark + bytes(4)  # before the end of the options
    section = data[:4] + struct.pack("<I", size + len(remark)) + head + struct.pack("<I", size + len(remark))
    remarked = about_of(Capture(section + data[size:], "remarked"))
    assert remarked is not None
    assert remarked["own"] == datarefs


def test_an_input_is_found_by_its_name(tmp_path):
    log = OwnLog(write(tmp_path / "w.rx_node.pcapng", PACKETS))
    assert has_input(log, "service set_origin")
    assert not has_input(log, "service")


def test_it_ends_where_something_is_missing(tmp_path):
    lost = Packet(0, 1015, b"lost\x0012 0", "n=1 w=1015 s=15")
    gap = OwnLog(write(tmp_path / "gap.pcapng", [PACKETS[0], lost, PACKETS[3]]))
    assert [e.kind for e in gap.events()] == [1, 1, 4, 4, 2]
    assert gap.problem.endswith("has a gap of 12 records, which were not written in time")
    filtered = OwnLog(write(tmp_path / "filtered.pcapng", [PACKETS[0], PACKETS[2]]))
    assert [e.kind for e in filtered.events()] == [1, 1, 4, 4, 2]
    assert filtered.problem.endswith("has a gap before packet 2: packets were taken out")
    whole = write(tmp_path / "whole.pcapng", PACKETS).read_bytes()
    (tmp_path / "cut.pcapng").write_bytes(whole[:-60])
    cut = OwnLog(tmp_path / "cut.pcapng")
    assert [e.kind for e in cut.events()] == [1, 1, 4, 4, 2, 3, 4, 5, 6]
    assert cut.problem.endswith("is cut off")


def test_another_programs_capture_is_none(tmp_path):
    path = write(tmp_path / "stranger.pcapng", [], comment="captured by hand")
    with pytest.raises(CaptureError, match="was not written with wire_log"):
        OwnLog(path)


def test_what_a_node_plays(tmp_path):
    data = b"".join(replayable(OwnLog(write(tmp_path / "w.pcapng", PACKETS))))
    assert data.startswith(b"xplane_bridge wire records 1\n")
    # The received datagram, field by field as wire_record.hpp has them.
    head = struct.pack("<IBBHqqqIHHI", 5, 2, 0, 1, 1010, 10, 1005, 0x0A000001, 49000, 0, 2)
    assert head + b"RREF," in data
