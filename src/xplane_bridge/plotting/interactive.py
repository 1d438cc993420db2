"""Draws figures with Plotly, for the report: zoom, hover, and one time axis shared by all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from xplane_bridge.analysis.decimation import min_max
from xplane_bridge.plotting.spec import COLOURS, SHADE_OPACITY, SHADES, PathFigure, TimeFigure

if TYPE_CHECKING:
    from xplane_bridge.plotting.spec import Series

#: Points drawn of one series; longer ones keep the lowest and highest of each stretch.
MAX_POINTS = 4000
_PANEL_HEIGHT = 190
_LABEL_HEIGHT = 14
_MARGIN = {"l": 70, "r": 20, "t": 30, "b": 40}


def script() -> str:
    """Give plotly.js itself, to be put into the page once."""
    return str(get_plotlyjs())


def draw(figure: TimeFigure | PathFigure, start: int) -> str:
    """Give a figure as an HTML fragment.

    Args:
        figure: What to show.
        start: [ns] zero of the time axis.
    """
    made = _time(figure, start) if isinstance(figure, TimeFigure) else _path(figure)
    config = {"displaylogo": False, "responsive": True}
    return str(made.to_html(full_html=False, include_plotlyjs=False, div_id=f"figure-{figure.key}", config=config))


def _time(figure: TimeFigure, start: int) -> go.Figure:
    rows = len(figure.panels)
    made = make_subplots(rows=rows, cols=1, shared_xaxes=True, vertical_spacing=0.05 if rows > 1 else 0.0)
    for row, panel in enumerate(figure.panels, 1):
        for k, series in enumerate(panel.series):
            made.add_trace(_line(series, start, k, panel.label), row=row, col=1)
        made.update_yaxes(title_text=panel.label, title_font_size=12, row=row, col=1, zeroline=False)
        flat = panel.flat_range()
        if flat is not None:
            made.update_yaxes(range=flat, row=row, col=1)
    named: list[tuple[str, str]] = []
    for kind, episode in figure.shades:
        made.add_vrect(
            x0=(episode.start - start) / 1e9,
            x1=(episode.end - start) / 1e9,
            fillcolor=SHADES[kind],
            opacity=SHADE_OPACITY,
            line_width=0,
            layer="below",
        )
        if (kind, episode.label) not in named:
            named.append((kind, episode.label))
            made.add_annotation(
                x=(episode.start - start) / 1e9,
                y=1.0,
                xref="x",
                yref="paper",
                yshift=_LABEL_HEIGHT * (len(named) - 1),
                text=episode.label,
                showarrow=False,
                xanchor="left",
                yanchor="bottom",
                font={"size": 11, "color": SHADES[kind]},
            )
    made.update_xaxes(title_text="time [s]", row=rows, col=1)
    made.update_layout(
        height=_PANEL_HEIGHT * rows + 90 + _LABEL_HEIGHT * len(named),
        margin={**_MARGIN, "t": _MARGIN["t"] + _LABEL_HEIGHT * len(named)},
        hovermode="x unified",
        template="plotly_white",
        legend={"orientation": "v", "font": {"size": 11}, "tracegroupgap": 12},
    )
    return made


def _line(series: Series, start: int, k: int, panel: str) -> go.Scatter:
    time, values = min_max((series.time - start) / 1e9, np.asarray(series.values, dtype=np.float64), MAX_POINTS)
    return go.Scatter(
        x=np.round(time, 4),
        y=_rounded(values),
        name=series.name,
        legendgroup=panel,
        legendgrouptitle={"text": panel},
        mode="lines",
        line={
            "color": COLOURS[k % len(COLOURS)],
            "width": 1.4,
            "dash": "dot" if series.dashed else "solid",
            "shape": "hv" if series.stepped else "linear",
        },
    )


def _rounded(values: np.ndarray) -> np.ndarray:
    """Cut to six significant digits of the largest: a plot shows no more, and the file stays small."""
    finite = np.abs(values[np.isfinite(values)])
    top = finite.max() if finite.size else 0.0
    return values if top == 0.0 else np.round(values, max(0, 6 - int(np.floor(np.log10(top)))))


def _path(figure: PathFigure) -> go.Figure:
    index = figure.thinned(MAX_POINTS)
    east, north, up, colour = (
        _rounded(values[index]) for values in (figure.east, figure.north, figure.up, figure.colour)
    )
    marker = {
        "color": colour,
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": figure.colour_label, "side": "right"}},
        "size": 3 if figure.in_space else 4,
    }
    made = go.Figure()
    if figure.in_space:
        line = {"color": "rgba(80,80,80,0.4)", "width": 2}
        made.add_trace(go.Scatter3d(x=east, y=north, z=up, mode="lines+markers", line=line, marker=marker, name=""))
        axes = {"xaxis_title": "east [m]", "yaxis_title": "north [m]", "zaxis_title": "altitude MSL [m]"}
        made.update_layout(scene={**axes, "aspectmode": "data"}, height=620, margin={**_MARGIN, "l": 0})
    else:
        line = {"color": "rgba(80,80,80,0.4)", "width": 1}
        made.add_trace(go.Scatter(x=east, y=north, mode="lines+markers", line=line, marker=marker, name=""))
        made.update_xaxes(title_text="east [m]")
        made.update_yaxes(title_text="north [m]", scaleanchor="x", scaleratio=1)
        made.update_layout(height=560, margin=_MARGIN)
    made.update_layout(template="plotly_white", showlegend=False)
    return made
