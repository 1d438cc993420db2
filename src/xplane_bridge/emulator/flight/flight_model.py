"""What the emulator's UDP side and its flight models say to each other.

Everything here is SI unless a name says otherwise. Axes: NED for the earth, FRD for the body. The planet is
X-Plane's: a sphere of 6 378 145 m that does not turn, with the same gravity everywhere. Signs of commands: roll +
right, pitch + nose up, yaw + nose right. Surfaces as X-Plane reports them: degrees, trailing edge down +, rudder
trailing edge right +, spoilers and speed brakes up +.

A surface is named as the leaf of X-Plane's ``sim/flightmodel/controls/<name>def`` dataref without ``def``:
``wing2l_ail1``, ``hstab1_elv1``, ``vstab1_rud1``. ``hstab1`` is the left, ``hstab2`` the right half of the tailplane.
"""

from __future__ import annotations

import copy
import dataclasses
import enum
import math
from dataclasses import dataclass, field
from typing import Optional, Protocol, Sequence, Type, TypeVar

MAX_ENGINES = 8

#: Longest integration step of a flight model [s]; ``step`` divides what it is given into equal parts no longer.
MAX_SUBSTEP_S = 1.0 / 240.0
#: Farther north or south no aircraft is put: the local level has no north at a pole.
HIGHEST_LATITUDE_DEG = 89.9
#: Longest time one ``step`` may fly [s].
MAX_STEP_S = 1.0


_Class = TypeVar("_Class")


def _slotted(cls: Type[_Class]) -> Type[_Class]:
    """The same dataclass with `__slots__` for its fields, which flights read and write a hundred times a frame.

    As `dataclass(slots=True)`, which Python has from 3.10 on.
    """
    names = tuple(f.name for f in dataclasses.fields(cls))  # type: ignore[arg-type]
    body = {name: value for name, value in vars(cls).items() if name not in (*names, "__dict__", "__weakref__")}
    made: Type[_Class] = type(cls.__name__, cls.__bases__, {**body, "__slots__": names})
    made.__qualname__ = cls.__qualname__
    return made


class FlightModelError(ValueError):
    """A flight model was asked for something it cannot do; the message says what, what it expects, and the remedy."""


class TrimError(FlightModelError):
    """Each number of a start is one that there is, but together they make no steady flight."""


class SurfaceKind(enum.Enum):
    """What a surface is for."""

    AILERON = "aileron"
    ELEVATOR = "elevator"
    RUDDER = "rudder"
    FLAP = "flap"
    SPEED_BRAKE = "speedbrake"


class Side(enum.Enum):
    """Where it is."""

    LEFT = "left"
    RIGHT = "right"
    CENTRE = "centre"


@dataclass(frozen=True)
class SurfaceSpec:
    """One control surface: what it is, where, and how far and how fast its own actuator moves it."""

    name: str  #: X-Plane dataref leaf without ``def``
    kind: SurfaceKind
    side: Side
    minimum_deg: float
    maximum_deg: float
    rate_deg_s: float

    @property
    def up_sign(self) -> float:
        """Sign of a deflection with the trailing edge up (rudder: left)."""
        return 1.0 if self.kind is SurfaceKind.SPEED_BRAKE else -1.0

    @property
    def fully_up_deg(self) -> float:
        """The end of the travel with the trailing edge up (rudder: left)."""
        return self.maximum_deg if self.up_sign > 0.0 else self.minimum_deg

    @property
    def fully_down_deg(self) -> float:
        """The other end."""
        return self.minimum_deg if self.up_sign > 0.0 else self.maximum_deg


class SurfaceFaultKind(enum.Enum):
    """How a surface can be broken."""

    STUCK = "stuck"  #: at ``value`` [deg], any angle; at the present one where ``value`` is None
    CENTRED = "centred"
    HARD_OVER_UP = "hard_over_up"  #: trailing edge fully up (rudder: left)
    HARD_OVER_DOWN = "hard_over_down"  #: trailing edge fully down (rudder: right)
    GONE = "gone"  #: no aerodynamic effect, reads 0
    FLOATING = "floating"  #: trails in the wind
    REDUCED = "reduced"  #: moves, but acts with ``value`` [0..1] of its effect
    SLOW = "slow"  #: moves at ``value`` [0..1] of its normal rate


@dataclass(frozen=True)
class SurfaceFault:
    """One broken surface; see ``SurfaceFaultKind`` for what ``value`` means."""

    kind: SurfaceFaultKind
    value: Optional[float] = None


class EngineFault(enum.Enum):
    """How an engine or motor can be broken."""

    NONE = "none"
    STOPPED = "stopped"  #: no combustion (or no current): windmills
    SEIZED = "seized"  #: the shaft does not turn


@_slotted
@dataclass
class Controls:
    """Everything that can be commanded. The caller keeps one, changes it, passes it to ``step``; the model reads it."""

    roll: float = 0.0  #: stick, -1..1
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: list[float] = field(default_factory=lambda: [0.0] * MAX_ENGINES)  #: levers, 0..1
    propeller: list[float] = field(default_factory=lambda: [1.0] * MAX_ENGINES)  #: levers, 0..1 (1 = highest speed)
    mixture: list[float] = field(default_factory=lambda: [1.0] * MAX_ENGINES)  #: levers, 0..1 (1 = rich)
    trim_roll: float = 0.0  #: -1..1
    trim_pitch: float = 0.0
    trim_yaw: float = 0.0
    flap_request: float = 0.0  #: handle, 0..1
    speedbrake: float = 0.0  #: handle, -0.5 (armed) .. 1
    gear_down: bool = True
    brake_left: float = 0.0  #: 0..1
    brake_right: float = 0.0
    parking_brake: float = 0.0
    thrust_vector: float = 0.0  #: 0 forward .. 1 vertical (and a little beyond: see the tiltrotor)
    artificial_stability: bool = True  #: the stabilisation inside the model, where it has one

    override_surfaces: bool = False  #: X-Plane's override_control_surfaces: only ``surface_deg`` drives any surface
    surface_deg: dict[str, float] = field(
        default_factory=dict
    )  #: used while overridden; those not named stay as they are
    override_throttles: bool = False  #: engines obey ``throttle_use`` alone, without levers, mixing and stabilisation
    throttle_use: list[float] = field(default_factory=lambda: [0.0] * MAX_ENGINES)  #: per engine or motor, -1..1

    surface_faults: dict[str, SurfaceFault] = field(default_factory=dict)  #: by surface name
    engine_faults: list[EngineFault] = field(default_factory=lambda: [EngineFault.NONE] * MAX_ENGINES)
    stability_fault: bool = False  #: the artificial stability has failed, whatever the switch says
    gear_fault: bool = False  #: the legs stay where they are, also on their way

    def copy(self) -> Controls:
        """Independent of this one."""
        return copy.deepcopy(self)


@_slotted
@dataclass
class EngineState:
    """One engine, motor or rotor. What a kind of engine does not have stays 0."""

    running: bool = False
    throttle: float = 0.0  #: what drives it now, -1..1: lever, mixing result, or override
    rpm: float = 0.0  #: shaft
    prop_rpm: float = 0.0
    power_w: float = 0.0
    thrust_n: float = 0.0
    torque_nm: float = 0.0
    fuel_flow_kg_s: float = 0.0
    manifold_pressure_pa: float = 0.0
    n1_percent: float = 0.0  #: turbines: gas generator
    n2_percent: float = 0.0  #: turbines: power turbine
    exhaust_gas_temperature_k: float = 0.0  #: turbines: between the turbines
    cylinder_head_temperature_k: float = 0.0
    oil_temperature_k: float = 0.0
    oil_pressure_pa: float = 0.0
    blade_pitch_deg: float = 0.0
    nacelle_deg: float = 0.0  #: 0 = thrust forward, 90 = thrust up


@_slotted
@dataclass
class GearState:
    """One wheel or skid."""

    name: str = ""
    extended: float = 1.0  #: 0 up .. 1 down
    on_ground: bool = False
    compression_m: float = 0.0
    vertical_force_n: float = 0.0  #: ground on wheel, up +
    steer_deg: float = 0.0  #: nose right +


@_slotted
@dataclass
class ModelState:
    """The aircraft after a step: one instant. The next step overwrites ``FlightModel.state``; ``copy`` keeps one."""

    sim_time_s: float = 0.0

    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0  #: of the centre of gravity above the sphere (MSL)
    agl_m: float = 0.0  #: of the centre of gravity above the ground below it
    terrain_elevation_m: float = 0.0

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    heading_rad: float = 0.0  #: true, 0..2 pi
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)  #: w x y z, rotates FRD vectors into local NED
    p_rad_s: float = 0.0
    q_rad_s: float = 0.0
    r_rad_s: float = 0.0
    p_dot_rad_s2: float = 0.0
    q_dot_rad_s2: float = 0.0
    r_dot_rad_s2: float = 0.0

    v_north_mps: float = 0.0
    v_east_mps: float = 0.0
    v_down_mps: float = 0.0
    u_mps: float = 0.0  #: over ground, FRD
    v_mps: float = 0.0
    w_mps: float = 0.0
    specific_force_x_mps2: float = 0.0  #: all but gravity, per mass, FRD: at rest and level (0, 0, -9.80665)
    specific_force_y_mps2: float = 0.0
    specific_force_z_mps2: float = 0.0
    acceleration_north_mps2: float = 0.0  #: d/dt of v_north... in the local level
    acceleration_east_mps2: float = 0.0
    acceleration_down_mps2: float = 0.0

    wind_north_mps: float = 0.0  #: velocity of the air, turbulence included
    wind_east_mps: float = 0.0
    wind_down_mps: float = 0.0
    alpha_rad: float = 0.0
    beta_rad: float = 0.0  #: wind from the right +
    alpha_dot_rad_s: float = 0.0
    true_airspeed_mps: float = 0.0
    equivalent_airspeed_mps: float = 0.0
    calibrated_airspeed_mps: float = 0.0
    mach: float = 0.0
    dynamic_pressure_pa: float = 0.0
    air_density_kg_m3: float = 0.0
    pressure_pa: float = 0.0
    temperature_k: float = 0.0
    speed_of_sound_mps: float = 0.0
    pressure_altitude_m: float = 0.0
    stall_warning: bool = False

    surfaces_deg: dict[str, float] = field(default_factory=dict)  #: every surface of ``FlightModel.surfaces``
    roll_ratio: float = 0.0  #: the command that reaches mixing, after artificial stability, -1..1
    pitch_ratio: float = 0.0
    yaw_ratio: float = 0.0
    flap_ratio: float = 0.0  #: where the flaps are, 0..1
    slat_ratio: float = 0.0
    speed_brake_ratio: float = 0.0
    thrust_vector_ratio: float = 0.0  #: where the nacelles are

    engines: list[EngineState] = field(default_factory=list)
    fuel_kg: list[float] = field(default_factory=list)  #: per tank
    payload_kg: float = 0.0
    empty_mass_kg: float = 0.0
    mass_kg: float = 0.0
    cg_forward_m: float = 0.0  #: of the centre of gravity ahead of the model's reference point
    cg_right_m: float = 0.0
    cg_down_m: float = 0.0

    lift_n: float = 0.0  #: perpendicular to the air's motion, up +
    drag_n: float = 0.0
    side_force_n: float = 0.0  #: FRD y
    aero_roll_nm: float = 0.0  #: aerodynamic moments about the centre of gravity, FRD
    aero_pitch_nm: float = 0.0
    aero_yaw_nm: float = 0.0

    gear: list[GearState] = field(default_factory=list)
    on_ground_any: bool = False
    on_ground_all: bool = False
    crashed: bool = False

    def copy(self) -> ModelState:
        """Independent of this one."""
        return copy.deepcopy(self)

    @property
    def dry_mass_kg(self) -> float:
        """Without fuel."""
        return self.mass_kg - sum(self.fuel_kg)


@dataclass(frozen=True)
class InitialState:
    """Where and how a flight starts. In the air the aircraft starts trimmed, its engines at their working speed."""

    latitude_deg: float = 47.4647
    longitude_deg: float = 8.5492
    heading_deg: float = 0.0
    on_ground: bool = False
    altitude_m: float = 1000.0  #: MSL; ignored on the ground
    airspeed_mps: Optional[float] = None  #: true; None: cruise, or hover of what can
    terrain_elevation_m: float = 0.0
    engines_running: bool = True
    sim_time_s: float = 0.0

    def check(self) -> None:
        """Raises a `FlightModelError` for a start that no aircraft can have."""
        speed = 0.0 if self.airspeed_mps is None else self.airspeed_mps
        numbers = (self.latitude_deg, self.longitude_deg, self.heading_deg, self.altitude_m, speed)
        if not all(math.isfinite(number) for number in numbers) or abs(self.latitude_deg) > HIGHEST_LATITUDE_DEG:
            raise FlightModelError(
                f"cannot start at {self}: numbers must be finite, the latitude within -89.9..89.9 deg"
            )
        if not self.on_ground and self.altitude_m < self.terrain_elevation_m + 1.0:
            raise FlightModelError(
                f"cannot start in the air at {self.altitude_m} m: the ground is at {self.terrain_elevation_m} m; "
                "give a greater altitude or start on the ground"
            )


@dataclass(frozen=True)
class ModelInfo:
    """What the wire needs to know about the aircraft itself."""

    name: str  #: stem of config/aircraft/<name>.yaml
    description: str
    icao: str
    engine_count: int
    propeller_direction: tuple[int, ...]  #: +1 clockwise seen along the thrust, -1 the other way
    tank_count: int
    gear_names: tuple[str, ...]
    retractable_gear: bool
    autopilot: bool = False  #: X-Plane's own flies it
    flap_detents: int = 0  #: notches of the flap handle; 0: no flaps
    max_throttle: float = 1.0
    min_throttle: float = 0.0  #: < 0 where the engine reverses
    hover_thrust_vector: Optional[float] = None  #: tiltrotor only
    maximum_mass_kg: float = 0.0  #: full tanks and all the payload that it carries
    maximum_power_w: float = 0.0  #: per engine
    maximum_rpm: float = 0.0
    never_exceed_mps: float = 0.0  #: indicated
    stall_mps: float = 0.0  #: clean, calibrated, at the default weight
    wing_span_m: float = 0.0
    length_m: float = 0.0
    eye_forward_m: float = 0.0  #: pilot's eye (or camera) from the reference point, FRD
    eye_down_m: float = 0.0
    standing_height_m: float = 0.0  #: of the centre of gravity above the ground, parked at the default loading
    trim_deg: tuple[tuple[str, float], ...] = ()  #: surface kind -> deflection at full trim, nose up or right
    turbines: bool = False  #: whose speeds are ``n1_percent`` and ``n2_percent``


class FlightModel(Protocol):
    """A flying aircraft. Not thread-safe; never looks at a clock; same calls, same seed: the same flight."""

    info: ModelInfo
    surfaces: tuple[SurfaceSpec, ...]

    @property
    def state(self) -> ModelState:
        """The present state (overwritten by the next step)."""

    @property
    def trim_controls(self) -> Controls:
        """A copy of the controls that keep the aircraft as ``reset`` left it: start the flight with them."""

    def reset(self, initial: InitialState) -> Controls:
        """Starts a flight; returns the controls that hold it there (parked: brakes set). Wind and loading stay."""

    def step(self, dt: float, controls: Controls) -> ModelState:
        """Flies ``dt`` [s] > 0 on, in steps of at most ``MAX_SUBSTEP_S``. Returns ``state``."""

    def place(
        self,
        latitude_deg: Optional[float] = None,
        longitude_deg: Optional[float] = None,
        altitude_m: Optional[float] = None,
        roll_rad: Optional[float] = None,
        pitch_rad: Optional[float] = None,
        heading_rad: Optional[float] = None,
        v_ned_mps: Optional[Sequence[float]] = None,
        pqr_rad_s: Optional[Sequence[float]] = None,
    ) -> ModelState:
        """Moves the aircraft at once (PREL, VEHS, writes to position, q, ...), never into the ground. None: stays."""

    def save(self) -> bytes:
        """The whole situation but the controls (SIMO); restored, it flies on as it would have, to millimetres."""

    def restore(self, situation: bytes) -> ModelState:
        """Raises ``FlightModelError`` for a situation of another model or version."""

    def set_wind(self, north_mps: float, east_mps: float, down_mps: float = 0.0) -> None:
        """Steady velocity of the air (a wind from the north has north_mps < 0)."""

    def set_turbulence(self, intensity_mps: float, seed: Optional[int] = None) -> None:
        """Dryden turbulence: standard deviation of the vertical gust [m/s]; 0 ends it. ``seed``: starts anew."""

    def set_atmosphere(self, temperature_offset_k: float = 0.0, sea_level_pressure_pa: float = 101325.0) -> None:
        """The day's difference from the standard atmosphere."""

    def set_terrain(self, elevation_m: float) -> None:
        """Height of the ground above the sphere below the aircraft."""

    def set_loading(
        self,
        fuel_kg: Optional[Sequence[float]] = None,
        payload_kg: Optional[float] = None,
        cg_aft_m: Optional[float] = None,
    ) -> None:
        """Fuel per tank, payload, and where the centre of gravity without fuel is now; what is None stays as it is.

        The payload is moved to bring the centre of gravity there, and stays where it was put.
        """

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Starts (at once, at working speed) or stops an engine."""
