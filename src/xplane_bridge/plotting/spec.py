"""What a figure shows, apart from how it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Optional

import numpy as np

if TYPE_CHECKING:
    from xplane_bridge.analysis.episodes import Episode

#: Colours of series in the order they are added to a panel; distinguishable with colour-blind eyes (Okabe-Ito).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#999933", "#000000")
#: Background of episodes by kind.
SHADES = {
    "auto": "#56b4e9",
    "manual": "#bbbbbb",
    "failsafe": "#6a3d9a",
    "failure": "#d62728",
    "excitation": "#e69f00",
    "disturbance": "#009e73",
}
#: Episodes overlap: each only tints.
SHADE_OPACITY = 0.12
_FLAT = 1e-6  # of any unit that is plotted: less is rounding


@dataclass
class Series:
    """One line of a panel."""

    name: str
    time: np.ndarray  #: int64 [ns], shape (n,)
    values: np.ndarray  #: shape (n,); NaN breaks the line
    dashed: bool = False
    stepped: bool = False  #: hold each value until the next


@dataclass
class Panel:
    """One pair of axes over time."""

    label: str  #: quantity and unit, e.g. ``roll [deg]``
    series: list[Series]

    def flat_range(self) -> Optional[tuple[float, float]]:
        """Bounds for values that do not move but for rounding, which would fill the axes with noise; else None."""
        values = np.concatenate([np.asarray(s.values, dtype=float) for s in self.series])
        values = values[np.isfinite(values)]
        if not values.size or np.ptp(values) > _FLAT:
            return None
        middle = float(np.mean(values))
        return middle - 0.5, middle + 0.5


@dataclass
class TimeFigure:
    """Panels above each other on one time axis."""

    key: str  #: short, for file names and links
    title: str
    panels: list[Panel]
    shades: list[tuple[str, Episode]] = field(default_factory=list)  #: (kind, stretch): kind is a key of `SHADES`
    note: str = ""


@dataclass
class PathFigure:
    """A track over ground, or a path in space, coloured by a quantity."""

    key: str
    title: str
    east: np.ndarray  #: [m]
    north: np.ndarray  #: [m]
    up: np.ndarray  #: [m]
    colour: np.ndarray
    colour_label: str
    in_space: bool  #: 3-D
    note: str = ""

    def thinned(self, most: int) -> np.ndarray:
        """Rows to draw: about `most`, evenly, and all that interrupt the line (NaN)."""
        rows = np.unique(np.linspace(0, len(self.east) - 1, most).astype(int))
        return np.union1d(rows, np.flatnonzero(~np.isfinite(self.east)))
