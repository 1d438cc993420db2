"""A campaign on one page: shares, quantiles, what drives them, and the worst flights. One file, no network."""

from __future__ import annotations

import html
import math
from typing import Dict, Iterable, List, Mapping, Sequence, Tuple, Union

import numpy as np
import pandas as pd

from xplane_bridge.analysis.criteria import Criterion
from xplane_bridge.analysis.intervals import quantile, rank_correlation, wilson
from xplane_bridge.campaign.definition import Campaign, parameter_of
from xplane_bridge.campaign.flight import FLOWN
from xplane_bridge.campaign.rows import WORKER_DIED

WORST = 10
#: Points of one figure; of more flights every so many-th is drawn.
_MOST_POINTS = 1500
_WIDTH, _HEIGHT = 300, 170
_LEFT, _BOTTOM, _TOP = 52, 34, 8
#: Traces of the worst flights: column and axis label.
_TRACES = (("roll", "roll [deg]"), ("altitude", "altitude [m]"), ("speed", "speed [m/s]"))

_SEQUENTIAL = (
    "Stopped because the interval was narrow enough: a sequential test, whose interval covers a little less often than "
    "95 %."
)
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 1000px; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 0.5em 0 1.5em; } td, th { padding: 0.2em 0.8em; text-align: right; }
th { border-bottom: 1px solid #999; } td:first-child, th:first-child { text-align: left; } svg { margin: 4px; }
svg text { font: 11px system-ui, sans-serif; } .flown { fill: #1f77b4; } .missed { fill: #d62728; }
code { background: #eee; }
.line { fill: none; stroke: #1f77b4; } .frame { fill: none; stroke: #999; } .note { color: #666; }
"""


def worst_first(campaign: Campaign, table: pd.DataFrame) -> pd.DataFrame:
    """The flights, the worst first.

    Those that were not flown to their end come first, then those that miss most criteria, then those whose values lie
    farthest beyond the bounds that they violate (the sum of their ranks among all flights; how well a criterion was met
    does not count); last the number, so that the order is one.
    """
    frame = pd.DataFrame({"ended": table["outcome"] == FLOWN, "missed": 0, "rank": 0.0, "flight": table["flight"]})
    for criterion in campaign.scenario_criteria:
        frame["missed"] += ~table[f"met_{criterion.name}"]
        frame["rank"] += _beyond(campaign, criterion, table).rank(method="average")
    order = frame.sort_values(["ended", "missed", "rank", "flight"], ascending=[True, False, False, True]).index
    return table.loc[order]


def _beyond(campaign: Campaign, criterion: Criterion, table: pd.DataFrame) -> pd.Series:
    """How far values lie beyond the bound that they violate: 0 where they violate none, infinite where not measured."""
    values = table[f"value_{criterion.name}"]
    beyond = pd.Series(0.0, values.index)
    if criterion.below is not None:
        beyond = np.maximum(beyond, values - _bound(campaign, criterion.name, "below", criterion.below, table))
    if criterion.above is not None:
        beyond = np.maximum(beyond, _bound(campaign, criterion.name, "above", criterion.above, table) - values)
    return beyond.fillna(math.inf)


def _bound(campaign: Campaign, name: str, side: str, first: float, table: pd.DataFrame) -> Union[float, pd.Series]:
    """A criterion's bound: one number, or that of each flight where it is drawn; `first` is that of flight 0."""
    drawn = parameter_of(campaign.document["scenario"]["criteria"].get(name, {}).get(side))
    return first if drawn is None else table[f"parameter_{drawn}"].astype(float)


def flights_to_draw(campaign: Campaign, table: pd.DataFrame) -> List[int]:
    """The worst flights that can be flown again for their traces."""
    worst = worst_first(campaign, table).head(WORST)
    flown = worst[(worst["outcome"] != WORKER_DIED) & (worst["sha256"] != "")]
    return [int(flight) for flight in flown["flight"]]


def page(campaign: Campaign, table: pd.DataFrame, traces: Mapping[int, Mapping[str, np.ndarray]], refly: str) -> str:
    """The page.

    Args:
        campaign: What was flown.
        table: Its rows.
        traces: Flight to its columns, for those that are to be drawn.
        refly: The command that flies one again, without the number.
    """
    sequential = campaign.stop is not None and len(table) < campaign.flights
    parts = [
        f"<h1>{html.escape(campaign.name)}</h1>",
        f"<p>{html.escape(str(campaign.document.get('description', '')))}</p>",
        f"<p>{len(table)} flights, {campaign.sampling.replace('_', ' ')}, seed {campaign.seed}. "
        + _outcomes(table) + "</p>",
        f"<p class=note>{_SEQUENTIAL}</p>" if sequential else "",
        "<h2>Criteria</h2>", _shares(campaign, table),
        "<p class=note>95 % intervals by Wilson. Every flight that was started counts, also those without a start.</p>",
        "<h2>Measured values</h2>", _quantiles(campaign, table),
        "<p class=note>By order statistics; intervals of 95 %; &ndash; where there are too few flights for one. "
        "What is of the whole flight is of flights that ended, here and below.</p>",
        "<h2>What drives them</h2>", _correlations(campaign, table), _figures(campaign, table),
        f"<h2>The worst {WORST}</h2>", _worst(campaign, table, traces, refly),
    ]  # fmt: skip
    head = f"<meta charset=utf-8><title>{html.escape(campaign.name)}</title><style>{_STYLE}</style>"
    return f"<!doctype html><html lang=en><head>{head}</head><body>{''.join(parts)}</body></html>\n"


def _outcomes(table: pd.DataFrame) -> str:
    counts = ", ".join(f"{count} {html.escape(str(name))}" for name, count in table["outcome"].value_counts().items())
    return f"Outcomes: {counts}."


def _rows(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; cells are HTML."""
    cells = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>{cells}</table>"


def _shares(campaign: Campaign, table: pd.DataFrame) -> str:
    rows = []
    words = {c.name: f"{c.measure} {c.variable}".strip() for c in campaign.scenario_criteria}
    for name, column in (("all of them", "passed"), *((name, f"met_{name}") for name in campaign.criteria)):
        passed, count = int(table[column].sum()), len(table)
        low, high = wilson(passed, count)
        numbers = f"{passed} of {count}", f"{passed / count:.1%}", f"{low:.1%} .. {high:.1%}"
        rows.append((html.escape(name), *numbers, html.escape(words.get(name, ""))))
    return _rows(("criterion", "met", "share", "95 %", "measures"), rows)


def _quantiles(campaign: Campaign, table: pd.DataFrame) -> str:
    rows = []
    for criterion in campaign.scenario_criteria:
        values = _measured(table, criterion)
        cells = [html.escape(criterion.name), f"{int((~np.isnan(values)).sum())} of {len(values)}"]
        for share in (0.05, 0.5, 0.95):
            got = quantile(values, share)
            cells += [_number(got.value), f"{_number(got.interval.low)} .. {_number(got.interval.high)}"]
        rows.append(cells)
    return _rows(("criterion", "flights", "5 %", "", "median", "", "95 %", ""), rows)


def _measured(table: pd.DataFrame, criterion: Criterion) -> np.ndarray:
    """Its values; NaN of a flight that did not end, where it is of the whole flight: that part says nothing of it."""
    values: np.ndarray = table[f"value_{criterion.name}"].to_numpy(dtype=float, copy=True)
    if criterion.end is None:
        values[(table["outcome"] != FLOWN).to_numpy()] = math.nan
    return values


def _number(value: float) -> str:
    if math.isnan(value):
        return "&ndash;"
    return "&infin;" if value == math.inf else f"{value:.4g}"


def _numeric(campaign: Campaign) -> List[Tuple[str, str]]:
    """Name and axis label of the parameters that are numbers."""
    return [(p.name, f"{p.name} [{p.unit}]" if p.unit else p.name) for p in campaign.parameters if p.numeric]


def _correlations(campaign: Campaign, table: pd.DataFrame) -> str:
    names = [name for name, _ in _numeric(campaign)]
    if not names:
        return "<p>No parameter is a number.</p>"
    rows = []
    for criterion in campaign.scenario_criteria:
        values = _measured(table, criterion)
        drawn = (table[f"parameter_{name}"].to_numpy(dtype=float) for name in names)
        rows.append((html.escape(criterion.name), *(_signed(rank_correlation(d, values)) for d in drawn)))
    note = "<p class=note>Rank correlation (Spearman) of each parameter with each measured value. Near 0 does not mean "
    note += "that a parameter has no effect: an effect of both signs on both sides does not show here, but below.</p>"
    return _rows(("value of", *map(html.escape, names)), rows) + note


def _signed(value: float) -> str:
    return "&ndash;" if math.isnan(value) else f"{value:+.2f}"


def _figures(campaign: Campaign, table: pd.DataFrame) -> str:
    every = max(1, math.ceil(len(table) / _MOST_POINTS))
    drawn = table.iloc[::every]
    out = []
    for criterion in campaign.scenario_criteria:
        y = _measured(drawn, criterion)
        met = drawn[f"met_{criterion.name}"].to_numpy(dtype=bool)
        for name, label in _numeric(campaign):
            out.append(_scatter(drawn[f"parameter_{name}"].to_numpy(dtype=float), y, met, label, criterion.name))
    note = "" if every == 1 else f"<p class=note>Every {every}th flight is drawn.</p>"
    note += "<p class=note>Red: the criterion is missed; on the lower edge: there is no value; above the frame: "
    note += "it never settles.</p>"
    return f"<div>{''.join(out)}</div>{note}"


class _Axes:
    """Scales of one figure, its frame and its labels."""

    def __init__(self, x: np.ndarray, y: np.ndarray, x_label: str, y_label: str) -> None:
        self._x, self._y = _range(x), _range(y)
        right, bottom = _WIDTH - 8, _HEIGHT - _BOTTOM
        self.frame = (
            f'<rect class=frame x="{_LEFT}" y="{_TOP}" width="{right - _LEFT}" height="{bottom - _TOP}"/>'
            f'<text x="{_LEFT}" y="{bottom + 13}">{_tick(self._x[0])}</text>'
            f'<text x="{right}" y="{bottom + 13}" text-anchor="end">{_tick(self._x[1])}</text>'
            f'<text x="{(_LEFT + right) / 2}" y="{bottom + 27}" text-anchor="middle">{html.escape(x_label)}</text>'
            f'<text x="{_LEFT - 4}" y="{bottom}" text-anchor="end">{_tick(self._y[0])}</text>'
            f'<text x="{_LEFT - 4}" y="{_TOP + 9}" text-anchor="end">{_tick(self._y[1])}</text>'
            f'<text transform="rotate(-90)" x="{-(_TOP + bottom) / 2}" y="12" text-anchor="middle">'
            f"{html.escape(y_label)}</text>"
        )

    @property
    def lowest(self) -> float:
        """The value on the lower edge."""
        return self._y[0]

    def place(self, x: float, y: float) -> Tuple[float, float]:
        """Where a point is drawn [px]."""
        (x_low, x_high), (y_low, y_high) = self._x, self._y
        across = _LEFT + (x - x_low) / (x_high - x_low) * (_WIDTH - 8 - _LEFT)
        bottom = _HEIGHT - _BOTTOM
        return across, bottom - (y - y_low) / (y_high - y_low) * (bottom - _TOP)


def _range(values: np.ndarray) -> Tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _tick(value: float) -> str:
    return f"{value:.4g}"


def _svg(content: str) -> str:
    return f'<svg width="{_WIDTH}" height="{_HEIGHT}" role="img">{content}</svg>'


def _scatter(x: np.ndarray, y: np.ndarray, met: np.ndarray, x_label: str, y_label: str) -> str:
    axes = _Axes(x, y, x_label, y_label)
    dots = []
    for across, value, good in zip(x, y, met):
        if not math.isfinite(across):
            continue
        cx, cy = axes.place(across, value if math.isfinite(value) else axes.lowest)
        if value == math.inf:
            cy = _TOP / 2  # beyond every value, and not taken for the largest one
        dots.append(f'<circle class={"flown" if good else "missed"} cx="{cx:.1f}" cy="{cy:.1f}" r="2"/>')
    return _svg(axes.frame + "".join(dots))


def _line(x: np.ndarray, y: np.ndarray, x_label: str, y_label: str) -> str:
    axes = _Axes(x, y, x_label, y_label)
    every = max(1, len(x) // 300)
    points = " ".join("{:.1f},{:.1f}".format(*axes.place(a, b)) for a, b in zip(x[::every], y[::every]))
    return _svg(axes.frame + f'<polyline class=line points="{points}"/>')


def _worst(campaign: Campaign, table: pd.DataFrame, traces: Mapping[int, Mapping[str, np.ndarray]], refly: str) -> str:
    note = "<p class=note>First what was not flown to its end, then what misses most criteria, then what lies farthest "
    note += f"beyond the bounds that it violates. One of them again: <code>{html.escape(refly)} NUMBER</code></p>"
    rows: List[List[str]] = []
    drawings: Dict[int, str] = {}
    worst = worst_first(campaign, table).head(WORST)
    for row in worst.to_dict("records"):
        flight = int(row["flight"])
        cells = [str(flight), html.escape(f"{row['outcome']} {row['reason']}".strip())]
        cells += [_cell(row[f"parameter_{p.name}"]) for p in campaign.parameters]
        cells += [_number(row[f"value_{name}"]) for name in campaign.criteria]
        rows.append(cells)
        if flight in traces:
            t = traces[flight]
            drawings[flight] = "".join(_line(t["time"], t[key], "time [s]", label) for key, label in _TRACES)
    head = (
        "flight",
        "outcome",
        *(html.escape(p.name) for p in campaign.parameters),
        *map(html.escape, campaign.criteria),
    )
    figures = "".join(f"<h3>Flight {flight}</h3><div>{drawing}</div>" for flight, drawing in drawings.items())
    return note + _rows(head, rows) + figures


def _cell(value: object) -> str:
    return html.escape(value) if isinstance(value, str) else _number(float(value))  # type: ignore[arg-type]
