"""Loops of the emulator's light twin, and flights made of them. Copy what you need; the gains are this aircraft's."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, Optional

from xplane_bridge.controllers.geometry import GRAVITY_MPS2, Field, Leg, Pace, Place, clip, turn_to
from xplane_bridge.controllers.state import State

AIRCRAFT = "fixed_wing"
Command = Dict[str, float]
_MOST_BANK_DEG = 25.0


class Loops:
    """Position -> velocity -> attitude -> stick, each a method; integrators start from what is flown.

    Args:
        state: The first FlightState.
    """

    def __init__(self, state: State) -> None:
        self._pitch = float(state.pitch_deg)
        self._elevator, self._rudder = float(state.control_pitch), 0.0
        self._throttle = float(state.control_throttle)

    def attitude(self, state: State, dt: float, roll_deg: float, pitch_deg: float) -> Command:
        """Stick for an attitude; pedals against sideslip.

        Args:
            state: FlightState.
            dt: Since the last one [s].
            roll_deg: Right wing down +.
            pitch_deg: Nose up +.
        """
        rates = state.angular_velocity
        error = pitch_deg - state.pitch_deg
        self._elevator = clip(self._elevator + 0.015 * error * dt, -0.6, 0.6)
        if not state.on_ground:
            self._rudder = clip(self._rudder + 0.02 * state.beta_deg * dt, -0.6, 0.6)
        return {
            "roll": clip(0.035 * (roll_deg - state.roll_deg) - 0.012 * math.degrees(rates.x), -1.0, 1.0),
            "pitch": clip(0.03 * error - 0.015 * math.degrees(rates.y) + self._elevator, -1.0, 1.0),
            "yaw": clip(self._rudder + 0.02 * state.beta_deg - 0.01 * math.degrees(rates.z), -1.0, 1.0),
        }

    def begin_climb(self, pitch_deg: float) -> None:
        """From this pitch `climb` goes on: what is right just after leaving the ground."""
        self._pitch = pitch_deg

    def climb(self, state: State, dt: float, climb: float) -> float:
        """Pitch for a vertical speed [deg].

        Args:
            state: FlightState.
            dt: Since the last one [s].
            climb: Up + [m/s].
        """
        error = climb - state.vertical_speed
        self._pitch = clip(self._pitch + 0.3 * error * dt, -15.0, 15.0)
        lean = 1.0 / max(math.cos(math.radians(state.roll_deg)), 0.3) - 1.0
        return clip(self._pitch + 1.2 * error + 10.0 * lean, -12.0, 16.0)

    def airspeed(self, state: State, dt: float, speed: float) -> float:
        """Throttle for a calibrated airspeed [m/s]."""
        error = speed - state.calibrated_airspeed
        self._throttle = clip(self._throttle + 0.006 * error * dt, 0.0, 1.0)
        return clip(self._throttle + 0.03 * error, 0.0, 1.0)

    @staticmethod
    def heading(state: State, heading_deg: float) -> float:
        """Bank for a true heading [deg]."""
        return clip(1.2 * turn_to(heading_deg, state.heading_true_deg), -_MOST_BANK_DEG, _MOST_BANK_DEG)

    @staticmethod
    def position(state: State, leg: Leg, place: Place) -> float:
        """Bank that brings it onto a leg, and along it [deg]."""
        course = leg.course_deg - math.degrees(math.atan2(leg.across(place), 350.0))
        return clip(1.4 * turn_to(course, state.track_deg), -_MOST_BANK_DEG, _MOST_BANK_DEG)

    @staticmethod
    def altitude(state: State, altitude: float) -> float:
        """Vertical speed for a height above the sea [m/s]."""
        return clip(0.2 * (altitude - state.altitude_msl), -5.0, 5.0)


class Flight:
    """A flight in phases: each answers states with commands, and says when the next one begins."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """The next state is the first one."""
        self.phase: Optional[Callable[[State, float], Command]] = None

    def fly(self, state: State) -> Command:
        """Fields of ControlCommand for a FlightState."""
        if self.phase is None:
            self.field, self.loops, self._pace = Field(state), Loops(state), Pace()
            self.began = float(state.sim_time_unwrapped)
            self.phase = self.first
        return self.phase(state, self._pace.step(state))

    def first(self, state: State, dt: float) -> Command:
        """The first phase."""
        raise NotImplementedError


class Hold(Flight):
    """Holds altitude and speed; after `turn_after` [s] turns right by `turn` [deg].

    Args:
        speed: Calibrated [m/s].
        turn_after: [s] of simulator time.
        turn: Right + [deg].
    """

    def __init__(self, speed: float = 60.0, turn_after: float = 20.0, turn: float = 90.0) -> None:
        super().__init__()
        self._speed, self._after, self._turn = speed, turn_after, turn

    def first(self, state: State, dt: float) -> Command:
        """All of it."""
        turned = self._turn if state.sim_time_unwrapped - self.began > self._after else 0.0
        roll = self.loops.heading(state, self.field.heading_deg + turned)
        pitch = self.loops.climb(state, dt, self.loops.altitude(state, self.field.altitude))
        return {
            **self.loops.attitude(state, dt, roll, pitch),
            "throttle": self.loops.airspeed(state, dt, self._speed),
        }


class TakeOff(Flight):
    """Takes off, and climbs straight ahead by pitch, at full throttle: also on one engine.

    Args:
        climb_speed: That the climb gives way for [m/s calibrated].
        cruise_altitude: Above where it stood [m].
    """

    flaps, rotation_mps, gear_up_m, flaps_up_m = 0.25, 38.0, 12.0, 60.0

    def __init__(self, climb_speed: float = 50.0, cruise_altitude: float = 300.0) -> None:
        super().__init__()
        self._climb_speed, self.cruise_altitude = climb_speed, cruise_altitude

    def first(self, state: State, dt: float) -> Command:
        """The run."""
        del dt
        if state.calibrated_airspeed > self.rotation_mps:
            self.phase = self.climb_out
        return {
            "roll": 0.0, "pitch": 0.0, "yaw": self.steered(state), "throttle": 1.0, "flaps": self.flaps,
            "parking_brake": 0.0, "left_brake": 0.0, "right_brake": 0.0, "gear": 1.0,
        }  # fmt: skip

    def steered(self, state: State) -> float:
        """Pedals that keep to the runway's middle."""
        across = self.field.place(state).right
        heading = self.field.heading_deg - clip(0.5 * across, -5.0, 5.0)
        return clip(
            0.03 * turn_to(heading, state.heading_true_deg) - 0.02 * math.degrees(state.angular_velocity.z), -0.5, 0.5
        )

    def climb_out(self, state: State, dt: float) -> Command:
        """Straight ahead; the climb gives way where the speed falls towards `climb_speed`."""
        height = state.altitude_msl - self.field.altitude
        middle = Leg(self.field, Place(0.0, 0.0), Place(1.0, 0.0))
        roll = self.loops.position(state, middle, self.field.place(state)) if height > self.gear_up_m else 0.0
        command = self.climbing(state, dt, roll)
        command["gear"] = 0.0 if height > self.gear_up_m else 1.0
        command["flaps"] = 0.0 if height > self.flaps_up_m else self.flaps
        return command

    def climbing(self, state: State, dt: float, roll: float) -> Command:
        """Full throttle, speed by pitch, up to the cruise altitude."""
        spare = clip(0.6 * (state.calibrated_airspeed - self._climb_speed), -1.0, 5.0)
        climb = min(spare, self.loops.altitude(state, self.field.altitude + self.cruise_altitude))
        if state.on_ground:
            self.loops.begin_climb(7.0)
            pitch = 14.0
        else:
            pitch = self.loops.climb(state, dt, climb)
        return {**self.loops.attitude(state, dt, roll, pitch), "throttle": 1.0}


class Circuit(TakeOff):
    """Take-off, left-hand circuit, landing on the runway it came from, and a full stop."""

    glide = math.tan(math.radians(3.0))
    #: Touch-down ahead of where the take-off run began [m], and where the flare begins above the ground [m].
    aim_m, flare_m = 300.0, 9.0
    _corners = (Place(3600.0, 0.0), Place(3600.0, -1900.0), Place(-5200.0, -1900.0), Place(-5200.0, 0.0))

    def climb_out(self, state: State, dt: float) -> Command:
        """Straight ahead, until the first turn."""
        if self.field.place(state).ahead > 2000.0:
            ways = [*zip((Place(0.0, 0.0), *self._corners), (*self._corners, Place(self.aim_m, 0.0)))]
            self._legs: List[Leg] = [Leg(self.field, start, end) for start, end in ways]
            self.phase, self._climbs = self.around, True
        return super().climb_out(state, dt)

    def around(self, state: State, dt: float) -> Command:
        """Leg by leg, each turn begun early enough to end on the next."""
        place, leg = self.field.place(state), self._legs[0]
        radius = state.ground_speed**2 / (GRAVITY_MPS2 * math.tan(math.radians(_MOST_BANK_DEG)))
        if len(self._legs) > 1 and leg.length - leg.along(place) < 1.1 * radius:
            self._legs.pop(0)
        roll = self.loops.position(state, self._legs[0], place)
        if len(self._legs) == 1 and state.altitude_agl < self.flare_m:
            self.phase = self.flare
        if state.altitude_msl - self.field.altitude > self.cruise_altitude - 20.0:
            self._climbs = False
        if self._climbs:
            return {**self.climbing(state, dt, roll), "gear": 0.0, "flaps": 0.0}
        return self._approach(state, dt, roll, place)

    def _approach(self, state: State, dt: float, roll: float, place: Place) -> Command:
        """Downwind slow and level, then down the glide path."""
        final = len(self._legs) <= 1
        away = sum(leg.length for leg in self._legs) - self._legs[0].along(place)
        path = self.field.altitude + min(self.cruise_altitude, self.glide * away)
        climb = clip(0.25 * (path - state.altitude_msl), -5.0, 3.0)
        if final and path < self.field.altitude + self.cruise_altitude:
            climb = clip(climb - self.glide * state.ground_speed, -5.0, 2.0)
        pitch = self.loops.climb(state, dt, climb)
        return {
            **self.loops.attitude(state, dt, roll, pitch),
            "throttle": self.loops.airspeed(state, dt, 45.0 if final else 52.0),
            "gear": 1.0,
            "flaps": 0.6 if final else 0.3,
        }  # fmt: skip

    def flare(self, state: State, dt: float) -> Command:
        """Throttle to idle, sinking ever slower, wings level."""
        if state.on_ground:
            self.phase = self.roll_out
        sink = clip(0.2 * state.altitude_agl, 0.3, 2.0)
        roll = clip(self.loops.position(state, self._legs[0], self.field.place(state)), -5.0, 5.0)
        # The climb loop alone would come too late.
        pitch = self.loops.climb(state, dt, -sink) + 2.5 * (-sink - state.vertical_speed)
        throttle = 0.2 * clip(state.altitude_agl / self.flare_m, 0.0, 1.0)
        return {**self.loops.attitude(state, dt, roll, pitch), "throttle": throttle, "gear": 1.0, "flaps": 0.6}

    def roll_out(self, state: State, dt: float) -> Command:
        """Nose down gently, brakes, pedals to the middle."""
        brake = 0.0 if state.ground_speed > 35.0 else 0.6
        command = self.loops.attitude(state, dt, 0.0, 0.0)
        command.update(yaw=self.steered(state), throttle=0.0, left_brake=brake, right_brake=brake, gear=1.0, flaps=0.0)
        return command


class PitchAndPower(Flight):
    """Flies without any airspeed: attitude and throttle from a table by the climb, which the altimeter asks for.

    Level for `level_s`, then `height` [m] up, level, half round, and down again. The table is of level flight near
    60 m/s: 3.3 degrees and 0.385; a metre a second more takes the slope of the path and 0.075 of throttle.
    """

    level_s, height, back_s = 20.0, 150.0, 130.0
    level_pitch_deg, level_throttle, throttle_per_mps, speed = 3.3, 0.385, 0.075, 58.0

    def first(self, state: State, dt: float) -> Command:
        """All of it; looks at attitude, heading, height and time."""
        time = state.sim_time_unwrapped - self.began
        up = self.height if self.level_s < time < self.back_s else 0.0
        turned = 180.0 if time > self.back_s - 45.0 else 0.0
        roll = clip(self.loops.heading(state, self.field.heading_deg + turned), -20.0, 20.0)
        climb = clip(0.1 * (self.field.altitude + up - state.altitude_msl), -2.5, 2.5)
        lean = 1.0 / math.cos(math.radians(state.roll_deg)) - 1.0
        pitch = self.level_pitch_deg + math.degrees(math.asin(climb / self.speed)) + 10.0 * lean
        throttle = clip(self.level_throttle + self.throttle_per_mps * climb + 0.8 * lean, 0.0, 1.0)
        return {**self.loops.attitude(state, dt, roll, pitch), "throttle": throttle}
