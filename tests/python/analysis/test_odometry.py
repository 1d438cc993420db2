"""Odometry against itself, of a flight whose position and velocity are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from xplane_bridge.analysis.consistency import Check, check_odometry
from xplane_bridge.analysis.odometry import differences, of_frames

S = 10**9


def columns(t: np.ndarray, error: float = 0.0) -> dict:
    """Flown at `t` [s] of the simulator; the body's axes are those of `map`."""
    ones = np.ones_like(t)
    out = {f"pose.pose.position.{k}": v for k, v in zip("xyz", (10 * np.sin(t), 5 * t, 0 * t))}
    out.update({f"twist.twist.linear.{k}": v + error for k, v in zip("xyz", (10 * np.cos(t), 5 * ones, 0 * t))})
    out.update({f"pose.pose.orientation.{k}": v for k, v in zip("xyzw", (0 * t, 0 * t, 0 * t, ones))})
    return out


def check(host: np.ndarray, t: np.ndarray, parts: list[slice] | None = None, error: float = 0.0) -> Check:
    """Check a flight whose frames at `t` [s] of the simulator were stamped `host` [s]."""
    stamp = np.round(host * S).astype(np.int64)
    parts = [slice(0, len(t))] if parts is None else parts
    return check_odometry(of_frames(stamp, columns(t, error), stamp, t, parts))


def test_it_is_compared_over_a_second() -> None:
    t = np.arange(500) / 50.0
    assert check(t, t).error < 1e-3
    wrong = check(t, t, error=0.05)
    assert wrong.error == pytest.approx(0.05, abs=1e-3)
    assert not wrong.ok


@pytest.mark.parametrize("ratio", [0.6, 2.0])
def test_a_simulator_that_is_slower_or_faster_than_real_time_flies_as_its_twist_says(ratio: float) -> None:
    t = np.arange(500) / 50.0
    assert check(t / ratio, t).error < 1e-3
    assert check(t / ratio, t, error=0.05).error == pytest.approx(0.05, abs=1e-3)


def test_a_pause_is_no_time_and_leaves_the_rest_to_be_compared() -> None:
    t = np.concatenate([np.arange(250) / 50.0, np.full(100, 4.98), 5.0 + np.arange(250) / 50.0])
    found = check(np.arange(600) / 50.0, t)
    assert found.error < 1e-3
    assert found.samples == 450
    assert check(np.arange(100) / 50.0, np.full(100, 4.98)).samples == 0


def test_a_reset_is_not_crossed() -> None:
    t = np.concatenate([100.0 + np.arange(250) / 50.0, np.arange(250) / 50.0])
    found = check(np.arange(500) / 50.0, t, [slice(0, 250), slice(250, 500)])
    assert found.error < 1e-3
    assert found.samples == 400


def test_only_messages_of_a_known_frame_count_each_with_the_time_of_its_own() -> None:
    stamp = np.array([10, 20, 35, 40], dtype=np.int64)
    found = of_frames(stamp, columns(np.arange(4.0)), np.array([20, 30, 40]), np.array([1.0, 2.0, 4.0]), [slice(0, 3)])
    np.testing.assert_array_equal(found.sim_time, [1.0, 4.0])
    np.testing.assert_array_equal(found.position[:, 1], [5.0, 15.0])
    assert found.parts == [slice(0, 2)]
    assert not len(differences(found))
