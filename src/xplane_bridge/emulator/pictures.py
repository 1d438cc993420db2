"""What draws the emulator's pictures, and how a frame of lock-step waits for its own."""

from __future__ import annotations

import logging
import time
from typing import Callable, Protocol

from xplane_bridge.emulator.simulator import Simulator

_LOG = logging.getLogger(__name__)

#: Longest wait without looking whether to stop [s].
_PATIENCE_S = 0.25
#: A picture that takes longer is reported in the log [s].
_LONG_DRAWING_S = 10.0


class View(Protocol):
    """Where the pictures go."""

    def show(self, sim: Simulator) -> None:
        """Has the frame drawn whose packets were just sent."""

    def drawn(self, timeout_s: float) -> bool:
        """Whether that is done; waits for it so long."""

    @property
    def alive(self) -> bool:
        """Whether there is something that draws."""


def wait_until_shown(view: View, frame: int, stopping: Callable[[], bool]) -> None:
    """Waits until a frame's picture is on display, or `stopping` says so.

    Args:
        view: What draws it, and counts it as drawn when it is on display.
        frame: Its number, for the log.
        stopping: Whether to give up.

    Raises:
        BrokenPipeError: The window is gone.
    """
    began, said = time.monotonic(), False
    while not stopping():
        if view.drawn(_PATIENCE_S):
            if not view.alive:
                raise BrokenPipeError("the window was closed: in lock-step no frame goes on without its picture")
            return
        if not said and time.monotonic() - began > _LONG_DRAWING_S:
            said = True
            _LOG.warning("frame %d waits for the renderer to show its picture", frame)
