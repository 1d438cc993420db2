"""When a warning comes to the player of a flight in lock-step: by the topic `mission/warnings`, and late."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Deque, Dict, Tuple

import yaml

from xplane_bridge.resources import config_file
from xplane_bridge.scenario import Scenario

_BUILT_IN_RATE = 5  #: of rx_node, where the file does not say it [1/s]
#: Messages that count are at least this old, and at least a period of theirs: as LockstepPlayer takes them [ns].
_LEAST_AGE_NS = 200_000_000
#: A message may be due this part of a frame later and still belong to this frame, as in the emulator's Pacer.
_EARLY = 0.01


def messages_a_second() -> int:
    """Rate of `mission/warnings` by config/rx.yaml [1/s]; 0: there is no such topic."""
    options: Dict[str, Any] = yaml.safe_load(config_file("rx.yaml").read_text(encoding="utf-8")) or {}
    return int(options.get("rates", {}).get("warnings", _BUILT_IN_RATE))


def awaits_stall(scenario: Scenario) -> bool:
    """Whether an event of a scenario waits for the stall warning."""
    return any(condition.variable == "stall_warning" for event in scenario.events for condition in event.when)


class WarningInStep:
    """A warning as the player of a flight in lock-step has it.

    Args:
        frame_rate: [Hz]
        rate: Of the topic [1/s], above 0.
    """

    def __init__(self, frame_rate: float, rate: int) -> None:
        self._frame_period, self._period = 1.0 / frame_rate, 1.0 / rate
        self._age_ns = max(_LEAST_AGE_NS, math.ceil(1e9 / rate))
        self._next = 0.0  # when a message is due [s]
        self._messages: Deque[Tuple[int, bool]] = deque()  # stamp [ns] and warning, too young to count
        self._last = False

    def at(self, frame: int, warning: bool) -> bool:
        """What counts in a frame that has this warning itself; to be asked for each, from 0 on."""
        now = frame * self._frame_period
        stamp_ns = round(now * 1e6) * 1000
        if now >= self._next - _EARLY * self._frame_period:
            self._next = max(self._next, now - self._frame_period) + self._period
            self._messages.append((stamp_ns, warning))
        while self._messages and self._messages[0][0] < stamp_ns - self._age_ns:
            self._last = self._messages.popleft()[1]
        return self._last
