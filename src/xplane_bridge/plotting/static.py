"""Draws figures with Matplotlib, as PNG files for papers and slides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from xplane_bridge.analysis.decimation import min_max
from xplane_bridge.plotting.spec import COLOURS, SHADE_OPACITY, SHADES, PathFigure, TimeFigure

if TYPE_CHECKING:
    from pathlib import Path

_MAX_POINTS = 8000
#: Of any unit: matplotlib's axes, which go a little beyond what they show, do not hold more.
_MOST = 1e300


def save(figure: TimeFigure | PathFigure, start: int, path: Path) -> None:
    """Write a figure as PNG.

    Args:
        figure: What to show.
        start: [ns] zero of the time axis.
        path: File to write.
    """
    with matplotlib.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True}):
        made = _time(figure, start) if isinstance(figure, TimeFigure) else _path(figure)
        made.savefig(path, dpi=150)


def _time(figure: TimeFigure, start: int) -> Figure:
    rows = len(figure.panels)
    made = Figure(figsize=(9, 1.9 * rows + 0.9), layout="constrained")
    all_axes = made.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(all_axes, figure.panels):
        for k, series in enumerate(panel.series):
            time, values = min_max((series.time - start) / 1e9, _drawable(series.values), _MAX_POINTS)
            axes.plot(
                time,
                values,
                label=series.name,
                color=COLOURS[k % len(COLOURS)],
                linewidth=1.1,
                linestyle=":" if series.dashed else "-",
                drawstyle="steps-post" if series.stepped else "default",
            )
        for kind, episode in figure.shades:
            axes.axvspan(
                (episode.start - start) / 1e9,
                (episode.end - start) / 1e9,
                color=SHADES[kind],
                alpha=SHADE_OPACITY,
                linewidth=0,
            )
        axes.set_ylabel(panel.label)
        flat = panel.flat_range()
        if flat is not None:
            axes.set_ylim(flat)
        axes.legend(loc="upper right", fontsize=8, ncol=min(3, len(panel.series)))
    all_axes[0].set_title(figure.title)
    all_axes[-1].set_xlabel("time [s]")
    return made


def _drawable(values: np.ndarray) -> np.ndarray:
    """The values as numbers; NaN where they are too large to be drawn."""
    numbers = np.asarray(values, dtype=float)
    return np.where(np.abs(numbers) > _MOST, np.nan, numbers)


def _path(figure: PathFigure) -> Figure:
    made = Figure(figsize=(8, 6.4), layout="constrained")
    index = figure.thinned(_MAX_POINTS)
    columns = (figure.east, figure.north, figure.up, figure.colour)
    east, north, up, colour = (_drawable(values[index]) for values in columns)
    if figure.in_space:
        axes = made.add_subplot(projection="3d")
        axes.plot(east, north, up, color="0.6", linewidth=0.6)
        dots = axes.scatter(east, north, up, c=colour, s=3)
        axes.set_zlabel("altitude MSL [m]")
    else:
        axes = made.add_subplot()
        axes.plot(east, north, color="0.6", linewidth=0.6)
        dots = axes.scatter(east, north, c=colour, s=4)
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")
    axes.set_title(figure.title)
    made.colorbar(dots, label=figure.colour_label, shrink=0.8)
    return made
