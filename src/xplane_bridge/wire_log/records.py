"""Records as a node plays them: the Python side of core/wire/wire_record.hpp."""

from __future__ import annotations

import socket
import struct
from typing import Tuple

MAGIC = b"xplane_bridge wire records 1\n"
OPENED, RECEIVED, SENT, WAITED, INPUT, REFUSED, LOST, NAMED, VALUES = range(1, 10)
_HEAD = struct.Struct("<IBBHqqqIHHI")

Address = Tuple[str, int]


def encode(
    kind: int,
    payload: bytes = b"",
    source: int = 0,
    wall_ns: int = 0,
    steady_ns: int = 0,
    kernel_ns: int = 0,
    peer: Address = ("0.0.0.0", 0),
    counted: int = 0,
) -> bytes:
    """The bytes of one record; the arguments are the fields of `core::WireRecord`."""
    address = struct.unpack(">I", socket.inet_aton(peer[0]))[0]
    return (
        _HEAD.pack(len(payload), kind, 0, source, wall_ns, steady_ns, kernel_ns, address, peer[1], 0, counted) + payload
    )
