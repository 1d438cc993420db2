"""The light twin. Aerodynamics, mass and gear: aircraft/fixed_wing/fixed_wing.xml."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from xplane_bridge import compiled
from xplane_bridge.emulator.flight import trim
from xplane_bridge.emulator.flight.actuators import asymmetric, sided
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    EngineFault,
    FlightModelError,
    InitialState,
    ModelInfo,
    ModelState,
    Side,
    SurfaceKind,
)
from xplane_bridge.emulator.flight.jsbsim_model import JsbsimModel
from xplane_bridge.emulator.flight.jsbsim_state import SLUG_FT3_KG_M3, substeps
from xplane_bridge.emulator.flight.rotors import Governor, GovernorSpec, PistonEngine, PistonSpec, Rotor, RotorSpec
from xplane_bridge.units import EARTH_RADIUS_M, FOOT_M

AILERON_UP_DEG, AILERON_DOWN_DEG = 25.0, 15.0
ELEVATOR_UP_DEG, ELEVATOR_DOWN_DEG = 18.0, 13.0
RUDDER_DEG = 27.0
FLAP_DEG = 42.0
SPEED_BRAKE_DEG = 60.0
#: What full trim adds to the deflection that the stick asks for.
AILERON_TRIM_DEG, ELEVATOR_TRIM_DEG, RUDDER_TRIM_DEG = 4.5, 12.6, 10.8

STALL_WARNING_RAD = math.radians(12.5)
CRUISE_PROPELLER = 0.75
#: Height of the centre of gravity and pitch attitude of the aircraft standing on its wheels, where the settling starts.
STANDING_HEIGHT_M, STANDING_PITCH_RAD = 1.14, -0.01

#: Three blades, 1.9 m; solidity and pitch range as usual for this power (our own estimate).
PROPELLER = {
    "forward_m": 1.1,
    "down_m": 0.05,
    "radius_m": 0.95,
    "blade_area_m2": 0.31,
    "inertia_kg_m2": 1.6,
    "edgewise_drag": 0.05,
}
GOVERNOR = GovernorSpec(minimum_rpm=1400.0, maximum_rpm=2700.0, fine_deg=13.0, coarse_deg=38.0)
ENGINE = PistonSpec(rated_power_w=134.2e3, rated_rpm=2700.0)
ENGINE_ARM_M = 1.7


class FixedWing(JsbsimModel):
    """Twin with counter-rotating constant-speed propellers, every surface driven on its own, nothing stabilised."""

    info = ModelInfo(
        name="fixed_wing",
        description="Light twin",
        icao="DA62",
        engine_count=2,
        propeller_direction=(1, -1),
        tank_count=2,
        gear_names=("nose", "left_main", "right_main"),
        retractable_gear=True,
        autopilot=True,
        flap_detents=3,
        maximum_mass_kg=2340.0,
        maximum_power_w=ENGINE.rated_power_w,
        maximum_rpm=ENGINE.rated_rpm,
        never_exceed_mps=105.0,
        stall_mps=35.0,
        wing_span_m=14.55,
        length_m=9.19,
        eye_forward_m=0.6,
        eye_down_m=-0.65,
        standing_height_m=1.131,
        trim_deg=(("aileron", AILERON_TRIM_DEG), ("elevator", ELEVATOR_TRIM_DEG), ("rudder", RUDDER_TRIM_DEG)),
    )
    surfaces = (
        sided("wing2l_ail1", SurfaceKind.AILERON, Side.LEFT, AILERON_UP_DEG, AILERON_DOWN_DEG, 70.0),
        sided("wing2r_ail1", SurfaceKind.AILERON, Side.RIGHT, AILERON_UP_DEG, AILERON_DOWN_DEG, 70.0),
        sided("hstab1_elv1", SurfaceKind.ELEVATOR, Side.LEFT, ELEVATOR_UP_DEG, ELEVATOR_DOWN_DEG, 60.0),
        sided("hstab2_elv1", SurfaceKind.ELEVATOR, Side.RIGHT, ELEVATOR_UP_DEG, ELEVATOR_DOWN_DEG, 60.0),
        sided("vstab1_rud1", SurfaceKind.RUDDER, Side.CENTRE, RUDDER_DEG, RUDDER_DEG, 60.0),
        sided("wing1l_fla1", SurfaceKind.FLAP, Side.LEFT, 0.0, FLAP_DEG, 7.0),
        sided("wing1r_fla1", SurfaceKind.FLAP, Side.RIGHT, 0.0, FLAP_DEG, 7.0),
        sided("wing1l_spo1", SurfaceKind.SPEED_BRAKE, Side.LEFT, 0.0, SPEED_BRAKE_DEG, 60.0),
        sided("wing1r_spo1", SurfaceKind.SPEED_BRAKE, Side.RIGHT, 0.0, SPEED_BRAKE_DEG, 60.0),
    )
    fuel_capacity_kg = (125.0, 125.0)
    default_fuel_kg = (100.0, 100.0)
    default_payload_kg = 210.0
    max_payload_kg = 500.0
    usual_speeds_mps = (75.0, 66.0, 60.0)

    def _build(self) -> None:
        self._rotors = [
            Rotor(RotorSpec(right_m=side * ENGINE_ARM_M, direction=direction, **PROPELLER), GOVERNOR.fine_deg)
            for side, direction in zip((-1.0, 1.0), self.info.propeller_direction)
        ]
        self._governors = [Governor(GOVERNOR) for _ in self._rotors]
        self._engines = [PistonEngine(ENGINE) for _ in self._rotors]
        self._commands = (0.0, 0.0, 0.0)
        # The same frames in C++, where they have been built: the same bits, some times as fast.
        self._loop = None if compiled.core is None else compiled.core.TwinLoop(self)

    # ---- one step

    def _advance(
        self, dt: float, controls: Controls, air: Sequence[float], rates: Sequence[float], density: float
    ) -> None:
        alpha_deg = math.degrees(self._alpha())
        self._surface_set.step(self._mix(controls), dt, controls, alpha_deg)
        pressure, temperature = self._outside_air()
        for i, (engine, governor, rotor) in enumerate(zip(self._engines, self._governors, self._rotors)):
            throttle = controls.throttle_use[i] if controls.override_throttles else controls.throttle[i]
            fault = controls.engine_faults[i]
            governor.step(dt, rotor, controls.propeller[i])
            rotor.air_loads(dt, air, rates, density)
            fuel = self._fuel_kg[i] > 0.0 and fault is EngineFault.NONE
            torque = engine.torque(dt, rotor.omega, throttle, controls.mixture[i], pressure, temperature, fuel)
            if fault is EngineFault.SEIZED:
                torque = rotor.torque - rotor.spec.inertia_kg_m2 * rotor.omega / dt
            rotor.turn(dt, torque, rates)
            self._fuel_kg[i] = max(self._fuel_kg[i] - engine.fuel_flow * dt, 0.0)

    def _fly(self, dt: float, controls: Controls) -> None:
        if self._loop is None:
            super()._fly(dt, controls)
            self._apply_loading()
        else:
            self._loop.fly(self, *substeps(dt), dt, controls)

    def _fill_parts(self, s: ModelState, controls: Controls) -> None:
        if self._loop is None:
            super()._fill_parts(s, controls)
        else:
            self._loop.fill(self, s, controls)

    def _mix(self, controls: Controls) -> Sequence[float]:
        """Where the controls want the surfaces, in the order of ``surfaces`` [deg]."""
        roll = min(max(controls.roll, -1.0), 1.0)
        pitch = min(max(controls.pitch, -1.0), 1.0)
        yaw = min(max(controls.yaw, -1.0), 1.0)
        self._commands = (roll, pitch, yaw)
        aileron_trim = AILERON_TRIM_DEG * controls.trim_roll
        elevator_trim = ELEVATOR_TRIM_DEG * controls.trim_pitch
        elevator = asymmetric(-pitch, ELEVATOR_UP_DEG, ELEVATOR_DOWN_DEG) - elevator_trim
        flap = FLAP_DEG * controls.flap_request
        brake = SPEED_BRAKE_DEG * controls.speedbrake
        return (
            asymmetric(roll, AILERON_UP_DEG, AILERON_DOWN_DEG) + aileron_trim,
            asymmetric(-roll, AILERON_UP_DEG, AILERON_DOWN_DEG) - aileron_trim,
            elevator,
            elevator,
            RUDDER_DEG * yaw + RUDDER_TRIM_DEG * controls.trim_yaw,
            flap,
            flap,
            brake,
            brake,
        )

    def _fill_state(self, state: ModelState, controls: Controls) -> None:
        state.roll_ratio, state.pitch_ratio, state.yaw_ratio = self._commands
        surfaces = state.surfaces_deg
        state.flap_ratio = 0.5 * (surfaces["wing1l_fla1"] + surfaces["wing1r_fla1"]) / FLAP_DEG
        state.speed_brake_ratio = 0.5 * (surfaces["wing1l_spo1"] + surfaces["wing1r_spo1"]) / SPEED_BRAKE_DEG
        state.thrust_vector_ratio = 0.0
        state.stall_warning = state.alpha_rad > STALL_WARNING_RAD and state.true_airspeed_mps > 15.0
        for i, (out, engine, rotor) in enumerate(zip(state.engines, self._engines, self._rotors)):
            out.running = engine.running
            out.throttle = controls.throttle_use[i] if controls.override_throttles else controls.throttle[i]
            out.rpm = out.prop_rpm = rotor.omega * 30.0 / math.pi
            out.power_w, out.torque_nm, out.thrust_n = engine.power, rotor.shaft_torque, rotor.thrust
            out.fuel_flow_kg_s, out.manifold_pressure_pa = engine.fuel_flow, engine.manifold_pa
            out.exhaust_gas_temperature_k, out.cylinder_head_temperature_k = engine.egt_k, engine.cht_k
            out.oil_temperature_k, out.oil_pressure_pa = engine.oil_k, engine.oil_pa
            out.blade_pitch_deg = math.degrees(rotor.blade_rad)

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Starts (at once) or stops an engine."""
        if engine not in (0, 1):
            raise FlightModelError(f"engine {engine}: this aircraft has engines 0 and 1")
        self._engines[engine].switch(running)
        if running:
            self._rotors[engine].omega = max(self._rotors[engine].omega, 100.0)

    def _save_more(self) -> dict[str, Any]:
        return {"engines": [e.save() for e in self._engines], "governors": [g.integral_deg for g in self._governors]}

    def _restore_more(self, saved: dict[str, Any]) -> None:
        for engine, values in zip(self._engines, saved["engines"]):
            engine.restore(values)
        for governor, angle in zip(self._governors, saved["governors"]):
            governor.integral_deg = angle

    # ---- starts

    def _settle_engines(self, controls: Controls, seconds: float) -> None:
        """Runs the engines alone in the air as it passes now, until they are steady."""
        dt = 1.0 / 60.0
        if self._loop is None:
            self._settle_in_python(controls, int(seconds / dt), dt)
        else:
            self._loop.settle(self, int(seconds / dt), dt, controls)
        _, temperature = self._outside_air()
        for engine in self._engines:
            engine.warm_up(temperature, max(engine.power / ENGINE.rated_power_w, 0.0))

    def _settle_in_python(self, controls: Controls, count: int, dt: float) -> None:
        u, v, w, p, q, r, density = [get() for get in self._air_getters]
        air, rates, density = (u * FOOT_M, v * FOOT_M, w * FOOT_M), (p, q, r), density * SLUG_FT3_KG_M3
        pressure, temperature = self._outside_air()
        for i, (engine, governor, rotor) in enumerate(zip(self._engines, self._governors, self._rotors)):
            for _ in range(count):
                governor.step(dt, rotor, controls.propeller[i])
                rotor.air_loads(dt, air, rates, density)
                torque = engine.torque(
                    dt,
                    rotor.omega,
                    controls.throttle[i],
                    controls.mixture[i],
                    pressure,
                    temperature,
                    self._fuel_kg[i] > 0.0,
                )
                rotor.turn(dt, torque, rates)

    def _start_in_air(self, initial: InitialState, speed: float) -> Controls:
        if not 30.0 <= speed <= 110.0:
            raise FlightModelError(f"airspeed {speed} m/s: the twin starts in the air at 30..110 m/s")
        controls = Controls(gear_down=False)
        self._gear.put(0.0)
        heading = math.radians(initial.heading_deg)
        course = (math.cos(heading), math.sin(heading))
        for i, engine in enumerate(self._engines):
            engine.switch(True)
            self._rotors[i].omega = ENGINE.rated_rpm * math.pi / 30.0

        def fly(x: np.ndarray) -> Sequence[float]:
            theta, trim_pitch, throttle, roll, trim_roll, trim_yaw = (float(value) for value in x)
            controls.trim_pitch, controls.trim_roll, controls.trim_yaw = trim_pitch, trim_roll, trim_yaw
            controls.throttle[0] = controls.throttle[1] = throttle
            for actuator, target in zip(self._surface_set.actuators, self._mix(controls)):
                actuator.jump(target)
            # Steady in the moving air: fly the heading, drift with the wind.
            v_ned = (speed * course[0] + self._wind[0], speed * course[1] + self._wind[1], self._wind[2])
            turning = speed / (EARTH_RADIUS_M + initial.altitude_m)
            position = (initial.latitude_deg, initial.longitude_deg, initial.altitude_m)
            self._set_motion(*position, (roll, theta, heading), v_ned, (0.0, -turning, 0.0))
            self._settle_engines(controls, 3.0)
            self._put(position, (roll, theta, heading), v_ned, (0.0, -turning, 0.0))
            s = self._read_state(controls)
            ahead = s.acceleration_north_mps2 * course[0] + s.acceleration_east_mps2 * course[1]
            aside = -s.acceleration_north_mps2 * course[1] + s.acceleration_east_mps2 * course[0]
            return ahead, aside, s.acceleration_down_mps2, s.p_dot_rad_s2, s.q_dot_rad_s2, s.r_dot_rad_s2

        start = (0.02, 0.0, 0.6, 0.0, 0.0, 0.0)
        differences = (1e-3, 1e-2, 1e-2, 1e-3, 1e-2, 1e-2)
        limits = ((-0.2, 0.3), (-1.0, 1.0), (0.0, 1.0), (-0.3, 0.3), (-1.0, 1.0), (-1.0, 1.0))
        what = f"level flight of the twin at {speed:.1f} m/s and {initial.altitude_m:.0f} m"
        for lever in (CRUISE_PROPELLER, 1.0):
            controls.propeller[0] = controls.propeller[1] = lever
            try:
                solution = trim.newton(fly, start, differences, limits, tolerance=1e-5, what=what)
                break
            except FlightModelError:
                if lever == 1.0:
                    raise
        fly(solution)
        return controls

    def _start_on_ground(self, initial: InitialState) -> Controls:
        controls = Controls(parking_brake=1.0)
        for i, engine in enumerate(self._engines):
            engine.switch(initial.engines_running)
            self._rotors[i].omega = 100.0 if initial.engines_running else 0.0
        altitude = initial.terrain_elevation_m + STANDING_HEIGHT_M
        euler = (0.0, STANDING_PITCH_RAD, math.radians(initial.heading_deg))
        self._set_motion(initial.latitude_deg, initial.longitude_deg, altitude, euler, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._settle_on_ground(controls, 4.0)
        return controls
