"""What clients send to X-Plane, as values with their encoding, and DATA, which goes both ways.

All is little-endian and unpadded except where a field is named padding. Every failure to decode is a `DecodeError`
that names the message, what was given and what was expected; no other exception leaves `decode_request`.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Callable, Dict, Tuple, Union

from xplane_bridge.protocol import constants as c
from xplane_bridge.protocol.fields import DecodeError, label_of, pad, require_size, text_of

_RREF_REQUEST = struct.Struct("<4sxii400s")
_DREF = struct.Struct("<4sBf500s")
_ROW = struct.Struct("<i8f")
_VEHICLE = struct.Struct("<4sxi3d3f")
_PLACEMENT = struct.Struct("<ii8sii5d")
_PREL = struct.Struct("<4sx64s")
_ACFN = struct.Struct("<4sxi150s2xi")
_ACPR = struct.Struct("<4sx160s64s")
_AIRCRAFT_BODY = struct.Struct("<i150s2xi")
_SIMO = struct.Struct("<4sxi150s2x")
_ISE4 = struct.Struct("<4sxi16s8si")


@dataclass(frozen=True)
class RrefRequest:
    """Subscribe to one dataref. `rate_hz` 0 stops the subscription with this `index`."""

    rate_hz: int
    index: int
    path: str

    def encode(self) -> bytes:
        """The datagram."""
        return _RREF_REQUEST.pack(b"RREF", self.rate_hz, self.index, pad(self.path, c.RREF_PATH_SIZE))


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
        return _ISE4.pack(b"ISE4", self.index, pad(self.host, 16), pad(str(self.port), 8), int(self.enabled))


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
            pad(self.airport, 8, terminated=False),
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
        return cls(start, aircraft, text_of(airport, "PREL airport"), runway, direction, lat, lon, ele, heading, speed)


@dataclass(frozen=True)
class AircraftLoad:
    """ACFN: load an aircraft file (`path` relative to X-Plane's folder)."""

    aircraft: int
    path: str
    livery: int = 0

    def encode(self) -> bytes:
        """The datagram."""
        return _ACFN.pack(b"ACFN", self.aircraft, pad(self.path, 150), self.livery)


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
        return _SIMO.pack(b"SIMO", self.action, pad(self.path, 150))


@dataclass(frozen=True)
class VehiclePose:
    """VEHX or VEHS: put an aircraft at a pose [? other-aircraft]. Angles in degrees, elevation in metres MSL."""

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
    label = label_of(datagram)
    decoder = _REQUEST_DECODERS.get(label)
    if decoder is None:
        raise DecodeError("unknown_label", f"label {label!r} is no request that X-Plane 11 or 12 honours")
    return decoder(datagram)


def decode_data(datagram: bytes) -> DataPacket:
    """Reads a DATA datagram of either direction: 5 + 36 n bytes, n >= 1."""
    if label_of(datagram) != b"DATA":
        raise DecodeError("unknown_label", f"expected DATA, got {datagram[:4]!r}")
    if len(datagram) == c.HEADER_SIZE or (len(datagram) - c.HEADER_SIZE) % c.ROW_SIZE:
        raise DecodeError("wrong_size", f"DATA of {len(datagram)} bytes; expected 5 + 36 n with n >= 1")
    rows = tuple((row[0], tuple(row[1:])) for row in _ROW.iter_unpack(datagram[c.HEADER_SIZE :]))
    return DataPacket(rows)


def _decode_rref_request(datagram: bytes) -> RrefRequest:
    require_size(datagram, "RREF request", c.RREF_REQUEST_SIZE)
    _, rate, index, path = _RREF_REQUEST.unpack(datagram)
    return RrefRequest(rate, index, text_of(path, "RREF path"))


_LEADING_NUMBER = re.compile(rb"\s*([+-]?\d{1,9})")


def _decode_rpos_request(datagram: bytes) -> RposRequest:
    match = _LEADING_NUMBER.match(datagram, c.HEADER_SIZE)
    if match is None:
        raise DecodeError("bad_value", f"RPOS rate {datagram[5:15]!r}; expected ASCII digits")
    return RposRequest(int(match.group(1)))


def decode_dref(datagram: bytes) -> DrefWrite:
    """Reads a DREF of either direction; the label is not checked."""
    require_size(datagram, "DREF", c.DREF_SIZE)
    _, _, value, path = _DREF.unpack(datagram)
    return DrefWrite(text_of(path, "DREF path"), value)


def _decode_command(datagram: bytes) -> CommandRequest:
    path = text_of(datagram[c.HEADER_SIZE :], "CMND path")
    if not path:
        raise DecodeError("bad_value", "CMND without a command path")
    return CommandRequest(path)


def _decode_row_selection(datagram: bytes) -> RowSelection:
    body = datagram[c.HEADER_SIZE :]
    if not body or len(body) % 4:
        raise DecodeError("wrong_size", f"row selection of {len(datagram)} bytes; expected 5 + 4 n with n >= 1")
    return RowSelection(datagram[:4].decode("ascii"), struct.unpack(f"<{len(body) // 4}i", body))


def _decode_network_target(datagram: bytes) -> NetworkTarget:
    require_size(datagram, "ISE4", c.ISE4_SIZE)
    _, index, host, port, enabled = _ISE4.unpack(datagram)
    text = text_of(port, "ISE4 port").strip()
    if not re.fullmatch(r"\d{1,5}", text, re.ASCII) or int(text) > 65535:
        raise DecodeError("bad_value", f"ISE4 port {text!r}; expected 0..65535 in ASCII digits")
    return NetworkTarget(index, text_of(host, "ISE4 address").strip(), int(text), enabled != 0)


def _decode_placement(datagram: bytes) -> Placement:
    require_size(datagram, "PREL", c.PREL_SIZE)
    return Placement.decode_body(datagram[c.HEADER_SIZE :])


def _decode_aircraft(datagram: bytes) -> AircraftLoad:
    require_size(datagram, "ACFN", c.ACFN_SIZE)
    aircraft, path, livery = _AIRCRAFT_BODY.unpack(datagram[c.HEADER_SIZE :])
    return AircraftLoad(aircraft, text_of(path, "ACFN path"), livery)


def _decode_aircraft_and_placement(datagram: bytes) -> AircraftLoadAndPlacement:
    require_size(datagram, "ACPR", c.ACPR_SIZE)
    _, load, placement = _ACPR.unpack(datagram)
    aircraft, path, livery = _AIRCRAFT_BODY.unpack(load)
    return AircraftLoadAndPlacement(
        AircraftLoad(aircraft, text_of(path, "ACPR path"), livery), Placement.decode_body(placement)
    )


def _decode_situation(datagram: bytes) -> Situation:
    require_size(datagram, "SIMO", c.SIMO_SIZE)
    _, action, path = _SIMO.unpack(datagram)
    return Situation(action, text_of(path, "SIMO path"))


def _decode_vehicle(datagram: bytes) -> VehiclePose:
    require_size(datagram, datagram[:4].decode("ascii"), c.VEHX_SIZE)
    label, aircraft, lat, lon, ele, heading, pitch, roll = _VEHICLE.unpack(datagram)
    return VehiclePose(label.decode("ascii"), aircraft, lat, lon, ele, heading, pitch, roll)


def _decode_recover_all(datagram: bytes) -> RecoverAll:
    require_size(datagram, "RESE", c.RESE_SIZE)
    return RecoverAll()


_REQUEST_DECODERS: Dict[bytes, Callable[[bytes], Request]] = {
    b"RREF": _decode_rref_request,
    b"RPOS": _decode_rpos_request,
    b"DREF": decode_dref,
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
