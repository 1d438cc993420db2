from __future__ import annotations

import numpy as np
import pytest

from xplane_bridge.analysis.criteria import Criterion
from xplane_bridge.analysis.scoring import score

T = np.arange(0, 20.001, 0.01)


def criterion(**values: object) -> Criterion:
    return Criterion(**{"name": "c", "variable": "roll", **values})


def one(c: Criterion, roll: np.ndarray, **labels: float) -> object:
    return score([c], T, {"roll": roll, "heading": roll}, labels, {})[0]


def test_rms_and_peak_in_a_window() -> None:
    roll = 10 + 5 * np.sin(2 * np.pi * T)  # rms about 10 is 5 / sqrt(2), over whole periods
    got = one(criterion(measure="rms", target=10.0, start=2.0, end=12.0, below=3.6), roll)
    assert got.value == pytest.approx(5 / np.sqrt(2), rel=1e-3)
    assert got.passed
    assert not one(criterion(measure="rms", target=10.0, start=2.0, end=12.0, below=3.5), roll).passed
    assert one(criterion(measure="peak", target=9.0), roll).value == pytest.approx(6.0, abs=1e-3)


def test_overshoot_is_seen_from_the_start() -> None:
    step = np.where(T < 5, 0.0, 10.0)
    ringing = step + np.where(T >= 5, 3 * np.exp(-(T - 5)) * np.sin(4 * (T - 5)), 0.0)
    up = one(criterion(measure="overshoot", target=10.0), ringing)
    assert up.value == pytest.approx(np.max(ringing) - 10.0)
    down = one(criterion(measure="overshoot", target=-10.0), -ringing)
    assert down.value == pytest.approx(up.value)


def test_where_it_begins_on_the_target_both_sides_are_beyond_it() -> None:
    rolled = np.where(T < 1, 0.0, -30 * np.sin(T - 1))
    assert one(criterion(measure="overshoot", target=0.0), rolled).value == pytest.approx(30.0, abs=0.01)


def turned(*corners: float) -> np.ndarray:
    """A heading that goes evenly from corner to corner, past 0 and 360."""
    return np.interp(T, np.linspace(0.0, 20.0, len(corners)), corners) % 360.0


@pytest.mark.parametrize(
    ("heading", "overshoot"),
    [
        (turned(0.1, -0.1, -180.0, -180.0), 0.0),  # left, after a yaw to the right that no target asks for
        (turned(0.1, -0.1, -180.0, -184.0, -180.0), 4.0),  # and too far
        (turned(0.1, -0.1, 0.1, 180.0, 183.0, 180.0), 3.0),  # to and fro, and then right
        (turned(359.9, 360.1, 540.0, 545.0, 540.0), 5.0),
        (turned(90.0, 180.0, 200.0, 180.0), 20.0),  # the short way
        (turned(90.0, 0.0, -180.0, -190.0, -180.0), 10.0),  # the long way
        (turned(90.0, 180.0, 400.0), 220.0),  # on past the target, and more than half a turn
        (turned(180.0, 174.0, 182.0), 6.0),  # from the target itself
    ],
)
def test_overshoot_of_a_heading_is_seen_from_the_side_from_which_it_turns_to_the_target(
    heading: np.ndarray, overshoot: float
) -> None:
    got = one(criterion(variable="heading", measure="overshoot", target=180.0), heading)
    assert got.value == pytest.approx(overshoot, abs=0.1)
    known = heading + unknown(0.3, 1.5) + unknown(16.0, 16.1)  # also where it crosses the border unseen
    assert one(criterion(variable="heading", measure="overshoot", target=180.0), known).value == pytest.approx(
        overshoot, abs=0.1
    )


def test_overshoot_of_what_does_not_wrap_has_no_other_side() -> None:
    climbed = score([criterion(variable="altitude", measure="overshoot", target=1000.0)], T,
                    {"altitude": 800.0 - 20.0 * T}, {}, {})[0]  # fmt: skip
    assert climbed.value == 0.0


def test_settling_counts_to_the_last_time_outside() -> None:
    roll = np.where(T < 5, 0.0, 30 * np.exp(-0.5 * (T - 5)))
    # 30 exp(-t / 2) = 3 at t = 2 ln 10
    got = one(criterion(measure="settling", target=0.0, band=3.0, start="fault", below=5.0), roll, fault=5.0)
    assert got.value == pytest.approx(2 * np.log(10), abs=0.02)
    assert got.passed
    never = one(criterion(measure="settling", target=0.0, band=3.0, start="fault", end=8.0, below=5.0), roll, fault=5.0)
    assert (never.value, never.passed) == (np.inf, False)
    assert one(criterion(measure="settling", target=0.0, band=40.0, below=1.0), roll).value == 0.0


def test_heading_compares_the_short_way() -> None:
    heading = np.where(T < 10, 350.0, 10.0)
    got = one(criterion(variable="heading", measure="peak", target=0.0), heading)
    assert got.value == pytest.approx(10.0)


def test_whether_a_sample_lies_in_a_window_does_not_hang_on_the_last_bit_of_its_time() -> None:
    criteria = (
        criterion(measure="maximum", start=1.0, end=3.0, above=0.0),
        criterion(measure="minimum", start=1.0, end=3.0, above=0.0),
        criterion(measure="final", above=0.0),
    )
    frames = np.arange(241)
    values = np.where(frames % 60 == 0, frames, 100.0)  # at the whole seconds 0, 60, 120, 180 and 240
    for period in (1.0 / 60.0, float(np.float32(1.0 / 60.0)), 1.0 / 60.0 - 1e-9):
        found = [score([each], frames * period, {"roll": values}, {}, {})[0].value for each in criteria]
        assert found == pytest.approx([180.0, 60.0, np.mean(values[180:])])


def test_final_and_extremes() -> None:
    assert one(criterion(measure="final"), T).value == pytest.approx(19.5)
    assert one(criterion(measure="minimum", start=3.0), T).value == pytest.approx(3.0)
    assert one(criterion(measure="maximum", end=4.0), T).value == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("variable", "values", "mean"),
    [
        ("roll", np.where(np.arange(len(T)) % 2, 179.0, -179.0), -180.0),  # on its back, not level
        ("heading", np.where(np.arange(len(T)) % 2, 359.5, 0.5), 0.0),
        ("heading", np.full(len(T), 359.0), 359.0),
        ("pitch", np.full(len(T), -89.0), -89.0),
    ],
)
def test_final_angles_are_meant_the_short_way(variable: str, values: np.ndarray, mean: float) -> None:
    got = score([criterion(variable=variable, measure="final")], T, {variable: values}, {}, {})[0].value
    assert abs((got - mean + 180.0) % 360.0 - 180.0) < 1.0
    assert -180.0 <= got < 360.0


def test_a_window_that_the_flight_did_not_reach_is_not_measured() -> None:
    held = criterion(measure="rms", start=0.0, end=60.0, below=6.0)
    got = one(held, 0 * T)  # T ends at 20 s
    assert not got.passed
    assert got.text == "below 6; the flight ended at 20 s, before 60 s"
    assert one(criterion(measure="rms", start=0.0, end=20.05, below=6.0), 0 * T).passed
    slow = np.arange(0.0, 20.1, 1.0)
    each_second = criterion(measure="rms", start=0.0, end=21.5, below=6.0)
    assert score([each_second], slow, {"roll": 0 * slow}, {}, {})[0].passed  # its next state would lie behind


def test_what_cannot_be_measured_has_not_passed() -> None:
    label = one(criterion(measure="rms", start="fault", below=1.0), 0 * T)
    assert not label.passed
    assert "the event 'fault' never happened" in label.text
    window = one(criterion(measure="rms", start=5.001, end=5.009, below=1.0), 0 * T)
    assert "no samples between 5.001 s and 5.009 s" in window.text
    camera = one(Criterion("p", "paired", above=0.9), 0 * T)
    assert "no images" in camera.text
    assert not camera.passed
    good = score([Criterion("p", "paired", above=0.9)], T, {}, {}, {"paired": 0.99})[0]
    assert good.passed


def unknown(begin: float, end: float) -> np.ndarray:
    return np.where((begin <= T) & (end > T), np.nan, 0.0)


@pytest.mark.parametrize("measure", ["rms", "peak", "overshoot", "settling", "minimum", "maximum"])
def test_half_of_a_window_must_be_known(measure: str) -> None:
    demand = criterion(measure=measure, start=0.0, end=10.0, band=1.0, above=-1.0, below=50.0)
    got = one(demand, unknown(1.0, 9.0))
    assert not got.passed
    assert got.text.endswith("; roll is known in 20 % of the samples between 0 s and 10 s; expected 50 % or more")
    assert one(demand, unknown(3.0, 7.0)).passed
    assert one(demand, unknown(10.1, 20.0)).passed  # outside of the window


@pytest.mark.parametrize("measure", ["settling", "final"])
def test_the_end_of_a_window_must_be_known_where_it_is_what_counts(measure: str) -> None:
    demand = criterion(measure=measure, band=1.0, above=-1.0, below=50.0)
    got = one(demand, unknown(12.0, 99.0))
    assert not got.passed
    assert got.text.endswith("; roll is known until 11.99 s; expected it where the window ends, at 20 s")
    assert one(demand, unknown(19.95, 99.0)).passed  # a few states
    assert one(criterion(measure="rms", below=1.0), unknown(12.0, 99.0)).passed


def test_final_is_of_the_last_second_of_the_window_whatever_was_known_before() -> None:
    demand = criterion(measure="final", below=50.0)
    assert one(demand, T + unknown(0.0, 18.0)).value == pytest.approx(19.5)
    assert one(demand, T + unknown(0.0, 19.5)).value == pytest.approx(19.75)
    got = one(demand, T + unknown(0.0, 19.9))
    assert not got.passed
    assert got.text.endswith("; roll is known in 11 % of the samples between 19 s and 20 s; expected 50 % or more")


def test_overshoot_takes_the_start_of_the_window() -> None:
    got = one(criterion(measure="overshoot", below=50.0), unknown(0.0, 5.0))
    assert not got.passed
    assert got.text.endswith("; roll is known from 5 s; expected it where the window begins, at 0 s")


def test_settling_takes_unknown_time_for_outside_of_the_band() -> None:
    demand = criterion(measure="settling", band=1.0, below=50.0)
    assert one(demand, unknown(0.0, 5.0)).value == pytest.approx(5.0)
    assert one(demand, unknown(8.0, 9.0)).value == pytest.approx(9.0)
    assert one(demand, np.where(T < 3.0, 5.0, unknown(8.0, 9.0))).value == pytest.approx(9.0)
    assert one(demand, np.where(T < 10.0, 5.0, 0.0) + unknown(8.0, 9.0)).value == pytest.approx(10.0)
    for few in (unknown(0.0, 0.05), unknown(8.0, 8.05)):
        assert one(demand, few).value == 0.0
