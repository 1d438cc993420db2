"""How long a flight is: by the simulator's time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Optional, Sequence
from unittest.mock import Mock

import pytest

from xplane_bridge.harness.running_flight import RunningFlight


def elapsed_after(times: Sequence[Optional[float]]) -> float:
    """What is counted when the newest states are of these simulator times [s]; None: there is none yet."""
    flight = RunningFlight(Mock(), Mock(), Mock())
    for time in times:
        flight.last = None if time is None else SimpleNamespace(sim_time=time)
        flight.count_time()
    return flight.elapsed


def test_what_passed_before_the_first_count_is_not_of_the_flight() -> None:
    assert elapsed_after([None, 100.0, 100.5, 102.0]) == pytest.approx(2.0)


def test_no_time_passes_while_the_simulator_stands() -> None:
    assert elapsed_after([5.0, 6.0, 6.0, 6.0]) == pytest.approx(1.0)


def test_a_restart_takes_nothing_away() -> None:
    assert elapsed_after([50.0, 53.0, 0.5, 1.5]) == pytest.approx(4.0)
