"""What one picture shows, as the emulator's loop hands it to the renderer."""

from __future__ import annotations

import itertools
import math
import struct
from dataclasses import astuple, dataclass, fields, replace
from typing import Iterator, Tuple

#: Latitude, longitude [deg], altitude [m MSL], roll, pitch, heading [deg] of another aircraft.
Pose = Tuple[float, float, float, float, float, float]
_MOST_OTHERS = 19
_NONE: Pose = (math.nan,) * 6
#: A row of the Data Output table as it is printed into the picture: its number and eight values.
Row = Tuple[float, ...]
_MOST_ROWS, _ROW_LENGTH = 8, 9
_NO_ROW: Row = (math.nan,) * _ROW_LENGTH


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
    others: Tuple[Pose, ...] = ()  #: at most 19
    rows: Tuple[Row, ...] = ()  #: printed into the picture; those after the eighth are left out

    def pack(self) -> bytes:
        """Fixed-size record for the pipe; short enough for a write to be all or nothing."""
        *numbers, others, rows = astuple(self)
        padded = [*others, *[_NONE] * (_MOST_OTHERS - len(others))]
        padded += [*rows[:_MOST_ROWS], *[_NO_ROW] * (_MOST_ROWS - len(rows))]
        return _FORMAT.pack(*numbers, *itertools.chain(*padded))

    @classmethod
    def unpack(cls, record: bytes) -> Scene:
        """The scene of a record made by `pack`."""
        numbers = _FORMAT.unpack(record)
        own, rest = numbers[: len(fields(cls)) - 2], numbers[len(fields(cls)) - 2 :]
        poses, rows = rest[:_OTHERS_LENGTH], rest[_OTHERS_LENGTH:]
        return replace(
            cls(*own),
            others=tuple(pose for pose in _cut(poses, len(_NONE)) if not math.isnan(pose[0])),  # type: ignore[misc]
            rows=tuple(row for row in _cut(rows, _ROW_LENGTH) if not math.isnan(row[0])),
        )


def _cut(numbers: Tuple[float, ...], length: int) -> Iterator[Tuple[float, ...]]:
    return (numbers[i : i + length] for i in range(0, len(numbers), length))


_OTHERS_LENGTH = _MOST_OTHERS * len(_NONE)
_FORMAT = struct.Struct("=QQ" + "d" * (len(fields(Scene)) - 4 + _OTHERS_LENGTH + _MOST_ROWS * _ROW_LENGTH))
RECORD_BYTES = _FORMAT.size
