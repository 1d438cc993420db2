"""Captures of other programs, made by hand."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import CaptureError, Packet, write_pcapng
from xplane_bridge.wire_log.strangers import MAGIC, StrangersCapture

XPLANE, CLIENT, OTHER = ("192.168.1.5", 49000), ("192.168.1.9", 60001), ("192.168.1.9", 60002)


def frame(source: tuple[str, int], to: tuple[str, int], payload: bytes) -> bytes:
    def octets(address: str) -> bytes:
        return bytes(int(part) for part in address.split("."))

    body = struct.pack(">HHHH", source[1], to[1], 8 + len(payload), 0) + payload
    head = bytes([0x45, 0]) + struct.pack(">HHHBBH", 20 + len(body), 0, 0, 64, 17, 0)
    return bytes(12) + b"\x08\x00" + head + octets(source[0]) + octets(to[0]) + body


def request(client: tuple[str, int], rate: int, index: int, path: str) -> bytes:
    return frame(client, XPLANE, b"RREF\0" + struct.pack("<ii", rate, index) + path.encode().ljust(400, b"\0"))


def answer(client: tuple[str, int], *pairs: tuple[int, float]) -> bytes:
    return frame(XPLANE, client, b"RREF," + b"".join(struct.pack("<if", *pair) for pair in pairs))


def capture(path: Path, *frames: bytes) -> Path:
    packets = [Packet(0, 10**18 + 20_000_000 * k, data) for k, data in enumerate(frames)]
    path.write_bytes(b"".join(write_pcapng([(1, "Ethernet", "")], iter(packets), "", "dumpcap")))
    return path


def test_answers_get_the_names_of_their_requests(tmp_path):
    strange = StrangersCapture(
        capture(
            tmp_path / "x.pcapng",
            request(CLIENT, 20, 7, "sim/a"),
            request(OTHER, 20, 7, "sim/b"),
            answer(CLIENT, (7, 1.5), (8, 9.0)),
            answer(OTHER, (7, 2.5)),
            request(CLIENT, 20, 7, "sim/b"),  # the number now means another
            answer(CLIENT, (7, 3.5)),
        )
    )
    assert (strange.xplane, strange.port) == XPLANE
    assert strange.paths == ["sim/a", "sim/b"]
    assert (strange.answers, strange.nameless) == (3, 1)
    data = b"".join(strange.playable())
    assert data.startswith(MAGIC)

    def values(client: int, number: int, value: float, k: int) -> bytes:
        time_ns, steady_ns = 10**18 + 20_000_000 * k, 1000 * 10**9 + 20_000_000 * (k - 2)
        payload = struct.pack("<If", number, value)
        return records.encode(records.VALUES, payload, client, time_ns, steady_ns, time_ns, XPLANE)

    for expected in (values(0, 0, 1.5, 2), values(1, 1, 2.5, 3), values(0, 1, 3.5, 5)):
        assert data.count(expected) == 1


def test_data_output_and_beacons_go_by_their_sockets(tmp_path):
    row = b"DATA*" + struct.pack("<i8f", 3, *range(8))
    strange = StrangersCapture(
        capture(tmp_path / "x.pcapng", frame(XPLANE, CLIENT, row), frame(XPLANE, CLIENT, b"DATAx"))
    )
    assert (strange.rows, strange.answers) == (1, 0)
    assert b"data\0" + row in b"".join(strange.playable())


def test_what_cannot_be_used_is_refused_in_words(tmp_path):
    with pytest.raises(CaptureError, match="has no datagrams of X-Plane; expected RREF, DATA"):
        StrangersCapture(capture(tmp_path / "a.pcapng", frame(CLIENT, OTHER, b"hello")))
    with pytest.raises(CaptureError, match="capture from before the program starts"):
        StrangersCapture(capture(tmp_path / "b.pcapng", answer(CLIENT, (1, 1.0))))
    with pytest.raises(CaptureError, match=r"no values of X-Plane at 10\.1\.1\.1"):
        StrangersCapture(
            capture(tmp_path / "c.pcapng", request(CLIENT, 1, 1, "sim/a"), answer(CLIENT, (1, 1.0))), "10.1.1.1"
        )
