"""What all the emulator's aircraft share: JSBSim on X-Plane's sphere, and its state in our units.

JSBSim integrates the rigid body and gives atmosphere, aerodynamics (the aircraft's XML), mass and gear. Surfaces,
engines, rotors and stabilisation are Python, stepped once per JSBSim step, so that every fault can be expressed and
every state saved.
"""

from __future__ import annotations

import json
import math
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Sequence

import jsbsim

from xplane_bridge.emulator.actuators import SurfaceSet
from xplane_bridge.emulator.flight_model import (
    EARTH_RADIUS_M,
    GRAVITY_MPS2,
    MAX_STEP_S,
    MAX_SUBSTEP_S,
    Controls,
    EngineState,
    FlightModelError,
    GearState,
    InitialState,
    ModelInfo,
    ModelState,
    SurfaceSpec,
)
from xplane_bridge.emulator.rotors import Rotor, sum_loads
from xplane_bridge.emulator.turbulence import DrydenTurbulence

FOOT_M = 0.3048
POUND_FORCE_N = 4.4482216152605
POUND_KG = 0.45359237
SLUG_KG = 14.593902937206364
KNOT_MPS = 1852.0 / 3600.0
PSF_PA = POUND_FORCE_N / FOOT_M**2
SLUG_FT3_KG_M3 = SLUG_KG / FOOT_M**3
POUND_FOOT_NM = POUND_FORCE_N * FOOT_M
INCH_M = 0.0254
RANKINE_K = 1.0 / 1.8

#: A structural part that meets the ground faster than this, or gear faster than the second, is a crash [m/s].
CRASH_STRUCTURE_MPS = 2.0
CRASH_GEAR_MPS = 6.0

SITUATION_VERSION = 1

_ROOT = Path(__file__).resolve().parent

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

_AIR_PROPERTIES = (
    "velocities/u-aero-fps",
    "velocities/v-aero-fps",
    "velocities/w-aero-fps",
    "velocities/p-rad_sec",
    "velocities/q-rad_sec",
    "velocities/r-rad_sec",
    "atmosphere/rho-slugs_ft3",
)

_LOADS = (
    ("external_reactions/thrusters_x/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_y/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_z/magnitude", POUND_FORCE_N),
    ("external_reactions/thrusters_l/magnitude-lbsft", POUND_FOOT_NM),
    ("external_reactions/thrusters_m/magnitude-lbsft", POUND_FOOT_NM),
    ("external_reactions/thrusters_n/magnitude-lbsft", POUND_FOOT_NM),
)


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


class _Contact:
    """A contact point of the aircraft's XML."""

    def __init__(self, element: ElementTree.Element, index: int) -> None:
        def value(tag: str) -> float:
            return float(element.findtext(tag, "0"))

        self.name = element.get("name", "")
        self.index = index
        self.is_gear = element.get("type") == "BOGEY"
        self.spring = value("spring_coeff")
        self.damping = value("damping_coeff")
        self.max_steer_deg = value("max_steer")
        self.wow = self.compression = self.compression_rate = None


class JsbsimModel:
    """Base of the aircraft; implements ``flight_model.FlightModel``, where the public methods are described.

    A subclass sets the class attributes, builds its rotors and engines in ``_build`` and flies them in ``_advance``;
    ``FixedWing`` shows the pattern.
    """

    info: ModelInfo
    surfaces: tuple[SurfaceSpec, ...] = ()
    fuel_capacity_kg: tuple[float, ...] = ()
    default_fuel_kg: tuple[float, ...] = ()
    default_payload_kg: float = 0.0
    max_payload_kg: float = 0.0
    gear_time_s: float = 6.0

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed
        self._wind = [0.0, 0.0, 0.0]
        self._gusts = [0.0, 0.0, 0.0]
        self._turbulence = DrydenTurbulence(seed)
        self._atmosphere = (0.0, 101325.0)
        self._terrain_m = 0.0
        self._fuel_kg = list(self.default_fuel_kg)
        self._payload_kg = self.default_payload_kg
        self._trimmed = Controls()
        self._trim_cache: dict[tuple, bytes] = {}
        self.state = ModelState()
        self._start_jsbsim()

    # ---- set-up

    def _start_jsbsim(self) -> None:
        """A fresh JSBSim, so that no flight inherits anything from the one before."""
        name = self.info.name
        # JSBSim reads this when it is made, and fills the terminal otherwise.
        before = os.environ.get("JSBSIM_DEBUG")
        os.environ["JSBSIM_DEBUG"] = "0"
        try:
            self._fdm = fdm = jsbsim.FGFDMExec(str(_ROOT))
        finally:
            if before is None:
                del os.environ["JSBSIM_DEBUG"]
            else:
                os.environ["JSBSIM_DEBUG"] = before
        fdm.set_debug_level(0)
        if not fdm.load_planet(str(_ROOT / "aircraft" / "planet.xml"), False):
            raise FlightModelError("JSBSim cannot read aircraft/planet.xml: is the package installed completely?")
        fdm.set_aircraft_path("aircraft")
        if not fdm.load_model(name):
            raise FlightModelError(
                f"JSBSim cannot read aircraft/{name}/{name}.xml: is the package installed completely?"
            )
        fdm["simulation/gravity-model"] = 0
        self._substep = MAX_SUBSTEP_S
        fdm.set_dt(MAX_SUBSTEP_S)

        manager = fdm.get_property_manager()

        def node(path: str):
            found = manager.get_node(path)
            if found is None:
                raise FlightModelError(f"this JSBSim has no property '{path}': jsbsim 1.2 or later is needed")
            return found

        self._state_getters = [node(path).get_double_value for path in _STATE_PROPERTIES]
        self._height = node("position/h-sl-ft").get_double_value
        self._agl = node("position/h-agl-ft").get_double_value
        self._roll = node("attitude/phi-rad").get_double_value
        self._pitch = node("attitude/theta-rad").get_double_value
        self._heading = node("attitude/psi-rad").get_double_value
        self._alpha = node("aero/alpha-rad").get_double_value
        self._airspeed = node("velocities/vt-fps").get_double_value
        self._mass = node("inertia/mass-slugs").get_double_value
        self._pressure = node("atmosphere/P-psf").get_double_value
        self._temperature = node("atmosphere/T-R").get_double_value
        self._air_getters = [node(path).get_double_value for path in _AIR_PROPERTIES]
        self._load_setters = [(node(path).set_double_value, 1.0 / unit) for path, unit in _LOADS]
        self._surface_set = SurfaceSet(self.surfaces)
        self._surface_setters = [node(f"surface/{spec.name}").set_double_value for spec in self.surfaces]
        axes = ("north", "east", "down")  # as JSBSim's gust, because starting a motion takes its wind away
        self._wind_setters = [node(f"atmosphere/gust-{axis}-fps").set_double_value for axis in axes]
        self._gear_setter = node("gear/gear-pos-norm").set_double_value
        self._brake_setters = [node(f"fcs/{side}-brake-cmd-norm").set_double_value for side in ("left", "right")]
        self._steer_setter = node("fcs/steer-cmd-norm").set_double_value
        masses = len(self.fuel_capacity_kg) + 1
        self._mass_setters = [node(f"inertia/pointmass-weight-lbs[{i}]").set_double_value for i in range(masses)]

        tree = ElementTree.parse(_ROOT / "aircraft" / name / f"{name}.xml").getroot()
        self._empty_mass_kg = float(tree.findtext("mass_balance/emptywt", "0"))
        self._contacts = [_Contact(e, i) for i, e in enumerate(tree.findall("ground_reactions/contact"))]
        for contact in self._contacts:
            unit = f"{'gear' if contact.is_gear else 'contact'}/unit[{contact.index}]"
            contact.wow = node(f"{unit}/WOW").get_double_value
            contact.compression = node(f"{unit}/compression-ft").get_double_value
            contact.compression_rate = node(f"{unit}/compression-velocity-fps").get_double_value
        self._gear = [contact for contact in self._contacts if contact.is_gear]

        self._time = 0.0
        self._gear_position = 1.0
        self._crashed = False
        self._gravity_force = (0.0, 0.0, 0.0)
        self._rotors: list[Rotor] = []
        state = ModelState()
        state.surfaces_deg = {spec.name: 0.0 for spec in self.surfaces}
        state.engines = [EngineState() for _ in range(self.info.engine_count)]
        state.gear = [GearState(name=contact.name) for contact in self._gear]
        self.state = state
        self._build()
        self._apply_loading()
        self._apply_atmosphere()
        self._apply_wind()

    # ---- for the subclass

    def _build(self) -> None:
        """Makes rotors (``self._rotors``), engines, and whatever else has a state."""
        raise NotImplementedError

    def _advance(
        self, dt: float, controls: Controls, air: Sequence[float], rates: Sequence[float], density: float
    ) -> None:
        """One JSBSim step of controls, actuators, engines and rotors. ``air``: velocity through the air, FRD [m/s]."""
        raise NotImplementedError

    def _fill_state(self, state: ModelState, controls: Controls) -> None:
        """Engines, ratios, stall warning."""
        raise NotImplementedError

    def _save_more(self) -> dict:
        raise NotImplementedError

    def _restore_more(self, saved: dict) -> None:
        raise NotImplementedError

    def _start_in_air(self, initial: InitialState) -> Controls:
        raise NotImplementedError

    def _start_on_ground(self, initial: InitialState) -> Controls:
        raise NotImplementedError

    # ---- flying

    @property
    def trim_controls(self) -> Controls:
        """A copy of the controls that keep the aircraft as ``reset`` left it."""
        return self._trimmed.copy()

    def reset(self, initial: InitialState) -> Controls:
        """Starts a flight."""
        self._check_initial(initial)
        self._terrain_m = initial.terrain_elevation_m
        self._gusts = [0.0, 0.0, 0.0]
        turbulence = self._turbulence.save()
        self._start_jsbsim()
        self._trimmed = self._start_on_ground(initial) if initial.on_ground else self._start_in_air(initial)
        self._turbulence.restore(turbulence)
        self._time = initial.sim_time_s
        self._crashed = False
        self._read_state(self._trimmed)
        return self.trim_controls

    def step(self, dt: float, controls: Controls) -> ModelState:
        """Flies on."""
        if not 0.0 < dt <= MAX_STEP_S:
            raise FlightModelError(
                f"step of {dt} s: expected more than 0 and at most {MAX_STEP_S} s; fly longer times in pieces"
            )
        self._surface_set.check(controls)
        self._fly(dt, controls)
        self._time += dt
        return self._read_state(controls)

    def _fly(self, dt: float, controls: Controls) -> None:
        count = max(1, math.ceil(dt / MAX_SUBSTEP_S - 1e-6))
        substep = dt / count
        if abs(substep - self._substep) > 1e-12:
            self._substep = substep
            self._fdm.set_dt(substep)
        self._move_gear(dt, controls)
        self._correct_gravity()
        run = self._fdm.run
        for _ in range(count):
            if self._turbulence.intensity_mps > 0.0:
                self._blow(substep)
            self._load(substep, controls)
            run()
            self._watch_crash()

    def _load(self, dt: float, controls: Controls) -> None:
        u, v, w, p, q, r, density = [get() for get in self._air_getters]
        self._advance(
            dt, controls, (u * FOOT_M, v * FOOT_M, w * FOOT_M), (p, q, r), max(density * SLUG_FT3_KG_M3, 1e-3)
        )
        self._apply_loads()

    def _outside_air(self) -> tuple[float, float]:
        """Pressure [Pa] and temperature [K]."""
        return self._pressure() * PSF_PA, self._temperature() * RANKINE_K

    def _move_gear(self, dt: float, controls: Controls) -> None:
        if self.info.retractable_gear:
            wanted, reach = (1.0 if controls.gear_down else 0.0), dt / self.gear_time_s
            self._gear_position += min(max(wanted - self._gear_position, -reach), reach)
        self._gear_setter(self._gear_position)
        parking = controls.parking_brake
        for setter, brake in zip(self._brake_setters, (controls.brake_left, controls.brake_right)):
            setter(min(max(brake, parking, 0.0), 1.0))
        # Nose wheel and rudder share the pedals; the wheel's share fades with speed as its tyre would skid.
        speed = math.hypot(self.state.v_north_mps, self.state.v_east_mps)
        self._steer = min(max(controls.yaw, -1.0), 1.0) / (1.0 + (speed / 12.0) ** 2)
        self._steer_setter(self._steer)

    def _correct_gravity(self) -> None:
        """X-Plane's gravity is constant, JSBSim's falls off with height: the difference, as a force."""
        height = self._height() * FOOT_M
        missing = GRAVITY_MPS2 * (1.0 - (EARTH_RADIUS_M / (EARTH_RADIUS_M + height)) ** 2)
        force = missing * self._mass() * SLUG_KG
        roll, pitch = self._roll(), self._pitch()
        cosine = math.cos(pitch)
        self._gravity_force = (
            -force * math.sin(pitch),
            force * math.sin(roll) * cosine,
            force * math.cos(roll) * cosine,
        )

    def _blow(self, dt: float) -> None:
        heading = self._heading()
        speed, agl = self._airspeed() * FOOT_M, self._agl() * FOOT_M
        along, across, down = self._turbulence.step(dt, speed, agl)
        sine, cosine = math.sin(heading), math.cos(heading)
        self._gusts = [along * cosine - across * sine, along * sine + across * cosine, down]
        self._apply_wind()

    def _watch_crash(self) -> None:
        if self._agl() * FOOT_M > 20.0:
            return
        for contact in self._contacts:
            if contact.wow() > 0.5:
                limit = CRASH_GEAR_MPS if contact.is_gear else CRASH_STRUCTURE_MPS
                if contact.compression_rate() * FOOT_M > limit:
                    self._crashed = True

    def _read_state(self, controls: Controls) -> ModelState:
        s = self.state
        (
            s.latitude_deg, s.longitude_deg, altitude, agl, s.roll_rad, s.pitch_rad, heading, s.p_rad_s, s.q_rad_s,
            s.r_rad_s, s.p_dot_rad_s2, s.q_dot_rad_s2, s.r_dot_rad_s2, north, east, down, u, v, w, fx, fy, fz, mass,
            wind_n, wind_e, wind_d,
            s.alpha_rad, s.beta_rad, s.alpha_dot_rad_s, tas, eas, cas, s.mach, qbar, rho, pressure, temperature, sound,
            pressure_altitude, cg_x, cg_y, cg_z, wind_x, wind_y, wind_z, roll_moment, pitch_moment, yaw_moment,
        ) = [get() for get in self._state_getters]  # fmt: skip
        s.sim_time_s = self._time
        s.altitude_m, s.agl_m, s.terrain_elevation_m = altitude * FOOT_M, agl * FOOT_M, self._terrain_m
        s.heading_rad = heading % (2.0 * math.pi)
        s.quaternion = w_, x_, y_, z_ = quaternion_from_euler(s.roll_rad, s.pitch_rad, heading)
        s.v_north_mps, s.v_east_mps, s.v_down_mps = vn, ve, vd = north * FOOT_M, east * FOOT_M, down * FOOT_M
        s.u_mps, s.v_mps, s.w_mps = u * FOOT_M, v * FOOT_M, w * FOOT_M
        s.mass_kg = mass * SLUG_KG
        gx, gy, gz = self._gravity_force
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
        for actuator in self._surface_set.actuators:
            s.surfaces_deg[actuator.spec.name] = actuator.position_deg
        s.fuel_kg = list(self._fuel_kg)
        s.payload_kg, s.empty_mass_kg = self._payload_kg, self._empty_mass_kg
        standing = 0
        for contact, gear in zip(self._gear, s.gear):
            gear.extended = self._gear_position
            gear.on_ground = contact.wow() > 0.5
            gear.compression_m = contact.compression() * FOOT_M if gear.on_ground else 0.0
            rate = contact.compression_rate() * FOOT_M
            gear.vertical_force_n = (
                max(contact.spring * gear.compression_m + contact.damping * rate, 0.0) if gear.on_ground else 0.0
            )
            gear.steer_deg = contact.max_steer_deg * self._steer
            standing += gear.on_ground
        s.on_ground_any, s.on_ground_all = standing > 0, standing == len(self._gear)
        s.crashed = self._crashed
        self._fill_state(s, controls)
        return s

    # ---- placing, saving

    _steer = 0.0

    def place(
        self,
        latitude_deg: float | None = None,
        longitude_deg: float | None = None,
        altitude_m: float | None = None,
        roll_rad: float | None = None,
        pitch_rad: float | None = None,
        heading_rad: float | None = None,
        v_ned_mps: Sequence[float] | None = None,
        pqr_rad_s: Sequence[float] | None = None,
    ) -> ModelState:
        """Moves the aircraft at once."""
        s = self.state

        def chosen(new, old):
            return old if new is None else new

        self._put(
            (
                chosen(latitude_deg, s.latitude_deg),
                chosen(longitude_deg, s.longitude_deg),
                chosen(altitude_m, s.altitude_m),
            ),
            (chosen(roll_rad, s.roll_rad), chosen(pitch_rad, s.pitch_rad), chosen(heading_rad, s.heading_rad)),
            chosen(v_ned_mps, (s.v_north_mps, s.v_east_mps, s.v_down_mps)),
            chosen(pqr_rad_s, (s.p_rad_s, s.q_rad_s, s.r_rad_s)),
        )
        self._crashed = False
        return self._read_state(self._trimmed)

    def _set_motion(
        self,
        latitude_deg: float,
        longitude_deg: float,
        altitude_m: float,
        euler_rad: Sequence[float],
        v_ned_mps: Sequence[float],
        pqr_rad_s: Sequence[float],
    ) -> None:
        values = [latitude_deg, longitude_deg, altitude_m, *euler_rad, *v_ned_mps, *pqr_rad_s]
        if not all(math.isfinite(value) for value in values):
            raise FlightModelError(f"cannot place the aircraft at {values}: every number must be finite")
        if abs(latitude_deg) > 89.9:
            raise FlightModelError(
                f"latitude {latitude_deg} deg: expected -89.9..89.9 (the local level has no north at a pole)"
            )
        fdm = self._fdm
        fdm["ic/terrain-elevation-ft"] = self._terrain_m / FOOT_M
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

    def _settle_on_ground(self, controls: Controls, seconds: float) -> None:
        """Lets the aircraft come to rest on its gear, without gusts."""
        intensity, self._turbulence.intensity_mps = self._turbulence.intensity_mps, 0.0
        for _ in range(math.ceil(seconds / 0.5)):
            self._fly(0.5, controls)
        self._turbulence.intensity_mps = intensity

    def save(self) -> bytes:
        """The whole situation but the controls."""
        s = self.state
        return json.dumps(
            {
                "version": SITUATION_VERSION,
                "model": self.info.name,
                "time": self._time,
                "position": [s.latitude_deg, s.longitude_deg, s.altitude_m],
                "euler": [s.roll_rad, s.pitch_rad, s.heading_rad],
                "v_ned": [s.v_north_mps, s.v_east_mps, s.v_down_mps],
                "pqr": [s.p_rad_s, s.q_rad_s, s.r_rad_s],
                "terrain": self._terrain_m,
                "wind": self._wind,
                "gusts": self._gusts,
                "turbulence": self._turbulence.save(),
                "atmosphere": self._atmosphere,
                "fuel": self._fuel_kg,
                "payload": self._payload_kg,
                "gear": self._gear_position,
                "crashed": self._crashed,
                "surfaces": [actuator.save() for actuator in self._surface_set.actuators],
                "rotors": [rotor.save() for rotor in self._rotors],
                "more": self._save_more(),
            }
        ).encode()

    def restore(self, situation: bytes) -> ModelState:
        """Goes on from a saved situation."""
        try:
            saved = json.loads(situation.decode())
            model, version = saved["model"], saved["version"]
        except (ValueError, KeyError, TypeError) as error:
            raise FlightModelError(f"not a saved situation of the emulator: {error}") from error
        if (model, version) != (self.info.name, SITUATION_VERSION):
            raise FlightModelError(
                f"situation of '{model}', version {version}: '{self.info.name}', version {SITUATION_VERSION} is loaded"
            )
        self._start_jsbsim()
        self._terrain_m, self._wind, self._gusts = saved["terrain"], list(saved["wind"]), list(saved["gusts"])
        self._turbulence.restore(saved["turbulence"])
        self._atmosphere = tuple(saved["atmosphere"])
        self._fuel_kg, self._payload_kg = list(saved["fuel"]), saved["payload"]
        self._gear_position = saved["gear"]
        for actuator, values in zip(self._surface_set.actuators, saved["surfaces"]):
            actuator.restore(values)
        for rotor, values in zip(self._rotors, saved["rotors"]):
            rotor.restore(values)
        self._restore_more(saved["more"])
        self._apply_loading()
        self._apply_atmosphere()
        self._apply_wind()
        self._gear_setter(self._gear_position)
        self._put(saved["position"], saved["euler"], saved["v_ned"], saved["pqr"])
        self._time, self._crashed = saved["time"], saved["crashed"]
        return self._read_state(self._trimmed)

    def _put(
        self, position: Sequence[float], euler: Sequence[float], v_ned: Sequence[float], pqr: Sequence[float]
    ) -> None:
        """Sets the motion, with the loads of surfaces and rotors as they are acting from the first instant."""
        self._set_motion(*position, euler, v_ned, pqr)
        self._correct_gravity()
        u, v, w, p, q, r, density = [get() for get in self._air_getters]
        for rotor in self._rotors:
            rotor.air_loads(0.0, (u * FOOT_M, v * FOOT_M, w * FOOT_M), (p, q, r), density * SLUG_FT3_KG_M3)
            rotor.turn(0.0, rotor.shaft_torque, (p, q, r))
        self._apply_loads()
        self._fdm.run_ic()  # again: the integrators start from the accelerations of now

    def _apply_loads(self) -> None:
        for setter, actuator in zip(self._surface_setters, self._surface_set.actuators):
            setter(actuator.effective_deg)
        loads = sum_loads(self._rotors)
        for axis in range(3):
            loads[axis] += self._gravity_force[axis]
        for (setter, factor), load in zip(self._load_setters, loads):
            setter(load * factor)

    # ---- surroundings, loading

    def set_wind(self, north_mps: float, east_mps: float, down_mps: float = 0.0) -> None:
        """Steady wind."""
        self._wind = [north_mps, east_mps, down_mps]
        self._apply_wind()

    def _apply_wind(self) -> None:
        for setter, wind, gust in zip(self._wind_setters, self._wind, self._gusts):
            setter((wind + gust) / FOOT_M)

    def set_turbulence(self, intensity_mps: float, seed: int | None = None) -> None:
        """Dryden turbulence."""
        if not 0.0 <= intensity_mps <= 20.0:
            raise FlightModelError(f"turbulence of {intensity_mps} m/s: expected 0..20 (light 1, moderate 2, severe 4)")
        self._turbulence.start(intensity_mps, seed)
        if intensity_mps == 0.0:
            self._gusts = [0.0, 0.0, 0.0]
            self._apply_wind()

    def set_atmosphere(self, temperature_offset_k: float = 0.0, sea_level_pressure_pa: float = 101325.0) -> None:
        """The day."""
        if not (abs(temperature_offset_k) <= 60.0 and 85000.0 <= sea_level_pressure_pa <= 110000.0):
            raise FlightModelError(
                f"atmosphere {temperature_offset_k} K off standard, {sea_level_pressure_pa} Pa at sea level: "
                "expected -60..60 K, 85000..110000 Pa"
            )
        self._atmosphere = (temperature_offset_k, sea_level_pressure_pa)
        self._apply_atmosphere()

    def _apply_atmosphere(self) -> None:
        offset, pressure = self._atmosphere
        self._fdm["atmosphere/delta-T"] = offset * 1.8
        self._fdm["atmosphere/P-sl-psf"] = pressure / PSF_PA

    def set_terrain(self, elevation_m: float) -> None:
        """Height of the ground."""
        self._terrain_m = elevation_m
        self._fdm["position/terrain-elevation-asl-ft"] = elevation_m / FOOT_M

    def set_loading(self, fuel_kg: Sequence[float] | None = None, payload_kg: float | None = None) -> None:
        """Fuel and payload."""
        if fuel_kg is not None:
            capacity = self.fuel_capacity_kg
            if len(fuel_kg) != len(capacity) or not all(0.0 <= f <= c for f, c in zip(fuel_kg, capacity)):
                raise FlightModelError(f"fuel {list(fuel_kg)} kg: expected one value per tank, 0..{list(capacity)}")
        if payload_kg is not None and not 0.0 <= payload_kg <= self.max_payload_kg:
            raise FlightModelError(f"payload {payload_kg} kg: expected 0..{self.max_payload_kg}")
        self._fuel_kg = self._fuel_kg if fuel_kg is None else list(fuel_kg)
        self._payload_kg = self._payload_kg if payload_kg is None else payload_kg
        self._apply_loading()

    def _apply_loading(self) -> None:
        for setter, mass in zip(self._mass_setters, [*self._fuel_kg, self._payload_kg]):
            setter(mass / POUND_KG)

    def _check_initial(self, initial: InitialState) -> None:
        speed = 0.0 if initial.airspeed_mps is None else initial.airspeed_mps
        numbers = (initial.latitude_deg, initial.longitude_deg, initial.heading_deg, initial.altitude_m, speed)
        if not all(math.isfinite(number) for number in numbers) or abs(initial.latitude_deg) > 89.9:
            raise FlightModelError(
                f"cannot start at {initial}: numbers must be finite, the latitude within -89.9..89.9 deg"
            )
        if not initial.on_ground and initial.altitude_m < initial.terrain_elevation_m + 1.0:
            raise FlightModelError(
                f"cannot start in the air at {initial.altitude_m} m: the ground is at {initial.terrain_elevation_m} m; "
                "give a greater altitude or start on the ground"
            )
