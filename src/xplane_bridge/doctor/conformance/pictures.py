"""Reads X-Plane's window again and again, to see how often its picture changes."""

from __future__ import annotations

import os
import time
import zlib
from dataclasses import dataclass
from typing import Callable, Iterator, Optional, Tuple

from xplane_bridge.doctor.conformance.verdict import NotTestableError
from xplane_bridge.doctor.observe import windows
from xplane_bridge.doctor.settings import WINDOW_TITLES

#: A piece of the watch has so many frames, and counts if so many of them fell between two readings of their own.
_PIECE_FRAMES, _DISTINCT = 10, 0.8


@dataclass(frozen=True)
class Seen:
    """What was seen of a window in the pieces of the watch in which it was read often enough.

    Attributes:
        frames: Frames in these pieces.
        distinct: Readings with a frame since the one before: so many different pictures could be seen.
        changes: How often a reading differed from the one before.
        grabs: All readings, of other pieces too.
        duration_s: Of the whole watch [s].
    """

    frames: int
    distinct: int
    changes: int
    grabs: int
    duration_s: float


def watch(new_frames: Callable[[], int], wanted: int, patience_s: float) -> Seen:
    """Reads the window's picture as often as it goes; arguments as of `compare`.

    Raises:
        NotTestableError: There is no such window on this computer, or it cannot be read.
    """
    name = os.environ.get("DISPLAY", "")
    if not name:
        raise NotTestableError("DISPLAY is not set: run the doctor where X-Plane's window is")
    found = [each for each in windows.observe(name, lambda _: False).windows if each.title in WINDOW_TITLES]
    if not found or not found[0].shown:
        raise NotTestableError(f"no window {' or '.join(WINDOW_TITLES)} is shown on display {name}")
    with windows.reader(name) as read:
        return compare(_checks(read, found[0]), new_frames, wanted, patience_s)


def compare(checks: Iterator[int], new_frames: Callable[[], int], wanted: int, patience_s: float) -> Seen:
    """Compares readings with frames until enough frames were distinct.

    A busy computer may read slower than X-Plane draws for a while; what falls between two readings then says nothing.

    Args:
        checks: Reads the picture; gives a number that differs when the picture does.
        new_frames: Gives the number of frames since the call before.
        wanted: Ends after so many frames in pieces that count.
        patience_s: Ends after so long [s].
    """
    last = next(checks)
    new_frames()
    begin = time.monotonic()
    total, piece, grabs = (0, 0, 0), (0, 0, 0), 0
    while total[0] < wanted and time.monotonic() < begin + patience_s:
        check, came = next(checks), new_frames()
        grabs += 1
        piece = _sum(piece, (came, int(came > 0), int(check != last)))
        last = check
        if piece[0] >= _PIECE_FRAMES:
            if piece[1] >= _DISTINCT * piece[0]:
                total = _sum(total, piece)
            piece = (0, 0, 0)
    return Seen(*total, grabs, time.monotonic() - begin)


def _sum(a: Tuple[int, int, int], b: Tuple[int, int, int]) -> Tuple[int, int, int]:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _checks(read: Callable[[windows.Window], Optional[bytes]], window: windows.Window) -> Iterator[int]:
    while True:
        picture = read(window)
        if picture is None:
            raise NotTestableError("the window's picture cannot be read")
        yield zlib.adler32(picture)
