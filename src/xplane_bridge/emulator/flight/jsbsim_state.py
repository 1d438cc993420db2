"""A JSBSim on X-Plane's planet, and its properties as our state in SI."""

from __future__ import annotations

import math
import os
from functools import lru_cache
from pathlib import Path
from typing import Any, Callable, Sequence, Tuple

import jsbsim

from xplane_bridge import compiled
from xplane_bridge.emulator.flight.flight_model import HIGHEST_LATITUDE_DEG, MAX_SUBSTEP_S, FlightModelError, ModelState
from xplane_bridge.units import EARTH_RADIUS_M, FOOT_M, GRAVITY_MPS2, KNOT_MPS

POUND_FORCE_N = 4.4482216152605
POUND_KG = 0.45359237
SLUG_KG = 14.593902937206364
PSF_PA = POUND_FORCE_N / FOOT_M**2
SLUG_FT3_KG_M3 = SLUG_KG / FOOT_M**3
POUND_FOOT_NM = POUND_FORCE_N * FOOT_M
INCH_M = 0.0254
RANKINE_K = 1.0 / 1.8

_STATE_PROPERTIES = (
    "position/lat-geod-deg",
    "position/long-gc-deg",
    "position/h-sl-ft",
    "position/h-agl-ft",
    "attitude/phi-rad",
    "attitude/theta-rad",
    "attitude/psi-rad",
    "velocities/p-rad_sec",
    "velocities/q-rad_sec",
    "velocities/r-rad_sec",
    "accelerations/pdot-rad_sec2",
    "accelerations/qdot-rad_sec2",
    "accelerations/rdot-rad_sec2",
    "velocities/v-north-fps",
    "velocities/v-east-fps",
    "velocities/v-down-fps",
    "velocities/u-fps",
    "velocities/v-fps",
    "velocities/w-fps",
    "forces/fbx-total-lbs",
    "forces/fby-total-lbs",
    "forces/fbz-total-lbs",
    "inertia/mass-slugs",
    "atmosphere/total-wind-north-fps",
    "atmosphere/total-wind-east-fps",
    "atmosphere/total-wind-down-fps",
    "aero/alpha-rad",
    "aero/beta-rad",
    "aero/alphadot-rad_sec",
    "velocities/vt-fps",
    "velocities/ve-kts",
    "velocities/vc-kts",
    "velocities/mach",
    "aero/qbar-psf",
    "atmosphere/rho-slugs_ft3",
    "atmosphere/P-psf",
    "atmosphere/T-R",
    "atmosphere/a-fps",
    "atmosphere/pressure-altitude",
    "inertia/cg-x-in",
    "inertia/cg-y-in",
    "inertia/cg-z-in",
    "forces/fwx-aero-lbs",
    "forces/fwy-aero-lbs",
    "forces/fwz-aero-lbs",
    "moments/l-aero-lbsft",
    "moments/m-aero-lbsft",
    "moments/n-aero-lbsft",
)

#: What rotors and surfaces meet: velocity through the air, turn rates, density.
AIR_PROPERTIES = (
    "velocities/u-aero-fps",
    "velocities/v-aero-fps",
    "velocities/w-aero-fps",
    "velocities/p-rad_sec",
    "velocities/q-rad_sec",
    "velocities/r-rad_sec",
    "atmosphere/rho-slugs_ft3",
)
#: Force and moment of rotors and gravity, and their unit in SI.
LOADS = (
    ("external_reactions/thrusters_x/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_y/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_z/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_l/magnitude-lbsft", POUND_FOOT_NM),
    ("external_reactions/thrusters_m/magnitude-lbsft", POUND_FOOT_NM),
    ("external_reactions/thrusters_n/magnitude-lbsft", POUND_FOOT_NM),
)


@lru_cache(maxsize=16)
def substeps(dt: float) -> Tuple[int, float]:
    """Number and length [s] of the JSBSim steps that fly `dt`."""
    count = max(1, math.ceil(dt / MAX_SUBSTEP_S - 1e-6))
    return count, dt / count


def quaternion_from_euler(roll: float, pitch: float, heading: float) -> tuple[float, float, float, float]:
    """w, x, y, z of the rotation of FRD vectors into NED (heading, then pitch, then roll)."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(heading / 2), math.sin(heading / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def new_jsbsim(root: Path, aircraft: str) -> jsbsim.FGFDMExec:
    """A JSBSim on X-Plane's planet with ``root``/aircraft/<aircraft> loaded."""
    # JSBSim reads this when it is made, and fills the terminal otherwise.
    before = os.environ.get("JSBSIM_DEBUG")
    os.environ["JSBSIM_DEBUG"] = "0"
    try:
        fdm = jsbsim.FGFDMExec(str(root))
    finally:
        if before is None:
            del os.environ["JSBSIM_DEBUG"]
        else:
            os.environ["JSBSIM_DEBUG"] = before
    fdm.set_debug_level(0)
    # The planet first: an aircraft keeps the one it was loaded on.
    if not fdm.load_planet(str(root / "aircraft" / "planet.xml"), False):
        raise FlightModelError("JSBSim cannot read aircraft/planet.xml: is the package installed completely?")
    fdm.set_aircraft_path("aircraft")
    if not fdm.load_model(aircraft):
        raise FlightModelError(
            f"JSBSim cannot read aircraft/{aircraft}/{aircraft}.xml: is the package installed completely?"
        )
    fdm["simulation/gravity-model"] = 0
    return fdm


def missing_gravity(height_m: float, mass_slugs: float, roll: float, pitch: float) -> tuple[float, float, float]:
    """What JSBSim's gravity lacks of X-Plane's at a height: a force in body axes, FRD [N]. Angles in rad."""
    missing = GRAVITY_MPS2 * (1.0 - (EARTH_RADIUS_M / (EARTH_RADIUS_M + height_m)) ** 2)
    force = missing * mass_slugs * SLUG_KG
    cosine = math.cos(pitch)
    return -force * math.sin(pitch), force * math.sin(roll) * cosine, force * math.cos(roll) * cosine


def start_motion(
    fdm: jsbsim.FGFDMExec,
    position: Sequence[float],
    euler_rad: Sequence[float],
    v_ned_mps: Sequence[float],
    pqr_rad_s: Sequence[float],
    terrain_m: float,
) -> None:
    """Starts JSBSim's motion anew at latitude, longitude [deg] and altitude [m], with roll, pitch, heading."""
    latitude_deg, longitude_deg, altitude_m = position
    values = [latitude_deg, longitude_deg, altitude_m, *euler_rad, *v_ned_mps, *pqr_rad_s]
    if not all(math.isfinite(value) for value in values):
        raise FlightModelError(f"cannot place the aircraft at {values}: every number must be finite")
    if abs(latitude_deg) > HIGHEST_LATITUDE_DEG:
        raise FlightModelError(
            f"latitude {latitude_deg} deg: expected -89.9..89.9 (the local level has no north at a pole)"
        )
    fdm["ic/terrain-elevation-ft"] = terrain_m / FOOT_M
    fdm["ic/lat-geod-deg"] = latitude_deg
    fdm["ic/long-gc-deg"] = longitude_deg
    fdm["ic/h-sl-ft"] = altitude_m / FOOT_M
    fdm["ic/psi-true-rad"] = euler_rad[2]
    fdm["ic/theta-rad"] = euler_rad[1]
    fdm["ic/phi-rad"] = euler_rad[0]
    fdm["ic/vn-fps"] = v_ned_mps[0] / FOOT_M
    fdm["ic/ve-fps"] = v_ned_mps[1] / FOOT_M
    fdm["ic/vd-fps"] = v_ned_mps[2] / FOOT_M
    for axis, rate in zip("pqr", pqr_rad_s):
        fdm[f"ic/{axis}-rad_sec"] = rate
    fdm.run_ic()


class Properties:
    """Finds JSBSim's properties once, so that no step looks a name up."""

    def __init__(self, manager: jsbsim.FGPropertyManager) -> None:
        self._manager = manager

    def _node(self, path: str) -> Any:
        found = self._manager.get_node(path)
        if found is None:
            raise FlightModelError(f"this JSBSim has no property '{path}': jsbsim 1.2 or later is needed")
        return found

    def getter(self, path: str) -> Callable[[], float]:
        """Reads the property, in JSBSim's unit."""
        get: Callable[[], float] = self._node(path).get_double_value
        return get

    def setter(self, path: str) -> Callable[[float], None]:
        """Writes the property, in JSBSim's unit."""
        put: Callable[[float], None] = self._node(path).set_double_value
        return put


class StateReader:
    """Fills in what JSBSim itself knows of a ``ModelState``."""

    def __init__(self, properties: Properties) -> None:
        self._getters = [properties.getter(path) for path in _STATE_PROPERTIES]
        # The same in C++, where it has been built: the same bits.
        self._compiled = None if compiled.core is None else compiled.core.StateReader(self._getters)

    def read(self, s: ModelState, gravity_force: Sequence[float]) -> None:
        """``gravity_force``: what stands among JSBSim's forces although it is gravity, FRD [N]."""
        if self._compiled is not None:
            self._compiled.read(s, gravity_force)
            return
        (
            s.latitude_deg, s.longitude_deg, altitude, agl, s.roll_rad, s.pitch_rad, heading, s.p_rad_s, s.q_rad_s,
            s.r_rad_s, s.p_dot_rad_s2, s.q_dot_rad_s2, s.r_dot_rad_s2, north, east, down, u, v, w, fx, fy, fz, mass,
            wind_n, wind_e, wind_d,
            s.alpha_rad, s.beta_rad, s.alpha_dot_rad_s, tas, eas, cas, s.mach, qbar, rho, pressure, temperature, sound,
            pressure_altitude, cg_x, cg_y, cg_z, wind_x, wind_y, wind_z, roll_moment, pitch_moment, yaw_moment,
        ) = [get() for get in self._getters]  # fmt: skip
        s.altitude_m, s.agl_m = altitude * FOOT_M, agl * FOOT_M
        s.heading_rad = heading % (2.0 * math.pi)
        s.quaternion = w_, x_, y_, z_ = quaternion_from_euler(s.roll_rad, s.pitch_rad, heading)
        s.v_north_mps, s.v_east_mps, s.v_down_mps = vn, ve, vd = north * FOOT_M, east * FOOT_M, down * FOOT_M
        s.u_mps, s.v_mps, s.w_mps = u * FOOT_M, v * FOOT_M, w * FOOT_M
        s.mass_kg = mass * SLUG_KG
        gx, gy, gz = gravity_force
        s.specific_force_x_mps2 = ax = (fx * POUND_FORCE_N - gx) / s.mass_kg
        s.specific_force_y_mps2 = ay = (fy * POUND_FORCE_N - gy) / s.mass_kg
        s.specific_force_z_mps2 = az = (fz * POUND_FORCE_N - gz) / s.mass_kg
        # Specific force in NED plus gravity, less what the turning of the local level takes (planet at rest).
        an = (1 - 2 * (y_ * y_ + z_ * z_)) * ax + 2 * (x_ * y_ - w_ * z_) * ay + 2 * (x_ * z_ + w_ * y_) * az
        ae = 2 * (x_ * y_ + w_ * z_) * ax + (1 - 2 * (x_ * x_ + z_ * z_)) * ay + 2 * (y_ * z_ - w_ * x_) * az
        ad = 2 * (x_ * z_ - w_ * y_) * ax + 2 * (y_ * z_ + w_ * x_) * ay + (1 - 2 * (x_ * x_ + y_ * y_)) * az
        radius = EARTH_RADIUS_M + s.altitude_m
        tangent = math.tan(math.radians(s.latitude_deg))
        s.acceleration_north_mps2 = an + (vn * vd - ve * ve * tangent) / radius
        s.acceleration_east_mps2 = ae + (ve * vd + ve * vn * tangent) / radius
        s.acceleration_down_mps2 = ad + GRAVITY_MPS2 - (vn * vn + ve * ve) / radius
        s.wind_north_mps, s.wind_east_mps, s.wind_down_mps = wind_n * FOOT_M, wind_e * FOOT_M, wind_d * FOOT_M
        s.true_airspeed_mps = tas * FOOT_M
        s.equivalent_airspeed_mps, s.calibrated_airspeed_mps = eas * KNOT_MPS, cas * KNOT_MPS
        s.dynamic_pressure_pa, s.air_density_kg_m3 = qbar * PSF_PA, rho * SLUG_FT3_KG_M3
        s.pressure_pa, s.temperature_k, s.speed_of_sound_mps = (
            pressure * PSF_PA,
            temperature * RANKINE_K,
            sound * FOOT_M,
        )
        s.pressure_altitude_m = pressure_altitude * FOOT_M
        s.cg_forward_m, s.cg_right_m, s.cg_down_m = -cg_x * INCH_M, cg_y * INCH_M, -cg_z * INCH_M
        s.drag_n, s.side_force_n, s.lift_n = wind_x * POUND_FORCE_N, wind_y * POUND_FORCE_N, wind_z * POUND_FORCE_N
        s.aero_roll_nm, s.aero_pitch_nm = roll_moment * POUND_FOOT_NM, pitch_moment * POUND_FOOT_NM
        s.aero_yaw_nm = yaw_moment * POUND_FOOT_NM
