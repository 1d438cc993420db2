"""The sender's bytes, held to messages that neither end has made (tests/data/eye)."""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path

import pytest

from xplane_bridge.eye import wire

DATA = Path(__file__).resolve().parents[2] / "data" / "eye"


def golden(name: str) -> bytes:
    return bytes.fromhex((DATA / f"{name}.hex").read_text(encoding="utf-8"))


HEADER = wire.PictureHeader(
    width=640,
    height=480,
    key=123.5,
    flags=wire.BORDERLINE,
    index=7,
    change_ns=2_000_000_000,
    arrival_ns=1_940_000_000,
    sent_ns=2_010_000_000,
    delay_s=0.05,
    residual_s=0.01,
)


def test_messages_have_the_golden_bytes():
    assert wire.encode_hello(2, "secret", "127.0.0.1:49000") == golden("hello_that_calibrates")
    assert wire.encode_picture(2, HEADER, b"JPEG") == golden("picture")
    assert wire.encode_status(2, "no window") == golden("status")
    assert wire.encode_calibration(2, 7, True, "42.5 ms, from 10 steps") == golden("calibration")


def test_what_no_receiver_would_take_is_not_sent():
    with pytest.raises(wire.WireError, match="16777217 bytes"):
        wire.encode_picture(0, HEADER, bytes(wire.MOST_BODY + 1))
    with pytest.raises(wire.WireError, match="the token has 513 bytes"):
        wire.encode_hello(0, "x" * 513, "")


@pytest.mark.parametrize(
    ("width", "height", "sent"),
    [
        (16, 16, True),
        (11520, 2160, True),
        (8192, 8192, True),
        (65500, 1024, True),
        (15, 480, False),
        (8193, 8192, False),
        (65501, 480, False),
    ],
)
def test_pictures_are_sent_of_the_sizes_that_capture_node_takes(width: int, height: int, sent: bool):
    header = dataclasses.replace(HEADER, width=width, height=height)
    if sent:
        assert struct.unpack_from("<HH", wire.encode_picture(0, header, b"JPEG"), 20) == (width, height)
    else:
        with pytest.raises(wire.WireError, match=f"{width}x{height} px; expected sides of 16 to 65500 px and at most"):
            wire.encode_picture(0, header, b"JPEG")


def test_a_long_status_is_cut_between_two_characters():
    assert wire.encode_status(0, "ä" * 300)[20:].decode("utf-8") == "ä" * 256


def test_replies_are_read_from_pieces():
    reader = wire.ReplyReader()
    stream = b"".join(struct.pack("<4sHHQ", b"XEYA", 1, *reply) for reply in ((0, 0), (1, 42), (3, 9)))
    replies = [reply for at in range(0, len(stream), 5) for reply in reader.feed(stream[at : at + 5])]
    assert replies == [wire.Reply(wire.WELCOME, 0), wire.Reply(wire.TAKEN, 42), wire.Reply(wire.CALIBRATE, 9)]


def test_another_server_is_no_capture_node():
    with pytest.raises(wire.WireError, match="no capture_node"):
        wire.ReplyReader().feed(b"HTTP/1.1 400 Bad Request")
