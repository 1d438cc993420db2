"""The quadrotor. Mass, body drag and legs: aircraft/multirotor/multirotor.xml.

Motors, in the order of the engine arrays: 0 front right, 1 rear left, 2 front left, 3 rear right; 0 and 1 turn
anticlockwise seen from above, 2 and 3 clockwise.
"""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from xplane_bridge.emulator.flight import trim
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    EngineFault,
    FlightModelError,
    InitialState,
    ModelInfo,
    ModelState,
)
from xplane_bridge.emulator.flight.jsbsim_model import JsbsimModel
from xplane_bridge.emulator.flight.jsbsim_state import SLUG_FT3_KG_M3
from xplane_bridge.emulator.flight.rotors import Rotor, RotorSpec, electric_torque
from xplane_bridge.emulator.flight.stabilisation import Stabilisation, StabilisationSpec
from xplane_bridge.units import FOOT_M

ARM_FORWARD_M, ARM_RIGHT_M = 0.115, 0.135
#: forward, right, direction: reaction of a + rotor (anticlockwise from above) turns the nose right.
MOTORS = ((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1))
#: 8.7 x 3.8 inch propellers (published), chord and inertia estimated.
ROTOR = {
    "down_m": -0.02,
    "radius_m": 0.11,
    "blade_area_m2": 0.0042,
    "inertia_kg_m2": 4.0e-5,
    "zero_lift_deg": -3.0,
    "profile_drag": 0.02,
    "edgewise_drag": 0.06,
}
BLADE_DEG = 10.5
#: Speed at full throttle; thrust is about proportional to the throttle: speed = this x sqrt(throttle).
MAXIMUM_OMEGA = 900.0
IDLE_OMEGA = 60.0
MOTOR_LAG_S = 0.035
MAXIMUM_TORQUE_NM = 0.5
MAXIMUM_POWER_W = 80.0

MAXIMUM_TILT_RAD = math.radians(30.0)
MAXIMUM_YAW_RATE_RAD_S = math.radians(100.0)
STABILISATION = StabilisationSpec(
    attitude=6.0,
    maximum_rate_rad_s=math.radians(200.0),
    rate=(0.022, 0.026, 0.15),
    integral=(0.12, 0.14, 0.15),
    limit=(0.4, 0.4, 0.25),
)
#: What the stick does to the mixer when nothing stabilises.
RAW_STICK = (0.05, 0.05, 0.1)
MAXIMUM_SPEED_MPS = 18.0
STANDING_HEIGHT_M = 0.052


class Multirotor(JsbsimModel):
    """Quadrotor with artificial stability (stick: attitude and yaw rate; throttle: thrust) that can be switched off."""

    info = ModelInfo(
        name="multirotor",
        description="Quadrotor",
        icao="QUAD",
        engine_count=4,
        propeller_direction=tuple(direction for _, _, direction in MOTORS),
        tank_count=0,
        gear_names=("front_left", "front_right", "rear_left", "rear_right"),
        retractable_gear=False,
        maximum_mass_kg=1.207,
        maximum_power_w=MAXIMUM_POWER_W,
        maximum_rpm=MAXIMUM_OMEGA * 30.0 / math.pi,
        never_exceed_mps=20.0,
        wing_span_m=0.354,
        length_m=0.322,
        eye_forward_m=0.1,
        standing_height_m=STANDING_HEIGHT_M,
    )
    max_payload_kg = 0.3
    usual_speeds_mps = (0.0,)
    contact_height_m = 1.0
    contact_runs = 2

    def _build(self) -> None:
        self._rotors = [
            Rotor(RotorSpec(forward_m=x * ARM_FORWARD_M, right_m=y * ARM_RIGHT_M, direction=d, **ROTOR), BLADE_DEG)
            for x, y, d in MOTORS
        ]
        for rotor in self._rotors:
            rotor.tilt(math.pi / 2.0)
        self._stabilisation = Stabilisation(STABILISATION)
        self._running = [False] * 4
        self._used = [0.0] * 4
        self._commands = [0.0, 0.0, 0.0]

    def _advance(
        self, dt: float, controls: Controls, air: Sequence[float], rates: Sequence[float], density: float
    ) -> None:
        if controls.override_throttles:
            self._used = [min(max(value, 0.0), 1.0) for value in controls.throttle_use[:4]]
            self._commands = [0.0, 0.0, 0.0]
        else:
            stick = [min(max(value, -1.0), 1.0) for value in (controls.roll, controls.pitch, controls.yaw)]
            if controls.artificial_stability and not controls.stability_fault:
                if max(controls.throttle[:4]) < 0.02:  # on the ground with idling motors nothing may wind up
                    self._stabilisation.integrals = [0.0, 0.0, 0.0]
                attitude = (self._roll(), self._pitch())
                wanted = (stick[0] * MAXIMUM_TILT_RAD, stick[1] * MAXIMUM_TILT_RAD, stick[2] * MAXIMUM_YAW_RATE_RAD_S)
                self._commands = self._stabilisation.step(dt, wanted, attitude, rates)
            else:
                self._commands = [value * share for value, share in zip(stick, RAW_STICK)]
            self._used = self._mix(controls.throttle, self._commands)
        for i, rotor in enumerate(self._rotors):
            fault = controls.engine_faults[i]
            rotor.air_loads(dt, air, rates, density)
            if fault is EngineFault.SEIZED:
                torque = rotor.torque - rotor.spec.inertia_kg_m2 * rotor.omega / dt
            elif fault is EngineFault.STOPPED or not self._running[i]:
                torque = -0.002 * min(rotor.omega / 20.0, 1.0)  # bearing friction
            else:
                omega = max(MAXIMUM_OMEGA * math.sqrt(self._used[i]), IDLE_OMEGA)
                torque = electric_torque(rotor, dt, omega, MOTOR_LAG_S, MAXIMUM_TORQUE_NM)
            rotor.turn(dt, torque, rates)

    @staticmethod
    def _mix(throttle: Sequence[float], commands: Sequence[float]) -> list[float]:
        """Motor commands 0..1. Levers at idle stay idle; where a motor would saturate, yaw gives way, then height."""
        roll, pitch, yaw = commands
        if max(throttle[:4]) < 0.02:
            return [0.0] * 4
        tilting = [throttle[i] - y * roll + x * pitch for i, (x, y, _) in enumerate(MOTORS)]
        room = min(min(max(1.0 - value, value), 1.0) for value in tilting)
        yaw = min(max(yaw, -max(room, 0.05)), max(room, 0.05))
        motors = [value + d * yaw for value, (_, _, d) in zip(tilting, MOTORS)]
        shift = max(max(motors) - 1.0, 0.0) - max(-min(motors), 0.0)
        return [min(max(value - shift, 0.0), 1.0) for value in motors]

    def _fill_state(self, state: ModelState, controls: Controls) -> None:
        state.roll_ratio, state.pitch_ratio, state.yaw_ratio = (
            min(max(command / limit, -1.0), 1.0) for command, limit in zip(self._commands, STABILISATION.limit)
        )
        state.thrust_vector_ratio = 1.0
        for i, (out, rotor) in enumerate(zip(state.engines, self._rotors)):
            out.running = self._running[i] and controls.engine_faults[i] is EngineFault.NONE
            out.throttle = self._used[i]
            out.rpm = out.prop_rpm = rotor.omega * 30.0 / math.pi
            out.thrust_n, out.torque_nm = rotor.thrust, rotor.shaft_torque
            out.power_w = rotor.shaft_torque * rotor.omega
            out.blade_pitch_deg, out.nacelle_deg = BLADE_DEG, 90.0

    def set_engine_running(self, engine: int, running: bool) -> None:
        """Arms or disarms a motor."""
        if engine not in range(4):
            raise FlightModelError(f"engine {engine}: this aircraft has motors 0 to 3")
        self._running[engine] = running

    def _save_more(self) -> dict[str, Any]:
        return {"running": self._running, "used": self._used, "integrals": self._stabilisation.integrals}

    def _restore_more(self, saved: dict[str, Any]) -> None:
        self._running, self._used = list(saved["running"]), list(saved["used"])
        self._stabilisation.integrals = list(saved["integrals"])

    def _start_in_air(self, initial: InitialState, speed: float) -> Controls:
        if not 0.0 <= speed <= MAXIMUM_SPEED_MPS:
            raise FlightModelError(
                f"airspeed {speed} m/s: the quadrotor starts in the air at 0..{MAXIMUM_SPEED_MPS} m/s"
            )
        controls = Controls()
        heading = math.radians(initial.heading_deg)
        position = (initial.latitude_deg, initial.longitude_deg, initial.altitude_m)
        v_ned = [0.0, 0.0, 0.0]  # a hover stands over the ground, whatever the wind
        if speed > 0.0:
            v_ned = [
                speed * math.cos(heading) + self._wind[0],
                speed * math.sin(heading) + self._wind[1],
                self._wind[2],
            ]
        self._running = [True] * 4

        def fly(x: np.ndarray) -> Sequence[float]:
            roll, pitch, throttle, *commands = (float(value) for value in x)
            controls.roll, controls.pitch = (angle / MAXIMUM_TILT_RAD for angle in (roll, pitch))
            controls.throttle = [throttle] * len(controls.throttle)
            self._stabilisation.integrals = list(commands)
            self._used = self._mix(controls.throttle, commands)
            self._set_motion(*position, (roll, pitch, heading), v_ned, (0.0, 0.0, 0.0))
            u, v, w, p, q, r, density = [get() for get in self._air_getters]
            for rotor, used in zip(self._rotors, self._used):
                rotor.omega = MAXIMUM_OMEGA * math.sqrt(used)
                for _ in range(60):
                    rotor.air_loads(0.02, (u * FOOT_M, v * FOOT_M, w * FOOT_M), (p, q, r), density * SLUG_FT3_KG_M3)
                rotor.shaft_torque = rotor.torque
            self._put(position, (roll, pitch, heading), v_ned, (0.0, 0.0, 0.0))
            s = self._read_state(controls)
            return (
                s.acceleration_north_mps2,
                s.acceleration_east_mps2,
                s.acceleration_down_mps2,
                s.p_dot_rad_s2,
                s.q_dot_rad_s2,
                s.r_dot_rad_s2,
            )

        solution = trim.newton(
            fly,
            (0.0, 0.0, 0.45, 0.0, 0.0, 0.0),
            (1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4),
            ((-0.5, 0.5), (-0.5, 0.5), (0.05, 0.95), (-0.2, 0.2), (-0.2, 0.2), (-0.2, 0.2)),
            tolerance=1e-4,
            what=f"flight of the quadrotor at {speed:.1f} m/s and {initial.altitude_m:.0f} m in this wind",
        )
        fly(solution)
        return controls

    def _start_on_ground(self, initial: InitialState) -> Controls:
        controls = Controls()
        self._running = [initial.engines_running] * 4
        altitude = initial.terrain_elevation_m + STANDING_HEIGHT_M
        euler = (0.0, 0.0, math.radians(initial.heading_deg))
        self._set_motion(initial.latitude_deg, initial.longitude_deg, altitude, euler, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._settle_on_ground(controls, 1.5)
        return controls
