from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from support.flights.synthetic_flight import record_a_clock_set_back
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.bags.segments import disordered, segments

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def ns(*seconds: float) -> np.ndarray:
    return np.array([round(s * 10**9) for s in seconds], dtype=np.int64)


def test_segments_cut_at_gaps_epochs_and_backward_time() -> None:
    time = ns(0, 0.1, 0.2, 1.0, 1.1, 0.5, 0.6)
    epoch = np.array([1, 1, 1, 1, 2, 2, 2])
    assert segments(time, epoch) == [slice(0, 3), slice(3, 4), slice(4, 5), slice(5, 7)]
    assert segments(time) == [slice(0, 3), slice(3, 5), slice(5, 7)]
    assert segments(ns()) == []


def test_slow_samples_are_one_segment_and_their_gaps_still_cut() -> None:
    # States at 1 Hz, one of them lost, then silence for ten seconds.
    assert segments(ns(0, 1, 2, 4, 5, 6, 16, 17)) == [slice(0, 6), slice(6, 8)]
    assert segments(ns(0, 0, 0)) == [slice(0, 3)]
    assert segments(ns(5)) == [slice(0, 1)]


def test_samples_among_those_of_another_time_are_found() -> None:
    # The clock is set back between 6 and 4, by two samples and a half; nothing is behind the begin of an epoch.
    sim_time = np.array([1.0, 2.0, 3.0, 6.0, 4.0, 7.0, 5.0, 8.0, 9.0, 9.0, 0.0, 1.0])
    epoch = np.array([1] * 10 + [2] * 2, dtype=np.uint32)
    assert disordered(epoch, sim_time).tolist() == [False] * 3 + [True] * 4 + [False] * 5
    assert disordered(epoch[:0], sim_time[:0]).tolist() == []
    raised = epoch + np.isin(sim_time, (6.0, 7.0, 8.0, 9.0)) + (epoch == 2)
    assert disordered(raised, sim_time).tolist() == [False] * 3 + [True] * 4 + [False] * 5


def test_a_clock_set_back_is_said_and_cut_where_the_order_was_lost(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "f.bag"
    record_a_clock_set_back(path, order_lost=True)
    with caplog.at_level(logging.WARNING), Bags(path) as bags:
        flight = read_flight(bags)
    # The last quarter of a second before the stamps went back lies among the first one behind.
    mixed = [slice(k, k + 1) for k in range(54, 78)]
    assert flight.parts == [slice(0, 54), *mixed, slice(78, 100)]
    assert "the host's clock was set back in flight: by their stamps 24 flight states" in caplog.text


def test_an_rx_node_that_was_started_anew_while_time_goes_on_shuffles_nothing() -> None:
    # It counts epochs from 0. The third one is of a pause; unwrapped times are off by less than a float32 step.
    sim_time = 10800.0 + np.array([0.0, 0.02, 0.0409, 0.04, 0.04, 0.06, 0.08])
    epoch = np.array([2, 3, 3, 0, 0, 0, 1], dtype=np.uint32)
    assert not disordered(epoch, sim_time).any()
    # Where epochs fall because states lie among each other, time falls, too.
    assert disordered(np.array([1, 2, 1, 2]), np.array([1.0, 3.0, 1.02, 3.02])).tolist() == [False, True, True, False]
