"""What one picture shows, as the emulator's loop hands it to the renderer."""

from __future__ import annotations

import struct
from dataclasses import astuple, dataclass, fields


@dataclass(frozen=True)
class Scene:
    """One frame. Angles in degrees relative to the local level, heading true; body axes forward, right, down."""

    frame: int = 0  #: rendered frames since the emulator started
    time_ns: int = 0  #: `time.monotonic_ns()` of the frame; the pipeline delay counts from here
    sim_time: float = 0.0  #: [s] `sim/time/total_running_time_sec`
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0  #: MSL
    terrain_m: float = 0.0  #: MSL, of the ground
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    head_heading_deg: float = 0.0  #: of the camera in the aircraft, right +
    head_pitch_deg: float = 0.0  #: up +
    head_roll_deg: float = 0.0  #: right +
    eye_forward_m: float = 0.0  #: of the camera from the aircraft's reference point, in its axes
    eye_right_m: float = 0.0
    eye_down_m: float = 0.0
    floor_down_m: float = 0.0  #: of the cockpit's floor from that point; 0: there is none
    field_of_view_deg: float = 60.0  #: horizontal
    vertical_field_of_view_deg: float = 0.0  #: 0: pixels are square
    shift_right: float = 0.0  #: [widths] that the picture's middle lies right of the line of sight
    shift_up: float = 0.0  #: [heights] that it lies above it
    airspeed_kt: float = 0.0  #: indicated; for the head-up display only
    vertical_speed_fpm: float = 0.0

    def pack(self) -> bytes:
        """Fixed-size record for the pipe; short enough for a write to be all or nothing."""
        return _FORMAT.pack(*astuple(self))

    @classmethod
    def unpack(cls, record: bytes) -> Scene:
        """The scene of a record made by `pack`."""
        return cls(*_FORMAT.unpack(record))


_FORMAT = struct.Struct("=QQ" + "d" * (len(fields(Scene)) - 2))
RECORD_BYTES = _FORMAT.size
