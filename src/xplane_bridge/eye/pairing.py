"""Which of X-Plane's frames does a picture show? Decided where both are seen, on one clock; no input or output here.

A picture appears some delay after the datagrams of its frame. With that delay known (`calibrate`), the frame is the one
whose arrival is nearest to the picture's change less the delay. Timing alone cannot give the delay: with regular frames
it is as good one period longer.
"""

from __future__ import annotations

import bisect
import itertools
import statistics
from collections import deque
from dataclasses import dataclass
from typing import Any, Deque, List, Optional, Tuple

from xplane_bridge.eye.wire import BORDERLINE, DELAY_ASSUMED

#: A picture that is farther from its frame than this share of the gap to the next may be the neighbour's.
_SURE_SHARE = 0.35
#: A picture that may have appeared earlier than its frame by this share may be of the frame before.
_EARLIER_SHARE = 0.5
#: Farther than this share it is of no frame that was heard; nor of the frame after the nearest, where that was shown
#: before: pictures would then stay one frame off.
_OWN_SHARE = 0.65
_FRAMES = 600
_WAITING = 32
#: A picture is decided without a later frame after so long: X-Plane stands still [s].
_PATIENCE_S = 0.25
_WINDOW = 31
_FOLLOW_GAIN = 0.05
#: Farthest the delay is followed in an hour, as a share of a frame.
_FOLLOW_SHARE_PER_HOUR = 0.25


@dataclass(frozen=True)
class Frame:
    """A frame of X-Plane as it was heard.

    Attributes:
        arrival_ns: When its datagram came [ns].
        key: Its simulator time, the float32 as received [s].
        index: Count of frames.
    """

    arrival_ns: int
    key: float
    index: int


@dataclass(frozen=True)
class Decision:
    """A picture with its frame.

    Attributes:
        picture: As it was handed in.
        change_ns: When it was seen [ns].
        frame: What it shows.
        delay_s: As applied [s].
        residual_s: Change - arrival - delay [s].
        flags: BORDERLINE, DELAY_ASSUMED.
    """

    picture: Any
    change_ns: int
    frame: Frame
    delay_s: float
    residual_s: float
    flags: int


class Pairing:
    """Pairs pictures with frames, in the order of the pictures, each frame at most once. One thread, or a lock.

    Args:
        delay_s: From a frame's datagram to its picture [s]; None: not measured, 0 is used and each picture is flagged.
    """

    def __init__(self, delay_s: Optional[float] = None) -> None:
        self._delay_s = delay_s or 0.0
        self._measured = delay_s is not None
        self._frames: Deque[Frame] = deque(maxlen=_FRAMES)
        self._waiting: Deque[Tuple[int, int, Any]] = deque()
        self._last = -1
        self._residuals: Deque[Tuple[int, float]] = deque(maxlen=_WINDOW)
        self._unseen_ns: Deque[int] = deque(maxlen=_WINDOW)
        self._since_followed = 0
        self._followed_ns: Optional[int] = None
        #: Pictures that were given up: of no frame that was heard, or a second one of the same frame.
        self.dropped = 0

    @property
    def delay_s(self) -> float:
        """The delay that is applied [s]."""
        return self._delay_s

    @property
    def delay_is_sure(self) -> bool:
        """Whether the delay was measured and the pictures have kept to it since."""
        return self._measured

    def set_delay(self, delay_s: float) -> None:
        """The delay was measured."""
        self._delay_s = delay_s
        self._measured = True
        self._residuals.clear()
        self._since_followed = 0
        self._followed_ns = None

    def doubt_delay(self) -> None:
        """From now on each picture is flagged: the window has changed, or its pictures come at another time."""
        self._measured = False

    def add_frame(self, arrival_ns: int, key: float) -> Frame:
        """Takes a frame, in the order of arrival."""
        frame = Frame(arrival_ns, key, self._frames[-1].index + 1 if self._frames else 0)
        self._frames.append(frame)
        return frame

    def add_picture(self, change_ns: int, picture: Any, unseen_ns: int = 0) -> None:
        """Takes a picture that appeared, up to `unseen_ns` before `change_ns`; the oldest of too many is given up."""
        if len(self._waiting) == _WAITING:
            self._waiting.popleft()
            self.dropped += 1
        self._waiting.append((change_ns, unseen_ns, picture))

    def decided(self, now_ns: int) -> List[Decision]:
        """Those pictures that can be decided now: a later frame has come, or none comes."""
        decisions = []
        while self._waiting:
            change_ns, unseen_ns, picture = self._waiting[0]
            moment_ns = change_ns - round(self._delay_s * 1e9)
            later_frame = bool(self._frames) and self._frames[-1].arrival_ns > moment_ns
            if not later_frame and now_ns - change_ns < _PATIENCE_S * 1e9:
                break
            self._waiting.popleft()
            decision = self._decide(change_ns, unseen_ns, moment_ns, picture)
            if decision is None:
                self.dropped += 1
            else:
                decisions.append(decision)
        return decisions

    def _decide(self, change_ns: int, unseen_ns: int, moment_ns: int, picture: Any) -> Optional[Decision]:
        place = self._nearest(moment_ns)
        if place is None:
            return None
        # A frame is shown once. The second picture that lies nearest to it is the next one's, if it is any one's.
        second = self._frames[place].index <= self._last
        if second:
            place += self._last + 1 - self._frames[place].index
            if place >= len(self._frames):
                return None
        frame, gap_ns = self._frames[place], self._gap_ns(place)
        residual_ns = moment_ns - frame.arrival_ns
        if gap_ns is None or abs(residual_ns) > _OWN_SHARE * gap_ns:
            return None
        # Seen late, it may be the picture of the frame before. What a look takes at least is part of the delay.
        self._unseen_ns.append(unseen_ns)
        late_ns = unseen_ns - min(self._unseen_ns)
        late = residual_ns - late_ns < -_EARLIER_SHARE * gap_ns
        flags = BORDERLINE if second or late or abs(residual_ns) > _SURE_SHARE * gap_ns else 0
        self._last = frame.index
        self._follow(change_ns, residual_ns, gap_ns)
        flags |= 0 if self._measured else DELAY_ASSUMED
        return Decision(picture, change_ns, frame, self._delay_s, residual_ns * 1e-9, flags)

    def _nearest(self, moment_ns: int) -> Optional[int]:
        if not self._frames:
            return None
        arrivals = [frame.arrival_ns for frame in self._frames]
        after = bisect.bisect_right(arrivals, moment_ns)
        if after == 0:
            return 0
        if after == len(arrivals):
            return after - 1
        return after if arrivals[after] - moment_ns < moment_ns - arrivals[after - 1] else after - 1

    def _gap_ns(self, place: int) -> Optional[float]:
        """What the residual is judged by: the time to the frame before or after, or between most frames [ns].

        The shortest of them: beside a stall, or a datagram that was lost, a long time is no room for doubt.
        """
        arrivals = [frame.arrival_ns for frame in itertools.islice(self._frames, max(0, place - _WINDOW), place + 2)]
        gaps = [after - before for before, after in zip(arrivals, arrivals[1:])]
        return max(min([*gaps[-2:], statistics.median(gaps)]), 1) if gaps else None

    def _follow(self, change_ns: int, residual_ns: int, gap_ns: float) -> None:
        """Lets the delay follow slow drift within a fraction of a frame; larger changes only raise the flag."""
        self._residuals.append((residual_ns, gap_ns))
        self._since_followed += 1
        if self._since_followed < _WINDOW:
            return
        self._since_followed = 0
        middle_ns = statistics.median(residual for residual, _ in self._residuals)
        period_ns = statistics.median(gap for _, gap in self._residuals)
        if abs(middle_ns) > _SURE_SHARE * period_ns:
            self.doubt_delay()
        since_ns = change_ns - (self._followed_ns if self._followed_ns is not None else change_ns)
        self._followed_ns = change_ns
        most_ns = _FOLLOW_SHARE_PER_HOUR * period_ns * since_ns / 3600e9
        self._delay_s += 1e-9 * max(-most_ns, min(most_ns, _FOLLOW_GAIN * middle_ns))
