"""What all messages share: their label, sizes, text fields, and the error for those that are not as they should be."""

from __future__ import annotations

from xplane_bridge.protocol import constants as c


class DecodeError(ValueError):
    """A datagram that is not what its label promises.

    Attributes:
        reason: One of `too_short`, `unknown_label`, `wrong_size`, `bad_text`, `bad_value`.
    """

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


def label_of(datagram: bytes) -> bytes:
    """The four letters; DecodeError for less than a header."""
    if len(datagram) < c.HEADER_SIZE:
        raise DecodeError("too_short", f"{len(datagram)} bytes; an X-Plane message has at least {c.HEADER_SIZE}")
    return bytes(datagram[:4])


def require_size(datagram: bytes, what: str, size: int) -> None:
    """DecodeError unless the datagram has exactly this size; `what` names it."""
    if len(datagram) != size:
        raise DecodeError("wrong_size", f"{what} of {len(datagram)} bytes; expected {size}")


def pad(text: str, size: int, terminated: bool = True) -> bytes:
    """Text for a field of `size` bytes, NUL-padded; ValueError if it does not fit."""
    raw = text.encode("ascii")
    if len(raw) > size - int(terminated):
        raise ValueError(f"{text!r} has {len(raw)} characters; at most {size - int(terminated)} fit")
    return raw.ljust(size, b"\0")


def text_of(field: bytes, what: str) -> str:
    """Text of a field: up to its NUL, without trailing spaces; DecodeError if it is not ASCII."""
    raw = bytes(field).split(b"\0", 1)[0].rstrip(b" ")
    try:
        return raw.decode("ascii")
    except UnicodeDecodeError:
        raise DecodeError("bad_text", f"{what} is not ASCII: {raw[:40]!r}") from None
