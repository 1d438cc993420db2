"""X-Plane's UDP messages as values, with their encoding and decoding.

Everything is little-endian and unpadded except where a field is named padding. `decode_request` reads what a client
sends to X-Plane; the `decode_*` functions at the end read what X-Plane sends. Every decoding failure is a
`DecodeError` that names the message, what was given and what was expected; no other exception leaves this module
for any input bytes.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple, Union

from . import constants as c

_INT = struct.Struct("<i")
_RREF_REQUEST = struct.Struct("<4sxii400s")
_RREF_PAIR = struct.Struct("<if")
_DREF = struct.Struct("<4sBf500s")
_ROW = struct.Struct("<i8f")
_RPOS = struct.Struct("<4sB3d10f")
_BEACON = struct.Struct("<4sBBBiiIH")
_VEHICLE = struct.Struct("<4sxi3d3f")
_PLACEMENT = struct.Struct("<ii8sii5d")
_PREL = struct.Struct("<4sx64s")
_ACFN = struct.Struct("<4sxi150s2xi")
_ACPR = struct.Struct("<4sx160s64s")
_AIRCRAFT_BODY = struct.Struct("<i150s2xi")
_SIMO = struct.Struct("<4sxi150s2x")
_ISE4 = struct.Struct("<4sxi16s8si")


class DecodeError(ValueError):
    """A datagram that is not what its label promises.

    Attributes:
        reason: One of `too_short`, `unknown_label`, `wrong_size`, `bad_text`, `bad_value`.
    """

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


# --- requests: client -> X-Plane -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RrefRequest:
    """Subscribe to one dataref. `rate_hz` 0 stops the subscription with this `index`."""

    rate_hz: int
    index: int
    path: str

    def encode(self) -> bytes:
        """The datagram."""
        return _RREF_REQUEST.pack(b"RREF", self.rate_hz, self.index, _pad(self.path, c.RREF_PATH_SIZE))


@dataclass(frozen=True)
class RposRequest:
    """Ask for the position stream at `rate_hz`; 0 stops it."""

    rate_hz: int

    def encode(self) -> bytes:
        """The datagram."""
        return b"RPOS\0" + str(self.rate_hz).encode("ascii") + b"\0"


@dataclass(frozen=True)
class DrefWrite:
    """Write one dataref or one element of it (`path` may end in `[i]`)."""

    path: str
    value: float

    def encode(self, fifth: int = 0) -> bytes:
        """The datagram."""
        text = self.path.encode("ascii") + b"\0"
        if len(text) > c.DREF_PATH_SIZE:
            raise ValueError(
                f"dataref path of {len(text) - 1} characters; at most {c.DREF_PATH_SIZE - 1} fit: {self.path!r}"
            )
        return _DREF.pack(b"DREF", fifth, self.value, text.ljust(c.DREF_PATH_SIZE, b" "))


@dataclass(frozen=True)
class DataPacket:
    """Rows of the Data Output table, either way: (row index, eight slots)."""

    rows: Tuple[Tuple[int, Tuple[float, ...]], ...]

    def encode(self, fifth: int = 0) -> bytes:
        """The datagram."""
        return b"DATA" + bytes([fifth]) + b"".join(_ROW.pack(index, *slots) for index, slots in self.rows)

    def as_dict(self) -> Dict[int, Tuple[float, ...]]:
        """Rows by index; the last one wins where an index appears twice."""
        return dict(self.rows)


@dataclass(frozen=True)
class CommandRequest:
    """Run a command once (press and release)."""

    path: str

    def encode(self) -> bytes:
        """The datagram."""
        return b"CMND\0" + self.path.encode("ascii") + b"\0"


@dataclass(frozen=True)
class RowSelection:
    """Switch rows of the Data Output table on or off.

    Attributes:
        label: `DSEL`/`USEL` (UDP on/off) or `DCOC`/`UCOC` (cockpit display on/off).
    """

    label: str
    rows: Tuple[int, ...]

    def encode(self) -> bytes:
        """The datagram."""
        return self.label.encode("ascii") + b"\0" + struct.pack(f"<{len(self.rows)}i", *self.rows)


@dataclass(frozen=True)
class NetworkTarget:
    """ISE4: set one of X-Plane's network targets (`c.DATA_OUTPUT_TARGET` is the Data Output one)."""

    index: int
    host: str
    port: int
    enabled: bool

    def encode(self) -> bytes:
        """The datagram."""
        return _ISE4.pack(b"ISE4", self.index, _pad(self.host, 16), _pad(str(self.port), 8), int(self.enabled))


@dataclass(frozen=True)
class Placement:
    """PREL: start the aircraft somewhere. Angles in degrees, elevation in metres MSL, speed in m/s."""

    start_type: int
    aircraft: int = 0
    airport: str = ""
    runway: int = 0
    runway_direction: int = 0
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    elevation_m: float = 0.0
    heading_deg: float = 0.0
    speed_mps: float = 0.0

    def encode_body(self) -> bytes:
        """The 64 bytes behind the header (also part of ACPR)."""
        return _PLACEMENT.pack(
            self.start_type,
            self.aircraft,
            _pad(self.airport, 8, terminated=False),
            self.runway,
            self.runway_direction,
            self.latitude_deg,
            self.longitude_deg,
            self.elevation_m,
            self.heading_deg,
            self.speed_mps,
        )

    def encode(self) -> bytes:
        """The datagram."""
        return _PREL.pack(b"PREL", self.encode_body())

    @classmethod
    def decode_body(cls, body: bytes) -> Placement:
        """Reads what `encode_body` makes."""
        start, aircraft, airport, runway, direction, lat, lon, ele, heading, speed = _PLACEMENT.unpack(body)
        return cls(start, aircraft, _text(airport, "PREL airport"), runway, direction, lat, lon, ele, heading, speed)


@dataclass(frozen=True)
class AircraftLoad:
    """ACFN: load an aircraft file (`path` relative to X-Plane's folder)."""

    aircraft: int
    path: str
    livery: int = 0

    def encode(self) -> bytes:
        """The datagram."""
        return _ACFN.pack(b"ACFN", self.aircraft, _pad(self.path, 150), self.livery)


@dataclass(frozen=True)
class AircraftLoadAndPlacement:
    """ACPR: load an aircraft file and place it."""

    load: AircraftLoad
    placement: Placement

    def encode(self) -> bytes:
        """The datagram."""
        return _ACPR.pack(b"ACPR", self.load.encode()[c.HEADER_SIZE :], self.placement.encode_body())


@dataclass(frozen=True)
class Situation:
    """SIMO: 0 save situation, 1 load situation, 2 save movie, 3 load movie."""

    SAVE = 0
    LOAD = 1

    action: int
    path: str

    def encode(self) -> bytes:
        """The datagram."""
        return _SIMO.pack(b"SIMO", self.action, _pad(self.path, 150))


@dataclass(frozen=True)
class VehiclePose:
    """VEHX or VEHS: put an aircraft at a pose. Angles in degrees, elevation in metres MSL."""

    label: str
    aircraft: int
    latitude_deg: float
    longitude_deg: float
    elevation_m: float
    heading_deg: float
    pitch_deg: float
    roll_deg: float

    def encode(self) -> bytes:
        """The datagram."""
        return _VEHICLE.pack(
            self.label.encode("ascii"),
            self.aircraft,
            self.latitude_deg,
            self.longitude_deg,
            self.elevation_m,
            self.heading_deg,
            self.pitch_deg,
            self.roll_deg,
        )


@dataclass(frozen=True)
class RecoverAll:
    """RESE: repair every failure."""

    def encode(self) -> bytes:
        """The datagram."""
        return b"RESE\0"


Request = Union[
    RrefRequest,
    RposRequest,
    DrefWrite,
    DataPacket,
    CommandRequest,
    RowSelection,
    NetworkTarget,
    Placement,
    AircraftLoad,
    AircraftLoadAndPlacement,
    Situation,
    VehiclePose,
    RecoverAll,
]


def decode_request(datagram: bytes) -> Request:
    """Reads one datagram sent to X-Plane.

    Raises:
        DecodeError: The label is none of those above, or size or contents do not fit it.
    """
    label = _label(datagram)
    decoder = _REQUEST_DECODERS.get(label)
    if decoder is None:
        raise DecodeError("unknown_label", f"label {label!r} is no request that X-Plane 11 or 12 honours")
    return decoder(datagram)


def decode_data(datagram: bytes) -> DataPacket:
    """Reads a DATA datagram of either direction: 5 + 36 n bytes, n >= 1."""
    if _label(datagram) != b"DATA":
        raise DecodeError("unknown_label", f"expected DATA, got {datagram[:4]!r}")
    if len(datagram) == c.HEADER_SIZE or (len(datagram) - c.HEADER_SIZE) % c.ROW_SIZE:
        raise DecodeError("wrong_size", f"DATA of {len(datagram)} bytes; expected 5 + 36 n with n >= 1")
    rows = tuple((row[0], tuple(row[1:])) for row in _ROW.iter_unpack(datagram[c.HEADER_SIZE :]))
    return DataPacket(rows)


def _decode_rref_request(datagram: bytes) -> RrefRequest:
    _require_size(datagram, "RREF request", c.RREF_REQUEST_SIZE)
    _, rate, index, path = _RREF_REQUEST.unpack(datagram)
    return RrefRequest(rate, index, _text(path, "RREF path"))


_LEADING_NUMBER = re.compile(rb"\s*([+-]?\d{1,9})")


def _decode_rpos_request(datagram: bytes) -> RposRequest:
    match = _LEADING_NUMBER.match(datagram, c.HEADER_SIZE)
    if match is None:
        raise DecodeError("bad_value", f"RPOS rate {datagram[5:15]!r}; expected ASCII digits")
    return RposRequest(int(match.group(1)))


def _decode_dref(datagram: bytes) -> DrefWrite:
    _require_size(datagram, "DREF", c.DREF_SIZE)
    _, _, value, path = _DREF.unpack(datagram)
    return DrefWrite(_text(path, "DREF path"), value)


def _decode_command(datagram: bytes) -> CommandRequest:
    path = _text(datagram[c.HEADER_SIZE :], "CMND path")
    if not path:
        raise DecodeError("bad_value", "CMND without a command path")
    return CommandRequest(path)


def _decode_row_selection(datagram: bytes) -> RowSelection:
    body = datagram[c.HEADER_SIZE :]
    if not body or len(body) % 4:
        raise DecodeError("wrong_size", f"row selection of {len(datagram)} bytes; expected 5 + 4 n with n >= 1")
    return RowSelection(datagram[:4].decode("ascii"), struct.unpack(f"<{len(body) // 4}i", body))


def _decode_network_target(datagram: bytes) -> NetworkTarget:
    _require_size(datagram, "ISE4", c.ISE4_SIZE)
    _, index, host, port, enabled = _ISE4.unpack(datagram)
    text = _text(port, "ISE4 port").strip()
    if not re.fullmatch(r"\d{1,5}", text, re.ASCII) or int(text) > 65535:
        raise DecodeError("bad_value", f"ISE4 port {text!r}; expected 0..65535 in ASCII digits")
    return NetworkTarget(index, _text(host, "ISE4 address").strip(), int(text), enabled != 0)


def _decode_placement(datagram: bytes) -> Placement:
    _require_size(datagram, "PREL", c.PREL_SIZE)
    return Placement.decode_body(datagram[c.HEADER_SIZE :])


def _decode_aircraft(datagram: bytes) -> AircraftLoad:
    _require_size(datagram, "ACFN", c.ACFN_SIZE)
    aircraft, path, livery = _AIRCRAFT_BODY.unpack(datagram[c.HEADER_SIZE :])
    return AircraftLoad(aircraft, _text(path, "ACFN path"), livery)


def _decode_aircraft_and_placement(datagram: bytes) -> AircraftLoadAndPlacement:
    _require_size(datagram, "ACPR", c.ACPR_SIZE)
    _, load, placement = _ACPR.unpack(datagram)
    aircraft, path, livery = _AIRCRAFT_BODY.unpack(load)
    return AircraftLoadAndPlacement(
        AircraftLoad(aircraft, _text(path, "ACPR path"), livery), Placement.decode_body(placement)
    )


def _decode_situation(datagram: bytes) -> Situation:
    _require_size(datagram, "SIMO", c.SIMO_SIZE)
    _, action, path = _SIMO.unpack(datagram)
    return Situation(action, _text(path, "SIMO path"))


def _decode_vehicle(datagram: bytes) -> VehiclePose:
    _require_size(datagram, datagram[:4].decode("ascii"), c.VEHX_SIZE)
    label, aircraft, lat, lon, ele, heading, pitch, roll = _VEHICLE.unpack(datagram)
    return VehiclePose(label.decode("ascii"), aircraft, lat, lon, ele, heading, pitch, roll)


def _decode_recover_all(datagram: bytes) -> RecoverAll:
    _require_size(datagram, "RESE", c.RESE_SIZE)
    return RecoverAll()


_REQUEST_DECODERS = {
    b"RREF": _decode_rref_request,
    b"RPOS": _decode_rpos_request,
    b"DREF": _decode_dref,
    b"DATA": decode_data,
    b"CMND": _decode_command,
    b"DSEL": _decode_row_selection,
    b"USEL": _decode_row_selection,
    b"DCOC": _decode_row_selection,
    b"UCOC": _decode_row_selection,
    b"ISE4": _decode_network_target,
    b"PREL": _decode_placement,
    b"ACFN": _decode_aircraft,
    b"ACPR": _decode_aircraft_and_placement,
    b"SIMO": _decode_situation,
    b"VEHX": _decode_vehicle,
    b"VEHS": _decode_vehicle,
    b"RESE": _decode_recover_all,
}


# --- responses: X-Plane -> client ------------------------------------------------------------------------------------


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
    if _label(datagram) != b"RREF":
        raise DecodeError("unknown_label", f"expected RREF, got {datagram[:4]!r}")
    if len(datagram) == c.HEADER_SIZE or (len(datagram) - c.HEADER_SIZE) % c.RREF_PAIR_SIZE:
        raise DecodeError("wrong_size", f"RREF response of {len(datagram)} bytes; expected 5 + 8 n with n >= 1")
    return list(_RREF_PAIR.iter_unpack(datagram[c.HEADER_SIZE :]))


def decode_rpos_response(datagram: bytes) -> RposResponse:
    """Reads an RPOS response."""
    if _label(datagram) != b"RPOS":
        raise DecodeError("unknown_label", f"expected RPOS, got {datagram[:4]!r}")
    _require_size(datagram, "RPOS response", c.RPOS_RESPONSE_SIZE)
    return RposResponse(*_RPOS.unpack(datagram)[2:])


def decode_dref_response(datagram: bytes) -> DrefWrite:
    """Reads a DREF datagram of the "Dataref Read/Write" output (the layout is that of the request)."""
    if _label(datagram) != b"DREF":
        raise DecodeError("unknown_label", f"expected DREF, got {datagram[:4]!r}")
    return _decode_dref(datagram)


def decode_beacon(datagram: bytes) -> Beacon:
    """Reads a beacon of X-Plane itself (not the plugin's one, which has the same label on another port)."""
    if _label(datagram) != b"BECN":
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


# --- helpers ---------------------------------------------------------------------------------------------------------


def _label(datagram: bytes) -> bytes:
    if len(datagram) < c.HEADER_SIZE:
        raise DecodeError("too_short", f"{len(datagram)} bytes; an X-Plane message has at least {c.HEADER_SIZE}")
    return bytes(datagram[:4])


def _require_size(datagram: bytes, what: str, size: int) -> None:
    if len(datagram) != size:
        raise DecodeError("wrong_size", f"{what} of {len(datagram)} bytes; expected {size}")


def _pad(text: str, size: int, terminated: bool = True) -> bytes:
    raw = text.encode("ascii")
    if len(raw) > size - int(terminated):
        raise ValueError(f"{text!r} has {len(raw)} characters; at most {size - int(terminated)} fit")
    return raw.ljust(size, b"\0")


def _text(field: bytes, what: str) -> str:
    raw = bytes(field).split(b"\0", 1)[0].rstrip(b" ")
    try:
        return raw.decode("ascii")
    except UnicodeDecodeError:
        raise DecodeError("bad_text", f"{what} is not ASCII: {raw[:40]!r}") from None
