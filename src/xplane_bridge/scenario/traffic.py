"""Other aircraft of a scenario: each is begun relative to the own one and flies straight on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from xplane_bridge.units import moved

#: Numbers of one aircraft: metres ahead, to the right of and above the own one where it begins, its heading against the
#: own one's [deg, right +], speed over ground and climb [m/s].
RANGES: Mapping[str, Tuple[float, float]] = {
    "ahead": (-50000.0, 50000.0),
    "right": (-50000.0, 50000.0),
    "above": (-10000.0, 10000.0),
    "turned": (-360.0, 360.0),
    "speed": (0.0, 600.0),
    "climb": (-100.0, 100.0),
}
MOST = 19
#: Between two messages [s] of scenario time; `tx_node` moves them on in between.
PERIOD_S = 0.1
_ROUND_OFF_S = 1e-6


@dataclass(frozen=True)
class _Way:
    number: int
    latitude: float
    longitude: float
    altitude: float
    heading: float
    velocity: Tuple[float, float, float]  # north, east, down [m/s]
    begin: float  # scenario time [s]

    def place(self, now: float) -> Tuple[float, float, float]:
        north, east, down = (speed * (now - self.begin) for speed in self.velocity)
        return *moved(self.latitude, self.longitude, north, east), self.altitude - down


class ScenarioTraffic:
    """Other aircraft of a scenario that is played."""

    def __init__(self) -> None:
        self._ways: List[_Way] = []
        self._sent: Optional[float] = None
        self._changed = False

    def begin(self, aircraft: Sequence[Mapping[str, float]], state: Any, now: float) -> None:
        """Takes an action's list: from now on these fly and no others. `state` is a FlightState of now [s]."""
        turn = math.radians(state.heading_true_deg)
        self._ways = []
        for each in aircraft:
            ahead, right = each.get("ahead", 0.0), each.get("right", 0.0)
            place = moved(
                state.latitude,
                state.longitude,
                ahead * math.cos(turn) - right * math.sin(turn),
                ahead * math.sin(turn) + right * math.cos(turn),
            )
            heading = (state.heading_true_deg + each.get("turned", 0.0)) % 360.0
            speed, along = each.get("speed", 0.0), math.radians(heading)
            velocity = (speed * math.cos(along), speed * math.sin(along), -each.get("climb", 0.0))
            altitude = state.altitude_msl + each.get("above", 0.0)
            self._ways.append(_Way(int(each["number"]), *place, altitude, heading, velocity, now))
        self._changed = True

    def due(self, now: float) -> bool:
        """Whether the list is to be sent now [s], anew or because it changed."""
        again = bool(self._ways) and (self._sent is None or not 0.0 <= now - self._sent < PERIOD_S - _ROUND_OFF_S)
        if not (again or self._changed):
            return False
        self._sent, self._changed = now, False
        return True

    def command(self, now: float) -> Dict[str, List[Any]]:
        """Arrays of TrafficCommand at scenario time `now` [s]."""
        places = [way.place(now) for way in self._ways]
        count = len(places)
        return {
            "number": [way.number for way in self._ways],
            "latitude": [place[0] for place in places],
            "longitude": [place[1] for place in places],
            "altitude_msl": [place[2] for place in places],
            "roll_deg": [0.0] * count,
            "pitch_deg": [0.0] * count,
            "heading_true_deg": [way.heading for way in self._ways],
            "velocity_north": [way.velocity[0] for way in self._ways],
            "velocity_east": [way.velocity[1] for way in self._ways],
            "velocity_down": [way.velocity[2] for way in self._ways],
        }
