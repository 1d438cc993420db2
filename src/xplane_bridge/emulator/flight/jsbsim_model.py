"""What all the emulator's aircraft share: JSBSim on X-Plane's sphere, and its state in our units.

JSBSim integrates the rigid body and gives atmosphere, aerodynamics (the aircraft's XML), mass and gear. Surfaces,
engines, rotors and stabilisation are Python, stepped once per JSBSim step, so that every fault can be expressed and
every state saved.
"""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, Optional, Sequence, TypeVar

import jsbsim

from xplane_bridge.emulator.flight.actuators import SurfaceSet
from xplane_bridge.emulator.flight.contacts import Contacts, LandingGear
from xplane_bridge.emulator.flight.flight_model import (
    MAX_STEP_S,
    MAX_SUBSTEP_S,
    Controls,
    EngineState,
    FlightModelError,
    InitialState,
    ModelInfo,
    ModelState,
    SurfaceSpec,
)
from xplane_bridge.emulator.flight.jsbsim_state import (
    AIR_PROPERTIES,
    INCH_M,
    LOADS,
    POUND_KG,
    PSF_PA,
    RANKINE_K,
    SLUG_FT3_KG_M3,
    Properties,
    StateReader,
    missing_gravity,
    new_jsbsim,
    start_motion,
    substeps,
)
from xplane_bridge.emulator.flight.limits import (
    check_atmosphere,
    check_fuel,
    check_payload,
    check_turbulence,
    opened_situation,
    payload_place,
)
from xplane_bridge.emulator.flight.rotors import Rotor, sum_loads
from xplane_bridge.emulator.flight.turbulence import DrydenTurbulence
from xplane_bridge.units import FOOT_M

SITUATION_VERSION = 3
#: Height below which contact with the ground is looked for.
CRASH_WATCH_M = 20.0
#: How deep in the ground the lowest point of a placed aircraft may be: the travel of its springs.
DEEPEST_PLACE_M = 0.25

_ROOT = Path(__file__).resolve().parents[1]  # holds aircraft/
_T = TypeVar("_T")


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
    #: How far ahead of and behind the reference point the payload can be put.
    payload_reach_m: float = 2.0
    gear_time_s: float = 6.0
    #: True airspeeds of a start in the air that names none, the most usual first.
    usual_speeds_mps: tuple[float, ...] = ()
    #: Below this height JSBSim runs this often per step: a light aircraft on stiff legs needs finer steps.
    contact_height_m: float = 0.0
    contact_runs: int = 1

    def __init__(self, seed: int = 0) -> None:
        self._wind = [0.0, 0.0, 0.0]
        self._gusts = [0.0, 0.0, 0.0]
        self._turbulence = DrydenTurbulence(seed)
        self._atmosphere = (0.0, 101325.0)
        self._terrain_m = 0.0
        self._loaded_fuel_kg = list(self.default_fuel_kg)
        self._fuel_kg = list(self._loaded_fuel_kg)
        self._payload_kg = self.default_payload_kg
        self._payload_aft_m = 0.0
        self._trimmed = self._flown = Controls()
        self.state = ModelState()
        self._start_jsbsim()

    # ---- set-up

    def _start_jsbsim(self) -> None:
        """A fresh JSBSim, so that no flight inherits anything from the one before."""
        self._fdm = fdm = new_jsbsim(_ROOT, self.info.name)
        self._fdm_step = MAX_SUBSTEP_S
        fdm.set_dt(MAX_SUBSTEP_S)
        self._find_properties(Properties(fdm.get_property_manager()))
        self._surface_set = SurfaceSet(self.surfaces)
        self._time = 0.0
        self._crashed = False
        self._gravity_force = (0.0, 0.0, 0.0)
        self._rotors: list[Rotor] = []
        state = ModelState()
        state.surfaces_deg = {spec.name: 0.0 for spec in self.surfaces}
        state.engines = [EngineState() for _ in range(self.info.engine_count)]
        state.gear = self._contacts.new_states()
        self.state = state
        self._build()
        self._apply_loading()
        self._apply_atmosphere()
        self._apply_wind()

    def _find_properties(self, properties: Properties) -> None:
        getter, setter = properties.getter, properties.setter
        self._reader = StateReader(properties)
        self._height = getter("position/h-sl-ft")
        self._agl = getter("position/h-agl-ft")
        self._roll = getter("attitude/phi-rad")
        self._pitch = getter("attitude/theta-rad")
        self._heading = getter("attitude/psi-rad")
        self._alpha = getter("aero/alpha-rad")
        self._airspeed = getter("velocities/vt-fps")
        self._mass = getter("inertia/mass-slugs")
        self._pressure = getter("atmosphere/P-psf")
        self._temperature = getter("atmosphere/T-R")
        self._air_getters = [getter(path) for path in AIR_PROPERTIES]
        self._load_setters = [(setter(path), 1.0 / unit) for path, unit in LOADS]
        self._surface_setters = [setter(f"surface/{spec.name}") for spec in self.surfaces]
        # As JSBSim's gust, because starting a motion takes its wind away.
        self._wind_setters = [setter(f"atmosphere/gust-{axis}-fps") for axis in ("north", "east", "down")]
        self._gear = LandingGear(properties, self.gear_time_s if self.info.retractable_gear else 0.0)
        masses = len(self.fuel_capacity_kg) + 1
        self._mass_setters = [setter(f"inertia/pointmass-weight-lbs[{i}]") for i in range(masses)]
        self._payload_aft_setter = setter(f"inertia/pointmass-location-X-inches[{masses - 1}]")
        name = self.info.name
        tree = ElementTree.parse(_ROOT / "aircraft" / name / f"{name}.xml").getroot()
        self._empty_mass_kg = float(tree.findtext("mass_balance/emptywt", "0"))
        self._contacts = Contacts(tree, self.info.gear_names, properties)

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

    def _save_more(self) -> dict[str, Any]:
        raise NotImplementedError

    def _restore_more(self, saved: dict[str, Any]) -> None:
        raise NotImplementedError

    def _start_in_air(self, initial: InitialState, speed: float) -> Controls:
        """Trims at ``speed`` [m/s, true] with running engines."""
        raise NotImplementedError

    def _start_on_ground(self, initial: InitialState) -> Controls:
        raise NotImplementedError

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Starts or stops an engine."""
        raise NotImplementedError

    # ---- flying

    @property
    def trim_controls(self) -> Controls:
        """A copy of the controls that keep the aircraft as ``reset`` left it."""
        return self._trimmed.copy()

    def reset(self, initial: InitialState) -> Controls:
        """Starts a flight."""
        initial.check()
        self._terrain_m = initial.terrain_elevation_m
        self._gusts = [0.0, 0.0, 0.0]
        self._fuel_kg = list(self._loaded_fuel_kg)
        turbulence = self._turbulence.save()
        self._start_jsbsim()
        self._trimmed = self._start_on_ground(initial) if initial.on_ground else self._trim(initial)
        self._turbulence.restore(turbulence)
        self._time = initial.sim_time_s
        self._crashed = False
        self._flown = self._trimmed
        self._read_state(self._trimmed)
        return self.trim_controls

    def _trim(self, initial: InitialState) -> Controls:
        """Starts in the air; without a speed at the first of the usual ones that the air up there allows."""
        speeds = self.usual_speeds_mps if initial.airspeed_mps is None else (initial.airspeed_mps,)
        for speed in speeds:
            try:
                controls = self._start_in_air(initial, speed)
                break
            except FlightModelError:
                if speed == speeds[-1]:
                    raise
        if not initial.engines_running:
            for engine in range(self.info.engine_count):
                self.set_engine_running(engine, False)
        return controls

    def step(self, dt: float, controls: Controls) -> ModelState:
        """Flies on."""
        if not 0.0 < dt <= MAX_STEP_S:
            raise FlightModelError(
                f"step of {dt} s: expected more than 0 and at most {MAX_STEP_S} s; fly longer times in pieces"
            )
        self._surface_set.check(controls)
        self._flown = controls
        try:
            self._fly(dt, controls)
        except jsbsim.BaseError as error:
            raise FlightModelError(f"JSBSim gave up: {error}; reset the flight") from error
        if not math.isfinite(self._height() + self._airspeed()):
            raise FlightModelError("the aircraft's motion is no longer finite: reset the flight")
        self._time += dt
        return self._read_state(controls)

    def _fly(self, dt: float, controls: Controls) -> None:
        count, substep = substeps(dt)
        self._gear.move(dt, controls, math.hypot(self.state.v_north_mps, self.state.v_east_mps))
        self._correct_gravity()
        self._run_steps(count, substep, controls)

    def _run_steps(self, count: int, substep: float, controls: Controls) -> None:
        """The JSBSim steps of a frame."""
        run = self._fdm.run
        for _ in range(count):
            if self._turbulence.intensity_mps > 0.0:
                self._blow(substep)
            self._load(substep, controls)
            runs = 1 if self._agl() * FOOT_M > self.contact_height_m else self.contact_runs
            if abs(substep / runs - self._fdm_step) > 1e-12:
                self._fdm_step = substep / runs
                self._fdm.set_dt(self._fdm_step)
            self._gear.set_struts(self._roll(), self._pitch(), self._agl() * FOOT_M < CRASH_WATCH_M)
            for _ in range(runs):
                run()
            if self._agl() * FOOT_M < CRASH_WATCH_M:
                self._crashed = self._crashed or self._contacts.hit()

    def _load(self, dt: float, controls: Controls) -> None:
        u, v, w, p, q, r, density = [get() for get in self._air_getters]
        self._advance(
            dt, controls, (u * FOOT_M, v * FOOT_M, w * FOOT_M), (p, q, r), max(density * SLUG_FT3_KG_M3, 1e-3)
        )
        self._apply_loads()

    def _outside_air(self) -> tuple[float, float]:
        """Pressure [Pa] and temperature [K]."""
        return self._pressure() * PSF_PA, self._temperature() * RANKINE_K

    def _correct_gravity(self) -> None:
        """X-Plane's gravity is constant, JSBSim's falls off with height: the difference, as a force."""
        self._gravity_force = missing_gravity(self._height() * FOOT_M, self._mass(), self._roll(), self._pitch())

    def _blow(self, dt: float) -> None:
        heading = self._heading()
        speed, agl = self._airspeed() * FOOT_M, self._agl() * FOOT_M
        along, across, down = self._turbulence.step(dt, speed, agl)
        sine, cosine = math.sin(heading), math.cos(heading)
        self._gusts = [along * cosine - across * sine, along * sine + across * cosine, down]
        self._apply_wind()

    def _read_state(self, controls: Controls) -> ModelState:
        s = self.state
        s.sim_time_s, s.terrain_elevation_m = self._time, self._terrain_m
        self._reader.read(s, self._gravity_force)
        s.payload_kg, s.empty_mass_kg = self._payload_kg, self._empty_mass_kg
        s.crashed = self._crashed
        self._fill_parts(s, controls)
        return s

    def _fill_parts(self, s: ModelState, controls: Controls) -> None:
        """What JSBSim does not know of the aircraft's parts: surfaces, tanks, wheels, and the subclass's own."""
        for actuator in self._surface_set.actuators:
            s.surfaces_deg[actuator.spec.name] = actuator.position_deg
        s.fuel_kg = list(self._fuel_kg)
        self._contacts.read(s, self._gear.position, self._gear.steering)
        self._fill_state(s, controls)

    # ---- placing, saving

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
        """Moves the aircraft at once, but not into the ground: it is lifted until its lowest point is on it."""
        s = self.state

        def chosen(new: Optional[_T], old: _T) -> _T:
            return old if new is None else new

        roll, pitch = chosen(roll_rad, s.roll_rad), chosen(pitch_rad, s.pitch_rad)
        # Springs pushed metres into the ground would fling the aircraft away.
        lowest = self._terrain_m + self._contacts.depth(roll, pitch) - DEEPEST_PLACE_M
        self._put(
            (
                chosen(latitude_deg, s.latitude_deg),
                chosen(longitude_deg, s.longitude_deg),
                max(chosen(altitude_m, s.altitude_m), lowest),
            ),
            (roll, pitch, chosen(heading_rad, s.heading_rad)),
            chosen(v_ned_mps, [s.v_north_mps, s.v_east_mps, s.v_down_mps]),
            chosen(pqr_rad_s, [s.p_rad_s, s.q_rad_s, s.r_rad_s]),
        )
        self._crashed = False
        return self._read_state(self._flown)

    def _set_motion(
        self,
        latitude_deg: float,
        longitude_deg: float,
        altitude_m: float,
        euler_rad: Sequence[float],
        v_ned_mps: Sequence[float],
        pqr_rad_s: Sequence[float],
    ) -> None:
        position = (latitude_deg, longitude_deg, altitude_m)
        start_motion(self._fdm, position, euler_rad, v_ned_mps, pqr_rad_s, self._terrain_m)

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
                "fuel": [self._fuel_kg, self._loaded_fuel_kg],
                "payload": self._payload_kg,
                "payload_aft": self._payload_aft_m,
                "gear": self._gear.position,
                "crashed": self._crashed,
                "surfaces": [actuator.save() for actuator in self._surface_set.actuators],
                "rotors": [rotor.save() for rotor in self._rotors],
                "more": self._save_more(),
            }
        ).encode()

    def restore(self, situation: bytes) -> ModelState:
        """Goes on from a saved situation."""
        saved = opened_situation(situation, self.info.name, SITUATION_VERSION)
        self._start_jsbsim()
        self._terrain_m, self._wind, self._gusts = saved["terrain"], list(saved["wind"]), list(saved["gusts"])
        self._turbulence.restore(saved["turbulence"])
        self._atmosphere = tuple(saved["atmosphere"])
        self._fuel_kg, self._loaded_fuel_kg = saved["fuel"]
        self._payload_kg, self._payload_aft_m = saved["payload"], saved["payload_aft"]
        for actuator, values in zip(self._surface_set.actuators, saved["surfaces"]):
            actuator.restore(values)
        for rotor, values in zip(self._rotors, saved["rotors"]):
            rotor.restore(values)
        self._restore_more(saved["more"])
        self._apply_loading()
        self._apply_atmosphere()
        self._apply_wind()
        self._gear.put(saved["gear"])
        self._put(saved["position"], saved["euler"], saved["v_ned"], saved["pqr"])
        self._time, self._crashed = saved["time"], saved["crashed"]
        return self._read_state(self._flown)

    def _put(
        self, position: Sequence[float], euler: Sequence[float], v_ned: Sequence[float], pqr: Sequence[float]
    ) -> None:
        """Sets the motion, with the loads of surfaces and rotors as they are acting from the first instant."""
        latitude_deg, longitude_deg, altitude_m = position
        self._set_motion(latitude_deg, longitude_deg, altitude_m, euler, v_ned, pqr)
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

    def set_turbulence(self, intensity_mps: float, seed: Optional[int] = None) -> None:
        """Dryden turbulence."""
        check_turbulence(intensity_mps)
        self._turbulence.start(intensity_mps, seed)
        if intensity_mps == 0.0:
            self._gusts = [0.0, 0.0, 0.0]
            self._apply_wind()

    def set_atmosphere(self, temperature_offset_k: float = 0.0, sea_level_pressure_pa: float = 101325.0) -> None:
        """The day."""
        check_atmosphere(temperature_offset_k, sea_level_pressure_pa)
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

    def set_loading(
        self,
        fuel_kg: Optional[Sequence[float]] = None,
        payload_kg: Optional[float] = None,
        cg_aft_m: Optional[float] = None,
    ) -> None:
        """Fuel, payload, balance."""
        if fuel_kg is not None:
            check_fuel(fuel_kg, self.fuel_capacity_kg)
        if payload_kg is not None:
            check_payload(payload_kg, self.max_payload_kg)
        payload = self._payload_kg if payload_kg is None else payload_kg
        fuel = self._fuel_kg if fuel_kg is None else list(fuel_kg)
        aft = self._payload_aft_m
        if cg_aft_m is not None:
            aft = payload_place(cg_aft_m, self._empty_mass_kg + payload, payload, self.payload_reach_m)
        if fuel_kg is not None:
            self._loaded_fuel_kg = list(fuel)
        self._fuel_kg, self._payload_kg, self._payload_aft_m = fuel, payload, aft
        self._apply_loading()
        state = self.state  # shown at once, also while the flight stands
        state.fuel_kg, state.payload_kg = list(fuel), payload
        state.mass_kg = self._empty_mass_kg + sum(fuel) + payload
        state.cg_forward_m = -aft * payload / state.mass_kg

    def _apply_loading(self) -> None:
        for setter, mass in zip(self._mass_setters, [*self._fuel_kg, self._payload_kg]):
            setter(mass / POUND_KG)
        self._payload_aft_setter(self._payload_aft_m / INCH_M)
