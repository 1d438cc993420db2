"""Several flights on one HTML page that needs no network: differences, overlaid figures, how each was made."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.analysis.comparison import (
    SIGNALS,
    Matched,
    ScoreDifference,
    difference,
    score_differences,
    signal_differences,
)
from xplane_bridge.plotting import interactive
from xplane_bridge.plotting.page import Section, missing, number, page, rows_table
from xplane_bridge.plotting.passports import differences_table
from xplane_bridge.plotting.spec import COLOURS, Panel, Series, TimeFigure

if TYPE_CHECKING:
    from xplane_bridge.analysis.intervals import Interval
    from xplane_bridge.bags.passport import Passport

#: Figures: key, title, columns of `SIGNALS`.
_FIGURES = (
    ("attitude", "Attitude", ("roll_deg", "pitch_deg", "heading_true_deg")),
    ("path", "Altitude and speed", ("altitude_msl", "vertical_speed", "true_airspeed")),
    ("airflow", "Angle of attack, sideslip, load", ("alpha_deg", "beta_deg", "load_factor_normal")),
    ("rates", "Body rates", ("angular_velocity.x", "angular_velocity.y", "angular_velocity.z")),
)
_LAST_COLOUR = len(COLOURS)


def build(flights: Sequence[Matched], passports: Sequence[Optional[Passport]], matched_by: str) -> str:
    """Make the page.

    Args:
        flights: The first is the reference, and with it all of its variant.
        passports: Of each flight.
        matched_by: What time 0 is, in words.
    """
    sections: list[Section] = [("flights", "Flights", _list(flights, matched_by))]
    sections.append(("criteria", "Criteria", _criteria(flights)))
    sections.append(("differences", "Differences over time", _differences(flights)))
    for key, title, columns in _FIGURES:
        panels = [panel for panel in (_overlaid(flights, column) for column in columns) if panel.series]
        sections.append(_figure(key, title, panels))
    panels = [_between(flights, column) for column in ("roll_deg", "pitch_deg", "altitude_msl", "true_airspeed")]
    sections.append(_figure("delta", "Difference from the first flight", [p for p in panels if p.series]))
    names = [flight.name for flight in flights]
    sections.append(("passports", "What was made otherwise", differences_table(names, passports)))
    return page(f"{len(flights)} flights compared", f"matched by {matched_by}", sections)


def _list(flights: Sequence[Matched], matched_by: str) -> str:
    rows = []
    for k, flight in enumerate(flights):
        colour = COLOURS[k % _LAST_COLOUR]
        mark = f'<span style="color:{colour}">&#9632;</span> {html.escape(flight.name)}'
        span = f"{number(flight.time[0])} to {number(flight.time[-1])}"
        rows.append((mark, html.escape(flight.variant), span, str(len(flight.time))))
    text = f"<p>Time 0 is {html.escape(matched_by)}. All differences are against the first variant.</p>"
    return text + rows_table(("flight", "variant", "time [s]", "states"), rows, (2, 3))


def _variants(flights: Sequence[Matched]) -> dict[str, list[Matched]]:
    out: dict[str, list[Matched]] = {}
    for flight in flights:
        out.setdefault(flight.variant, []).append(flight)
    return out


def _criteria(flights: Sequence[Matched]) -> str:
    if not any(flight.scores for flight in flights):
        return missing("the flights have no criteria: they are those of a scenario that run_scenario has flown")
    names = list(dict.fromkeys(name for flight in flights for name in flight.scores))
    rows = [(html.escape(name), *(number(f.scores.get(name, math.nan)) for f in flights)) for name in names]
    text = rows_table(("criterion", *(flight.name for flight in flights)), rows, tuple(range(1, len(flights) + 1)))
    variants = _variants(flights)
    reference = next(iter(variants))
    for variant, others in variants.items():
        if variant == reference:
            continue
        changed = [
            (
                html.escape(each.name), number(each.reference), number(each.other), number(each.difference),
                _interval(each.interval), _settled(each) if any(each.never) else _verdict(each.interval),
            )
            for each in score_differences(variants[reference], others)
        ]  # fmt: skip
        text += f"<h3>{html.escape(variant)} against {html.escape(reference)}</h3>"
        head = ("criterion", "reference", "here", "difference", "95 % interval", "")
        text += rows_table(head, changed, (1, 2, 3, 4))
    if max(map(len, variants.values())) == 1:
        text += "<p>An interval needs repetitions: give folders, each with several flights of one variant.</p>"
    return text


def _differences(flights: Sequence[Matched]) -> str:
    text = ""
    for flight in flights[1:]:
        rows = [
            (
                html.escape(each.signal), each.unit, number(each.mean), _interval(each.interval),
                _verdict(each.interval), number(each.rms), number(each.largest), number(each.at),
            )
            for each in signal_differences(flights[0], flight)
        ]  # fmt: skip
        text += f"<h3>{html.escape(flight.name)} - {html.escape(flights[0].name)}</h3>"
        if rows:
            head = ("signal", "unit", "mean", "95 % interval of it", "", "rms", "largest", "at [s]")
            text += rows_table(head, rows, (2, 3, 5, 6, 7))
        else:
            text += missing("they have no time in common")
    return text


def _interval(interval: Interval) -> str:
    if math.isnan(interval.low):
        return "&ndash;"
    return f"{number(interval.low)} to {number(interval.high)}"


def _verdict(interval: Interval) -> str:
    """Whether a difference is more than chance."""
    if math.isnan(interval.low):
        return ""
    if interval.low == interval.high == 0.0:
        return '<span class="good">equal</span>'
    return '<span class="bad">differs</span>' if interval.low > 0.0 or interval.high < 0.0 else "not significant"


def _settled(each: ScoreDifference) -> str:
    """Which of two variants never settles: numbers do not say it."""
    never, of = each.never, each.flights
    if never == of:
        return "neither ever settles"
    if never == (of[0], 0):
        return '<span class="good">settles here, never in the reference</span>'
    if never == (0, of[1]):
        return '<span class="bad">never settles here, does in the reference</span>'
    return f"never settles in {never[1]} of {of[1]} flights here, in {never[0]} of {of[0]} of the reference"


def _figure(key: str, title: str, panels: list[Panel]) -> Section:
    if not panels:
        return key, title, missing("no flight has valid values of these quantities")
    return key, title, f"<div data-time>{interactive.draw(TimeFigure(key, title, panels), 0)}</div>"


def _overlaid(flights: Sequence[Matched], column: str) -> Panel:
    name, unit, factor, period = SIGNALS[column]
    series = []
    for flight in flights:
        if column not in flight.values or not np.isfinite(flight.values[column]).any():
            continue
        values = np.asarray(flight.values[column], dtype=float) * factor
        for part in flight.parts[1:]:
            values[part.start] = np.nan
        if period:
            values[1:][np.abs(np.diff(values)) > period / 2.0] = np.nan
        series.append(Series(flight.name, _ns(flight.time), values))
    return Panel(f"{name} [{unit}]", series)


def _interrupted(reference: Matched, time: np.ndarray, delta: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Differences at some of the reference's samples, with NaN where others are left out, and between its parts."""
    rows = np.searchsorted(reference.time, time)
    starts = [part.start for part in reference.parts[1:]]
    at = np.flatnonzero((np.diff(rows) > 1) | np.isin(rows[1:], starts)) + 1
    return np.insert(time, at, (time[at - 1] + time[at]) / 2.0), np.insert(delta, at, np.nan)


def _between(flights: Sequence[Matched], column: str) -> Panel:
    name, unit, factor, _ = SIGNALS[column]
    series = []
    for flight in flights[1:]:
        if column in flight.values and column in flights[0].values:
            time, delta = difference(flights[0], flight, column)
            if len(time):
                time, delta = _interrupted(flights[0], time, delta * factor)
                series.append(Series(flight.name, _ns(time), delta))
    return Panel(f"{name} [{unit}]", series)


def _ns(time: np.ndarray) -> np.ndarray:
    return np.round(time * 1e9).astype(np.int64)
