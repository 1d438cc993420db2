"""Measures the delay from a frame to its picture: steps of the field of view, seen in both.

X-Plane is asked for a wider field of view and back at random times. The frame whose datagram first reports a step is
the frame whose picture zooms; the random times leave one delay only that explains all steps. The user's value is
written to a file before the first step, and restored on any exit, or by the next start after a kill.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Callable, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye import names
from xplane_bridge.whole_file import replaced

#: Frames by which the datagram that reports a step is later than the step in the picture. 0 until a real
#: X-Plane has been seen to read its network after it answered.
FIELD_OF_VIEW_REPORT_LAG = 0

_STEPS = 10
_STEP_DEG = 8.0
_WIDEST_DEG = 120.0
_BETWEEN_S = (0.15, 0.3)
_SETTLE_S = 0.7
#: Steps that must fit the delay that is found, and how many more than fit any other.
_ENOUGH = 6
_MORE = 2
#: The delay is looked for within these [s].
_LEAST_S, _MOST_S = -0.02, 0.5
#: So many more pictures than steps, those that differ most from the one before, may have zoomed; they differ by at
#: least so many grey levels. No multiple of the usual difference separates them: at few frames a second the aircraft
#: moves nearly as much between two pictures as a step does.
_SPARE = 2
_LEAST_DIFFERENCE = 1.5
_GREY_SIZE = (56, 80)
_SAME_VALUE = 0.01
_WRITE_TIMEOUT_S = 2.0
_WRITE_AGAIN_S = 0.2
#: Another eye's measurement is waited for: longer than one takes, so that capture_node, which waits for 30 s, hears.
_ALONE_WITHIN_S = 15.0
_ALONE_AGAIN_S = 0.1


class CalibrationError(XplaneBridgeError):
    """The delay could not be measured."""


class NoLockError(CalibrationError):
    """There is no file by which the user's eyes could know of each other."""


@dataclass(frozen=True)
class Delay:
    """What was found: the delay [s], the steps that agree with it, and how far these lie from it (median) [s]."""

    delay_s: float
    steps: int
    spread_s: float


def default_undo_file() -> Path:
    """Where the field of view of a running calibration is kept, for each user."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home())
    else:
        base = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return base / "xplane_bridge" / "eye_undo.json"


@contextlib.contextmanager
def alone_with(xplane: str) -> Iterator[None]:
    """Keeps the user's other eyes from an X-Plane's field of view: amid steps, they would take one for the user's own.

    Args:
        xplane: Which X-Plane, HOST:PORT.

    Raises:
        CalibrationError: Another one keeps it for long.
        NoLockError: No file by which they know of each other can be locked.
    """
    end = time.monotonic() + _ALONE_WITHIN_S
    problems = []
    with contextlib.ExitStack() as opened:
        for folder in _lock_folders():
            path = folder / f"eye_{xplane.replace(':', '_')}.lock"
            try:
                folder.mkdir(parents=True, exist_ok=True)
                file = opened.enter_context(path.open("ab"))
                while not _locked(file):
                    if time.monotonic() > end:
                        raise CalibrationError(
                            f"another xplane_eye has kept the field of view of X-Plane at {xplane} for "
                            f"{_ALONE_WITHIN_S:g} s ({path} is locked): end it, or measure again later"
                        )
                    time.sleep(_ALONE_AGAIN_S)
                break
            except OSError as error:
                problems.append(f"{path} cannot be locked ({error.strerror})")
        else:
            raise NoLockError(
                f"{', '.join(problems)}, and without a lock another xplane_eye could change X-Plane's field of view at "
                "the same time: it is left alone. Make one of these folders writable, or give --delay instead"
            )
        yield


def _lock_folders() -> List[Path]:
    """Where the user's eyes look for each other's lock: in the first that can be written and locked."""
    folders = [default_undo_file().parent]
    own = "xplane_bridge"
    if sys.platform != "win32":  # there the temporary folder is the user's own
        own += f"_{os.getuid()}"
    with contextlib.suppress(FileNotFoundError):  # no temporary folder can be written either
        folders.append(Path(tempfile.gettempdir()) / own)
    return folders


def _locked(file: BinaryIO) -> bool:
    """Locks a file until it is closed, by its process's end at the latest; False while another one has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


class UndoFile:
    """A setting of the user's while it is changed: a file, so that it outlives a killed process.

    Args:
        path: The file.
        xplane: Which X-Plane, HOST:PORT; another one's value is left alone.
        name: Of the value in the file.
        words: The setting's name for people.
    """

    def __init__(
        self, path: Path, xplane: str, name: str = "field_of_view_deg", words: str = "X-Plane's field of view"
    ) -> None:
        self._path = path
        self.xplane = xplane
        self._name = name
        self._words = words

    def keep(self, value: float) -> None:
        """Writes it down.

        Raises:
            CalibrationError: The file cannot be written: then nothing may be changed.
        """
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with replaced(self._path) as file:
                json.dump({"xplane": self.xplane, self._name: value}, file)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise CalibrationError(
                f"{self._path} cannot be written ({error.strerror}), and without it {self._words} could not be "
                "restored after a crash: it is left alone"
            ) from None

    def kept(self) -> Optional[float]:
        """The value, where a calibration of this X-Plane was not undone."""
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
            value = float(content[self._name])
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return value if content.get("xplane") == self.xplane and math.isfinite(value) else None

    def forget(self) -> None:
        """Removes the file: the value is restored."""
        self._path.unlink()


def small_grey(pixels: Any) -> np.ndarray:
    """A picture as 80x56 grey levels: blocks of it are looked at by one pixel in each 3x3 of theirs."""
    rows = np.linspace(0, pixels.shape[0] - 1, 3 * _GREY_SIZE[0]).astype(int)
    columns = np.linspace(0, pixels.shape[1] - 1, 3 * _GREY_SIZE[1]).astype(int)
    grey = pixels[rows[:, None], columns, 1].astype(np.float32)
    means: np.ndarray = grey.reshape(_GREY_SIZE[0], 3, _GREY_SIZE[1], 3).mean(axis=(1, 3))
    return means


def step_frames(frames: Sequence[Tuple[int, float]]) -> List[int]:
    """When frames came that report another field of view than the one before [ns].

    Args:
        frames: Arrival [ns] and field of view [deg] of each.
    """
    return [
        arrival_ns for (_, before), (arrival_ns, now) in zip(frames, frames[1:]) if abs(now - before) > 0.5 * _STEP_DEG
    ]


def step_pictures(pictures: Sequence[Tuple[int, float]], steps: int) -> List[int]:
    """When those pictures appeared that may show a step: the ones that differ most from the picture before [ns].

    Args:
        pictures: Change [ns] and mean difference from the picture before [grey levels] of each.
        steps: How many steps there were.
    """
    seen = [picture for picture in pictures if picture[1] > _LEAST_DIFFERENCE]
    most = sorted(seen, key=lambda picture: picture[1], reverse=True)[: steps + _SPARE]
    return sorted(change_ns for change_ns, _ in most)


def settle(frames: Sequence[Tuple[int, float]], pictures: Sequence[Tuple[int, float]]) -> Delay:
    """The delay that explains the steps.

    Args:
        frames: As for `step_frames`.
        pictures: As for `step_pictures`.

    Raises:
        CalibrationError: Too few steps were seen, or they do not agree.
    """
    asked = step_frames(frames)
    shown = step_pictures(pictures, len(asked))
    if len(asked) < _ENOUGH:
        raise CalibrationError(
            f"X-Plane reports {len(asked)} of {_STEPS} steps of its field of view; at least {_ENOUGH} are needed. "
            "Is it held by an aircraft or a plugin? Give --delay instead (estimate_latency measures it)"
        )
    period_ns = statistics.median(b - a for (a, _), (b, _) in zip(frames, frames[1:]))

    def matches(delay_ns: float) -> List[int]:
        found = []
        for arrival_ns in asked:
            nearest = min(
                (change_ns - arrival_ns for change_ns in shown), key=lambda d: abs(d - delay_ns), default=None
            )
            if nearest is not None and abs(nearest - delay_ns) <= 0.5 * period_ns:
                found.append(nearest)
        return found

    pairs = (change_ns - arrival_ns for change_ns in shown for arrival_ns in asked)
    candidates = [delay_ns for delay_ns in pairs if _LEAST_S * 1e9 <= delay_ns <= _MOST_S * 1e9]
    best = max((matches(delay_ns) for delay_ns in candidates), key=len, default=[])
    if len(best) < _ENOUGH:
        raise CalibrationError(
            f"only {len(best)} of {len(asked)} steps of the field of view were seen in the pictures; at least "
            f"{_ENOUGH} are needed. Does the window show X-Plane's own view, and does it change with it? A further "
            "window with a field of view of its own does not: give --delay, which estimate_latency --camera measures"
        )
    middle_ns = statistics.median(best)
    rivals = [len(matches(delay_ns)) for delay_ns in candidates if abs(delay_ns - middle_ns) > 1.5 * period_ns]
    if len(best) < max(rivals, default=0) + _MORE:
        raise CalibrationError(
            f"the steps of the field of view in the pictures fit more than one delay ({len(best)} and {max(rivals)} of "
            f"{len(asked)}): the view moves too much, or X-Plane draws too few frames"
        )
    spread_ns = statistics.median(abs(delay_ns - middle_ns) for delay_ns in best)
    lag_ns = FIELD_OF_VIEW_REPORT_LAG * period_ns
    # Those that agree with a delay at the limit may lie half a frame beyond it, where --delay would not take it.
    delay_s = min(max(_LEAST_S, 1e-9 * (middle_ns + lag_ns)), _MOST_S)
    return Delay(delay_s, len(best), 1e-9 * spread_ns)


class Calibration:
    """A calibration under way: what was seen, and X-Plane's field of view in the meantime.

    Args:
        write: Writes a dataref of X-Plane's.
        read: X-Plane's field of view as of its last frame [deg]; nan while it says none.
        undo: Where the user's value is kept.
        wait: Waits some seconds; may raise to end the program.
    """

    def __init__(
        self,
        write: Callable[[str, float], None],
        read: Callable[[], float],
        undo: UndoFile,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self._write = write
        self._read = read
        self._undo = undo
        self._wait = wait
        self._frames: List[Tuple[int, float]] = []
        self._pictures: List[Tuple[int, float]] = []
        self._before: Optional[np.ndarray] = None

    def add_frame(self, arrival_ns: int, field_of_view_deg: float) -> None:
        """Takes a frame of X-Plane; from any thread."""
        self._frames.append((arrival_ns, field_of_view_deg))

    def add_picture(self, change_ns: int, pixels: Any) -> None:
        """Takes a picture that appeared; from any one thread."""
        grey = small_grey(pixels)
        if self._before is not None:
            self._pictures.append((change_ns, float(np.abs(grey - self._before).mean())))
        self._before = grey

    def restore(self) -> None:
        """Gives X-Plane the value back that a killed calibration has left in it, if there is one.

        Raises:
            CalibrationError: X-Plane does not take it.
        """
        if self._undo.kept() is None:
            return
        with contextlib.ExitStack() as alone:
            with contextlib.suppress(NoLockError):  # without a lock none measures, so none is disturbed
                alone.enter_context(alone_with(self._undo.xplane))
            self._give_back()

    def run(self, why_not: Callable[[], str] = lambda: "") -> Delay:
        """Takes about three seconds. X-Plane's field of view is as before when it returns or raises.

        Args:
            why_not: Gives what speaks against it, else an empty text; asked when no other eye measures any more, for
                which it waits.

        Raises:
            CalibrationError: The delay could not or must not be measured, or the field of view not be restored.
        """
        with alone_with(self._undo.xplane):
            self._give_back()
            reason = why_not()
            if reason:
                raise CalibrationError(reason)
            own = self._read()
            if not math.isfinite(own):
                raise CalibrationError("X-Plane does not say its field of view. Give --delay instead")
            self._undo.keep(own)
            self._frames.clear()  # they show the other eye's steps
            self._pictures.clear()
            try:
                self._step(own)
            except BaseException:
                with contextlib.suppress(CalibrationError):  # which would hide Ctrl-C
                    self._give_back()
                raise
            self._give_back()
        return settle(list(self._frames), list(self._pictures))

    def _step(self, own: float) -> None:
        other = own + _STEP_DEG if own + _STEP_DEG <= _WIDEST_DEG else own - _STEP_DEG
        self._wait(_SETTLE_S)
        for step in range(_STEPS):
            self._write(names.FIELD_OF_VIEW, own if step % 2 else other)
            self._wait(random.uniform(*_BETWEEN_S))
        self._wait(_SETTLE_S)

    def _give_back(self) -> None:
        value = self._undo.kept()
        if value is None:
            return
        if not self._set(value):
            raise CalibrationError(
                f"X-Plane does not take its field of view of {value:g} deg back; it stays noted for the next start"
            )
        self._undo.forget()

    def _set(self, value: float) -> bool:
        return write_until_reported(self._write, self._read, names.FIELD_OF_VIEW, value)


def write_until_reported(
    write: Callable[[str, float], None], read: Callable[[], float], path: str, value: float
) -> bool:
    """Writes a dataref until X-Plane reports it; False when that takes longer than two seconds.

    Args:
        write: Writes a dataref of X-Plane's.
        read: What it said of this one in its last frame.
        path: The dataref.
        value: For it.
    """
    end = time.monotonic() + _WRITE_TIMEOUT_S
    while time.monotonic() < end:
        write(path, value)
        again = time.monotonic() + _WRITE_AGAIN_S
        while time.monotonic() < again:
            if abs(read() - value) < _SAME_VALUE:
                return True
            time.sleep(0.01)
    return False
