"""One rendered frame as X-Plane shows it: the flight model's state turned into X-Plane's axes, units and oddities.

`Frame.update` runs once a frame; datarefs and DATA rows read what it computed, so that all of them belong together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Tuple

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import ModelInfo, ModelState
from xplane_bridge.units import FOOT_M

MPS_TO_KT = 3600.0 / 1852.0
MPS_TO_MPH = 3600.0 / 1609.344
MPS_TO_FPM = 60.0 / FOOT_M
M_TO_FT = 1.0 / FOOT_M
PA_TO_INHG = 1.0 / 3386.389
PA_TO_PSF = FOOT_M**2 / 4.4482216152605
PA_TO_PSI = 1.0 / 6894.757293168
SEA_LEVEL_DENSITY = 1.225
SEA_LEVEL_PRESSURE_PA = 101325.0

#: [? beta-sign] Laminar: hpath + beta = psi, which makes beta positive when the nose points right of the path (wind
#: from the left): the opposite of the aerospace sign. Working programs disagree.
BETA_SIGN = -1.0
#: [? parked-height] Height above ground that X-Plane shows for a parked aircraft: it measures from about the wheels,
#: not from the centre of gravity (captured: 0.25 and 0.23 ft) [m].
PARKED_HEIGHT_M = 0.076
#: Below this speed over ground hpath is noise [m/s].
PATH_NOISE_BELOW_MPS = 0.1
#: The simulated magnetic pole: a dipole's, so the declination is of the right kind but up to 20 degrees off.
_MAGNETIC_POLE_DEG = (80.7, -72.7)


def magnetic_declination(latitude_deg: float, longitude_deg: float) -> float:
    """Declination of a dipole field, east positive [deg]."""
    return earth.bearing_degrees(latitude_deg, longitude_deg, *_MAGNETIC_POLE_DEG)


def indicated_altitude_m(static_pressure_pa: float, setting_pa: float) -> float:
    """What an altimeter with this setting shows."""
    ratio: float = (setting_pa / SEA_LEVEL_PRESSURE_PA) ** 0.190263 - (
        static_pressure_pa / SEA_LEVEL_PRESSURE_PA
    ) ** 0.190263
    return ratio * (288.15 / 0.0065)


@dataclass
class Clocks:
    """The simulator's times [s] and frame counters, kept as doubles; datarefs show them as float32."""

    frame: int = 0  #: rendered frames since the emulator started
    running: float = 0.0  #: sim/time/total_running_time_sec
    flight: float = 0.0  #: sim/time/total_flight_time_sec
    zulu: float = 43200.0  #: sim/time/zulu_time_sec
    date_days: int = 171  #: 0 is 1 January; there is no leap year
    simulated_period: float = 1.0 / 60.0  #: time that this frame advanced the simulation, or would have
    wall_period: float = 1.0 / 60.0  #: time between this frame and the one before
    time_ratio: float = 1.0  #: simulated time that passes in a second of `simulated_period`, as clients ask for it
    work: float = 0.0  #: time that computing the last frame took
    elapsed: float = 0.0  #: simulated time since the emulator started, also without a flight
    paused: bool = False

    def local(self, longitude_deg: float) -> float:
        """Zone time [s]: whole hours from zulu by longitude."""
        return (self.zulu + 3600.0 * round(longitude_deg / 15.0)) % 86400.0

    def advance(self, dt: float, flying: bool) -> None:
        """Simulated time passes."""
        self.elapsed += dt
        self.running += dt
        if flying:
            self.flight += dt
            self.zulu += dt
            if self.zulu >= 86400.0:
                self.zulu -= 86400.0
                self.date_days = (self.date_days + 1) % 365


@dataclass
class Frame:
    """See the module's text. Angles in degrees, lengths in metres, forces in newtons; axes by name."""

    info: ModelInfo
    clocks: Clocks = field(default_factory=Clocks)
    from_wheels: bool = True  #: whether heights are measured as PARKED_HEIGHT_M says; else from the centre of gravity
    m: ModelState = field(default_factory=ModelState)
    local: earth.LocalFrame = field(default_factory=lambda: earth.LocalFrame(0.0, 0.0))

    position: Tuple[float, float, float] = (0.0, 0.0, 0.0)  #: X east, Y up, Z south of the local frame
    velocity: Tuple[float, float, float] = (0.0, 0.0, 0.0)
    acceleration: Tuple[float, float, float] = (0.0, 0.0, 0.0)
    wind: Tuple[float, float, float] = (0.0, 0.0, 0.0)  #: velocity of the air in the local frame's axes
    true_phi: float = 0.0  #: relative to the local level
    true_theta: float = 0.0
    true_psi: float = 0.0
    phi: float = 0.0  #: relative to the origin's axes
    theta: float = 0.0
    psi: float = 0.0
    q: Tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)  #: body to the origin's north, east, down
    declination: float = 0.0
    ground_speed: float = 0.0
    hpath: float = 0.0
    vpath: float = 0.0
    wind_speed: float = 0.0
    wind_from: float = 0.0
    altimeter_ft: float = 0.0
    distance: float = 0.0  #: travelled over ground since the flight began
    origin_jumped: bool = False

    def start(self, state: ModelState) -> None:
        """A new flight: the origin is where the aircraft is."""
        self.local = earth.LocalFrame(state.latitude_deg, state.longitude_deg)
        self.distance = 0.0

    def update(self, state: ModelState, altimeter_setting_pa: float) -> None:
        """Takes over a state of the flight model."""
        self.m = state
        self.origin_jumped = self.local.follow(state.latitude_deg, state.longitude_deg)
        turn, self.position = self.local.level_and_place(state.latitude_deg, state.longitude_deg, state.altitude_m)
        velocity = (state.v_north_mps, state.v_east_mps, state.v_down_mps)
        acceleration = (state.acceleration_north_mps2, state.acceleration_east_mps2, state.acceleration_down_mps2)
        wind = (state.wind_north_mps, state.wind_east_mps, state.wind_down_mps)
        self.velocity = _opengl(earth.turned(turn, velocity))
        self.acceleration = _opengl(earth.turned(turn, acceleration))
        self.wind = _opengl(earth.turned(turn, wind))
        self.true_phi, self.true_theta = math.degrees(state.roll_rad), math.degrees(state.pitch_rad)
        self.true_psi = earth.wrap_degrees(math.degrees(state.heading_rad))
        in_origin = earth.product(turn, earth.body_rows(self.true_phi, self.true_theta, self.true_psi))
        self.phi, self.theta, self.psi = earth.euler_degrees(in_origin)
        self.q = earth.quaternion(in_origin)
        self.declination = magnetic_declination(state.latitude_deg, state.longitude_deg)
        north, east, down = velocity
        self.ground_speed = math.hypot(north, east)
        if self.ground_speed < PATH_NOISE_BELOW_MPS:
            self.hpath = (self.clocks.running * 8250.48) % 360.0
        else:
            self.hpath = earth.wrap_degrees(math.degrees(math.atan2(east, north)))
        moves = math.hypot(self.ground_speed, down) >= PATH_NOISE_BELOW_MPS
        self.vpath = math.degrees(math.atan2(-down, self.ground_speed)) if moves else 0.0
        self.wind_speed = math.hypot(state.wind_north_mps, state.wind_east_mps)
        self.wind_from = (
            earth.wrap_degrees(math.degrees(math.atan2(-state.wind_east_mps, -state.wind_north_mps)))
            if self.wind_speed > 0.0
            else 0.0
        )
        self.altimeter_ft = indicated_altitude_m(state.pressure_pa, altimeter_setting_pa) * M_TO_FT

    @property
    def height(self) -> float:
        """Height above ground as X-Plane gives it [m]; ModelState's is that of the centre of gravity."""
        return self.m.agl_m - self.info.standing_height_m + PARKED_HEIGHT_M if self.from_wheels else self.m.agl_m

    @property
    def mag_psi(self) -> float:
        """Magnetic heading."""
        return earth.wrap_degrees(self.true_psi - self.declination)


def _opengl(ned: earth.Vector) -> earth.Vector:
    """North, east, down to X east, Y up, Z south."""
    north, east, down = ned
    return east, -down, -north
