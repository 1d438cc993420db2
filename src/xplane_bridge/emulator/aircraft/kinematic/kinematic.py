"""A flight model without dynamics: coordinated flight from the positions of the surfaces.

Deterministic and fast: for tests of the wire and for machines without JSBSim (`--model kinematic`). It is no aircraft:
bank follows the ailerons as a rate, the flight path follows the elevator as a rate, speed follows thrust minus a
quadratic drag. What it does keep is consistency: rates are those of its attitude, specific force is acceleration minus
gravity, air velocity is ground velocity minus wind.
"""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from typing import Dict, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import (
    MAX_ENGINES,
    MAX_SUBSTEP_S,
    Controls,
    EngineFault,
    EngineState,
    FlightModelError,
    GearState,
    InitialState,
    ModelInfo,
    ModelState,
    Side,
    SurfaceFaultKind,
    SurfaceKind,
    SurfaceSpec,
)
from xplane_bridge.units import EARTH_RADIUS_M, GRAVITY_MPS2

_ENGINES = 2
_LIMIT_DEG = 20.0
_SURFACE_RATE_DEG_S = 120.0
_ROLL_RATE_DEG_S = 45.0
_PATH_RATE_DEG_S = 8.0
_MAX_THRUST_MPS2 = 4.0
_DRAG_PER_V2 = 4.0 * 0.6 / 70.0**2  # 60 % throttle holds 70 m/s
_CRUISE_MPS = 70.0
_LIFT_OFF_MPS = 38.0
_GROUND_HEIGHT_M = 1.2
_MAX_RPM = 2700.0
_MAX_POWER_W = 150e3
_SEA_LEVEL_DENSITY = 1.225


def _wing(name: str, kind: SurfaceKind, side: Side, low: float = -_LIMIT_DEG, high: float = _LIMIT_DEG) -> SurfaceSpec:
    return SurfaceSpec(name, kind, side, low, high, _SURFACE_RATE_DEG_S)


class KinematicModel:
    """See the module's text. Implements `flight_model.FlightModel`."""

    info = ModelInfo(
        name="kinematic",
        description="Coordinated flight without dynamics",
        icao="KINE",
        engine_count=_ENGINES,
        propeller_direction=(1, 1),
        tank_count=2,
        gear_names=("nose", "left", "right"),
        retractable_gear=True,
        flap_detents=4,
        maximum_mass_kg=1500.0,
        maximum_power_w=_MAX_POWER_W,
        maximum_rpm=_MAX_RPM,
        never_exceed_mps=120.0,
        stall_mps=30.0,
        wing_span_m=12.0,
        length_m=9.0,
        standing_height_m=_GROUND_HEIGHT_M,
        eye_forward_m=1.0,
        eye_down_m=-0.5,
    )
    surfaces: Tuple[SurfaceSpec, ...] = (
        _wing("wing2l_ail1", SurfaceKind.AILERON, Side.LEFT),
        _wing("wing2r_ail1", SurfaceKind.AILERON, Side.RIGHT),
        _wing("wing1l_fla1", SurfaceKind.FLAP, Side.LEFT, 0.0, 40.0),
        _wing("wing1r_fla1", SurfaceKind.FLAP, Side.RIGHT, 0.0, 40.0),
        _wing("hstab1_elv1", SurfaceKind.ELEVATOR, Side.LEFT),
        _wing("hstab2_elv1", SurfaceKind.ELEVATOR, Side.RIGHT),
        _wing("vstab1_rud1", SurfaceKind.RUDDER, Side.CENTRE),
    )

    def __init__(self, seed: int = 0) -> None:
        self._specs = {spec.name: spec for spec in self.surfaces}
        self._random = np.random.default_rng(seed)
        self._wind = np.zeros(3)
        self._turbulence_mps = 0.0
        self._gust = np.zeros(3)
        self._temperature_offset_k = 0.0
        self._sea_level_pressure_pa = 101325.0
        self._terrain_m = 0.0
        self._fuel_kg = [120.0, 120.0]
        self._payload_kg = 160.0
        self._running = [True] * _ENGINES
        self._surface_deg: Dict[str, float] = {}
        self.state = ModelState()
        self.trim_controls = Controls()
        self.reset(InitialState())

    def reset(self, initial: InitialState) -> Controls:
        """Starts a flight."""
        self._terrain_m = initial.terrain_elevation_m
        self._running = [initial.engines_running] * _ENGINES
        self._surface_deg = {spec.name: 0.0 for spec in self.surfaces}
        self._lat, self._lon = initial.latitude_deg, initial.longitude_deg
        self._bank = self._path = 0.0
        self._track = math.radians(initial.heading_deg)
        self._time = initial.sim_time_s
        if initial.on_ground:
            self._alt, self._speed = self._terrain_m + _GROUND_HEIGHT_M, 0.0
        else:
            self._alt = initial.altitude_m
            self._speed = _CRUISE_MPS if initial.airspeed_mps is None else initial.airspeed_mps
        controls = Controls()
        if initial.on_ground:
            controls.parking_brake = 1.0
        else:
            lever = min(max(_DRAG_PER_V2 * self._speed**2 / _MAX_THRUST_MPS2, 0.0), 1.0)
            controls.throttle = [lever] * _ENGINES + [0.0] * (MAX_ENGINES - _ENGINES)
        self.trim_controls = self._flown = controls
        self.state = ModelState()
        self._flap = self._tilt = 0.0
        self._gear = 1.0
        self._previous: Optional[Tuple[np.ndarray, np.ndarray]] = None
        self._publish(MAX_SUBSTEP_S, controls, (0.0, 0.0, 0.0))
        return controls.copy()

    def step(self, dt: float, controls: Controls) -> ModelState:
        """Flies on."""
        if not dt > 0.0:
            raise FlightModelError(f"step of {dt} s; expected more than 0")
        self._flown = controls
        count = max(1, math.ceil(dt / MAX_SUBSTEP_S - 1e-9))
        for _ in range(count):
            self._substep(dt / count, controls)
        return self.state

    def place(
        self,
        latitude_deg: Optional[float] = None,
        longitude_deg: Optional[float] = None,
        altitude_m: Optional[float] = None,
        roll_rad: Optional[float] = None,
        pitch_rad: Optional[float] = None,
        heading_rad: Optional[float] = None,
        v_ned_mps: Optional[Sequence[float]] = None,
        pqr_rad_s: Optional[Sequence[float]] = None,  # noqa: ARG002 (the interface has it)
    ) -> ModelState:
        """Moves the aircraft; rates follow from its path, so `pqr_rad_s` is not used."""
        self._lat = self._lat if latitude_deg is None else latitude_deg
        self._lon = self._lon if longitude_deg is None else longitude_deg
        self._alt = self._alt if altitude_m is None else altitude_m
        if v_ned_mps is not None:
            air = np.asarray(v_ned_mps, dtype=float) - self._wind
            self._speed = float(np.linalg.norm(air))
            if self._speed > 1.0:
                self._path = math.asin(-air[2] / self._speed)
                self._track = math.atan2(air[1], air[0])
        if roll_rad is not None or pitch_rad is not None or heading_rad is not None:
            present = (self.state.roll_rad, self.state.pitch_rad, self.state.heading_rad)
            wanted = (p if a is None else a for a, p in zip((roll_rad, pitch_rad, heading_rad), present))
            self._turn_to(earth.body_to_level(*map(math.degrees, wanted)))
        self._previous = None
        s = self.state
        self._publish(MAX_SUBSTEP_S, self._flown, (s.roll_ratio, s.pitch_ratio, s.yaw_ratio))
        return s

    def save(self) -> bytes:
        """Levers and handles, for a situation."""
        names = [name for name in vars(self) if name not in ("_specs",)]
        return pickle.dumps(("kinematic", 1, {name: vars(self)[name] for name in names}))

    def restore(self, situation: bytes) -> ModelState:
        """Puts back what `save` gave."""
        try:
            kind, version, values = pickle.loads(situation)
        except Exception as error:
            raise FlightModelError(f"this is no saved situation: {error}") from None
        if (kind, version) != ("kinematic", 1):
            raise FlightModelError(f"a situation of {kind} version {version}; expected kinematic version 1")
        self.__dict__.update(values)
        return self.state

    def set_wind(self, north_mps: float, east_mps: float, down_mps: float = 0.0) -> None:
        """Sets the wind that blows at every height."""
        self._wind = np.array((north_mps, east_mps, down_mps))

    def set_turbulence(self, intensity_mps: float, seed: Optional[int] = None) -> None:
        """Sets the standard deviation of the vertical gust [m/s]."""
        self._turbulence_mps = intensity_mps
        if seed is not None:
            self._random = np.random.default_rng(seed)

    def set_atmosphere(self, temperature_offset_k: float = 0.0, sea_level_pressure_pa: float = 101325.0) -> None:
        """Sets the day."""
        self._temperature_offset_k = temperature_offset_k
        self._sea_level_pressure_pa = sea_level_pressure_pa

    def set_terrain(self, elevation_m: float) -> None:
        """Sets the height of the ground."""
        self._terrain_m = elevation_m

    def set_loading(
        self,
        fuel_kg: Optional[Sequence[float]] = None,
        payload_kg: Optional[float] = None,
        cg_aft_m: Optional[float] = None,
    ) -> None:
        """Sets fuel and payload; the centre of gravity stays where it is."""
        if cg_aft_m is not None:
            raise FlightModelError("the kinematic model has no centre of gravity to move")
        if fuel_kg is not None:
            self._fuel_kg = [max(0.0, float(x)) for x in fuel_kg][:2]
        if payload_kg is not None:
            self._payload_kg = max(0.0, float(payload_kg))
        self.state.fuel_kg, self.state.payload_kg = list(self._fuel_kg), self._payload_kg  # shown at once

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Starts or stops an engine."""
        if not 0 <= engine < _ENGINES:
            raise FlightModelError(f"engine {engine}; the kinematic model has engines 0 and 1")
        self._running[engine] = running

    def _turn_to(self, attitude: np.ndarray) -> None:
        """Takes the path of an attitude: here the nose stands above the path by the angle of attack alone."""
        self._publish_air(self._air_velocity())
        for _ in range(10):  # the angle depends on the bank
            path = attitude @ earth.body_to_level(0.0, math.degrees(self._alpha()), 0.0).T
            self._bank, self._path, self._track = map(math.radians, earth.euler_degrees(path))

    def _alpha(self) -> float:
        if self._alt <= self._terrain_m + _GROUND_HEIGHT_M + 1e-6:
            return 0.0
        lift = 1.0 / max(math.cos(self._bank), 0.2)
        weight = 1400.0 * GRAVITY_MPS2
        return min(lift * weight / max(self.state.dynamic_pressure_pa, 200.0) / 90.0, 0.3)

    # --- motion -------------------------------------------------------------------------------------------------------

    def _substep(self, dt: float, controls: Controls) -> None:
        self._move_surfaces(dt, controls)
        deg = self._surface_deg
        roll = (deg["wing2l_ail1"] - deg["wing2r_ail1"]) / (2 * _LIMIT_DEG)
        pitch = -(deg["hstab1_elv1"] + deg["hstab2_elv1"]) / (2 * _LIMIT_DEG)
        yaw = deg["vstab1_rud1"] / _LIMIT_DEG
        throttle = [self._throttle(i, controls) for i in range(_ENGINES)]
        thrust = _MAX_THRUST_MPS2 * sum(throttle) / _ENGINES
        g = GRAVITY_MPS2
        on_ground = self._alt <= self._terrain_m + _GROUND_HEIGHT_M + 1e-6
        rate = thrust - _DRAG_PER_V2 * self._speed**2 - g * math.sin(self._path)
        if on_ground:
            brakes = max(controls.parking_brake, 0.5 * (controls.brake_left + controls.brake_right))
            rate -= min(6.0 * brakes + 0.2, self._speed / dt + max(rate, 0.0))
            self._bank = 0.0
            self._track += 0.3 * yaw * dt * min(self._speed / 5.0, 1.0)
            lifting = pitch if self._speed > _LIFT_OFF_MPS else 0.0
            self._path = max(0.0, self._path + math.radians(_PATH_RATE_DEG_S) * lifting * dt)
        else:
            self._bank += math.radians(_ROLL_RATE_DEG_S) * roll * dt
            self._bank = math.remainder(self._bank, 2 * math.pi)
            self._path += math.radians(_PATH_RATE_DEG_S) * pitch * dt
            self._path = min(max(self._path, -1.2), 1.2)
            turn = g * math.sin(self._bank) / (max(self._speed, 10.0) * max(abs(math.cos(self._bank)), 0.2))
            self._track += turn * dt
        self._speed = max(0.0, self._speed + rate * dt)
        if self._turbulence_mps > 0.0:  # first-order coloured gusts, a second long
            noise = self._random.standard_normal(3) * self._turbulence_mps * math.sqrt(2 * dt)
            self._gust += -self._gust * dt + noise
        else:
            self._gust = np.zeros(3)
        self._time += dt
        self._flap += min(max(controls.flap_request - self._flap, -0.2 * dt), 0.2 * dt)
        if not controls.gear_fault:
            self._gear += min(max(float(controls.gear_down) - self._gear, -0.25 * dt), 0.25 * dt)
        self._tilt += min(max(controls.thrust_vector - self._tilt, -0.2 * dt), 0.2 * dt)
        burnt = sum(throttle) * 0.008 * dt
        self._fuel_kg = [max(0.0, kg - burnt / len(self._fuel_kg)) for kg in self._fuel_kg]
        self._travel(dt)
        self._publish(dt, controls, (roll, pitch, yaw))

    def _move_surfaces(self, dt: float, controls: Controls) -> None:
        roll = controls.roll + controls.trim_roll
        pitch = controls.pitch + controls.trim_pitch
        yaw = controls.yaw + controls.trim_yaw
        wanted = {
            "wing2l_ail1": roll * _LIMIT_DEG,
            "wing2r_ail1": -roll * _LIMIT_DEG,
            "wing1l_fla1": self._flap * 40.0,
            "wing1r_fla1": self._flap * 40.0,
            "hstab1_elv1": -pitch * _LIMIT_DEG,
            "hstab2_elv1": -pitch * _LIMIT_DEG,
            "vstab1_rud1": yaw * _LIMIT_DEG,
        }
        if controls.override_surfaces:
            wanted = {name: controls.surface_deg.get(name, self._surface_deg[name]) for name in wanted}
        for name, spec in self._specs.items():
            target, rate = min(max(wanted[name], spec.minimum_deg), spec.maximum_deg), spec.rate_deg_s
            fault = controls.surface_faults.get(name)
            if fault is not None:
                if fault.kind is SurfaceFaultKind.STUCK:
                    target = self._surface_deg[name] if fault.value is None else fault.value
                elif fault.kind in (SurfaceFaultKind.CENTRED, SurfaceFaultKind.GONE, SurfaceFaultKind.FLOATING):
                    target = 0.0
                elif fault.kind is SurfaceFaultKind.HARD_OVER_UP:
                    target = spec.fully_up_deg
                elif fault.kind is SurfaceFaultKind.HARD_OVER_DOWN:
                    target = spec.fully_down_deg
                elif fault.kind is SurfaceFaultKind.REDUCED:
                    target *= fault.value or 0.0
                elif fault.kind is SurfaceFaultKind.SLOW:
                    rate *= fault.value or 0.0
            if controls.override_surfaces and fault is None:
                self._surface_deg[name] = target  # X-Plane takes written deflections at once
            else:
                step = rate * dt
                self._surface_deg[name] += min(max(target - self._surface_deg[name], -step), step)

    def _throttle(self, engine: int, controls: Controls) -> float:
        if not self._running[engine] or controls.engine_faults[engine] is not EngineFault.NONE:
            return 0.0
        value = controls.throttle_use[engine] if controls.override_throttles else controls.throttle[engine]
        return min(max(value, 0.0), 1.0)

    def _air_velocity(self) -> np.ndarray:
        c = math.cos(self._path)
        return self._speed * np.array((c * math.cos(self._track), c * math.sin(self._track), -math.sin(self._path)))

    def _travel(self, dt: float) -> None:
        air = self._air_velocity()
        on_ground = self._alt <= self._terrain_m + _GROUND_HEIGHT_M + 1e-6 and air[2] >= 0.0
        north, east, down = map(float, air if on_ground else air + self._wind + self._gust)
        radius = EARTH_RADIUS_M + self._alt
        self._lat += math.degrees(north / radius) * dt
        self._lon = earth.wrap_half_turn(
            self._lon + math.degrees(east / (radius * math.cos(math.radians(self._lat)))) * dt
        )
        self._alt -= down * dt
        floor = self._terrain_m + _GROUND_HEIGHT_M
        if self._alt < floor:
            self._alt = floor
            self._path = max(self._path, 0.0)

    # --- output -------------------------------------------------------------------------------------------------------

    def _publish(self, dt: float, controls: Controls, command: Tuple[float, float, float]) -> None:
        s = self.state
        floor = self._terrain_m + _GROUND_HEIGHT_M
        on_ground = self._alt <= floor + 1e-6
        air = self._air_velocity()
        wind = self._wind + self._gust
        ground = air if on_ground else air + wind
        self._publish_air(air if not on_ground else air - wind)
        # body axes: the air path turned by bank, then pitched up by the angle of attack
        alpha = self._alpha()
        path = earth.body_to_level(math.degrees(self._bank), math.degrees(self._path), math.degrees(self._track))
        rotation = path @ earth.body_to_level(0.0, math.degrees(alpha), 0.0)
        roll, pitch, heading = earth.euler_degrees(rotation)
        rates = np.zeros(3)
        acceleration = np.zeros(3)
        if self._previous is not None:
            before, velocity = self._previous
            delta = before.T @ rotation
            rates = np.array((delta[2, 1] - delta[1, 2], delta[0, 2] - delta[2, 0], delta[1, 0] - delta[0, 1])) / (
                2 * dt
            )
            acceleration = (ground - velocity) / dt
        old = np.array((s.p_rad_s, s.q_rad_s, s.r_rad_s))
        s.p_dot_rad_s2, s.q_dot_rad_s2, s.r_dot_rad_s2 = map(float, (rates - old) / dt)
        self._previous = (rotation, ground)
        specific = rotation.T @ (acceleration - np.array((0.0, 0.0, GRAVITY_MPS2)))
        body = rotation.T @ ground

        s.sim_time_s = self._time
        s.latitude_deg, s.longitude_deg, s.altitude_m = self._lat, self._lon, self._alt
        s.terrain_elevation_m, s.agl_m = self._terrain_m, self._alt - self._terrain_m
        s.roll_rad, s.pitch_rad, s.heading_rad = math.radians(roll), math.radians(pitch), math.radians(heading)
        s.quaternion = earth.quaternion(rotation)
        s.p_rad_s, s.q_rad_s, s.r_rad_s = map(float, rates)
        s.v_north_mps, s.v_east_mps, s.v_down_mps = map(float, ground)
        s.u_mps, s.v_mps, s.w_mps = map(float, body)
        s.specific_force_x_mps2, s.specific_force_y_mps2, s.specific_force_z_mps2 = map(float, specific)
        s.acceleration_north_mps2, s.acceleration_east_mps2, s.acceleration_down_mps2 = map(float, acceleration)
        s.wind_north_mps, s.wind_east_mps, s.wind_down_mps = map(float, wind)
        s.alpha_dot_rad_s = (alpha - s.alpha_rad) / dt
        relative = rotation.T @ (ground - wind)
        speed = float(np.linalg.norm(relative))
        s.alpha_rad = math.atan2(relative[2], relative[0]) if speed > 1.0 else 0.0
        s.beta_rad = math.asin(min(max(relative[1] / speed, -1.0), 1.0)) if speed > 1.0 else 0.0
        s.stall_warning = not on_ground and s.true_airspeed_mps < self.info.stall_mps
        s.surfaces_deg = dict(self._surface_deg)
        s.roll_ratio, s.pitch_ratio, s.yaw_ratio = command
        s.flap_ratio, s.speed_brake_ratio = self._flap, max(controls.speedbrake, 0.0)
        s.thrust_vector_ratio = self._tilt
        s.engines = [self._engine(i, controls) for i in range(_ENGINES)]
        s.fuel_kg = list(self._fuel_kg)
        s.payload_kg, s.empty_mass_kg = self._payload_kg, 1000.0
        s.mass_kg = 1000.0 + self._payload_kg + sum(self._fuel_kg)
        s.lift_n = -s.mass_kg * s.specific_force_z_mps2
        s.drag_n = s.mass_kg * _DRAG_PER_V2 * self._speed**2
        load = s.mass_kg * GRAVITY_MPS2 / 3.0 if on_ground else 0.0
        s.gear = [GearState(name, self._gear, on_ground, 0.0, load, 0.0) for name in self.info.gear_names]
        s.on_ground_any = s.on_ground_all = on_ground

    def _publish_air(self, air: np.ndarray) -> None:
        s = self.state
        s.temperature_k = max(288.15 - 0.0065 * self._alt, 216.65) + self._temperature_offset_k
        s.pressure_pa = self._sea_level_pressure_pa * max(1.0 - 2.25577e-5 * self._alt, 0.1) ** 5.25588
        s.pressure_altitude_m = (1.0 - (s.pressure_pa / 101325.0) ** (1.0 / 5.25588)) / 2.25577e-5
        s.air_density_kg_m3 = s.pressure_pa / (287.0528 * s.temperature_k)
        s.speed_of_sound_mps = math.sqrt(1.4 * 287.0528 * s.temperature_k)
        s.true_airspeed_mps = float(np.linalg.norm(air))
        s.mach = s.true_airspeed_mps / s.speed_of_sound_mps
        s.dynamic_pressure_pa = 0.5 * s.air_density_kg_m3 * s.true_airspeed_mps**2
        s.equivalent_airspeed_mps = s.true_airspeed_mps * math.sqrt(s.air_density_kg_m3 / _SEA_LEVEL_DENSITY)
        impact = s.pressure_pa * ((1.0 + 0.2 * s.mach**2) ** 3.5 - 1.0)
        s.calibrated_airspeed_mps = 340.294 * math.sqrt(5.0 * ((impact / 101325.0 + 1.0) ** (2.0 / 7.0) - 1.0))

    def _engine(self, index: int, controls: Controls) -> EngineState:
        throttle = self._throttle(index, controls)
        alive = self._running[index] and controls.engine_faults[index] is EngineFault.NONE
        rpm = (700.0 + (_MAX_RPM - 700.0) * throttle) if alive else 0.0
        power = _MAX_POWER_W * throttle
        return replace(
            EngineState(),
            running=alive,
            throttle=throttle,
            rpm=rpm,
            prop_rpm=rpm,
            power_w=power,
            thrust_n=self.state.mass_kg * _MAX_THRUST_MPS2 * throttle / _ENGINES,
            torque_nm=power / (rpm * math.pi / 30.0) if rpm > 0.0 else 0.0,
            fuel_flow_kg_s=0.008 * throttle,
            manifold_pressure_pa=35e3 + 60e3 * throttle if alive else self.state.pressure_pa,
            exhaust_gas_temperature_k=700.0 + 350.0 * throttle if alive else self.state.temperature_k,
            cylinder_head_temperature_k=400.0 + 60.0 * throttle if alive else self.state.temperature_k,
            oil_temperature_k=350.0 + 15.0 * throttle if alive else self.state.temperature_k,
            oil_pressure_pa=3e5 + 1e5 * throttle if alive else 0.0,
            blade_pitch_deg=15.0,
            nacelle_deg=90.0 * self._tilt,
        )
