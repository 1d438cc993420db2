"""Reads X-Plane's window again and again, to see how often its picture changes."""

from __future__ import annotations

import os
import time
import zlib
from dataclasses import dataclass

from xplane_bridge.doctor.conformance.verdict import NotTestableError
from xplane_bridge.doctor.observe import windows
from xplane_bridge.doctor.settings import WINDOW_TITLES


@dataclass(frozen=True)
class Seen:
    """What was seen of a window: readings, how often one differed from the one before, and for how long [s]."""

    grabs: int
    changes: int
    duration_s: float


def watch(duration_s: float) -> Seen:
    """Reads the window's picture as often as it goes, for so long [s].

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
        begin = time.monotonic()
        grabs, changes, last = 0, 0, None
        while time.monotonic() < begin + duration_s:
            picture = read(found[0])
            if picture is None:
                raise NotTestableError("the window's picture cannot be read")
            check = zlib.adler32(picture)
            grabs += 1
            changes += last is not None and check != last
            last = check
        return Seen(grabs, changes, time.monotonic() - begin)
