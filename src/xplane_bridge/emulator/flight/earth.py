"""X-Plane's earth: a sphere, and the tilted local frame that it simulates in.

Local (OpenGL) frame: X east, Y up, Z south, metres, tangent to the sphere at the origin (lat_ref, lon_ref) with Y = 0
at sea level. Away from the origin its axes are tilted against the local level, which is why X-Plane has two sets of
angles (`theta` and `true_theta`) and why its local velocities are not north/east/down ones.
"""

from __future__ import annotations

import math
from typing import Tuple, Union

import numpy as np

from xplane_bridge.units import EARTH_RADIUS_M

Vector = Tuple[float, float, float]
#: A rotation, for what is worked out in each frame: of 3 x 3 numbers, arrays take longer, and round by their library.
Rows = Tuple[Vector, Vector, Vector]

#: How far the aircraft must be beyond the line where the origin changes before it jumps, so that flying along that
#: line does not make it jump every frame [deg].
ORIGIN_HYSTERESIS_DEG = 0.001
_REACH_DEG = 0.5 + ORIGIN_HYSTERESIS_DEG  # from an origin to where it changes
#: Cosine of the pitch below which roll and heading are one.
_VERTICAL = 1e-7


def wrap_degrees(angle_deg: float) -> float:
    """Angle in [0, 360)."""
    wrapped = math.fmod(angle_deg, 360.0)
    if wrapped < 0.0:
        wrapped += 360.0
    return 0.0 if wrapped >= 360.0 else wrapped


def wrap_half_turn(angle_deg: float) -> float:
    """Angle or longitude in [-180, 180)."""
    return wrap_degrees(angle_deg + 180.0) - 180.0


def bearing_degrees(
    latitude_deg: float, longitude_deg: float, to_latitude_deg: float, to_longitude_deg: float
) -> float:
    """True bearing in (-180, 180] at which the great circle to another place begins."""
    lat, to_lat = math.radians(latitude_deg), math.radians(to_latitude_deg)
    difference = math.radians(to_longitude_deg - longitude_deg)
    east = math.sin(difference) * math.cos(to_lat)
    north = math.cos(lat) * math.sin(to_lat) - math.sin(lat) * math.cos(to_lat) * math.cos(difference)
    return math.degrees(math.atan2(east, north))


def nominal_origin(latitude_deg: float, longitude_deg: float) -> Tuple[float, float]:
    """Where X-Plane 11 puts the local frame's origin: floor(latitude) + 0.5, nearest whole degree of longitude."""
    latitude = min(max(math.floor(latitude_deg) + 0.5, -89.5), 89.5)
    return latitude, wrap_half_turn(math.floor(longitude_deg + 0.5))


def _level_rows(latitude_deg: float, longitude_deg: float) -> Rows:
    lat, lon = math.radians(latitude_deg), math.radians(longitude_deg)
    sin_lat, cos_lat, sin_lon, cos_lon = math.sin(lat), math.cos(lat), math.sin(lon), math.cos(lon)
    return (
        (-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
        (-sin_lon, cos_lon, 0.0),
        (-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat),
    )


def level_axes(latitude_deg: float, longitude_deg: float) -> np.ndarray:
    """Rows: unit vectors north, east, down at a place, in earth-centred axes (x to 0 N 0 E, z to the north pole)."""
    return np.array(_level_rows(latitude_deg, longitude_deg))


def body_rows(roll_deg: float, pitch_deg: float, heading_deg: float) -> Rows:
    """`body_to_level` as rows."""
    phi, theta, psi = math.radians(roll_deg), math.radians(pitch_deg), math.radians(heading_deg)
    s_phi, c_phi, s_theta, c_theta = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    s_psi, c_psi = math.sin(psi), math.cos(psi)
    return (
        (c_theta * c_psi, s_phi * s_theta * c_psi - c_phi * s_psi, c_phi * s_theta * c_psi + s_phi * s_psi),
        (c_theta * s_psi, s_phi * s_theta * s_psi + c_phi * c_psi, c_phi * s_theta * s_psi - s_phi * c_psi),
        (-s_theta, s_phi * c_theta, c_phi * c_theta),
    )


def body_to_level(roll_deg: float, pitch_deg: float, heading_deg: float) -> np.ndarray:
    """Rotation from body (FRD) to level (NED) axes for roll, pitch and true heading in the usual order."""
    return np.array(body_rows(roll_deg, pitch_deg, heading_deg))


def turned(rows: Rows, vector: Vector) -> Vector:
    """A vector in the axes into which a rotation turns."""
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def product(left: Rows, right: Rows) -> Rows:
    """The rotation `right`, and then `left`."""
    columns = [turned(left, column) for column in zip(*right)]
    return tuple(zip(*columns))  # type: ignore[return-value]


def euler_degrees(rotation: Union[np.ndarray, Rows]) -> Tuple[float, float, float]:
    """Roll, pitch, heading (0..360) of a body-to-level rotation, in degrees; straight up or down, roll is 0."""
    if math.hypot(rotation[0][0], rotation[1][0]) < _VERTICAL:
        heading = wrap_degrees(math.degrees(math.atan2(-rotation[0][1], rotation[1][1])))
        return 0.0, math.copysign(90.0, -rotation[2][0]), heading
    roll = math.degrees(math.atan2(rotation[2][1], rotation[2][2]))
    pitch = math.degrees(math.asin(min(max(-rotation[2][0], -1.0), 1.0)))
    heading = wrap_degrees(math.degrees(math.atan2(rotation[1][0], rotation[0][0])))
    return roll, pitch, heading


def quaternion(rotation: Union[np.ndarray, Rows]) -> Tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z), w >= 0, of a rotation matrix (Shepperd's method: no loss near 180 degrees)."""
    m = rotation
    trace = m[0][0] + m[1][1] + m[2][2]
    diagonal = (trace, m[0][0], m[1][1], m[2][2])
    largest = max(range(4), key=diagonal.__getitem__)
    if largest == 0:
        q = [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    elif largest == 1:
        q = [m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]]
    elif largest == 2:
        q = [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + 2.0 * m[1][1] - trace, m[1][2] + m[2][1]]
    else:
        q = [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + 2.0 * m[2][2] - trace]
    scale = math.copysign(1.0 / math.sqrt(sum(x * x for x in q)), q[0])
    return tuple(float(x * scale) for x in q)  # type: ignore[return-value]


def rotation_from_quaternion(w: float, x: float, y: float, z: float) -> np.ndarray:
    """Rotation matrix of a quaternion of any non-zero length.

    Raises:
        ValueError: All four components are zero.
    """
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if norm == 0.0:
        raise ValueError("a quaternion of four zeros describes no attitude")
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


class LocalFrame:
    """X-Plane's local frame; follows the aircraft by jumping from origin to origin.

    Attributes:
        lat_ref, lon_ref: Origin [deg].
        origin_axes: Rows north, east, down of the origin in earth-centred axes.
    """

    def __init__(self, latitude_deg: float, longitude_deg: float) -> None:
        self.lat_ref = 0.0
        self.lon_ref = 0.0
        self._move_to(*nominal_origin(latitude_deg, longitude_deg))

    def follow(self, latitude_deg: float, longitude_deg: float) -> bool:
        """Moves the origin if the aircraft has left its area.

        Returns:
            Whether the origin jumped.
        """
        north, east = latitude_deg - self.lat_ref, longitude_deg - self.lon_ref
        # Wrapped only beyond it: this is asked in each frame.
        if abs(north) <= _REACH_DEG and (abs(east) <= _REACH_DEG or abs(wrap_half_turn(east)) <= _REACH_DEG):
            return False
        origin = nominal_origin(latitude_deg, longitude_deg)
        if origin == (self.lat_ref, self.lon_ref):  # beyond the outermost origin, at a pole
            return False
        self._move_to(*origin)
        return True

    def to_local(self, latitude_deg: float, longitude_deg: float, elevation_m: float) -> Tuple[float, float, float]:
        """X east, Y up, Z south [m] of a place."""
        return self._place(_level_rows(latitude_deg, longitude_deg)[2], elevation_m)

    def to_geodetic(self, x: float, y: float, z: float) -> Tuple[float, float, float]:
        """Latitude, longitude [deg] and elevation [m MSL] of a local position."""
        point = self.origin_axes.T @ np.array((-z, x, -(EARTH_RADIUS_M + y)))
        radius = math.sqrt(float(point @ point))
        latitude = math.degrees(math.asin(min(max(point[2] / radius, -1.0), 1.0)))
        return latitude, math.degrees(math.atan2(point[1], point[0])), radius - EARTH_RADIUS_M

    def from_level(self, latitude_deg: float, longitude_deg: float) -> np.ndarray:
        """Rotation from the local level (NED) at a place to the origin's north, east, down axes."""
        axes: np.ndarray = self.origin_axes @ level_axes(latitude_deg, longitude_deg).T
        return axes

    def level_and_place(self, latitude_deg: float, longitude_deg: float, elevation_m: float) -> Tuple[Rows, Vector]:
        """`from_level` and `to_local` of a place."""
        rows = _level_rows(latitude_deg, longitude_deg)
        columns: Rows = tuple(turned(self._origin_rows, row) for row in rows)  # type: ignore[assignment]
        return tuple(zip(*columns)), self._place(rows[2], elevation_m)  # type: ignore[return-value]

    def _place(self, down: Vector, elevation_m: float) -> Vector:
        distance = -(EARTH_RADIUS_M + elevation_m)
        x, y, z = down
        north, east, below = turned(self._origin_rows, (x * distance, y * distance, z * distance))
        return east, -below - EARTH_RADIUS_M, -north

    def _move_to(self, lat_ref: float, lon_ref: float) -> None:
        self.lat_ref, self.lon_ref = lat_ref, lon_ref
        self._origin_rows = _level_rows(lat_ref, lon_ref)
        self.origin_axes = np.array(self._origin_rows)
