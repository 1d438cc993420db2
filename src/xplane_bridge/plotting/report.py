"""A flight as one HTML page that needs no network: figures, images with their state, and how good the recording is."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Callable, Optional, Sequence, Union

import numpy as np

from xplane_bridge.analysis.consistency import Check, check_flight, check_odometry
from xplane_bridge.analysis.episodes import from_values, who_flew, within
from xplane_bridge.analysis.odometry import of_frames
from xplane_bridge.analysis.quality import bit_shares, pace, timing
from xplane_bridge.analysis.resampling import held
from xplane_bridge.analysis.summary import summary
from xplane_bridge.bags.passport import read_passports
from xplane_bridge.constants import LinkState, words
from xplane_bridge.plotting import cameras, interactive, overlay
from xplane_bridge.plotting.flight_figures import MissingError, all_figures
from xplane_bridge.plotting.page import Section, day_of, missing, number, page, rows_table
from xplane_bridge.plotting.passports import passport_section

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags, Table
    from xplane_bridge.bags.flight import Flight
    from xplane_bridge.labels.table import Labels
    from xplane_bridge.plotting.spec import PathFigure, TimeFigure

#: Of simulated time to the time that it should take, from which on the page says so.
_SLOW = 1.05
_LINK_STATES = words(LinkState)


def build(
    bags: Bags,
    flight: Flight,
    labels: Optional[Labels] = None,
    made: Callable[[Union[TimeFigure, PathFigure]], None] = lambda _: None,
) -> str:
    """Make the report.

    Args:
        bags: Open; images are streamed from them.
        flight: Read from `bags`.
        labels: Of its pictures, to be drawn into some.
        made: Takes each figure as it is made (for PNG files); none is kept, they hold the whole flight.

    Returns:
        The page.
    """
    sections: list[Section] = [("summary", "Summary", _summary(flight))]
    for key, title, make in all_figures():
        try:
            figure = make(flight)
        except MissingError as error:
            sections.append((key, title, missing(str(error))))
            continue
        made(figure)
        linked = " data-time" if hasattr(figure, "panels") else ""
        sections.append((key, title, f"<div{linked}>{interactive.draw(figure, flight.start)}</div>"))
        del figure
    sections.append(("images", "Images and their state", cameras.strips(bags, flight)))
    if labels is not None:
        sections.append(("labels", "Labels in the images", overlay.section(bags, labels, flight.start)))
    sections.append(("quality", "Data quality", _quality(flight)))
    sections.append(("experiment", "How it was made", passport_section(read_passports(bags))))
    return _page(flight, bags, sections)


def _page(flight: Flight, bags: Bags, sections: Sequence[Section]) -> str:
    names = ", ".join(path.name for path in bags.paths)
    # Most recordings are called alike: they go by their folder.
    title = flight.name if flight.name != "flight" else bags.paths[0].resolve().parent.name or flight.name
    return page(f"Flight report: {title}", f"{names} \u00b7 {day_of(flight.start)}", sections)


def _summary(flight: Flight) -> str:
    if "state" not in flight.tables:
        return missing("the bag has no flight_state")
    state = flight.tables["state"]
    cards = [
        f'<div class="card"><b>{number(q.value)} {html.escape(q.unit)}</b><span>{html.escape(q.name)}</span></div>'
        for q in summary(state.stamp, state.columns, flight.parts)
    ]
    rate = timing(state.stamp)
    cards.append(f'<div class="card"><b>{number(rate.rate)} /s</b><span>flight states</span></div>')
    text = f'<div class="cards">{"".join(cards)}</div>'
    return text + _pace(flight) + _who_flew(flight) + _scenario(flight) + _links(flight) + _events(flight)


def _pace(flight: Flight) -> str:
    """Say that the simulator ran slower than real time, where it did."""
    state, asked = flight.tables["state"], np.ones(len(flight.tables["state"]))
    if "sim" in flight.tables:
        sim = flight.tables["sim"]
        ratio = held(state.stamp, sim.stamp, sim["time_ratio_requested"])
        asked = np.where(ratio > 0.0, ratio, 1.0)  # unknown: 1, as X-Plane begins
    found = pace(state.stamp, state.columns, flight.parts, asked)
    if not found.factor > _SLOW:
        return ""
    ends = [number(rate, 2) for rate in (found.slowest, found.fastest)]
    rate = ends[0] if ends[0] == ends[1] else " to ".join(ends)
    return (
        f"<p>X-Plane ran slower than real time, at {rate} frames/s: {number(found.simulated, 3)} s of its time took "
        f"{number(found.host, 3)} s, {found.factor:.3g} times as long. Duration, rates and gaps are of real time.</p>"
    )


def _who_flew(flight: Flight) -> str:
    if "mode" not in flight.tables:
        return ""
    table = flight.tables["mode"]
    rows = []
    end = max(flight.end, int(table.stamp[-1]))
    for stretch in who_flew(table.stamp, table["mode"], table["failsafe"], end):
        first = int(np.searchsorted(table.stamp, stretch.start, side="right")) - 1
        begin = max(stretch.start, _recorded_from(table, flight))
        who = f'<span class="bad">{stretch.label}</span>' if stretch.label == "failsafe" else stretch.label
        why, asked_by = (html.escape(str(table[name][first])) for name in ("reason", "requested_by"))
        if stretch.end > begin:
            rows.append((_seconds(begin, flight), f"{(stretch.end - begin) / 1e9:.1f}", who, why, asked_by))
    return "<h3>Who flew</h3>" + rows_table(("at [s]", "for [s]", "who", "why", "asked by"), rows, (0, 1))


def _recorded_from(table: Table, flight: Flight) -> int:
    """[ns] from which on a latched topic was recorded: its first message may be as old as the bridge."""
    return min(flight.start, int(table.time[0]))


def _scenario(flight: Flight) -> str:
    if "label" not in flight.tables:
        return ""
    table = flight.tables["label"]
    return _stretches("Scenario", "label", table, list(table["data"]), flight)


def _links(flight: Flight) -> str:
    if "link" not in flight.tables:
        return ""
    table = flight.tables["link"]
    return _stretches(
        "Link to X-Plane", "state", table, [_LINK_STATES.get(int(k), str(k)) for k in table["state"]], flight
    )


def _stretches(title: str, column: str, table: Table, labels: Sequence[str], flight: Flight) -> str:
    """List what was so for how long: of a latched topic's messages, the label of each."""
    end = max(flight.end, int(table.stamp[-1]))
    rows = [
        (_seconds(e.start, flight), f"{(e.end - e.start) / 1e9:.1f}", html.escape(e.label))
        for e in within(from_values(table.stamp, labels, end), _recorded_from(table, flight), end)
    ]
    return f"<h3>{title}</h3>" + rows_table(("at [s]", "for [s]", column), rows, (0, 1))


def _events(flight: Flight) -> str:
    rows = [(_seconds(e.stamp, flight), html.escape(e.text), html.escape(e.requested_by)) for e in flight.events]
    if not rows:
        return ""
    return "<h3>Events</h3>" + rows_table(("at [s]", "what", "asked by"), rows, (0,))


def _seconds(stamp: int, flight: Flight) -> str:
    return f"{(stamp - flight.start) / 1e9:.1f}"


def _quality(flight: Flight) -> str:
    rows = []
    for topic in sorted(flight.times):
        t = timing(flight.times[topic])
        gaps = f'<span class="bad">{t.gaps}</span>' if t.gaps else "0"
        jitter, longest = number(t.jitter * 1e3, 3), number(t.longest_gap, 3)
        rows.append((html.escape(topic), str(t.count), number(t.rate), jitter, gaps, longest))
    head = ("topic", "messages", "rate [1/s]", "jitter [ms]", "gaps", "longest pause [s]")
    text = "<h3>Rates, as received</h3>" + rows_table(head, rows, (1, 2, 3, 4, 5))
    if "state" in flight.tables:
        text += _clock(flight) + _validity(flight) + _physics(flight)
    return text + cameras.quality(flight)


def _clock(flight: Flight) -> str:
    state = flight.tables["state"]
    uncertainty = state["stamp_uncertainty"][np.isfinite(state["stamp_uncertainty"])]
    epochs = len(np.unique(state["epoch"]))
    worst = number(np.max(uncertainty) * 1e3, 3) if len(uncertainty) else "&ndash;"
    median = number(np.median(uncertainty) * 1e3, 3) if len(uncertainty) else "&ndash;"
    return (
        f"<h3>Clock</h3><p>Stamps known within {median} ms (median), {worst} ms (worst); {epochs} "
        f"epoch{'s' if epochs != 1 else ''}, {len(flight.parts)} stretch{'es' if len(flight.parts) != 1 else ''} "
        "without a gap.</p>"
    )


def _validity(flight: Flight) -> str:
    state = flight.tables["state"]
    shares = bit_shares(state["valid"], flight.constants["state"], "VALID_")
    poor = {name: share for name, share in shares.items() if share < 1.0}
    if not poor:
        return '<h3>Validity</h3><p class="good">Every group of the flight state is valid in every message.</p>'
    rows = [
        (html.escape(name.lower()), f'<span class="bad">{share * 100:.1f} %</span>') for name, share in poor.items()
    ]
    return "<h3>Validity</h3>" + rows_table(("group of the flight state", "valid in"), rows, (1,))


def _physics(flight: Flight) -> str:
    state = flight.tables["state"]
    checks = check_flight(state.columns, flight.parts)
    if "odom" in flight.tables:
        checks.append(_odometry(flight))
    rows = []
    for check in checks:
        if not check.samples:
            verdict = '<span class="missing">nothing to compare</span>'
        elif check.ok:
            verdict = '<span class="good">holds</span>'
        else:
            verdict = '<span class="bad">violated</span>'
        error = f"{number(check.error, 3)} {check.unit}"
        rows.append((html.escape(check.name), error, f"{number(check.limit, 3)} {check.unit}", verdict))
    return "<h3>Physics</h3>" + rows_table(("relation", "median error", "limit", ""), rows, (1, 2))


def _odometry(flight: Flight) -> Check:
    odom, state = flight.tables["odom"], flight.tables["state"]
    sim_time = state["sim_time_unwrapped"]
    return check_odometry(of_frames(odom.stamp, odom.columns, state.stamp, sim_time, flight.parts))
