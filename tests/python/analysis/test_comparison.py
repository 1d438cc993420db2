"""Differences between flights and their intervals, against what is known of made-up flights."""

from __future__ import annotations

import dataclasses
import math
import re
import tracemalloc

import numpy as np
import pytest

from xplane_bridge.analysis.comparison import (
    Matched,
    difference,
    mean_interval,
    score_differences,
    signal_differences,
    welch,
)
from xplane_bridge.plotting.comparison import _between, build


def flight(offset=0.0, shift=0.0, variant="a", scores=None, name="roll_deg", wrap=False):
    time = np.arange(0.0, 60.0, 0.02) + shift
    values = 10.0 * np.sin(time) + offset
    return Matched("f", variant, time, {name: values % 360.0 if wrap else values}, [slice(0, len(time))], scores or {})


def test_a_constant_offset_is_found_at_the_times_both_have():
    time, delta = difference(flight(), flight(2.5, shift=0.007), "roll_deg")
    assert delta == pytest.approx(2.5, abs=1e-3)
    assert time[0] == pytest.approx(0.02)
    (found,) = signal_differences(flight(), flight(2.5))
    assert found[:3] == ("roll", "deg", pytest.approx(2.5))
    assert found.interval.low <= 2.5 <= found.interval.high
    assert (found.rms, found.largest) == (pytest.approx(2.5), pytest.approx(2.5))


def test_an_angle_is_compared_the_short_way_round():
    a, b = flight(0.0, name="heading_true_deg", wrap=True), flight(-3.0, name="heading_true_deg", wrap=True)
    assert difference(a, b, "heading_true_deg")[1] == pytest.approx(-3.0, abs=1e-6)


def test_nothing_is_interpolated_across_a_gap():
    gappy = flight()
    keep = (gappy.time < 20.0) | (gappy.time > 30.0)
    first = int(np.sum(gappy.time < 20.0))
    cut = Matched(
        "g", "a", gappy.time[keep], {"roll_deg": gappy.values["roll_deg"][keep]}, [slice(0, first), slice(first, None)]
    )
    time, delta = difference(flight(), cut, "roll_deg")
    assert not ((time > 20.0) & (time < 30.0)).any()
    assert delta == pytest.approx(0.0, abs=1e-9)


def reset(at, heights=(100.0, 300.0, 700.0)):
    """10 s at a height, then another one from each of these times [s] on, both at the instant."""
    edges = [0.0, *at, 10.0]
    times = [np.arange(a, b + 0.05, 0.1) for a, b in zip(edges[:-1], edges[1:])]
    values = [np.full(len(time), height) for time, height in zip(times, heights)]
    ends = np.cumsum([0, *map(len, times)]).tolist()
    parts = [slice(a, b) for a, b in zip(ends[:-1], ends[1:])]
    return Matched("f", "a", np.concatenate(times), {"altitude_msl": np.concatenate(values)}, parts)


@pytest.mark.parametrize("at", [(3.0,), (3.0, 6.0), (3.0, 3.0)])
def test_at_a_reset_what_was_before_is_compared_with_what_was_before(at):
    time, delta = difference(reset(at), reset(at), "altitude_msl")
    assert len(time) == 101 + len(at)
    assert not delta.any()


def test_where_one_flight_alone_is_reset_its_last_state_before_is_compared_too():
    plain, other = reset(()), reset((3.0,))
    for time, delta in (difference(plain, other, "altitude_msl"), difference(other, plain, "altitude_msl")):
        assert (np.abs(delta[time < 2.95]) == 0.0).all()
        assert (np.abs(delta[time > 3.05]) == 200.0).all()
    assert np.abs(difference(plain, other, "altitude_msl")[1]).tolist() == [0.0] * 31 + [200.0] * 70


def test_flights_without_common_time_have_no_difference():
    assert signal_differences(flight(), flight(shift=1000.0)) == []


def test_the_interval_of_a_mean_covers_it_for_signals_that_remember():
    dice = np.random.default_rng(7)
    covered = 0
    for _ in range(200):
        noise = dice.normal(size=4000)
        samples = np.empty(4000)
        level = 0.0
        for k, each in enumerate(noise):
            level = 0.9 * level + each
            samples[k] = level
        interval = mean_interval(samples)
        covered += interval.low <= 0.0 <= interval.high
    assert 175 <= covered <= 199  # as independent samples it would be some 70


def test_a_flight_too_short_for_its_memory_has_no_interval():
    assert math.isnan(mean_interval(np.linspace(0.0, 1.0, 100)).low)
    assert math.isnan(mean_interval(np.empty(0)).low)
    assert mean_interval(np.full(10, 2.0)) == (2.0, 2.0)


def test_the_interval_of_an_hour_of_noise_needs_little_memory():
    noise = np.random.default_rng(2).normal(size=216_000)
    tracemalloc.start()
    interval = mean_interval(noise)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert interval.high - interval.low == pytest.approx(2.0 * 1.96 / math.sqrt(len(noise)), rel=0.1)
    assert peak < 12 * noise.nbytes


def test_welchs_interval_is_that_of_scipy():
    from scipy.stats import ttest_ind

    a, b = np.array([1.0, 2.0, 4.0]), np.array([3.0, 5.0, 9.0, 4.0])
    interval = welch(a, b)
    for edge in interval:
        assert ttest_ind(b - edge, a, equal_var=False).pvalue == pytest.approx(0.05, rel=1e-6)
    assert math.isnan(welch(a, b[:1]).low)
    assert welch(np.ones(2), np.ones(3) * 2) == (1.0, 1.0)


def test_criteria_are_compared_between_variants_where_all_flights_have_them():
    before = [flight(scores={"error": 1.0, "lost": math.nan}), flight(scores={"error": 1.2, "lost": 1.0})]
    after = [flight(scores={"error": 3.0, "lost": 1.0}), flight(scores={"error": 3.4, "lost": 1.0})]
    (found,) = score_differences(before, after)
    assert (found.name, found.difference) == ("error", pytest.approx(2.1))
    assert found.interval.low > 0.0
    (single,) = score_differences(before[1:], [flight(scores={"error": 2.0})])
    assert math.isnan(single.interval.low)


def test_a_settling_that_never_came_is_a_difference():
    settled, never = (
        [flight(scores={"settle": value}) for value in values] for values in ((2.0, 2.1), (math.inf,) * 2)
    )
    (found,) = score_differences(settled, never)
    assert (found.reference, found.other, found.difference) == (pytest.approx(2.05), math.inf, math.inf)
    assert (found.never, found.flights) == ((0, 2), (2, 2))
    assert math.isnan(found.interval.low)
    assert score_differences(never, settled)[0].difference == -math.inf
    assert math.isnan(score_differences(never, never)[0].difference)


@pytest.mark.parametrize(
    ("before", "after", "cells", "words"),
    [
        ((2.0, 2.2), (math.inf, math.inf), "2.1 &infin; &infin; &ndash;", "never settles here, does in the reference"),
        ((math.inf,), (2.0,), "&infin; 2 -&infin; &ndash;", "settles here, never in the reference"),
        ((math.inf,), (math.inf,), "&infin; &infin; &ndash; &ndash;", "neither ever settles"),
        (
            (2.0, 2.0, math.inf),
            (math.inf, 2.0),
            "&infin; &infin; &ndash; &ndash;",
            "never settles in 1 of 2 flights here, in 1 of 3 of the reference",
        ),
    ],
)
def test_the_page_shows_that_one_settles_and_the_other_never_does(before, after, cells, words):
    flights = [
        dataclasses.replace(flight(variant=variant, scores={"settle": value}), name=f"{variant}{k}")
        for variant, values in (("before", before), ("after", after))
        for k, value in enumerate(values)
    ]
    page = build(flights, [None] * len(flights), "the start")
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr><td>settle</td>.*?</tr>", page)]
    shown = {2.0: "2", 2.2: "2.2", math.inf: "&infin;"}
    assert rows[0][1:] == [shown[value] for value in (*before, *after)]
    assert " ".join(rows[1][1:5]) == cells
    assert re.sub(r"<.*?>", "", rows[1][5]) == words


def test_the_line_of_differences_is_interrupted_where_the_one_or_the_other_is():
    gappy, cut = flight(1.0), flight()
    keep = (gappy.time < 20.0) | (gappy.time > 30.0)
    first = int(np.sum(gappy.time < 20.0))
    parts = [slice(0, first), slice(first, int(keep.sum()))]
    cut = Matched("g", "a", gappy.time[keep], {"roll_deg": cut.values["roll_deg"][keep]}, parts)
    for flights in ([gappy, cut], [cut, gappy]):
        (series,) = _between(flights, "roll_deg").series
        assert np.flatnonzero(np.isnan(series.values)).tolist() == [first]
        assert 20e9 < series.time[first] < 30e9
        assert (np.diff(series.time) > 0).all()
