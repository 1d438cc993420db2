"""UDP datagrams as captures hold them."""

from __future__ import annotations

import struct
from typing import Tuple

Address = Tuple[str, int]


def udp(source: Address, to: Address, payload: bytes) -> bytes:
    """An IPv4 packet without checksums."""
    body = struct.pack(">HHHH", source[1], to[1], 8 + len(payload), 0) + payload
    head = bytes([0x45, 0]) + struct.pack(">HHHBBH", 20 + len(body), 0, 0, 64, 17, 0)
    return head + _octets(source[0]) + _octets(to[0]) + body


def _octets(address: str) -> bytes:
    return bytes(int(part) for part in address.split("."))
