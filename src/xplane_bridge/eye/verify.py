"""Checks the pairing by X-Plane's own word: the time that it prints into the picture is compared with the frame's key.

`Verification` takes pictures as the sender does, and says in the end how many show the frame that they are paired with.
"""

from __future__ import annotations

import threading
from collections import Counter, deque
from dataclasses import dataclass, field, replace
from typing import Callable, Deque, Dict, List, Optional, Sequence, Tuple
from typing import Counter as CounterType

import numpy as np

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye.pairing import Decision, Frame
from xplane_bridge.eye.printed import Finder, Place, Reading, grey_of, read

#: Compared in the end.
STILLS = 200
#: Share of the unflagged stills that are to show their very frame.
PROMISED = 0.98
#: Frames so far from the one that a still is paired with are looked at.
_NEIGHBOURS = 12
_KEPT_FRAMES = 4000
_WAITING = 8
#: Share of the stills that must show some frame's time: else it is another number that was read.
_ENOUGH = 0.5
_NOT_FOUND = (
    "no printed time could be read that goes with sim/time/total_running_time_sec: is X-Plane's window in front, and "
    "what lies behind the numbers at its upper left calm? Stand on the ground or look up into the sky, and try again"
)


class VerifyError(XplaneBridgeError):
    """The printed time could not be found or read."""


@dataclass(frozen=True)
class Still:
    """One picture, compared.

    Attributes:
        index: Of the frame that it was paired with.
        off: Frames by which the picture is later than the frame it was paired with; 0: it shows that very frame.
        alone: Whether that frame's neighbours print another time; else the still does not distinguish them.
        flags: Of the pairing.
    """

    index: int
    off: int
    alone: bool
    flags: int


@dataclass
class Findings:
    """What was found.

    Attributes:
        stills: Compared.
        unreadable: Pictures in which a digit could not be read.
        of_no_frame: Pictures that print a time of no frame near.
        decimals: Of the printed time.
    """

    stills: List[Still]
    unreadable: int
    of_no_frame: int
    decimals: int
    off: CounterType[int] = field(init=False)

    def __post_init__(self) -> None:
        self.off = Counter(still.off for still in self.stills)

    @property
    def unflagged(self) -> List[Still]:
        """Stills that the pairing is sure of."""
        return [still for still in self.stills if not still.flags]

    @property
    def good(self) -> bool:
        """Whether as many unflagged stills show their very frame as is promised."""
        sure = self.unflagged
        return bool(sure) and sum(still.off == 0 for still in sure) >= PROMISED * len(sure)

    def lines(self) -> List[str]:
        """The report."""
        count = len(self.stills)
        lines = [f"{self.off[0]} of {count} stills show the frame that they are paired with"]
        for off, stills in sorted(self.off.items()):
            if off:
                side = "later" if off > 0 else "earlier"
                lines.append(f"{stills} show a frame {abs(off)} {side} than the one that they are paired with")
        sure = self.unflagged
        lines.append(f"unflagged: {sum(still.off == 0 for still in sure)} of {len(sure)}")
        blurred = sum(not still.alone for still in self.stills)
        if blurred:
            lines.append(
                f"{blurred} stills fit their frame and its neighbours alike: X-Plane prints {self.decimals} "
                "decimals; lower its frame rate"
            )
        if self.unreadable or self.of_no_frame:
            lines.append(f"left out: {self.unreadable} could not be read, {self.of_no_frame} print a time of no frame")
        return lines


def compare(pairs: Sequence[Tuple[Decision, Optional[Reading]]], keys: Dict[int, float], cut: bool = False) -> Findings:
    """Compares pictures with frames.

    Args:
        pairs: Pictures as they were paired, and what was read in them.
        keys: Time of each frame by its index [s].
        cut: X-Plane cuts decimals off; else it rounds them.
    """
    stills: List[Still] = []
    unreadable = of_no_frame = decimals = 0
    for decision, reading in pairs:
        if reading is None:
            unreadable += 1
            continue
        decimals = max(decimals, reading.decimals)
        index = decision.frame.index
        near = range(index - _NEIGHBOURS, index + _NEIGHBOURS + 1)
        fitting = [k - index for k in near if k in keys and reading.fits(keys[k], cut)]
        if fitting:
            stills.append(Still(index, min(fitting, key=abs), len(fitting) == 1, decision.flags))
        else:
            of_no_frame += 1
    return Findings(stills, unreadable, of_no_frame, decimals)


class Verification:
    """Takes pictures and frames, from any threads; `work` is called again and again by one.

    Args:
        say: Prints what happens.
        stills: Pictures to compare.
    """

    def __init__(self, say: Callable[[str], None], stills: int = STILLS) -> None:
        self._say = say
        self._wanted = stills
        self._lock = threading.Lock()
        self._waiting: Deque[Decision] = deque(maxlen=_WAITING)
        self._keys: Dict[int, float] = {}
        self._finder = Finder()
        self._places: List[Place] = []
        self._layout: Tuple[int, ...] = ()
        self._lines: List[List[np.ndarray]] = []
        self._decisions: List[Decision] = []
        #: In the end.
        self.findings: Optional[Findings] = None

    def __enter__(self) -> Verification:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    @property
    def finished(self) -> bool:
        """Whether there is a result."""
        return self.findings is not None

    def report_problem(self, problem: str) -> None:
        """Does nothing: no other program waits for pictures."""

    def add_frame(self, frame: Frame) -> None:
        """Takes a frame, paired or not."""
        with self._lock:
            self._keys[frame.index] = frame.key
            self._keys.pop(frame.index - _KEPT_FRAMES, None)

    def offer(self, decision: Decision) -> None:
        """Takes a picture; the oldest of too many is given up."""
        with self._lock:
            self._waiting.append(decision)

    def work(self) -> None:
        """Looks at the pictures that have come.

        Raises:
            VerifyError: In the end, no time can be read.
        """
        with self._lock:
            waiting = list(self._waiting)
            self._waiting.clear()
        for decision in waiting:
            if not self.finished:
                self._take(decision)

    def _take(self, decision: Decision) -> None:
        grey = grey_of(decision.picture)
        layout = (*grey.shape, len(str(int(decision.frame.key))))  # with one more digit, all stand elsewhere
        if layout != self._layout:
            self._layout = layout
            self._finder, self._decisions, self._places = Finder(), [], []
        if not self._places:
            self._finder.add(grey, decision.frame.key)
            if not self._finder.missing:
                self._places = self._finder.places()
                self._lines = [[] for _ in self._places]
                if not self._places:
                    raise VerifyError(_NOT_FOUND)
                self._say(f"learnt the digits; reading {self._wanted} stills")
            return
        self._decisions.append(replace(decision, picture=None))
        for place, lines in zip(self._places, self._lines):
            lines.append(place.cut(grey))
        if len(self._decisions) >= self._wanted + _NEIGHBOURS:  # the frames after the last still have come, too
            self.findings = self._result()

    def _result(self) -> Findings:
        with self._lock:
            keys = dict(self._keys)
        results = []
        for place, lines in zip(self._places, self._lines):
            readings = read(place, lines[: self._wanted])
            pairs = list(zip(self._decisions, readings))
            results += [compare(pairs, keys, cut) for cut in (False, True)]
        best = max(results, key=lambda found: len(found.stills))
        if len(best.stills) < _ENOUGH * self._wanted:
            raise VerifyError(_NOT_FOUND)
        return best
