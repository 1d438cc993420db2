"""A window with live curves: several axes over one rolling time window, pause, PNG."""

from __future__ import annotations

import collections
import itertools
import sys
import threading
import time
from typing import TYPE_CHECKING, Optional, Sequence

import matplotlib
import numpy as np

from xplane_bridge.plotting.spec import COLOURS

if TYPE_CHECKING:
    from pathlib import Path

_REFRESH_MS = 50
_WINDOWLESS = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")  #: matplotlib's backends
_ARRIVALS = itertools.count(1)  #: of samples of all series, in their order: stamps do not say it over a restart


def can_show() -> bool:
    """Returns whether a window can be opened: matplotlib falls back to drawing into memory where it cannot."""
    from matplotlib import pyplot

    pyplot.figure()  # only now the backend is chosen
    pyplot.close()
    return str(matplotlib.get_backend()).lower() not in _WINDOWLESS


class RollingSeries:
    """The newest samples of one quantity; written by one thread, read by another.

    Args:
        name: Shown in the legend.
        window: [s] how much to keep.
    """

    def __init__(self, name: str, window: float) -> None:
        self.name = name
        self.latest = 0  #: number of its newest sample among those of all series
        self.restarted = 0  #: number of the sample with which it last began anew; 0: it never did
        self._window = window
        self._samples: collections.deque[tuple[float, float]] = collections.deque()
        self._lock = threading.Lock()

    def add(self, stamp: float, value: float) -> None:
        """Add a sample; one from before the newest [s] begins anew (the source was restarted)."""
        with self._lock:
            if self._samples and stamp < self._samples[-1][0]:
                self._samples.clear()
                self.restarted = self.latest = next(_ARRIVALS)
            else:
                self.latest = next(_ARRIVALS)
            self._samples.append((stamp, value))
            while self._samples[0][0] < stamp - self._window:
                self._samples.popleft()

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Give times [s] and values, shapes (n,)."""
        with self._lock:
            pairs = np.array(self._samples, dtype=np.float64).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]


class LiveWindow:
    """The window. Space pauses and goes on, s writes a PNG, q closes.

    Args:
        groups: One list of series for each pair of axes, with the axes' label.
        window: [s] width of the time axis.
        png: File that the s key writes; its ending says the format.
    """

    def __init__(self, groups: Sequence[tuple[str, Sequence[RollingSeries]]], window: float, png: Path) -> None:
        from matplotlib import pyplot

        for key in ("keymap.quit", "keymap.save"):
            matplotlib.rcParams[key] = []
        self._window = window
        self._png = png
        self._paused = False
        self._failed: Optional[OSError] = None
        self._pyplot = pyplot
        self._groups = groups
        self.figure, axes = pyplot.subplots(
            len(groups), 1, sharex=True, squeeze=False, figsize=(9, 1.2 + 2.2 * len(groups)), layout="constrained"
        )
        self._axes = axes[:, 0]
        self._lines = []
        for ax, (label, series) in zip(self._axes, groups):
            self._lines.append(
                [ax.plot([], [], color=COLOURS[k % len(COLOURS)], label=s.name)[0] for k, s in enumerate(series)]
            )
            ax.set_ylabel(label)
            ax.grid(alpha=0.3)
            ax.legend(loc="upper left", fontsize=8)
        self._axes[-1].set_xlabel("time [s], 0 is now")
        self._title()
        self.figure.canvas.mpl_connect("key_press_event", self._key)

    def run(self, seconds: Optional[float] = None) -> None:
        """Show the window until it is closed; or for so long [s], and write the PNG then, also without any window.

        Raises:
            OSError: The PNG cannot be written then.
        """
        if seconds is not None and not can_show():
            time.sleep(seconds)
            self._save_and_close()
        else:
            self._show(seconds)
        if self._failed is not None:
            raise self._failed

    def _show(self, seconds: Optional[float]) -> None:
        timer = self.figure.canvas.new_timer(interval=_REFRESH_MS)
        timer.add_callback(self.refresh)
        timer.start()
        end = self.figure.canvas.new_timer(interval=round(1000 * (seconds or 0)) or 1)
        if seconds is not None:
            end.single_shot = True
            end.add_callback(self._save_and_close)
            end.start()
        self._pyplot.show()

    def _save_and_close(self) -> None:
        self.refresh()
        try:
            self.save(self._png)
        except OSError as error:  # a timer's exception would be printed, and the window stay
            self._failed = error
        self._pyplot.close(self.figure)

    def refresh(self) -> None:
        """Draw the newest samples, unless paused."""
        if self._paused:
            return
        every = [series for _, group in self._groups for series in group]
        # Stamps from before a restart that has set the clock back are of no use to find out what is now.
        restart = max((series.restarted for series in every), default=0)
        ends = [series.arrays()[0][-1:] for series in every if series.latest >= restart]
        now = max((float(end[0]) for end in ends if len(end)), default=0.0)
        for ax, lines, (_, group) in zip(self._axes, self._lines, self._groups):
            for line, series in zip(lines, group):
                times, values = series.arrays()
                shown = slice(0) if series.latest < restart and (times[-1:] > now).any() else slice(None)
                line.set_data(times[shown] - now, values[shown])
            ax.relim()
            ax.autoscale_view(scalex=False)
        self._axes[-1].set_xlim(-self._window, 0.0)
        self.figure.canvas.draw_idle()

    def save(self, path: Path) -> None:
        """Write what the window shows."""
        self.figure.savefig(path, dpi=120)

    def _title(self) -> None:
        state = "paused" if self._paused else "live"
        manager = self.figure.canvas.manager
        if manager is not None:
            manager.set_window_title(f"live_plot ({state}; space: pause, s: PNG, q: quit)")

    def _key(self, event: object) -> None:
        key = getattr(event, "key", None)
        if key == " ":
            self._paused = not self._paused
            self._title()
        elif key == "s":
            try:
                self.save(self._png)
            except OSError as error:
                print(f"{self._png} is not written: {error.strerror or error}", file=sys.stderr, flush=True)
            else:
                print(f"wrote {self._png}", flush=True)
        elif key == "q":
            self._pyplot.close(self.figure)
