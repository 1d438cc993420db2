"""Labels against what the emulator draws: white lines and sun lie there, and not with the neighbour's state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from support.flights.drawn_approach import write_approach
from support.white_lines import MEDIAN_PX, P95_PX, flight_of, measure_flight
from xplane_bridge.bags import Bags
from xplane_bridge.bags.pictures import grey_pictures

if TYPE_CHECKING:
    from pathlib import Path

    from support.white_lines import Lines


def lines_of(path: Path) -> Lines:
    with Bags(path) as bags:
        return measure_flight(bags, flight_of(bags))


def test_white_lines_lie_where_the_labels_say(tmp_path: Path) -> None:
    lines = lines_of(write_approach(tmp_path / "flight.bag", 28))
    assert lines.pictures > 15
    error = np.abs(lines.error)
    assert len(error) > 300
    assert np.median(error) <= 0.2
    assert np.percentile(error, 95) <= 0.6
    assert abs(np.mean(lines.error)) < 0.1


def test_the_state_of_the_neighbouring_frame_shows(tmp_path: Path) -> None:
    lines = lines_of(write_approach(tmp_path / "flight.bag", 28, late=1))
    error = np.abs(lines.error)
    assert len(error) > 200
    assert np.median(error) > MEDIAN_PX
    assert np.percentile(error, 95) > P95_PX


def test_the_sun_is_where_it_is_drawn(tmp_path: Path) -> None:
    looking = {"heading_deg": 35.0, "pitch_deg": 24.0, "roll_deg": 15.0}
    path = write_approach(tmp_path / "flight.bag", 1, **looking)
    with Bags(path) as bags:
        flight = flight_of(bags)
        (line,) = flight.labels()
        ((_, grey),) = grey_pictures(bags, "/xplane/camera/image_raw/compressed")
    (sun,) = (thing for thing in line["objects"] if thing["kind"] == "sun")
    rows, columns = np.nonzero(grey[:440] > 248)
    np.testing.assert_allclose(sun["centre"], [columns.mean(), rows.mean()], atol=0.5)
    assert sun["sigma_px"] < 0.5
    (left, top, right, bottom), radius = sun["box"], np.radians(0.265)
    assert right - left == pytest.approx(2 * 554.26 * np.tan(radius), rel=0.2)
    assert bottom - top == pytest.approx(right - left)


def test_lines_that_run_out_below_the_camera_are_straight(tmp_path: Path) -> None:
    lines = lines_of(write_approach(tmp_path / "flight.bag", 8, far=-300.0))
    assert len(lines.error) > 100
    assert np.percentile(np.abs(lines.error), 95) <= P95_PX
