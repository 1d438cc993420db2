"""What a controller sees of a flight in process: fields of FlightState, rounded as they are on the bridge's way."""

from __future__ import annotations

import math
from typing import NamedTuple

from xplane_bridge.compiled import require
from xplane_bridge.emulator.flight.flight_model import Controls, ModelInfo, ModelState
from xplane_bridge.emulator.flight.frame import PARKED_HEIGHT_M
from xplane_bridge.units import GRAVITY_MPS2


class Vector3(NamedTuple):
    """As geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class _Numbers(NamedTuple):
    """Those of FlightState, and the parts of its vectors, in the order of lib/bindings/flight_record.cpp."""

    frame_period: float
    sim_time: float
    latitude: float
    longitude: float
    altitude_msl: float
    altitude_agl: float
    roll_deg: float
    pitch_deg: float
    heading_true_deg: float
    p: float
    q: float
    r: float
    p_dot: float
    q_dot: float
    r_dot: float
    v_north: float
    v_east: float
    v_down: float
    u: float
    v: float
    w: float
    wind_north: float
    wind_east: float
    wind_down: float
    ground_speed: float
    alpha_deg: float
    beta_deg: float
    calibrated_airspeed: float
    equivalent_airspeed: float
    true_airspeed: float
    mach: float
    dynamic_pressure: float
    air_density: float
    load_factor_normal: float
    load_factor_axial: float
    load_factor_side: float
    control_roll: float
    control_pitch: float
    control_yaw: float
    control_throttle: float
    wind_speed: float
    wind_from_deg: float


class FlightView(_Numbers):
    """One instant of a flight, with names, units, signs and rounding of `FlightState.msg`.

    Not there: the header and stamps, positions in a map, what magnetism and the altimeter show, raw airflow angles,
    aerodynamic moments, and the attitude as a quaternion or its derivatives. The position is float32 of X-Plane's own
    numbers, where the bridge makes it from local coordinates, which are exact to 2 to 8 mm.
    """

    # A tuple, because a flight makes one in each frame, and reads few of its numbers.

    paused = False
    replay = False
    epoch = 1

    frame_count: int
    on_ground: bool
    stall_warning: bool

    def __new__(cls, info: ModelInfo, state: ModelState, controls: Controls, frame: int, period: float) -> FlightView:
        """That of a state, `frame` frames of `period` [s] after the start."""
        heights = info.standing_height_m, PARKED_HEIGHT_M
        numbers = require("a flight in process").flight_numbers(state, controls, period, *heights)
        self = tuple.__new__(cls, numbers)
        self.frame_count = frame
        self.on_ground, self.stall_warning = state.on_ground_any, state.stall_warning
        return self

    @property
    def sim_time_unwrapped(self) -> float:
        """[s] since the start."""
        return self.frame_count * self.frame_period

    @property
    def angular_velocity(self) -> Vector3:
        """[rad/s] FRD."""
        return Vector3(self.p, self.q, self.r)

    @property
    def angular_acceleration(self) -> Vector3:
        """[rad/s^2] FRD."""
        return Vector3(self.p_dot, self.q_dot, self.r_dot)

    @property
    def velocity_ned(self) -> Vector3:
        """[m/s] over ground."""
        return Vector3(self.v_north, self.v_east, self.v_down)

    @property
    def velocity_body(self) -> Vector3:
        """[m/s] over ground, FRD."""
        return Vector3(self.u, self.v, self.w)

    @property
    def wind_ned(self) -> Vector3:
        """[m/s] velocity of the air."""
        return Vector3(self.wind_north, self.wind_east, self.wind_down)

    @property
    def vertical_speed(self) -> float:
        """[m/s] up +."""
        return -self.v_down

    @property
    def track_deg(self) -> float:
        """[deg] 0..360 of the way over ground; below 0.5 m/s the heading."""
        if self.ground_speed < 0.5:
            return self.heading_true_deg
        return math.degrees(math.atan2(self.v_east, self.v_north)) % 360.0

    @property
    def flight_path_angle_deg(self) -> float:
        """[deg] climbing +."""
        return math.degrees(math.atan2(-self.v_down, self.ground_speed))

    @property
    def specific_force(self) -> Vector3:
        """[m/s^2] FRD."""
        g = GRAVITY_MPS2
        return Vector3(self.load_factor_axial * g, self.load_factor_side * g, -self.load_factor_normal * g)
