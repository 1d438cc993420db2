"""What X-Plane sends, except DATA (in `requests`), as values with their encoding; decoding fails as requests' does."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import List, Sequence, Tuple

from xplane_bridge.protocol import constants as c
from xplane_bridge.protocol.fields import DecodeError, label_of, require_size
from xplane_bridge.protocol.requests import DrefWrite, decode_dref

_RREF_PAIR = struct.Struct("<if")
_RPOS = struct.Struct("<4sB3d10f")
_BEACON = struct.Struct("<4sBBBiiIH")


@dataclass(frozen=True)
class RposResponse:
    """Position stream. Angles in degrees, metres, m/s along X-Plane's east/up/south axes, body rates in rad/s (FRD)."""

    longitude_deg: float
    latitude_deg: float
    elevation_m: float
    height_agl_m: float
    pitch_deg: float
    heading_deg: float
    roll_deg: float
    vx_mps: float
    vy_mps: float
    vz_mps: float
    p_radps: float
    q_radps: float
    r_radps: float

    def encode(self, fifth: int = c.FIFTH_BYTE[b"RPOS"]) -> bytes:
        """The datagram."""
        return _RPOS.pack(
            b"RPOS",
            fifth,
            self.longitude_deg,
            self.latitude_deg,
            self.elevation_m,
            self.height_agl_m,
            self.pitch_deg,
            self.heading_deg,
            self.roll_deg,
            self.vx_mps,
            self.vy_mps,
            self.vz_mps,
            self.p_radps,
            self.q_radps,
            self.r_radps,
        )


@dataclass(frozen=True)
class Beacon:
    """What X-Plane announces once a second on 239.255.1.1:49707."""

    version: int
    port: int
    host_name: str
    major: int = 1
    minor: int = 2
    host_id: int = 1
    role: int = 1
    raknet_port: int = c.RAKNET_PORT

    def encode(self) -> bytes:
        """The datagram."""
        head = _BEACON.pack(
            b"BECN", 0, self.major, self.minor, self.host_id, self.version, self.role, self.port
        ) + self.host_name.encode("utf-8", "replace").replace(b"\0", b"")
        tail = struct.pack("<H", self.raknet_port) if self.minor >= 2 else b""
        return head + b"\0" + tail


def encode_rref_response(pairs: Sequence[Tuple[int, float]], fifth: int = c.FIFTH_BYTE[b"RREF"]) -> bytes:
    """One RREF datagram with (index, value) pairs.

    Raises:
        ValueError: More pairs than `c.RREF_MAX_PAIRS`.
    """
    if len(pairs) > c.RREF_MAX_PAIRS:
        raise ValueError(f"{len(pairs)} pairs in one RREF datagram; at most {c.RREF_MAX_PAIRS}")
    return b"RREF" + bytes([fifth]) + b"".join(_RREF_PAIR.pack(index, value) for index, value in pairs)


def decode_rref_response(datagram: bytes) -> List[Tuple[int, float]]:
    """Reads the (index, value) pairs of an RREF response."""
    if label_of(datagram) != b"RREF":
        raise DecodeError("unknown_label", f"expected RREF, got {datagram[:4]!r}")
    if len(datagram) == c.HEADER_SIZE or (len(datagram) - c.HEADER_SIZE) % c.RREF_PAIR_SIZE:
        raise DecodeError("wrong_size", f"RREF response of {len(datagram)} bytes; expected 5 + 8 n with n >= 1")
    return list(_RREF_PAIR.iter_unpack(datagram[c.HEADER_SIZE :]))


def decode_rpos_response(datagram: bytes) -> RposResponse:
    """Reads an RPOS response."""
    if label_of(datagram) != b"RPOS":
        raise DecodeError("unknown_label", f"expected RPOS, got {datagram[:4]!r}")
    require_size(datagram, "RPOS response", c.RPOS_RESPONSE_SIZE)
    return RposResponse(*_RPOS.unpack(datagram)[2:])


def decode_dref_response(datagram: bytes) -> DrefWrite:
    """Reads a DREF datagram of the "Dataref Read/Write" output (the layout is that of the request)."""
    if label_of(datagram) != b"DREF":
        raise DecodeError("unknown_label", f"expected DREF, got {datagram[:4]!r}")
    return decode_dref(datagram)


def decode_beacon(datagram: bytes) -> Beacon:
    """Reads a beacon of X-Plane itself (not the plugin's one, which has the same label on another port)."""
    if label_of(datagram) != b"BECN":
        raise DecodeError("unknown_label", f"expected BECN, got {datagram[:4]!r}")
    if len(datagram) < _BEACON.size + 1:
        raise DecodeError("wrong_size", f"beacon of {len(datagram)} bytes; expected at least {_BEACON.size + 1}")
    _, _, major, minor, host_id, version, role, port = _BEACON.unpack_from(datagram)
    if major != 1:
        raise DecodeError("bad_value", f"beacon major version {major}; expected 1")
    end = datagram.find(b"\0", _BEACON.size)
    if end < 0:
        raise DecodeError("bad_text", "beacon host name without a terminating NUL")
    name = datagram[_BEACON.size : end].decode("utf-8", "replace")
    rest = datagram[end + 1 :]
    raknet = struct.unpack_from("<H", rest)[0] if minor >= 2 and len(rest) >= 2 else 0
    return Beacon(version, port, name, major, minor, host_id, role, raknet)
