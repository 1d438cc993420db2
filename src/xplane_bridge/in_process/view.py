"""What a controller sees of a flight in process: fields of FlightState, the same numbers as on the bridge."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from xplane_bridge.compiled import require
from xplane_bridge.emulator.flight.earth import LocalFrame
from xplane_bridge.emulator.flight.flight_model import Controls, ModelInfo, ModelState
from xplane_bridge.emulator.flight.frame import PARKED_HEIGHT_M


@lru_cache(maxsize=1)  # each frame asks
def _flight_numbers() -> Any:
    return require("a flight in process").flight_numbers


class Vector3(NamedTuple):
    """As geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class _Numbers(NamedTuple):
    """Those of FlightState, and the parts of its vectors, in the order of lib/bindings/flight_view.cpp."""

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
    force_x: float
    force_y: float
    force_z: float
    vertical_speed: float
    ground_speed: float
    track_deg: float
    flight_path_angle_deg: float
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


#: Vectors of FlightState, and the first of their three numbers.
_VECTORS = {
    "angular_velocity": "p", "angular_acceleration": "p_dot", "velocity_ned": "v_north", "velocity_body": "u",
    "wind_ned": "wind_north", "specific_force": "force_x",
}  # fmt: skip


def place_of(field: str) -> int:
    """Where the tuple that a FlightView is has a number of FlightState, such as `roll_deg` or `velocity_ned.x`.

    Raises:
        ValueError: It has none of that name.
    """
    vector, _, axis = field.partition(".")
    first = _Numbers._fields.index(_VECTORS.get(vector, vector))
    return first + "xyz".index(axis) if axis else first


class FlightView(_Numbers):
    """One instant of a flight, as `rx_node` publishes it: fields of `FlightState.msg`, worked out by its own code.

    Not there: the header and stamps, positions in a map, what magnetism and instruments show, raw airflow angles,
    aerodynamic moments, and the attitude as a quaternion or its derivatives.
    """

    # A tuple, because a flight makes one in each frame, and reads few of its numbers.

    paused = False
    replay = False
    epoch = 1

    frame_count: int
    on_ground: bool
    stall_warning: bool

    def __new__(
        cls, info: ModelInfo, state: ModelState, controls: Controls, origin: LocalFrame, frame: int, period: float
    ) -> FlightView:
        """That of a state, `frame` frames of `period` [s] after the start, in the scenery of `origin`."""
        heights = info.standing_height_m, PARKED_HEIGHT_M
        numbers = _flight_numbers()(state, controls, period, *heights, origin.lat_ref, origin.lon_ref)
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
        return tuple.__new__(Vector3, (self.p, self.q, self.r))  # not by its own, slower one: each frame asks

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
    def specific_force(self) -> Vector3:
        """[m/s^2] FRD."""
        return Vector3(self.force_x, self.force_y, self.force_z)
