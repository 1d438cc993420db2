"""The tiltrotor. Aerodynamics, mass and gear: aircraft/tiltrotor/tiltrotor.xml.

``thrust_vector`` 0 puts the nacelles forward, 0.9 upright, 1 ten degrees aft of that; they follow at 8 deg/s. The
throttle is a thrust lever: the collective pitch follows the air that forward flight sends through the rotor, so that
thrust answers the lever in hover and in cruise; the engines hold the rotor speed as long as their power lasts. One
shaft joins both rotors: one engine can drive both.
"""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from xplane_bridge.emulator.flight import trim
from xplane_bridge.emulator.flight.actuators import sided
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
from xplane_bridge.emulator.flight.jsbsim_state import SLUG_FT3_KG_M3
from xplane_bridge.emulator.flight.rotors import Rotor, RotorSpec
from xplane_bridge.emulator.flight.stabilisation import Stabilisation, StabilisationSpec
from xplane_bridge.units import EARTH_RADIUS_M, FOOT_M, GRAVITY_MPS2

FLAPERON_DEG, ELEVATOR_DEG, RUDDER_DEG = 25.0, 25.0, 22.0
FLAP_DROOP_DEG = 20.0

#: Nacelles: angle per thrust-vector ratio, rate, where they turn, length to the hub.
NACELLE_DEG_PER_RATIO = 100.0
HOVER_RATIO = 0.9
NACELLE_RATE_DEG_S = 8.0
PIVOT_RIGHT_M, PIVOT_DOWN_M, MAST_M = 2.3, -0.3, 0.9

ROTOR = {
    "radius_m": 1.525,
    "blade_area_m2": 0.70,
    "inertia_kg_m2": 25.0,
    "zero_lift_deg": -2.0,
    "profile_drag": 0.012,
    "edgewise_drag": 0.03,
}
#: Rotor speed upright and forward [rad/s]: 1430 and 1200 rpm.
HOVER_OMEGA, CRUISE_OMEGA = 150.0, 126.0
#: Collective beyond the inflow's own angle at idle, and what full throttle adds upright and forward [deg].
COLLECTIVE_IDLE_DEG, COLLECTIVE_HOVER_DEG, COLLECTIVE_CRUISE_DEG = -5.0, 20.5, 6.5
COLLECTIVE_RATE_DEG_S = 40.0
#: What full commands add: differential collective for roll, cyclic for pitch, differential cyclic for yaw [deg].
ROLL_COLLECTIVE_DEG, PITCH_CYCLIC_DEG, YAW_CYCLIC_DEG = 4.0, 12.0, 9.0
CYCLIC_RATE_DEG_S = 60.0

ENGINE_POWER_W = 260e3
FUEL_KG_PER_JOULE = 0.35 / 3.6e6
GOVERNOR_PER_S = 3.0

#: Attitude at full stick, in any flight phase, and rate of turn at full pedal upright.
MAXIMUM_ROLL_RAD, MAXIMUM_PITCH_RAD, MAXIMUM_YAW_RATE_RAD_S = math.radians(45.0), math.radians(25.0), math.radians(30.0)
PITCH_TRIM_RAD = math.radians(12.0)
STABILISATION = StabilisationSpec(
    attitude=1.6,
    maximum_rate_rad_s=math.radians(30.0),
    rate=(0.55, 1.2, 1.3),
    integral=(0.3, 0.7, 0.4),
    limit=(1.0, 1.0, 1.0),
)
#: Dynamic pressure above which the surfaces' travel is geared down in proportion [Pa].
AILERON_FULL_PA, ELEVATOR_FULL_PA, RUDDER_FULL_PA = 3000.0, 900.0, 3000.0

MAXIMUM_SPEED_MPS = 120.0
AIRPLANE_SPEED_MPS = 62.0
STANDING_HEIGHT_M = 0.90


class Tiltrotor(JsbsimModel):
    """Two proprotors on tilting nacelles, a wing, and attitude-command stabilisation that can be switched off."""

    info = ModelInfo(
        name="tiltrotor",
        description="Tiltrotor",
        icao="TILT",
        engine_count=2,
        propeller_direction=(1, -1),
        tank_count=1,
        gear_names=("nose", "left_main", "right_main"),
        retractable_gear=True,
        flap_detents=1,
        hover_thrust_vector=HOVER_RATIO,
        maximum_mass_kg=1170.0,
        maximum_power_w=ENGINE_POWER_W,
        maximum_rpm=HOVER_OMEGA * 30.0 / math.pi,
        never_exceed_mps=115.0,
        stall_mps=48.0,
        wing_span_m=4.6,
        length_m=5.5,
        eye_forward_m=2.0,
        eye_down_m=-0.2,
        standing_height_m=STANDING_HEIGHT_M,
        trim_deg=(("elevator", 0.0),),
        turbines=True,
    )
    surfaces = (
        sided("wing1l_ail1", SurfaceKind.AILERON, Side.LEFT, FLAPERON_DEG, FLAPERON_DEG + FLAP_DROOP_DEG, 80.0),
        sided("wing1r_ail1", SurfaceKind.AILERON, Side.RIGHT, FLAPERON_DEG, FLAPERON_DEG + FLAP_DROOP_DEG, 80.0),
        sided("hstab1_elv1", SurfaceKind.ELEVATOR, Side.LEFT, ELEVATOR_DEG, ELEVATOR_DEG, 80.0),
        sided("hstab2_elv1", SurfaceKind.ELEVATOR, Side.RIGHT, ELEVATOR_DEG, ELEVATOR_DEG, 80.0),
        sided("vstab1_rud1", SurfaceKind.RUDDER, Side.CENTRE, RUDDER_DEG, RUDDER_DEG, 80.0),
    )
    fuel_capacity_kg = (200.0,)
    default_fuel_kg = (150.0,)
    default_payload_kg = 80.0
    max_payload_kg = 200.0
    usual_speeds_mps = (0.0, 85.0)

    def _build(self) -> None:
        self._rotors = [
            Rotor(
                RotorSpec(forward_m=0.0, right_m=side * PIVOT_RIGHT_M, down_m=PIVOT_DOWN_M, direction=d, **ROTOR), 5.0
            )
            for side, d in zip((-1.0, 1.0), self.info.propeller_direction)
        ]
        self._stabilisation = Stabilisation(STABILISATION)
        self._running = [False, False]
        self._nacelle_deg = NACELLE_DEG_PER_RATIO * HOVER_RATIO
        self._cyclic_deg = [0.0, 0.0]
        self._commands = [0.0, 0.0, 0.0]
        self._throttle = [0.0, 0.0]
        self._power_w = 0.0
        self._gas_temperature_k = 288.15

    # ---- one step

    def _upright(self) -> float:
        """0 with nacelles forward .. 1 upright: the share of control that the rotors have."""
        share = min(max((self._nacelle_deg - 10.0) / 70.0, 0.0), 1.0)
        return share * share * (3.0 - 2.0 * share)

    def _advance(
        self, dt: float, controls: Controls, air: Sequence[float], rates: Sequence[float], density: float
    ) -> None:
        wanted_deg = NACELLE_DEG_PER_RATIO * min(max(controls.thrust_vector, 0.0), 1.0)
        reach = NACELLE_RATE_DEG_S * dt
        self._nacelle_deg += min(max(wanted_deg - self._nacelle_deg, -reach), reach)
        upright = self._upright()
        dynamic_pressure = 0.5 * density * (air[0] ** 2 + air[1] ** 2 + air[2] ** 2)

        stick = [min(max(value, -1.0), 1.0) for value in (controls.roll, controls.pitch, controls.yaw)]
        if controls.artificial_stability and not controls.stability_fault:
            self._commands = self._stabilise(dt, stick, controls, rates, upright)
        else:
            self._commands = stick
        self._surface_set.step(
            self._mix(self._commands, controls.flap_request, dynamic_pressure),
            dt,
            controls,
            math.degrees(self._alpha()),
        )
        if controls.override_throttles:
            levers, commands = controls.throttle_use, [0.0, 0.0, 0.0]
        else:
            levers, commands = controls.throttle, self._commands
        self._throttle = [min(max(levers[i], 0.0), 1.0) for i in range(2)]
        self._pitch_blades(dt, commands, upright)
        for rotor in self._rotors:
            rotor.air_loads(dt, air, rates, density)
        self._drive(dt, controls, rates, upright, density)

    def _stabilise(
        self, dt: float, stick: Sequence[float], controls: Controls, rates: Sequence[float], upright: float
    ) -> list[float]:
        if self._agl() * FOOT_M < STANDING_HEIGHT_M + 0.1:  # standing: nothing may wind up
            self._stabilisation.integrals = [0.0, 0.0, 0.0]
        roll, pitch = self._roll(), self._pitch()
        speed = max(self._airspeed() * FOOT_M, 25.0)
        wanted_roll = stick[0] * MAXIMUM_ROLL_RAD
        # On the wing a bank turns; the pedals then only add to the turn.
        turn = (1.0 - upright) * GRAVITY_MPS2 / speed * math.tan(min(max(roll, -1.0), 1.0))
        turn += stick[2] * MAXIMUM_YAW_RATE_RAD_S * (0.5 + 0.5 * upright)
        wanted_pitch = stick[1] * MAXIMUM_PITCH_RAD + controls.trim_pitch * PITCH_TRIM_RAD
        return self._stabilisation.step(dt, (wanted_roll, wanted_pitch, turn), (roll, pitch), rates)

    @staticmethod
    def _mix(commands: Sequence[float], flap: float, dynamic_pressure: float) -> Sequence[float]:
        """Where the commands want the surfaces, in the order of ``surfaces`` [deg]."""
        roll, pitch, yaw = commands
        pressure = max(dynamic_pressure, 1.0)
        aileron = FLAPERON_DEG * roll * min(1.0, AILERON_FULL_PA / pressure)
        elevator = -ELEVATOR_DEG * pitch * min(1.0, ELEVATOR_FULL_PA / pressure)
        rudder = RUDDER_DEG * yaw * min(1.0, RUDDER_FULL_PA / pressure)
        droop = FLAP_DROOP_DEG * min(max(flap, 0.0), 1.0)
        return droop + aileron, droop - aileron, elevator, elevator, rudder

    def _pitch_blades(self, dt: float, commands: Sequence[float], upright: float) -> None:
        """Nacelle, cyclic and collective of both rotors."""
        roll, pitch, yaw = commands
        travel = COLLECTIVE_CRUISE_DEG + (COLLECTIVE_HOVER_DEG - COLLECTIVE_CRUISE_DEG) * upright
        nacelle = math.radians(self._nacelle_deg)
        # The blades follow forward flight only: climbing upright, the rotors keep the damping that nature gives them.
        through = max(self._air_getters[0]() * FOOT_M * math.cos(nacelle), 0.0)
        for i, (side, rotor) in enumerate(zip((-1.0, 1.0), self._rotors)):
            # Left rotor: more thrust rolls right; tilted aft it pulls the nose left: forward for a right turn.
            cyclic = upright * (PITCH_CYCLIC_DEG * pitch + side * YAW_CYCLIC_DEG * yaw)
            reach = CYCLIC_RATE_DEG_S * dt
            self._cyclic_deg[i] += min(max(cyclic - self._cyclic_deg[i], -reach), reach)
            rotor.tilt(nacelle + math.radians(self._cyclic_deg[i]))
            rotor.x, rotor.z = MAST_M * math.cos(nacelle), PIVOT_DOWN_M - MAST_M * math.sin(nacelle)
            inflow_deg = math.degrees(math.atan2(through, 0.75 * rotor.spec.radius_m * max(rotor.omega, 20.0)))
            wanted = (
                inflow_deg
                + COLLECTIVE_IDLE_DEG
                + travel * self._throttle[i]
                - side * upright * ROLL_COLLECTIVE_DEG * roll
            )
            reach = math.radians(COLLECTIVE_RATE_DEG_S) * dt
            rotor.blade_rad += min(max(math.radians(wanted) - rotor.blade_rad, -reach), reach)

    def _drive(self, dt: float, controls: Controls, rates: Sequence[float], upright: float, density: float) -> None:
        """The joined shafts: engines hold the speed while their power lasts; without any, the rotors windmill."""
        healthy = [self._is_driving(i, controls) for i in range(2)]
        inertia = self._rotors[0].spec.inertia_kg_m2
        omega = 0.5 * (self._rotors[0].omega + self._rotors[1].omega)
        wanted = CRUISE_OMEGA + (HOVER_OMEGA - CRUISE_OMEGA) * upright
        absorbed = self._rotors[0].torque + self._rotors[1].torque
        available = sum(healthy) * ENGINE_POWER_W * min(density / 1.225, 1.0) ** 0.8 / max(omega, 20.0)
        friction = 8.0 * min(omega / 5.0, 1.0)
        torque = min(max(absorbed + friction + 2.0 * inertia * GOVERNOR_PER_S * (wanted - omega), 0.0), available)
        acceleration = (torque - friction - absorbed) / (2.0 * inertia)
        if EngineFault.SEIZED in controls.engine_faults[:2]:
            acceleration, torque = -omega / dt, 0.0
        for rotor in self._rotors:
            rotor.omega = omega  # the joining shaft lets them not differ
            rotor.turn(dt, rotor.torque + inertia * acceleration, rates)
        self._power_w = torque * omega
        load = self._power_w / (max(sum(healthy), 1) * ENGINE_POWER_W)
        hot = 600.0 + 480.0 * load if any(healthy) else self._outside_air()[1]
        self._gas_temperature_k += (hot - self._gas_temperature_k) * min(dt / 2.0, 1.0)
        self._fuel_kg[0] = max(self._fuel_kg[0] - self._fuel_flow(healthy) * dt, 0.0)

    def _is_driving(self, engine: int, controls: Controls) -> bool:
        return self._running[engine] and controls.engine_faults[engine] is EngineFault.NONE and self._fuel_kg[0] > 0.0

    def _fuel_flow(self, healthy: Sequence[bool]) -> float:
        return self._power_w * FUEL_KG_PER_JOULE + 0.006 * sum(healthy)

    def _fly(self, dt: float, controls: Controls) -> None:
        super()._fly(dt, controls)
        self._apply_loading()

    def _fill_state(self, state: ModelState, controls: Controls) -> None:
        state.roll_ratio, state.pitch_ratio, state.yaw_ratio = self._commands
        surfaces = state.surfaces_deg
        droop = 0.5 * (surfaces["wing1l_ail1"] + surfaces["wing1r_ail1"])
        state.flap_ratio = min(max(droop / FLAP_DROOP_DEG, 0.0), 1.0)
        state.thrust_vector_ratio = self._nacelle_deg / NACELLE_DEG_PER_RATIO
        state.stall_warning = self._upright() < 0.5 and state.alpha_rad > math.radians(14.0)
        healthy = [self._is_driving(i, controls) for i in range(2)]
        for i, (out, rotor) in enumerate(zip(state.engines, self._rotors)):
            share = self._power_w / max(sum(healthy), 1) if healthy[i] else 0.0
            load = share / ENGINE_POWER_W
            out.running, out.throttle = healthy[i], self._throttle[i]
            out.rpm = out.prop_rpm = rotor.omega * 30.0 / math.pi
            out.power_w, out.thrust_n, out.torque_nm = share, rotor.thrust, share / max(rotor.omega, 1.0)
            out.fuel_flow_kg_s = self._fuel_flow(healthy) / max(sum(healthy), 1) if healthy[i] else 0.0
            out.n1_percent = 62.0 + 38.0 * load**0.4 if healthy[i] else 0.0
            out.n2_percent = 100.0 * rotor.omega / HOVER_OMEGA
            out.exhaust_gas_temperature_k = self._gas_temperature_k
            out.oil_temperature_k, out.oil_pressure_pa = (360.0, 500e3) if healthy[i] else (self._outside_air()[1], 0.0)
            out.blade_pitch_deg, out.nacelle_deg = math.degrees(rotor.blade_rad), self._nacelle_deg

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Starts or stops an engine; the rotors take their time."""
        if engine not in (0, 1):
            raise FlightModelError(f"engine {engine}: this aircraft has engines 0 and 1")
        self._running[engine] = running

    def _save_more(self) -> dict[str, Any]:
        return {
            "running": self._running,
            "nacelle": self._nacelle_deg,
            "cyclic": self._cyclic_deg,
            "throttle": self._throttle,
            "power": self._power_w,
            "temperature": self._gas_temperature_k,
            "integrals": self._stabilisation.integrals,
        }

    def _restore_more(self, saved: dict[str, Any]) -> None:
        self._running, self._cyclic_deg = list(saved["running"]), list(saved["cyclic"])
        self._nacelle_deg, self._throttle = saved["nacelle"], list(saved["throttle"])
        self._power_w, self._gas_temperature_k = saved["power"], saved["temperature"]
        self._stabilisation.integrals = list(saved["integrals"])

    # ---- starts

    def _start_in_air(self, initial: InitialState, speed: float) -> Controls:
        if not 0.0 <= speed <= MAXIMUM_SPEED_MPS:
            raise FlightModelError(
                f"airspeed {speed} m/s: the tiltrotor starts in the air at 0..{MAXIMUM_SPEED_MPS} m/s"
            )
        on_wing = min(max((speed - 15.0) / (AIRPLANE_SPEED_MPS - 15.0), 0.0), 1.0)
        ratio = HOVER_RATIO * (1.0 - on_wing * on_wing)  # the wing carries with the square of the speed
        controls = Controls(gear_down=on_wing == 0.0, thrust_vector=ratio)
        self._gear.put(1.0 if controls.gear_down else 0.0)
        self._nacelle_deg = NACELLE_DEG_PER_RATIO * ratio
        self._running = [True] * 2
        upright = self._upright()
        omega = CRUISE_OMEGA + (HOVER_OMEGA - CRUISE_OMEGA) * upright
        heading = math.radians(initial.heading_deg)
        north, east = math.cos(heading), math.sin(heading)
        position = (initial.latitude_deg, initial.longitude_deg, initial.altitude_m)
        v_ned = [0.0, 0.0, 0.0]  # a hover stands over the ground, whatever the wind
        if speed > 0.0:
            v_ned = [speed * north + self._wind[0], speed * east + self._wind[1], self._wind[2]]
        pqr = (0.0, -(v_ned[0] * north + v_ned[1] * east) / (EARTH_RADIUS_M + initial.altitude_m), 0.0)

        def fly(x: np.ndarray) -> Sequence[float]:
            roll, pitch, throttle, *commands = (float(value) for value in x)
            controls.roll = roll / MAXIMUM_ROLL_RAD
            controls.trim_pitch = pitch / PITCH_TRIM_RAD
            controls.throttle = [throttle] * len(controls.throttle)
            self._throttle = [throttle, throttle]
            self._stabilisation.integrals = list(commands)
            self._set_motion(*position, (roll, pitch, heading), v_ned, pqr)
            u, v, w, p, q, r, density = [get() for get in self._air_getters]
            air, density = (u * FOOT_M, v * FOOT_M, w * FOOT_M), density * SLUG_FT3_KG_M3
            pressure = 0.5 * density * (air[0] ** 2 + air[1] ** 2 + air[2] ** 2)
            for actuator, target in zip(self._surface_set.actuators, self._mix(commands, 0.0, pressure)):
                actuator.jump(target)
            for rotor in self._rotors:
                rotor.omega = omega
            self._pitch_blades(10.0, commands, upright)
            for rotor in self._rotors:
                for _ in range(60):
                    rotor.air_loads(0.02, air, (p, q, r), density)
                rotor.shaft_torque = rotor.torque
            self._power_w = omega * (self._rotors[0].torque + self._rotors[1].torque)
            self._put(position, (roll, pitch, heading), v_ned, pqr)
            s = self._read_state(controls)
            return (
                s.acceleration_north_mps2 * north + s.acceleration_east_mps2 * east,
                s.acceleration_east_mps2 * north - s.acceleration_north_mps2 * east,
                s.acceleration_down_mps2,
                s.p_dot_rad_s2,
                s.q_dot_rad_s2,
                s.r_dot_rad_s2,
            )

        solution = trim.newton(
            fly,
            (0.0, 0.05 * on_wing, 0.7 - 0.2 * on_wing, 0.0, 0.0, 0.0),
            (1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3),
            ((-0.4, 0.4), (-0.3, 0.3), (0.0, 1.0), (-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)),
            tolerance=1e-5,
            what=f"flight of the tiltrotor at {speed:.1f} m/s and {initial.altitude_m:.0f} m in this wind",
        )
        fly(solution)
        self._gas_temperature_k = 600.0 + 480.0 * self._power_w / (2.0 * ENGINE_POWER_W)
        return controls

    def _start_on_ground(self, initial: InitialState) -> Controls:
        controls = Controls(parking_brake=1.0, thrust_vector=HOVER_RATIO)
        self._running = [initial.engines_running] * 2
        for rotor in self._rotors:
            rotor.omega = HOVER_OMEGA if initial.engines_running else 0.0
        altitude = initial.terrain_elevation_m + STANDING_HEIGHT_M
        euler = (0.0, 0.0, math.radians(initial.heading_deg))
        self._set_motion(initial.latitude_deg, initial.longitude_deg, altitude, euler, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._settle_on_ground(controls, 4.0)
        return controls
