"""When a warning comes to the player of a flight in lock-step: by the topic `mission/warnings`, and late."""

from __future__ import annotations

import functools
from collections import deque
from typing import Any, Deque, Dict, Tuple

import yaml

from xplane_bridge.emulator.wire.subscriptions import Pacer
from xplane_bridge.resources import config_file
from xplane_bridge.scenario.stall_warnings import RATE, age_ns


@functools.lru_cache(maxsize=1)
def messages_a_second() -> int:
    """Rate of `mission/warnings` by config/rx.yaml [1/s]; 0: there is no such topic."""
    options: Dict[str, Any] = yaml.safe_load(config_file("rx.yaml").read_text(encoding="utf-8")) or {}
    return int(options.get("rates", {}).get("warnings", RATE))


class WarningInStep:
    """A warning as the player of a flight in lock-step has it.

    Args:
        frame_rate: [Hz]
        rate: Of the topic [1/s], above 0.
    """

    def __init__(self, frame_rate: float, rate: int) -> None:
        self._frame_period, self._pacer = 1.0 / frame_rate, Pacer(rate)
        self._age_ns = age_ns(rate)
        self._messages: Deque[Tuple[int, bool]] = deque()  # stamp [ns] and warning, too young to count
        self._last = False

    def at(self, frame: int, warning: bool) -> bool:
        """What counts in a frame that has this warning itself; to be asked for each, from 0 on."""
        now = frame * self._frame_period
        stamp_ns = round(now * 1e6) * 1000
        if self._pacer.due(now, self._frame_period):
            self._messages.append((stamp_ns, warning))
        while self._messages and self._messages[0][0] < stamp_ns - self._age_ns:
            self._last = self._messages.popleft()[1]
        return self._last
