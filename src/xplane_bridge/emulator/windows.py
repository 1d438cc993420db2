"""Further windows of the emulator, each with a view of its own, as X-Plane has one for each monitor."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from typing import Tuple

#: Views with a name: heading and pitch.
_NAMED = {"down": (0.0, -90.0), "rear": (180.0, 0.0), "left": (-90.0, 0.0), "right": (90.0, 0.0)}
_EXPECTED = f"one of {', '.join(_NAMED)}, or HEADING/PITCH or HEADING/PITCH/ROLL in degrees; @DEGREES may follow"


@dataclass(frozen=True)
class WindowView:
    """How a further window looks, relative to the first one's camera [deg].

    Attributes:
        heading_deg: Right +.
        pitch_deg: Up +.
        roll_deg: Right +.
        field_of_view_deg: Of its own, horizontal; 0: the first window's.
    """

    heading_deg: float
    pitch_deg: float
    roll_deg: float = 0.0
    field_of_view_deg: float = 0.0


def window_view(text: str) -> WindowView:
    """Reads ``down``, ``30/-20``, ``30/-20/5`` or any of these with a field of view, ``down@90``.

    Raises:
        argparse.ArgumentTypeError: It is none of these.
    """
    direction, at, width = text.partition("@")
    angles: Tuple[float, ...] = ()
    try:
        angles = _NAMED.get(direction) or tuple(float(part) for part in direction.split("/"))
        field_of_view = float(width) if at else 0.0
    except ValueError:
        field_of_view = math.nan
    good = len(angles) in (2, 3) and all(abs(angle) <= 180.0 for angle in angles)
    if not good or (at and not 5.0 <= field_of_view <= 150.0):
        raise argparse.ArgumentTypeError(f"{text}: expected {_EXPECTED} (5..150)")
    heading, pitch, roll = (*angles, 0.0)[:3]
    return WindowView(heading, pitch, roll, field_of_view)
