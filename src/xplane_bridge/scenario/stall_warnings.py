"""By which messages of `mission/warnings` a scenario in lock-step waits for the stall warning."""

from __future__ import annotations

import math

from xplane_bridge.scenario.schema import Scenario

RATE = 5  #: of rx_node where its parameter is not set [1/s]
#: Age of the messages that count, at least: one of them a period later has come by then, at rx_node's own rate or more.
_LEAST_AGE_NS = 200_000_000


def awaits_stall(scenario: Scenario) -> bool:
    """Whether an event of a scenario waits for the stall warning."""
    return any(condition.variable == "stall_warning" for event in scenario.events for condition in event.when)


def age_ns(rate: float) -> int:
    """Age of the messages that count, at a rate of theirs above 0 [1/s]."""
    return max(_LEAST_AGE_NS, math.ceil(1e9 / rate))
