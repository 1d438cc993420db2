"""attitude_hold: a controller to start from. Holds roll or heading, pitch or altitude, and airspeed of the light twin.

Copy it, and put your own law into `AttitudeHold.fly`. It listens to flight_state and answers each with a ControlCommand
on control/auto; tx_node sends that while the mode is AUTO. When states stop coming, commands stop with them, and the
failsafe of config/aircraft/<name>.yaml takes over.
"""

from __future__ import annotations

import argparse
import math
from typing import Any, Dict, Mapping, Optional, Sequence

from xplane_bridge import lockstep
from xplane_bridge.cli.bridge.flown_law import FlownLaw
from xplane_bridge.cli.entry import guarded, number, ros_arguments, start_node
from xplane_bridge.topics import NAMESPACE, absolute

#: Whose gains these are: stem of a file in config/aircraft.
AIRCRAFT = "fixed_wing"
_REMEDY = "copy this program and put gains for yours into it, or fly it as it is with --any-aircraft"
_NEEDED = ("ATTITUDE", "RATES", "POSITION", "VELOCITY", "AIRSPEEDS")  # groups of FlightState that it looks at
_LONGEST_STEP_S = 0.1  # over a longer gap integrators do not go on


def clip(value: float, low: float, high: float) -> float:
    """The value, or the nearer bound."""
    return low if value < low else high if value > high else value


class AttitudeHold:
    """Cascaded loops: heading -> roll -> stick, altitude -> climb -> pitch -> stick, airspeed -> throttle.

    Args:
        wanted: `roll`, `heading`, `pitch` [deg], `altitude` [m MSL], `speed` [m/s calibrated]. Heading goes before
            roll, pitch before altitude. What is missing: wings level, the altitude and speed of the first state.
    """

    def __init__(self, wanted: Dict[str, Optional[float]]) -> None:
        self._wanted = wanted
        self.targets = dict(wanted)
        self._time: Optional[float] = None
        self._epoch: Optional[int] = None
        # Integrators: pitch attitude [deg], elevator, throttle. They start from what is flown: nothing jumps.
        self._pitch, self._elevator, self._throttle = 0.0, 0.0, 0.5

    def restart(self) -> None:
        """The next state is the first one: while another source flies, integrators must follow and not run away."""
        self._epoch = None

    def fly(self, state: Any) -> Dict[str, float]:
        """Stick and throttle [-1..1; right, nose up, 0..1] for a FlightState."""
        dt = self._step(state)
        t: Mapping[str, Any] = self.targets
        if t.get("heading") is None:
            wanted_roll = t.get("roll") or 0.0
        else:
            wanted_roll = clip(1.2 * math.remainder(t["heading"] - state.heading_true_deg, 360.0), -25.0, 25.0)
        rates = state.angular_velocity
        roll_rate, pitch_rate = math.degrees(rates.x), math.degrees(rates.y)
        roll = clip(0.035 * (wanted_roll - state.roll_deg) - 0.012 * roll_rate, -1.0, 1.0)

        if t.get("pitch") is None:
            climb = clip(0.2 * (t["altitude"] - state.altitude_msl), -5.0, 5.0)
            error = climb - state.vertical_speed
            self._pitch = clip(self._pitch + 0.3 * error * dt, -15.0, 15.0)
            lean = 1.0 / max(math.cos(math.radians(state.roll_deg)), 0.3) - 1.0
            wanted_pitch = clip(self._pitch + 1.2 * error + 10.0 * lean, -15.0, 20.0)
        else:
            wanted_pitch = t["pitch"]
        error = wanted_pitch - state.pitch_deg
        self._elevator = clip(self._elevator + 0.015 * error * dt, -0.6, 0.6)
        pitch = clip(0.03 * error - 0.015 * pitch_rate + self._elevator, -1.0, 1.0)

        error = t["speed"] - state.calibrated_airspeed
        self._throttle = clip(self._throttle + 0.006 * error * dt, 0.0, 1.0)
        return {"roll": roll, "pitch": pitch, "throttle": clip(self._throttle + 0.03 * error, 0.0, 1.0)}

    def _step(self, state: Any) -> float:
        """Simulator time since the last state [s]; a first state, or one after a reset, starts everything."""
        if self._epoch != state.epoch:
            self._epoch, self._time = state.epoch, state.sim_time_unwrapped
            self._pitch, self._elevator, self._throttle = state.pitch_deg, state.control_pitch, state.control_throttle
            self.targets = dict(self._wanted)
            for name, value in (("altitude", state.altitude_msl), ("speed", state.calibrated_airspeed)):
                if self.targets.get(name) is None:
                    self.targets[name] = value
        step = clip(state.sim_time_unwrapped - self._time, 0.0, _LONGEST_STEP_S)
        self._time = state.sim_time_unwrapped
        return step


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="attitude_hold",
        description="A controller to start from: holds attitude, altitude and airspeed of the twin on control/auto.",
    )
    p.add_argument("--roll", type=number("degrees"), metavar="DEG", help="right + (default: wings level)")
    p.add_argument("--heading", type=number("degrees"), metavar="DEG", help="true; instead of roll")
    p.add_argument("--pitch", type=number("degrees"), metavar="DEG", help="nose up +; instead of altitude")
    p.add_argument("--altitude", type=number("metres"), metavar="M", help="MSL (default: the one at engagement)")
    p.add_argument(
        "--speed",
        type=number("metres per second"),
        metavar="M/S",
        help="calibrated airspeed (default: as at engagement)",
    )
    p.add_argument("--engage", action="store_true", help="ask for mode AUTO")
    p.add_argument("--any-aircraft", action="store_true", help=f"fly others than {AIRCRAFT} too, with the same gains")
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    return p


class _Stick:
    """The law with its pedals: those are held in the middle."""

    def __init__(self, hold: AttitudeHold) -> None:
        self._hold = hold
        self.restart = hold.restart

    def fly(self, state: Any) -> Dict[str, float]:
        return {**self._hold.fly(state), "yaw": 0.0}


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    args = parser().parse_args(ros_arguments(argv))
    namespace = args.namespace.rstrip("/")
    start_node("attitude_hold", namespace, **lockstep.node_options(namespace))
    hold = AttitudeHold({name: getattr(args, name) for name in ("roll", "heading", "pitch", "altitude", "speed")})
    aircraft = [] if args.any_aircraft else [AIRCRAFT]
    FlownLaw(_Stick(hold), "attitude_hold", namespace, aircraft, _REMEDY, _NEEDED).run(args.engage)
    return 0
