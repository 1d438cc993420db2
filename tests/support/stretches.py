"""Stretches of a recording in which a busy machine did nearly all that it was asked for."""

from __future__ import annotations

from typing import Iterable, Optional

import numpy as np

_SHARE = 0.9


def last_stretch(came: Iterable[bool], length: int) -> Optional[slice]:
    """The last stretch of so many, one after the other, of which more than nine in ten came; None: there is none.

    A busy machine loses some of a short queue, or stands still altogether for a moment.
    """
    total = np.cumsum([0, *came])
    begins = np.flatnonzero(total[length:] - total[:-length] > _SHARE * length)
    return slice(int(begins[-1]), int(begins[-1]) + length) if len(begins) else None
