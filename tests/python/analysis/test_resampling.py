from __future__ import annotations

import numpy as np
import pytest

from xplane_bridge.analysis.resampling import held, interpolated, rotated, time_base
from xplane_bridge.bags.segments import segments

S = 10**9


def ns(*seconds: float) -> np.ndarray:
    return np.array([round(s * S) for s in seconds], dtype=np.int64)


def test_time_base_is_uniform_inside_segments_and_on_one_grid() -> None:
    time = ns(10.0, 10.1, 10.2, 11.05, 11.15, 11.25)
    base = time_base(time, segments(time), 20.0)
    expected = [10.0, 10.05, 10.1, 10.15, 10.2, 11.05, 11.1, 11.15, 11.2, 11.25]
    np.testing.assert_array_equal(base, ns(*expected))
    with pytest.raises(ValueError, match="rate must be positive, got 0"):
        time_base(time, segments(time), 0)


def test_time_base_does_not_drift_over_hours() -> None:
    time = np.arange(0, 7200 * S + 1, S // 10, dtype=np.int64)
    base = time_base(time, segments(time), 30.0)
    assert len(base) == 7200 * 30 + 1
    assert base[-1] == 7200 * S


def test_held_gives_the_newest_sample_not_after() -> None:
    time = ns(1, 2, 3)
    base = ns(0.5, 1.0, 1.999, 2.0, 9.0)
    np.testing.assert_array_equal(held(base, time, np.array([10.0, 20.0, 30.0])), [np.nan, 10, 10, 20, 30])
    assert list(held(base, time, np.array([1, 2, 3]))) == [None, 1, 1, 2, 3]


def test_interpolation_is_linear_and_never_crosses_a_segment() -> None:
    time = ns(0, 1, 5, 6)
    parts = segments(time, max_gap=1.5)
    got = interpolated(ns(0.25, 1.0, 3.0, 5.5, 6.5), time, np.array([0.0, 4.0, 100.0, 102.0]), parts)
    np.testing.assert_allclose(got, [1.0, 4.0, np.nan, 101.0, np.nan])


@pytest.mark.parametrize(
    ("low", "known", "expected"),
    [(0.0, [350.0, 10.0], [355.0, 0.0, 5.0]), (-180.0, [170.0, -170.0], [175.0, -180.0, -175.0])],
)
def test_angles_take_the_short_way_round(low: float, known: list, expected: list) -> None:
    time = ns(0, 1)
    parts = segments(time, max_gap=2)
    got = interpolated(ns(0.25, 0.5, 0.75), time, np.array(known), parts, wrap=360.0, low=low)
    np.testing.assert_allclose(got, expected, atol=1e-9)


def test_a_missing_angle_does_not_spread() -> None:
    time = ns(0, 1, 2, 3)
    parts = segments(time, max_gap=2)
    got = interpolated(ns(0, 2.5), time, np.array([10.0, np.nan, 20.0, 30.0]), parts, wrap=360.0)
    np.testing.assert_allclose(got, [10.0, 25.0])


def test_rotation_takes_the_shortest_arc_at_constant_rate() -> None:
    time = ns(0, 1)
    parts = segments(time, max_gap=2)
    half = np.radians(90) / 2
    turn = np.array([[0, 0, 0, 1.0], [0, 0, -np.sin(half), -np.cos(half)]])  # 90 deg about z, with the sign flipped
    got = rotated(ns(0, 1 / 3, 1), time, turn, parts)
    third = np.radians(30) / 2
    np.testing.assert_allclose(np.abs(got[1]), [0, 0, np.sin(third), np.cos(third)], atol=1e-9)
    np.testing.assert_allclose(np.abs(got[2]), [0, 0, np.sin(half), np.cos(half)], atol=1e-9)
    assert np.isnan(rotated(ns(2), time, turn, parts)).all()


def test_a_segment_of_one_sample_keeps_it() -> None:
    time = ns(0, 5)
    parts = segments(time)
    np.testing.assert_allclose(rotated(ns(5), time, np.array([[0, 0, 0, 1.0], [1.0, 0, 0, 0]]), parts), [[1, 0, 0, 0]])
    np.testing.assert_allclose(interpolated(ns(0, 5), time, np.array([3.0, 4.0]), parts), [3.0, 4.0])
