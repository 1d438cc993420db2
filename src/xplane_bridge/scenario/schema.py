"""What a scenario is made of, after it has been read and checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Tuple

from xplane_bridge.analysis.criteria import SCORED, Criterion
from xplane_bridge.constants import COMMAND_FIELDS, FlightMode, words
from xplane_bridge.errors import XplaneBridgeError


def _range(field: str) -> Tuple[float, float]:
    return COMMAND_FIELDS[field].low, COMMAND_FIELDS[field].high


#: Stick axes and their ranges; throttle is a lever.
STICK_AXES: Dict[str, Tuple[float, float]] = {name: _range(name) for name in ("roll", "pitch", "yaw", "throttle")}
#: Handles, and the fields of ControlCommand that each moves.
HANDLE_FIELDS: Dict[str, Tuple[str, ...]] = {
    "flaps": ("flaps",),
    "gear": ("gear",),
    "speedbrake": ("speedbrake",),
    "thrust_vector": ("thrust_vector",),
    "brakes": ("left_brake", "right_brake"),
    "trim_roll": ("trim_roll",),
    "trim_pitch": ("trim_pitch",),
    "trim_yaw": ("trim_yaw",),
}
#: Earlier names of handles, still accepted.
OLD_HANDLES: Dict[str, str] = {
    "speed_brake": "speedbrake",
    "roll_trim": "trim_roll",
    "pitch_trim": "trim_pitch",
    "yaw_trim": "trim_yaw",
}
#: Handles and their ranges; gear: 1 down.
HANDLES: Dict[str, Tuple[float, float]] = {handle: _range(fields[0]) for handle, fields in HANDLE_FIELDS.items()}
#: Targets that the player flies to, with their ranges (units in config/scenarios/README.md).
HOLDS: Dict[str, Tuple[float, float]] = {
    "roll": (-80.0, 80.0),
    "pitch": (-60.0, 60.0),
    "heading": (-360.0, 360.0),
    "climb": (-30.0, 30.0),
    "altitude": (-500.0, 20000.0),
    "speed": (0.0, 300.0),
    "yaw_rate": (-90.0, 90.0),
}
#: What conditions can look at.
VARIABLES = ("time", *SCORED, "on_ground", "stall_warning", "mode")
#: Modes by name, and their numbers.
MODES: Dict[str, int] = {name: number for number, name in words(FlightMode).items()}


class ScenarioError(XplaneBridgeError, ValueError):
    """A scenario that cannot be used: says where (key path), what was given and what is expected."""


@dataclass(frozen=True)
class Condition:
    """All bounds must hold for `variable`."""

    variable: str
    above: Optional[float] = None
    below: Optional[float] = None

    def holds(self, values: Mapping[str, float]) -> bool:
        """Whether it is true of these values."""
        value = values[self.variable]
        return (self.above is None or value > self.above) and (self.below is None or value < self.below)


@dataclass(frozen=True)
class Event:
    """Something that happens once, when its time has come and its conditions hold.

    Attributes:
        at: Scenario time before which it does not happen [s]; None: `after` counts.
        after: Time since the event before it [s].
        when: Conditions, all of them.
        timeout: How long to wait for them before going on without [s]; None: for ever.
        over: How long stick movements take [s].
        actions: By kind, validated; in the order they were written.
    """

    at: Optional[float] = None
    after: float = 0.0
    when: Tuple[Condition, ...] = ()
    timeout: Optional[float] = None
    over: float = 0.0
    actions: Tuple[Tuple[str, Any], ...] = ()


@dataclass(frozen=True)
class Scenario:
    """A scripted flight."""

    name: str
    description: str = ""
    aircraft: Tuple[str, ...] = ()  #: empty: any
    repeat_every: Optional[float] = None  #: start over after so long [s]
    start: Mapping[str, float] = field(default_factory=dict)  #: where it means to begin; for those who can arrange it
    gains: Mapping[str, float] = field(default_factory=dict)
    criteria: Tuple[Criterion, ...] = ()  #: for run_scenario, which checks them
    events: Tuple[Event, ...] = ()
    controller: str = ""  #: module:class or module:function that flies in mode auto; empty: none of its own
    aerodrome: Mapping[str, float] = field(default_factory=dict)  #: what the emulator draws; empty: where it begins

    @property
    def last_event(self) -> float:
        """When a round's last event comes at the latest [s], where conditions without a timeout hold at once."""
        time = 0.0
        for event in self.events:
            time = time + event.after if event.at is None else max(time, event.at)
            time += (event.timeout or 0.0) if event.when else 0.0
        return time
