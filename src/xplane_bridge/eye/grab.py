"""What the ways of reading a window have in common."""

from __future__ import annotations

import threading
from typing import Any, Callable, List, Optional, Sequence, Tuple, TypeVar, Union

from xplane_bridge.errors import XplaneBridgeError

#: Titles of X-Plane's window, exactly: up to early 12, and since.
TITLES = ("X-System", "X-Plane")
#: The problem where all windows that fit are so.
MINIMISED = "X-Plane's window is minimised: it has no picture"

#: Takes a picture (rows x columns x 4 of BGRX, the taker's own), when it was seen, by time.perf_counter_ns [ns], and
#: for how long before that the window had not been looked at [ns]: it may have appeared so much earlier. 0 where the
#: system brings the pictures: how late it does is not known on macOS, nor on Windows where it gives no time.
Take = Callable[[Any, int, int], None]


#: Of a window on the screen: x, y, width, height [px].
Rect = Tuple[int, int, int, int]
#: Which of several windows alike: its number, or a point [px] of the screen that it covers; None: the largest.
Which = Union[int, Tuple[int, int], None]
W = TypeVar("W")


class GrabError(XplaneBridgeError):
    """Windows cannot be read on this computer."""


def is_xplane(program: str) -> bool:
    """Whether a program, its file's name or path, is X-Plane (X-Plane 12.exe, X-Plane-x86_64), not a browser."""
    return program.replace("/", "\\").rsplit("\\", 1)[-1].lower().startswith("x-plane")


class Grabber:
    """Reads the pictures of a window from a thread of its own; finds a lost window again.

    Args:
        titles: Of the window, exactly.
        which: Of several such windows: its number, counted from 0, the leftmost, then the topmost; or a point of the
            screen that it covers, x, y; None: the largest.
        take: Takes the pictures.

    Attributes:
        problem: Why there is no picture; empty while there are some.
        remark: What is to be known of the window that is taken; empty: nothing.
    """

    def __init__(self, titles: Tuple[str, ...], which: Which, take: Take) -> None:
        self.remark = ""
        self.problem = "the window was not looked for yet"
        self._titles = titles
        self._which = which
        self._taken: Any = None
        self._beside: List[Any] = []  # what had the title when it was taken, shown or not, itself included
        self._take = take
        self._stop = threading.Event()
        self._thread: Optional[threading.Thread] = None

    def start(self) -> None:
        """Begins."""
        self._thread = threading.Thread(target=self.run, name="grab", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def run(self) -> None:
        """Hands pictures over until the end; runs in a thread of its own."""
        raise NotImplementedError

    def _number_of(self, window: Any) -> Any:
        """By which a window is known again when it has moved."""
        return window

    def _chosen(self, windows: Sequence[Tuple[Rect, W]], titled: Sequence[W]) -> Optional[W]:
        """The window that is asked for; says why there is none, and that there are several.

        The one that was taken is taken again, wherever it is by now and whatever its size. Where it goes, numbers and
        sizes choose another of several, which shows another view: that is not taken.

        Args:
            windows: Those to choose from, at least one, with their places.
            titled: All of the title, also those that cannot be chosen now, as they are minimised or not X-Plane's.
        """
        known = [window for _, window in windows if self._number_of(window) == self._taken]
        found = known[0] if known else self._fitting(windows)
        if found is None:
            return None
        number = self._number_of(found)
        if not known and number in self._beside:
            self.problem = (
                "the window that was captured is hidden or closed, and another that was there beside it is not taken "
                "in its place: show it again, or start anew"
            )
            return None
        self._taken = number
        self._beside = [self._number_of(window) for window in titled]
        several = self._which is None and len(windows) > 1
        self.remark = f"the window is one of {len(windows)} that are alike; --window chooses" if several else ""
        return found

    def _fitting(self, windows: Sequence[Tuple[Rect, W]]) -> Optional[W]:
        if self._which is None:
            return max(windows, key=lambda window: window[0][2] * window[0][3])[1]
        ordered = sorted(windows, key=lambda window: window[0][:2])
        if isinstance(self._which, tuple):
            x, y = self._which
            there = [name for (left, top, w, h), name in ordered if left <= x < left + w and top <= y < top + h]
            if there:
                return there[0]
            self.problem = f"there is no window at {x},{y} of the screen: {len(windows)} are alike, none of them there"
            return None
        if self._which < len(windows):
            return ordered[self._which][1]
        self.problem = f"there is no window number {self._which}: {len(windows)} are alike, counted from 0"
        return None

    def _no_window(self, others: Tuple[str, ...]) -> str:
        wanted = " or ".join(f'"{title}"' for title in self._titles)
        seen = ", ".join(f'"{title}"' for title in others[:8]) or "none"
        return f"no window is titled exactly {wanted} (windows with a title: {seen}): is X-Plane running here?"
