"""What a controller sees of a flight in process: fields of FlightState, rounded as they are on the bridge's way."""

from __future__ import annotations

import math
import struct
from typing import List, NamedTuple, Tuple

from xplane_bridge.emulator.flight.flight_model import Controls, ModelInfo, ModelState
from xplane_bridge.emulator.flight.frame import PARKED_HEIGHT_M

G0 = 9.80665


class Vector3(NamedTuple):
    """As geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


_LAYOUT = struct.Struct("<42f")


def _rounded(values: List[float]) -> Tuple[float, ...]:
    """As float32, in which X-Plane sends every number."""
    return _LAYOUT.unpack(_LAYOUT.pack(*values))


class FlightView:
    """One instant of a flight, with names, units, signs and rounding of `FlightState.msg`.

    Not there: the header and stamps, positions in a map, what magnetism and the altimeter show, raw airflow angles,
    aerodynamic moments, and the attitude as a quaternion or its derivatives. The position is float32 of X-Plane's own
    numbers, where the bridge makes it from local coordinates, which are exact to 2 to 8 mm.
    """

    paused = False
    replay = False
    epoch = 1

    def __init__(self, info: ModelInfo, state: ModelState, controls: Controls, frame: int, period: float) -> None:
        s = state
        self.frame_count = frame
        north, east = s.wind_north_mps, s.wind_east_mps
        (
            self.frame_period, self.sim_time, self.latitude, self.longitude, self.altitude_msl, self.altitude_agl,
            self.roll_deg, self.pitch_deg, self.heading_true_deg, p, q, r, p_dot, q_dot, r_dot,
            vn, ve, vd, u, v, w, wn, we, wd,
            self.ground_speed, self.alpha_deg, self.beta_deg, self.calibrated_airspeed, self.equivalent_airspeed,
            self.true_airspeed, self.mach, self.dynamic_pressure, self.air_density,
            self.load_factor_normal, self.load_factor_axial, self.load_factor_side,
            self.control_roll, self.control_pitch, self.control_yaw, self.control_throttle,
            self.wind_speed, self.wind_from_deg,
        ) = _rounded([
            period, s.sim_time_s, s.latitude_deg, s.longitude_deg, s.altitude_m,
            s.agl_m - info.standing_height_m + PARKED_HEIGHT_M,
            math.degrees(s.roll_rad), math.degrees(s.pitch_rad), math.degrees(s.heading_rad) % 360.0,
            s.p_rad_s, s.q_rad_s, s.r_rad_s, s.p_dot_rad_s2, s.q_dot_rad_s2, s.r_dot_rad_s2,
            s.v_north_mps, s.v_east_mps, s.v_down_mps, s.u_mps, s.v_mps, s.w_mps, north, east, s.wind_down_mps,
            math.hypot(s.v_north_mps, s.v_east_mps), math.degrees(s.alpha_rad), math.degrees(s.beta_rad),
            s.calibrated_airspeed_mps, s.equivalent_airspeed_mps, s.true_airspeed_mps, s.mach, s.dynamic_pressure_pa,
            s.air_density_kg_m3,
            -s.specific_force_z_mps2 / G0, s.specific_force_x_mps2 / G0, s.specific_force_y_mps2 / G0,
            controls.roll, controls.pitch, controls.yaw, controls.throttle[0],
            math.hypot(north, east), math.degrees(math.atan2(-east, -north)) % 360.0,
        ])  # fmt: skip
        self.sim_time_unwrapped = frame * self.frame_period
        self.angular_velocity = Vector3(p, q, r)
        self.angular_acceleration = Vector3(p_dot, q_dot, r_dot)
        self.velocity_ned, self.velocity_body = Vector3(vn, ve, vd), Vector3(u, v, w)
        self.wind_ned = Vector3(wn, we, wd)
        self.on_ground, self.stall_warning = s.on_ground_any, s.stall_warning

    @property
    def vertical_speed(self) -> float:
        """[m/s] up +."""
        return -self.velocity_ned.z

    @property
    def track_deg(self) -> float:
        """[deg] 0..360 of the way over ground; below 0.5 m/s the heading."""
        if self.ground_speed < 0.5:
            return self.heading_true_deg
        return math.degrees(math.atan2(self.velocity_ned.y, self.velocity_ned.x)) % 360.0

    @property
    def flight_path_angle_deg(self) -> float:
        """[deg] climbing +."""
        return math.degrees(math.atan2(-self.velocity_ned.z, self.ground_speed))

    @property
    def specific_force(self) -> Vector3:
        """[m/s^2] FRD."""
        return Vector3(self.load_factor_axial * G0, self.load_factor_side * G0, -self.load_factor_normal * G0)
