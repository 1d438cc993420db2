"""Buttons of a joystick that are tapped: each tap is a press of its own, however the stick is looked at."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Dict, Optional, Set, Tuple

_TAP_S = 0.15  # a press: longer than the mapper's debouncing


@dataclass
class _Tapped:
    waiting: int = 0  # presses still to come
    until: Optional[float] = None  # when the press that is shown ends [s]


class Taps:
    """Presses that begin when the stick is next looked at; between two of a button it is released for one look.

    So none is lost that comes and goes between two looks. For several threads.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._buttons: Dict[int, _Tapped] = {}

    @property
    def pending(self) -> bool:
        """Whether a press goes on or is still to come."""
        with self._lock:
            return bool(self._buttons)

    def add(self, button: int) -> None:
        """Taps a button."""
        with self._lock:
            self._buttons.setdefault(button, _Tapped()).waiting += 1

    def look(self, now: float) -> Tuple[Set[int], Set[int]]:
        """Gives the buttons that are pressed and those that are released now; others are as they would be without taps.

        Args:
            now: Time of this look [s], by any clock that does not go back.
        """
        pressed, released = set(), set()
        with self._lock:
            for button, tap in list(self._buttons.items()):
                if tap.until is None:
                    tap.waiting, tap.until = tap.waiting - 1, now + _TAP_S
                if now < tap.until:
                    pressed.add(button)
                elif tap.waiting:
                    tap.until = None
                    released.add(button)
                else:
                    del self._buttons[button]
        return pressed, released
