"""Has X-Plane print its times into the picture for a while; in the end, or after a kill, it is as it was before."""

from __future__ import annotations

import math
import time
from typing import Callable

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye import names
from xplane_bridge.eye.calibrate import UndoFile, write_until_reported

_HEARD_WITHIN_S = 5.0


class ScreenError(XplaneBridgeError):
    """X-Plane does not print its times, or does not end it."""


class TimesOnScreen:
    """Row 1 of the Data Output table in the picture; use it with ``with``.

    Args:
        write: Writes a dataref of X-Plane's.
        read: Whether X-Plane printed the row in its last frame, 0 or 1; nan while it does not say.
        undo: Where the user's choice is kept.

    Raises:
        ScreenError: X-Plane does not take it.
        CalibrationError: It cannot be kept.
    """

    def __init__(self, write: Callable[[str, float], None], read: Callable[[], float], undo: UndoFile) -> None:
        self._write = write
        self._read = read
        self._undo = undo

    def __enter__(self) -> None:
        self.restore()
        own = self._heard()
        if own == 1.0:
            return  # the user wants to see it anyway
        taken = False
        if math.isfinite(own):
            self._undo.keep(own)
            taken = self._set(1.0)
            if not taken:
                self.restore()
        if not taken:
            raise ScreenError(
                f"X-Plane does not take {names.TIMES_ON_SCREEN}: tick row 1 (times) for the cockpit in its Data Output "
                "settings, and start again"
            )

    def __exit__(self, *_: object) -> None:
        self.restore()

    def _heard(self) -> float:
        """What X-Plane says of it, whose answers to a new client come one by one; nan where none comes for a while."""
        end = time.monotonic() + _HEARD_WITHIN_S
        while math.isnan(own := self._read()) and time.monotonic() < end:
            time.sleep(0.01)
        return own

    def restore(self) -> None:
        """Gives the user's choice back where a run, this one or a killed one, has changed it.

        Raises:
            ScreenError: X-Plane does not take it.
        """
        own = self._undo.kept()
        if own is None:
            return
        if not self._set(own):
            raise ScreenError(
                "X-Plane does not take back that it prints its times: untick row 1 for the cockpit in its Data Output "
                "settings; it stays noted for the next start"
            )
        self._undo.forget()

    def _set(self, value: float) -> bool:
        return write_until_reported(self._write, self._read, names.TIMES_ON_SCREEN, value)
