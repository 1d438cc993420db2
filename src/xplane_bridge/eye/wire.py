"""The bytes between `xplane_eye` and `capture_node`; all numbers are little-endian.

The eye sends messages: a prefix of 16 bytes, a header, a body. The prefix is the letters XEY1, the version (u16), the
sizes of header (u16) and body (u32), and the CRC-32 of the header (u32). The header begins with the kind and the
number of the window (u8 each); a receiver passes over what it is longer than expected, and over kinds it does not know.
`capture_node` answers with replies of 16 bytes and sends nothing else. One of them is a request: to measure the delay,
sent only to an eye whose hello says that it does so, and answered by a message. No other command travels from ROS to
X-Plane's computer.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import List, Tuple

VERSION = 1
MOST_BODY = 16 * 1024 * 1024
#: Sides of a picture [px], which libjpeg bounds, and its size [pixels], 200 MB when `capture_node` decodes it.
LEAST_SIDE, MOST_SIDE = 16, 65500
MOST_PIXELS = 8192 * 8192
#: Longest token, name of an X-Plane and status text [bytes].
MOST_TEXT = 512
#: Bits of `PictureHeader.flags`: it may be the neighbouring frame's picture; the delay is not measured.
BORDERLINE = 1
DELAY_ASSUMED = 2

_MAGIC = b"XEY1"
_PREFIX = struct.Struct("<4sHHII")
_HELLO, _PICTURE, _STATUS, _CALIBRATION = 1, 2, 3, 4
_JPEG = 0
#: Bit of a hello's abilities, which releases before them end without.
_CALIBRATES = 1
_HELLO_HEADER = struct.Struct("<BBHHH")
_CALIBRATION_HEADER = struct.Struct("<BBHQ")
_STATUS_HEADER = struct.Struct("<BBH")
_PICTURE_HEADER = struct.Struct("<BBBBHHfIQqqqdd")
_REPLY = struct.Struct("<4sHHQ")
_REPLY_MAGIC = b"XEYA"

#: Codes of replies: the eye may send; a picture was taken over; the connection is refused; the delay is to be measured.
WELCOME, TAKEN, REFUSED, CALIBRATE = 0, 1, 2, 3
#: The number of a welcome while the pictures are being recorded: the view is not to be changed.
RECORDED = 1
#: Why, by the number of a refusal.
REFUSALS = {
    1: "the token is not the one in capture_node's sender/token",
    2: f"capture_node speaks another version than {VERSION}: install the same release on both computers",
    3: "capture_node has another sender already: each window needs a capture_node of its own",
    4: "capture_node could not read what was sent",
}


class WireError(ValueError):
    """Bytes that are not as they should be, or a value that no message can carry."""


@dataclass(frozen=True)
class PictureHeader:
    """What goes with a picture.

    Attributes:
        width: [px]
        height: [px]
        key: `sim/time/total_running_time_sec` of the frame shown, the float32 as received.
        flags: BORDERLINE, DELAY_ASSUMED.
        index: The eye's count of frames, for the frame shown.
        change_ns: When the picture was seen, by the eye's clock [ns].
        arrival_ns: When the frame's datagram came, by the eye's clock [ns].
        sent_ns: When the message was made, by the eye's clock [ns].
        delay_s: From a frame to its picture, as applied [s].
        residual_s: What is left of change - arrival - delay [s].
    """

    width: int
    height: int
    key: float
    flags: int
    index: int
    change_ns: int
    arrival_ns: int
    sent_ns: int
    delay_s: float
    residual_s: float


@dataclass(frozen=True)
class Reply:
    """A reply of `capture_node`.

    WELCOME with RECORDED or 0, TAKEN with the picture's index, REFUSED with the reason, CALIBRATE with its own number.
    """

    code: int
    number: int


def encode_hello(window: int, token: str, xplane: str) -> bytes:
    """The first message of a connection.

    Raises:
        WireError: A text is longer than MOST_TEXT.
    """
    secret, name = _text(token, "the token"), _text(xplane, "X-Plane's name")
    return _message(_HELLO_HEADER.pack(_HELLO, window, len(secret), len(name), _CALIBRATES), secret + name)


def encode_picture(window: int, header: PictureHeader, jpeg: bytes) -> bytes:
    """A picture.

    Raises:
        WireError: It is larger than MOST_BODY, or has another size than `capture_node` takes.
    """
    sides = header.width, header.height
    if min(sides) < LEAST_SIDE or max(sides) > MOST_SIDE or header.width * header.height > MOST_PIXELS:
        raise WireError(
            f"X-Plane's window has {header.width}x{header.height} px; expected sides of {LEAST_SIDE} to {MOST_SIDE} px "
            f"and at most {MOST_PIXELS} pixels: give it another size"
        )
    if len(jpeg) > MOST_BODY:
        raise WireError(
            f"the picture is a JPEG of {len(jpeg)} bytes; at most {MOST_BODY} can be sent: give a lower --quality or "
            "make X-Plane's window smaller"
        )
    packed = _PICTURE_HEADER.pack(
        _PICTURE,
        window,
        _JPEG,
        0,
        header.width,
        header.height,
        header.key,
        header.flags,
        header.index,
        header.change_ns,
        header.arrival_ns,
        header.sent_ns,
        header.delay_s,
        header.residual_s,
    )
    return _message(packed, jpeg)


def encode_status(window: int, problem: str) -> bytes:
    """What keeps the eye from sending pictures; empty: nothing. Sent every now and then, also as a sign of life."""
    return _message(_STATUS_HEADER.pack(_STATUS, window, 0), _cut(problem))


def encode_calibration(window: int, number: int, measured: bool, text: str) -> bytes:
    """The answer to a CALIBRATE of this number: whether the delay was measured, and what is to be said of it."""
    return _message(_CALIBRATION_HEADER.pack(_CALIBRATION, window, int(measured), number), _cut(text))


def _cut(text: str) -> bytes:
    return text.encode("utf-8")[:MOST_TEXT].decode("utf-8", "ignore").encode("utf-8")


def _text(text: str, what: str) -> bytes:
    raw = text.encode("utf-8")
    if len(raw) > MOST_TEXT:
        raise WireError(f"{what} has {len(raw)} bytes; at most {MOST_TEXT} can be sent")
    return raw


def _message(header: bytes, body: bytes) -> bytes:
    return _PREFIX.pack(_MAGIC, VERSION, len(header), len(body), zlib.crc32(header)) + header + body


class ReplyReader:
    """Cuts what `capture_node` sends into replies."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> List[Reply]:
        """Takes bytes as they come.

        Raises:
            WireError: They are no replies.
        """
        self._rest += data
        whole = len(self._rest) - len(self._rest) % _REPLY.size
        replies = [self._reply(fields) for fields in _REPLY.iter_unpack(self._rest[:whole])]
        self._rest = self._rest[whole:]
        return replies

    @staticmethod
    def _reply(fields: Tuple[bytes, int, int, int]) -> Reply:
        magic, _version, code, number = fields
        if magic != _REPLY_MAGIC or code > CALIBRATE:
            raise WireError(f"an answer that begins with {magic!r}, code {code}: this is no capture_node")
        return Reply(code, number)
