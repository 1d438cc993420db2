"""What of a recording says whose it is, and that it is taken out."""

from __future__ import annotations

import struct
import xmlrpc.client
from pathlib import Path

import pytest

from support.simulator.udp_packets import udp
from xplane_bridge.wire_log.anonymous import Anonymiser, Disguise
from xplane_bridge.wire_log.capture import Capture, Packet, write_pcapng
from xplane_bridge.wire_log.datagrams import datagram_in
from xplane_bridge.wire_log.own_log import OwnLog, user_files

XPLANE, OURS, LOOPBACK = ("192.168.1.5", 49000), ("172.16.20.30", 50002), ("127.0.0.1", 49000)
BEACON = b"BECN\0\x01\x02" + struct.pack("<iiIH", 1, 115501, 1, 49000) + b"peters-laptop\0" + struct.pack("<H", 7)
TARGET = b"ISE4\0" + struct.pack("<i", 64) + b"172.16.20.30\0".ljust(16, b"\0") + b"49003\0\0\0" + struct.pack("<i", 1)
# A text in a field of its own, whose stand-in is longer.
SHORT = b"x" + b"1.2.3.4".ljust(16, b"\0")


def about(shared: dict[str, object], own: dict[str, object]) -> str:
    head = {
        "node": "/x/rx_node",
        "program": "rx_node",
        "namespace": "/x",
        "ordered": True,
        "shared": shared,
        "own": own,
    }
    text = xmlrpc.client.dumps((head,))
    return text[text.index("<value>") : text.rindex("</value>") + 8].replace("\n", "")


def disguised(path: Path, out: Path) -> Capture:
    out.write_bytes(b"".join(Anonymiser([path]).blocks(path)))
    return Capture.open(out)


def test_a_log_keeps_all_but_addresses_and_names(tmp_path):
    comment = about(
        {"host": "peters-laptop", "conformance_file": "/srv/peter/card.yaml", "port": 49000},
        {"data_address": "172.16.20.30", "rates": {"flight": 60}},
    )
    packets = [
        Packet(1, 1, udp(OURS, XPLANE, TARGET), "n=0 w=1 s=1", outbound=True),
        Packet(1, 2, udp(XPLANE, OURS, BEACON), "n=1 w=2 s=2 k=1", dropped=3),
        Packet(0, 3, b"service x\0abc", "n=2 w=3 s=3"),
        Packet(1, 4, udp(LOOPBACK, LOOPBACK, b"RREF,"), "n=3 w=4 s=4"),
        Packet(1, 5, udp(("1.2.3.4", 5), OURS, SHORT), "n=4 w=5 s=5"),
    ]
    interfaces = [(147, "rx_node/notes", ""), (101, "rx_node/control", "port 50002")]
    path = tmp_path / "wire.pcapng"
    path.write_bytes(b"".join(write_pcapng(interfaces, iter(packets), comment, "a test")))
    out = tmp_path / "out.pcapng"
    capture = disguised(path, out)
    after = list(capture.packets())
    assert [each.comment for each in after] == [each.comment for each in packets]
    assert [(each.time_ns, each.outbound, each.dropped) for each in after] == [
        (each.time_ns, each.outbound, each.dropped) for each in packets
    ]
    sent, beacon, note, local, short = after
    datagram = datagram_in(101, sent.data)
    assert datagram.source == ("10.0.0.1", 50002)
    assert datagram.destination == ("10.0.0.2", 49000)
    assert datagram.payload == TARGET.replace(b"172.16.20.30", b"10.0.0.1\0\0\0\0")
    assert datagram_in(101, beacon.data).payload == BEACON.replace(b"peters-laptop", b"computercompu")
    assert note.data == b"service x\0abc"
    assert datagram_in(101, local.data) == (LOOPBACK, LOOPBACK, b"RREF,")
    assert datagram_in(101, short.data).payload == b"x" + b"10.0.0.3".ljust(16, b"\0")
    data = out.read_bytes()
    for word in (b"peter", b"192.168", b"172.16", b"1.2.3.4"):
        assert word not in data
    log = OwnLog(out)
    assert log.about["shared"] == {"host": "10.0.0.2", "conformance_file": "card.yaml", "port": 49000}
    assert log.about["own"] == {"data_address": "10.0.0.1", "rates": {"flight": 60}}
    assert (log.node, log.is_ordered) == ("/x/rx_node", True)
    assert len(list(log.events())) == 1 + 5  # a socket, and the packets


def test_of_another_programs_capture_only_datagrams_are_kept(tmp_path):
    ethernet = b"\xaa\xbb\xcc\xdd\xee\xff" * 2 + b"\x08\x00"
    frames = [ethernet + udp(XPLANE, OURS, b"RREF,"), ethernet[:12] + b"\x08\x06" + bytes(28)]
    path = tmp_path / "mine.pcapng"
    packets = [Packet(0, 1 + k, data, "a remark of peter's") for k, data in enumerate(frames)]
    path.write_bytes(b"".join(write_pcapng([(1, "wlan of peter", "")], iter(packets), "on peter's laptop", "dumpcap")))
    out = tmp_path / "out.pcapng"
    (packet,) = disguised(path, out).packets()
    assert datagram_in(101, packet.data) == (("10.0.0.1", 49000), ("10.0.0.2", 50002), b"RREF,")
    data = out.read_bytes()
    for word in (b"peter", b"\xaa\xbb\xcc"):
        assert word not in data


CARD = b'{"format": "xplane_bridge conformance", "xplane_version": 115501, "host": "%s", "port": 49000, "text": "%s"}'
NOTES = [(147, "rx_node/notes", ""), (101, "rx_node/control", "port 50002")]


def test_files_of_earlier_flights_have_the_addresses_of_the_datagrams(tmp_path):
    files = {
        "192.168.1.5_49000_conformance.yaml": CARD
        % (b"192.168.1.5", b"asked at peters-laptop:49000, not 172.16.20.30"),
        # Of an X-Plane that is not in the log, of this computer, and named by the user.
        "192.168.1.77_49000_conformance.yaml": CARD % (b"192.168.1.77", b"Peters-Laptop_49000 answered 192.168.001.77"),
        "127.0.0.1_49000_conformance.yaml": CARD % (b"127.0.0.1", b"version 999.1.2.3"),
        "mixing/peters-laptop_DA62.yaml": b"{}",
    }
    notes = [Packet(0, k, f"file {name}\0".encode() + files[name], f"n={k} w=1 s=1") for k, name in enumerate(files)]
    sent = Packet(1, 9, udp(OURS, XPLANE, b"asks"), "n=4 w=2 s=2", outbound=True)
    call = Packet(0, 10, b"service x\0peters-laptop", "n=5 w=3 s=3")
    comment = about(
        {"host": "peters-laptop", "conformance_file": "/srv/peter/peters-laptop_192.168.1.77.yaml", "port": 49000},
        {"url": "udp://192.168.1.77:5600", "frame": "peters-laptop", "topic": "/peters-laptop/x.y", "name": "a/b"},
    )
    path, out = tmp_path / "wire.pcapng", tmp_path / "out.pcapng"
    path.write_bytes(b"".join(write_pcapng(NOTES, iter([*notes, sent, call]), comment, "a test")))
    disguised(path, out)
    log = OwnLog(out)
    # The datagrams' addresses are the first, ours and X-Plane's; 192.168.1.77 comes after them.
    assert [event.peer for event in log.events() if event.payload == b"asks"] == [("10.0.0.2", 49000)]
    assert user_files(log) == {
        "10.0.0.2_49000_conformance.yaml": CARD % (b"10.0.0.2", b"asked at 10.0.0.2:49000, not 10.0.0.1"),
        "10.0.0.3_49000_conformance.yaml": CARD % (b"10.0.0.3", b"10.0.0.2_49000 answered 10.0.0.3"),
        "127.0.0.1_49000_conformance.yaml": CARD % (b"127.0.0.1", b"version 999.1.2.3"),
        "mixing/10.0.0.2_DA62.yaml": b"{}",
    }
    assert log.about["shared"]["conformance_file"] == "10.0.0.2_10.0.0.3.yaml"
    assert log.about["own"] == {"url": "udp://10.0.0.3:5600", "frame": "10.0.0.2", "topic": "x.y", "name": "a/b"}
    # A message's bytes stay: it would not be one any more.
    assert b"service x\0peters-laptop" in [event.payload for event in log.events()]


def test_a_secret_in_a_log_of_an_earlier_version_is_left_out(tmp_path):
    comment = about({"host": "127.0.0.1"}, {"source": "sender", "sender": {"token": "window seat", "peer": ""}})
    path, out = tmp_path / "wire.pcapng", tmp_path / "out.pcapng"
    path.write_bytes(b"".join(write_pcapng(NOTES, iter(()), comment, "a test")))
    disguised(path, out)
    assert OwnLog(out).about["own"] == {"source": "sender", "sender": {"token": "...", "peer": ""}}
    assert b"window seat" not in out.read_bytes()
    assert Disguise().value({"token": ""}) == {"token": ""}


def test_a_host_called_as_the_words_of_a_file_leaves_it_readable():
    disguise = Disguise()
    disguise.name("xplane", "192.168.1.5")
    note = b"file xplane_49000_conformance.yaml\0" + CARD % (b"xplane", b"XPLANE!")
    assert disguise.note(note) == b"file 10.0.0.1_49000_conformance.yaml\0" + CARD % (b"10.0.0.1", b"10.0.0.1!")
    assert disguise.value({"frame": "xplane/base_link", "host": "xplane"}) == {
        "frame": "xplane/base_link",
        "host": "10.0.0.1",
    }


@pytest.mark.parametrize(
    ("value", "kept"),
    [
        ("/home/user/x.yaml", "x.yaml"),
        ("/home/user/", "user"),
        ("~/user/x.yaml", "x.yaml"),
        ("~user/x", "x"),
        ("~user", ""),
        ("../user/x", "x"),
        ("./user/x", "x"),
        ("user/config/x.yaml", "x.yaml"),
        ("file:///home/user/x", "x"),
        ("C:/Users/user/x", "x"),
        ("C:\\Users\\user\\x.yaml", "x.yaml"),
        ("\\\\server\\user\\x", "x"),
        ("user@lab:/home/user/x", "x"),
        # None of these is a path of the user's.
        ("xplane/base_link", "xplane/base_link"),
        ("/xplane", "/xplane"),
        ("udp://127.0.0.1:5600", "udp://127.0.0.1:5600"),
        ("sim/flightmodel/position/theta", "sim/flightmodel/position/theta"),
        ("x.yaml", "x.yaml"),
        ("a word: and more", "a word: and more"),
        ("", ""),
    ],
)
def test_of_a_path_the_last_part_is_kept(value, kept):
    assert Disguise().value(value) == kept
    assert Disguise().value({"list": [value]}) == {"list": [kept]}


def test_a_host_of_which_nothing_was_sent_gets_an_address(tmp_path):
    path, out = tmp_path / "wire.pcapng", tmp_path / "out.pcapng"
    path.write_bytes(b"".join(write_pcapng(NOTES, iter([]), about({"host": "peters-laptop"}, {}), "a test")))
    disguised(path, out)
    assert OwnLog(out).about["shared"] == {"host": "10.0.0.1"}


def test_stand_ins_are_not_taken_for_addresses_and_fit_their_field():
    disguise = Disguise()
    assert [disguise.address(each) for each in ("192.168.1.5", "10.0.0.1")] == ["10.0.0.1", "10.0.0.2"]
    assert disguise.payload(b"192.168.1.5 10.0.0.1 ") == b"10.0.0.1\0\0\0 10.0.0.2 "
    # Of a computer that is in no datagram, and without room for what stands for it.
    assert disguise.payload(b"7.7.7.7x") == b"0.0.0.0x"
    assert disguise.payload(b"8.8.8.8\0x") == b"10.0.0.4x"


def test_all_parts_have_one_disguise(tmp_path):
    other = ("192.168.1.77", 49000)
    first, second = tmp_path / "w.rx_node.pcapng", tmp_path / "w.rx_node_part2.pcapng"
    comment = about({"host": "peters-laptop"}, {})
    parts = {
        first: [Packet(1, 1, udp(OURS, XPLANE, b"asks"), "n=0 w=1 s=1", outbound=True)],
        second: [
            Packet(1, 2, udp(other, OURS, b"says"), "n=1 w=2 s=2"),
            Packet(1, 3, udp(XPLANE, OURS, b"says"), "n=2 w=3 s=3"),
        ],
    }
    for path, packets in parts.items():
        path.write_bytes(b"".join(write_pcapng(NOTES, iter(packets), comment, "a test")))
    anonymiser = Anonymiser(list(parts))
    out = tmp_path / "out"
    out.mkdir()
    for path in parts:
        (out / path.name).write_bytes(b"".join(anonymiser.blocks(path)))
    log = OwnLog(out / first.name)
    peers = [event.peer[0] for event in log.events() if event.payload in (b"asks", b"says")]
    assert peers == ["10.0.0.2", "10.0.0.3", "10.0.0.2"]
    assert log.problem == ""
    assert OwnLog(out / second.name).about["shared"] == {"host": "10.0.0.2"}


def test_fragments_are_kept_as_one_datagram_and_what_is_not_kept_is_said(tmp_path):
    whole = udp(XPLANE, OURS, bytes(range(64)))
    first = whole[:2] + struct.pack(">HHH", 44, 5, 0x2000) + whole[8:44]
    last = whole[:2] + struct.pack(">HHH", 20 + len(whole) - 44, 5, 3) + whole[8:20] + whole[44:]
    lost = whole[:2] + struct.pack(">HHH", 44, 6, 0x2000) + whole[8:44]
    path, out = tmp_path / "mine.pcapng", tmp_path / "out.pcapng"
    frames = [Packet(0, k, data) for k, data in enumerate((last, first, lost, whole[:-1]))]
    path.write_bytes(b"".join(write_pcapng([(101, "", "")], iter(frames), "", "dumpcap")) + b"\x06\0\0\0")
    (packet,) = disguised(path, out).packets()
    assert datagram_in(101, packet.data) == (("10.0.0.1", 49000), ("10.0.0.2", 50002), bytes(range(64)))
    assert Anonymiser([path]).left_out() == [
        f"1 datagrams of {path} are left out because fragments of them are missing",
        f"1 datagrams of {path} are left out because the capture has cut them short",
        f"{path} is cut off; all before that is kept",
    ]
