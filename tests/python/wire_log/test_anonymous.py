"""What of a recording says whose it is, and that it is taken out."""

from __future__ import annotations

import struct
import xmlrpc.client
from pathlib import Path

from xplane_bridge.wire_log.anonymous import anonymised
from xplane_bridge.wire_log.capture import Capture, Packet, write_pcapng
from xplane_bridge.wire_log.datagrams import datagram_in
from xplane_bridge.wire_log.own_log import OwnLog

XPLANE, OURS, LOOPBACK = ("192.168.1.5", 49000), ("172.16.20.30", 50002), ("127.0.0.1", 49000)
BEACON = b"BECN\0\x01\x02" + struct.pack("<iiIH", 1, 115501, 1, 49000) + b"peters-laptop\0" + struct.pack("<H", 7)
TARGET = b"ISE4\0" + struct.pack("<i", 64) + b"172.16.20.30\0".ljust(16, b"\0") + b"49003\0\0\0" + struct.pack("<i", 1)
# A text in a field of its own, whose stand-in is longer.
SHORT = b"x" + b"1.2.3.4".ljust(16, b"\0")


def udp(source: tuple[str, int], to: tuple[str, int], payload: bytes) -> bytes:
    def octets(address: str) -> bytes:
        return bytes(int(part) for part in address.split("."))

    body = struct.pack(">HHHH", source[1], to[1], 8 + len(payload), 0) + payload
    head = bytes([0x45, 0]) + struct.pack(">HHHBBH", 20 + len(body), 0, 0, 64, 17, 0)
    return head + octets(source[0]) + octets(to[0]) + body


def disguised(path: Path, out: Path) -> Capture:
    out.write_bytes(b"".join(anonymised(path)))
    return Capture.open(out)


def test_a_log_keeps_all_but_addresses_and_names(tmp_path):
    about = {
        "node": "/x/rx_node",
        "program": "rx_node",
        "namespace": "/x",
        "ordered": True,
        "shared": {"host": "peters-laptop", "conformance_file": "/srv/peter/card.yaml", "port": 49000},
        "own": {"data_address": "172.16.20.30", "rates": {"flight": 60}},
    }
    text = xmlrpc.client.dumps((about,))
    comment = text[text.index("<value>") : text.rindex("</value>") + 8].replace("\n", "")
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
