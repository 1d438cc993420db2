"""Figures of a flight draw nothing where there are no data."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import Flight, read_flight
from xplane_bridge.plotting import interactive, static
from xplane_bridge.plotting.flight_figures import all_figures
from xplane_bridge.plotting.spec import Panel, PathFigure, Series, TimeFigure

if TYPE_CHECKING:
    from pathlib import Path


def figure(flight: Flight, wanted: str) -> TimeFigure | PathFigure:
    return next(make for key, _, make in all_figures() if key == wanted)(flight)


def read(path: Path) -> Flight:
    with Bags(path) as bags:
        return read_flight(bags)


def test_lines_of_every_topic_are_broken_where_states_are_missing(tmp_path: Path) -> None:
    """Of 1 min without states; the engines' first message behind it comes before the first state."""
    with FlightBag(tmp_path / "gap.bag") as bag:
        for k in range(200):
            t = k / 20 + (60.0 if k >= 100 else 0.0)
            state = {**bag.state(t, k), "altitude_msl": 3000.0 if k < 100 else 100.0}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
            ns = stamp_ns(t - 0.01)
            engines = {"header": bag.header(ns, ""), "count": 1, "thrust": [1000.0 + k] + [0.0] * 7}
            bag.add("/xplane/mission/engines", "xplane_bridge/EngineStates", ns, engines)
    flight = read(tmp_path / "gap.bag")
    for key in ("altitude", "engines", "attitude"):
        for series in (series for panel in figure(flight, key).panels for series in panel.series):
            missing = np.flatnonzero(np.isnan(series.values))
            assert missing.tolist() == [100], series.name
            assert len(series.values) == 201, series.name
            assert (np.diff(series.time) > 0).all()


@pytest.mark.parametrize(
    ("middle", "label", "low"),
    [(0.0, "heading -180..180 [deg]", -30.0), (180.0, "heading [deg]", 150.0), (90.0, "heading [deg]", 60.0)],
)
def test_a_heading_about_north_is_one_line(tmp_path: Path, middle: float, label: str, low: float) -> None:
    with FlightBag(tmp_path / "weave.bag") as bag:
        for k in range(500):
            heading = (middle + 30.0 * np.sin(k / 20)) % 360.0
            state = {**bag.state(k / 20, k), "heading_true_deg": heading, "heading_magnetic_deg": heading}
            bag.add(
                "/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 20), {**state, "track_deg": heading}
            )
    panel = figure(read(tmp_path / "weave.bag"), "attitude").panels[2]
    assert panel.label == label
    for series in panel.series:
        assert not np.isnan(series.values).any(), series.name
        assert (series.values.min(), series.values.max()) == pytest.approx((low, low + 60.0), abs=0.1)


def test_a_heading_that_goes_round_is_broken_once_a_turn(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "turns.bag") as bag:
        for k in range(400):
            heading = (5.0 + 3.0 * k) % 360.0
            state = {**bag.state(k / 20, k), "heading_true_deg": heading}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 20), state)
    true = figure(read(tmp_path / "turns.bag"), "attitude").panels[2].series[0]
    assert np.isnan(true.values).sum() == 3


def test_the_track_is_broken_at_a_new_origin(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "origin.bag") as bag:
        for k in range(100):
            t = k / 20
            place = {"position_epoch": 1 + (k >= 50), "position_north": 60.0 * t - (5000.0 if k >= 50 else 0.0)}
            values = {**bag.state(t, k), "position_east": 0.0, **place}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), values)
    track = figure(read(tmp_path / "origin.bag"), "track")
    assert np.nanmax(np.abs(np.diff(track.north))) < 3.01
    assert np.flatnonzero(np.isnan(track.north)).tolist() == [50]


def test_a_command_goes_on_while_surfaces_are_sent_one_by_one(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "both.bag") as bag:
        for k in range(50):
            ns = stamp_ns(k / 50)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, bag.state(k / 50, k))
            controls = {"header": bag.header(ns, ""), "total_roll": 0.01 * k}
            bag.add("/xplane/mission/controls", "xplane_bridge/ControlStates", ns, controls)
            fields = 1 if k < 40 else 2  # then roll is commanded no longer
            command = {"header": bag.header(ns, ""), "source": 2, "fields": fields, "roll": 0.01 * k}
            bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", ns, command)
            echo = {"header": bag.header(ns + 8_000_000, ""), "surface_names": ["rudder1"]}
            bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", ns + 8_000_000, echo)
    lines = {series.name: series.values for series in figure(read(tmp_path / "both.bag"), "controls").panels[0].series}
    np.testing.assert_allclose(lines["commanded"], [*(0.01 * np.arange(40)), *[np.nan] * 10], atol=1e-6)


def test_every_surface_that_moves_is_drawn(tmp_path: Path) -> None:
    moving = ("spoiler2", "flap2", "speedbrake2", "yaw_brake", "wing_elevator1", "wing_elevator2")
    with FlightBag(tmp_path / "wing.bag") as bag:
        for k in range(50):
            ns = stamp_ns(k / 50)
            surfaces = {name: [0.1 * k, -0.1 * k, *[np.nan] * 6] for name in moving}
            values = {"header": bag.header(ns, ""), **surfaces}
            bag.add("/xplane/mission/surfaces", "xplane_bridge/SurfaceStates", ns, values)
    panels = figure(read(tmp_path / "wing.bag"), "surfaces").panels
    assert [panel.label for panel in panels] == [f"{name} [deg]" for name in moving]
    assert {tuple(series.name for series in panel.series) for panel in panels} == {("wing 1 left", "wing 1 right")}


@pytest.mark.parametrize(("count", "drawn"), [(0, ["engine 1", "engine 2"]), (1, ["engine 1"])])
def test_engines_are_drawn_also_without_their_number(tmp_path: Path, count: int, drawn: list[str]) -> None:
    """As one way: rows have eight places, and 0 where the aircraft has no engine."""
    with FlightBag(tmp_path / "engines.bag") as bag:
        for k in range(50):
            ns = stamp_ns(k / 50)
            thrust = [1000.0 + k, 900.0, *[0.0] * 5, np.nan]
            engines = {"header": bag.header(ns, ""), "count": count, "thrust": thrust, "power": [np.nan] * 8}
            bag.add("/xplane/mission/engines", "xplane_bridge/EngineStates", ns, engines)
    panels = {panel.label: panel.series for panel in figure(read(tmp_path / "engines.bag"), "engines").panels}
    assert [series.name for series in panels["thrust [N]"]] == drawn
    assert "power [kW]" not in panels


def test_a_thinned_track_stays_interrupted_in_every_figure() -> None:
    east = np.arange(20001.0)
    east[9_999] = np.nan
    track = PathFigure("track", "Ground track", east, east, east, np.zeros(20001), "altitude", in_space=False)
    for drawn in (static._path(track).axes[0].lines[0].get_xdata(), interactive._path(track).data[0].x):
        assert len(drawn) < 20001
        assert np.isnan(np.asarray(drawn, dtype=float)).sum() == 1


@pytest.mark.parametrize("large", [1e300, 1e308, -1.7e308, np.inf])
def test_values_too_large_to_be_drawn_do_not_end_a_figure(tmp_path: Path, large: float) -> None:
    values = np.arange(100.0)
    values[50] = large
    track = PathFigure("track", "Ground track", values, values, values, values, "altitude", in_space=False)
    series = Series("altitude", (1e9 * np.arange(100.0)).astype(np.int64), values)
    over_time = TimeFigure("altitude", "Altitude", [Panel("altitude [m]", [series])])
    for figure in (track, replace(track, in_space=True), over_time):
        static.save(figure, 0, tmp_path / "x.png")
        assert (tmp_path / "x.png").stat().st_size > 1000
