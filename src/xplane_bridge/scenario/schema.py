"""What a scenario is made of, after it has been read and checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Tuple

from xplane_bridge.analysis.criteria import SCORED, Criterion

from ..errors import XplaneBridgeError

#: Stick axes and their ranges; throttle is a lever.
STICK_AXES: Dict[str, Tuple[float, float]] = {
    "roll": (-1.0, 1.0),
    "pitch": (-1.0, 1.0),
    "yaw": (-1.0, 1.0),
    "throttle": (-1.0, 1.0),
}
#: Handles and their ranges; gear: 1 down.
HANDLES: Dict[str, Tuple[float, float]] = {
    "flaps": (0.0, 1.0),
    "gear": (0.0, 1.0),
    "speed_brake": (-0.5, 1.0),
    "thrust_vector": (0.0, 1.0),
    "brakes": (0.0, 1.0),
    "roll_trim": (-1.0, 1.0),
    "pitch_trim": (-1.0, 1.0),
    "yaw_trim": (-1.0, 1.0),
}
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
FAILURE_KINDS = (
    "stuck",
    "hard_over_up",
    "hard_over_down",
    "centred",
    "floating",
    "reduced",
    "slow",
    "gone",
    "failed",
)
EXCITATION_KINDS = ("doublet", "3-2-1-1", "multisine", "chirp")
MODES = {"manual": 1, "auto": 2}


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
