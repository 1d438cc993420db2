"""What controllers read of a flight: fields of FlightState.msg, of a message or of a flight in process."""

from __future__ import annotations

from typing import Protocol


class Vector(Protocol):
    """As geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class State(Protocol):
    """Names, units and signs of FlightState.msg."""

    sim_time_unwrapped: float  #: [s]
    latitude: float  #: [deg]
    longitude: float  #: [deg]
    altitude_msl: float  #: [m]
    altitude_agl: float  #: [m]
    roll_deg: float
    pitch_deg: float
    heading_true_deg: float  #: 0..360
    angular_velocity: Vector  #: [rad/s] FRD
    velocity_ned: Vector  #: [m/s] over ground
    vertical_speed: float  #: [m/s] up +
    ground_speed: float  #: [m/s]
    track_deg: float  #: 0..360, of the way over ground
    beta_deg: float  #: sideslip, wind from the right +
    calibrated_airspeed: float  #: [m/s]
    control_pitch: float  #: -1..1, as X-Plane flies it
    control_throttle: float  #: -1..1, of the first engine
    on_ground: bool


class MappedState(State, Protocol):
    """Of a message, which has the place in `map`, too."""

    position_north: float  #: [m]
    position_east: float  #: [m]
    position_down: float  #: [m]
