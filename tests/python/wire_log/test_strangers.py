"""Captures of other programs, made by hand."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from support.simulator.udp_packets import udp
from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import CaptureError, Packet, write_pcapng
from xplane_bridge.wire_log.strangers import MAGIC, StrangersCapture

XPLANE, CLIENT, OTHER = ("192.168.1.5", 49000), ("192.168.1.9", 60001), ("192.168.1.9", 60002)


def frame(source: tuple[str, int], to: tuple[str, int], payload: bytes) -> bytes:
    return bytes(12) + b"\x08\x00" + udp(source, to, payload)


def request(client: tuple[str, int], rate: int, index: int, path: str, label: bytes = b"RREF\0") -> bytes:
    return frame(client, XPLANE, label + struct.pack("<ii", rate, index) + path.encode().ljust(400, b"\0"))


def answer(client: tuple[str, int], *pairs: tuple[int, float], label: bytes = b"RREF,") -> bytes:
    return frame(XPLANE, client, label + b"".join(struct.pack("<if", *pair) for pair in pairs))


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


def test_data_output_in_fragments_is_played_and_what_is_missing_is_said(tmp_path):
    rows = b"DATA*" + b"".join(struct.pack("<i8f", k, *range(8)) for k in range(60))
    whole = frame(XPLANE, CLIENT, rows)
    head, body = whole[14:34], whole[34:]

    def piece(number: int, at: int, more: int) -> bytes:
        part = body[at : at + 1480]
        return whole[:14] + head[:2] + struct.pack(">HHH", 20 + len(part), number, at // 8 | more) + head[8:] + part

    first, last = piece(9, 0, 0x2000), piece(9, 1480, 0)
    strange = StrangersCapture(capture(tmp_path / "x.pcapng", last, first))
    assert strange.left_out() == []
    event = records.encode(
        records.RECEIVED, b"data\0" + rows, 0, 10**18 + 20_000_000, 1000 * 10**9, 10**18 + 20_000_000, XPLANE
    )
    assert b"".join(strange.playable()) == MAGIC + event
    # As a filter by port gives it: the first fragment only; and another computer's, of which nothing is asked.
    others = piece(3, 0, 0x2000).replace(bytes([192, 168, 1, 5]), bytes([192, 168, 1, 6]))
    unknown_kind = frame(XPLANE, CLIENT, b"XGPS")
    file = capture(tmp_path / "y.pcapng", last, first, piece(10, 0, 0x2000), others, unknown_kind)
    file.write_bytes(file.read_bytes() + b"\x06\0\0\0")
    strange = StrangersCapture(file)
    assert strange.rows == 1
    assert strange.left_out() == [
        "1 datagrams are not replayed because the capture does not have all fragments of them; capture with the filter "
        "of docs/experiments/wire_log.md, which takes fragments too",
        "1 datagrams of X-Plane are not replayed: they are neither RREF, DATA, RPOS nor BECN",
        f"{file} is cut off; the replay ends there",
    ]
    with pytest.raises(CaptureError, match=r"no datagrams of X-Plane; .*; 1 datagrams are not replayed because"):
        StrangersCapture(capture(tmp_path / "z.pcapng", first))


def test_packets_cut_short_are_counted(tmp_path):
    row = frame(XPLANE, CLIENT, b"DATA*" + bytes(36))
    file = capture(tmp_path / "x.pcapng", row, row)
    data = bytearray(file.read_bytes())
    # The second is longer than what was captured of it.
    at = data.rindex(struct.pack("<II", len(row), len(row)))
    struct.pack_into("<I", data, at + 4, len(row) + 36)
    file.write_bytes(data)
    strange = StrangersCapture(file)
    assert strange.rows == 1
    assert strange.left_out() == [
        "1 datagrams are not replayed because they were cut short; capture whole packets (-s 0)"
    ]


def test_commands_to_x_plane_on_the_same_computer_are_not_its_data_output(tmp_path):
    xplane, client = ("127.0.0.1", 49000), ("127.0.0.1", 60001)
    row = b"DATA*" + bytes(36)
    strange = StrangersCapture(
        capture(
            tmp_path / "x.pcapng",
            frame(client, xplane, b"DATA\0" + bytes(36)),
            frame(xplane, client, row),
            frame(client, xplane, b"CMND\0sim/none/none"),
        )
    )
    assert (strange.rows, strange.left_out()) == (1, [])


def test_rows_that_are_written_to_x_plane_do_not_make_their_sender_x_plane(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rows = frame(("192.168.1.5", 49001), CLIENT, b"DATA*" + struct.pack("<i8f", 17, *range(8)))
    command = frame(OTHER, XPLANE, b"DATA\0" + struct.pack("<i8f", 8, *range(8)))
    strange = StrangersCapture(capture(tmp_path / "x.pcapng", rows, command, command, command))
    assert (strange.xplane, strange.rows, strange.left_out()) == (XPLANE[0], 1, [])
    # Another port shows by the requests.
    other_port = (XPLANE[0], 49010)
    asked = frame(CLIENT, other_port, b"RREF\0" + struct.pack("<ii", 20, 7) + b"sim/time/paused".ljust(400, b"\0"))
    elsewhere = frame(CLIENT, other_port, b"DATA\0" + bytes(36))
    file = capture(tmp_path / "y.pcapng", asked, elsewhere, elsewhere, elsewhere, answer(CLIENT, (7, 1.0)))
    assert StrangersCapture(file).xplane == XPLANE[0]
    assert caplog.text == ""
    with pytest.raises(CaptureError, match=r"no values of X-Plane at 192\.168\.1\.5 .*; where .* --xplane ADDRESS"):
        StrangersCapture(capture(tmp_path / "z.pcapng", command))


def test_of_two_addresses_that_may_be_x_plane_the_choice_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    row = b"DATA*" + bytes(36)
    second = ("192.168.1.6", 49000)
    file = capture(tmp_path / "x.pcapng", frame(second, CLIENT, row), *[frame(XPLANE, CLIENT, row)] * 2)
    assert (StrangersCapture(file).xplane, StrangersCapture(file, second[0]).xplane) == (XPLANE[0], second[0])
    assert caplog.messages == [
        f"{file}: X-Plane may be at 192.168.1.5 or 192.168.1.6; 192.168.1.5 is taken, for which most datagrams speak; "
        "--xplane ADDRESS takes another"
    ]


@pytest.mark.parametrize(("asks", "answers"), [(b"RREF0", b"RREF,"), (b"RREF\0", b"RREFO")])
def test_programs_and_versions_with_another_fifth_byte_are_read(tmp_path: Path, asks: bytes, answers: bytes) -> None:
    """ArduPilot asks with a 0; X-Plane 10 answers with an O. An answer of 51 values is as long as a request."""
    pairs = [(number, 0.5 * number) for number in range(51)]
    requests = [request(CLIENT, 20, number, f"sim/{number}", label=asks) for number, _ in pairs]
    strange = StrangersCapture(capture(tmp_path / "x.pcapng", *requests, answer(CLIENT, *pairs, label=answers)))
    assert (strange.answers, strange.nameless, len(strange.paths)) == (1, 0, 51)
    values = b"".join(struct.pack("<If", *pair) for pair in pairs)
    assert values in b"".join(strange.playable())


def test_what_cannot_be_used_is_refused_in_words(tmp_path):
    with pytest.raises(CaptureError, match="only requests are in it: capture what X-Plane sends, too"):
        StrangersCapture(capture(tmp_path / "r.pcapng", request(CLIENT, 1, 1, "sim/a")))
    with pytest.raises(CaptureError, match="has no datagrams of X-Plane; expected RREF, DATA"):
        StrangersCapture(capture(tmp_path / "a.pcapng", frame(CLIENT, OTHER, b"hello")))
    with pytest.raises(CaptureError, match="capture from before the program starts"):
        StrangersCapture(capture(tmp_path / "b.pcapng", answer(CLIENT, (1, 1.0))))
    with pytest.raises(CaptureError, match=r"no values of X-Plane at 10\.1\.1\.1"):
        StrangersCapture(
            capture(tmp_path / "c.pcapng", request(CLIENT, 1, 1, "sim/a"), answer(CLIENT, (1, 1.0))), "10.1.1.1"
        )
