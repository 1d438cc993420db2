"""What X-Plane's own autopilot moves: stick, pedals and levers, by its modes and dials."""

from __future__ import annotations

import math
from typing import Optional

from xplane_bridge.emulator.beam import Beam
from xplane_bridge.emulator.datarefs import autopilot as ap
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight.flight_model import Controls, ModelInfo
from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT, Frame
from xplane_bridge.scenario.holds import HoldAutopilot, HoldGains, Targets
from xplane_bridge.units import FOOT_M, GRAVITY_MPS2

_THROTTLE = "sim/cockpit2/engine/actuators/throttle_ratio"
_OVERRIDE = "sim/operation/override/override_"
#: An axis: attribute of `Controls`, name in `servo_*_ratio` and in the override that takes it.
_AXES = (("roll", "roll"), ("pitch", "pitch"), ("yaw", "heading"))
#: What the servos add to the stick on an axis.
_SHOWN = "sim/joystick/servo_{}_ratio"
#: In the order in which `Servos.move` takes them.
_SWITCHES = (
    ap.MASTER,
    ap.YAW_DAMPER,
    *(_OVERRIDE + name for name in ("joystick", "flightcontrol", "autopilot")),
    *(f"{_OVERRIDE}joystick_{name}" for _, name in _AXES),
)
#: Climb for speed that is too high, by pitch [m/s of climb per m/s], and at most [m/s].
_CLIMB_PER_SPEED, _MOST_CLIMB = 1.2, 6.0
#: Pedals against yaw that no coordinated turn has [per deg/s].
_DAMPING = 0.03
#: Of the autothrottle, slower than a scripted pilot's.
_GAINS = HoldGains(speed=0.05, speed_integral=0.004)
#: Below this speed nothing is damped [m/s].
_SLOW_MPS = 20.0


class Servos:
    """Flies by the autopilot's datarefs, on an axis as long as no client has it.

    Args:
        store: Has them.
    """

    def __init__(self, store: DatarefStore) -> None:
        self._store = store
        self._switches = store.gather(_SWITCHES)
        self._holds: Optional[HoldAutopilot] = None
        self._throttle: Optional[HoldAutopilot] = None

    def rest(self) -> None:
        """Nothing is moved, as where a flight begins; an aircraft without an autopilot leaves it so."""
        self._holds = self._throttle = None
        self._store.set(ap.AUTOTHROTTLE, ap.OFF)
        for _, name in _AXES:
            self._store.set(_SHOWN.format(name), 0.0)

    def move(
        self,
        dt: float,
        frame: Frame,
        info: ModelInfo,
        altitude_ft: float,
        controls: Controls,
        beam: Optional[Beam],
    ) -> None:
        """Adds to `controls`, which have stick and pedals, and moves the levers for the next frame.

        Args:
            dt: Since the last frame [s].
            frame: The present one.
            info: Of the loaded aircraft.
            altitude_ft: As indicated.
            controls: Of this frame.
            beam: What the radios show; None where they hear no station.
        """
        if not info.autopilot:
            return
        m = frame.m
        master, damper, joystick, flight_control, autopilot, *taken_axes = self._switches()
        flies = master == ap.SERVOS
        deflections = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0}
        if flies:
            self._holds = self._holds or HoldAutopilot(HoldGains())
            targets = self._targets(frame, beam)
            rates = math.degrees(m.p_rad_s), math.degrees(m.q_rad_s)
            climb, altitude = -m.v_down_mps, altitude_ft * FOOT_M
            deflections["roll"] = self._holds.roll(targets, frame.true_phi, rates[0], frame.mag_psi) or 0.0
            attitude = frame.true_theta, rates[1], frame.true_phi
            deflections["pitch"] = self._holds.pitch(targets, dt, *attitude, climb, altitude, present=0.0) or 0.0
        else:
            self._holds = None
        if damper and m.true_airspeed_mps > _SLOW_MPS:
            turn = GRAVITY_MPS2 / m.true_airspeed_mps * math.sin(m.roll_rad) * math.cos(m.pitch_rad)
            deflections["yaw"] = min(max(-_DAMPING * math.degrees(m.r_rad_s - turn), -0.3), 0.3)
        everything = joystick or flight_control or autopilot
        for (axis, name), taken in zip(_AXES, taken_axes):
            deflection = 0.0 if everything or taken else deflections[axis]
            self._store.set(_SHOWN.format(name), deflection)
            setattr(controls, axis, min(max(getattr(controls, axis) + deflection, -1.0), 1.0))
        self._move_levers(dt, frame, info, controls)

    def _targets(self, frame: Frame, beam: Optional[Beam]) -> Targets:
        get = self._store.get
        targets = Targets(roll=0.0)
        if get(ap.HEADING):
            targets.update({"heading": get(ap.HEADING_DIAL)})
        elif beam is not None and ap.CAPTURED in (get(ap.NAV), get(ap.APPROACH)):
            targets.update({"heading": beam.heading_deg(frame)})
        if beam is not None and get(ap.GLIDESLOPE):
            targets.climb = beam.climb_mps(frame)
        elif get(ap.ALTITUDE):
            targets.altitude = get(ap.HELD_FT) * FOOT_M
        elif get(ap.CLIMB):
            targets.climb = get(ap.CLIMB_DIAL) / MPS_TO_FPM
        elif get(ap.SPEED):
            fast = frame.m.calibrated_airspeed_mps - ap.dial_speed_kt(self._store, frame) / MPS_TO_KT
            targets.climb = min(max(_CLIMB_PER_SPEED * fast, -_MOST_CLIMB), _MOST_CLIMB)
        else:
            targets.pitch = get(ap.HELD_PITCH)
        return targets

    def _move_levers(self, dt: float, frame: Frame, info: ModelInfo, controls: Controls) -> None:
        if self._store.get(ap.AUTOTHROTTLE) < 1.0:
            self._throttle = None
            return
        self._throttle = self._throttle or HoldAutopilot(_GAINS)
        targets = Targets(speed=ap.dial_speed_kt(self._store, frame) / MPS_TO_KT)
        lever = self._throttle.throttle(targets, dt, frame.m.calibrated_airspeed_mps, controls.throttle[0])
        self._store.values[self._store.dataref(_THROTTLE).slots[: info.engine_count]] = lever
