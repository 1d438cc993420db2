"""A recorded flight: what it writes to, what it removes, and when it is given up."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Callable
from unittest.mock import Mock

import pytest

from xplane_bridge.harness import HarnessError, flight
from xplane_bridge.harness.flight import FlightPlan
from xplane_bridge.harness.running_flight import RunningFlight


class Simulator:
    """A flight whose states come ten times a second of a clock that a test need not wait for.

    Args:
        monkeypatch: Replaces the clock.
        shown: Simulator's time [s] by the clock's [s].
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, shown: Callable[[float], float]) -> None:
        self.flight = RunningFlight(Mock(), Mock(), Mock())
        self._shown, self._now = shown, 0.0
        monkeypatch.setattr(flight, "time", SimpleNamespace(monotonic=lambda: self._now, sleep=self._sleep))

    def _sleep(self, seconds: float) -> None:
        assert self._now < 3600.0, "the flight is never given up"
        self._now += seconds
        self.flight.last = SimpleNamespace(sim_time=self._shown(self._now))
        self.flight.states += 1


def test_a_pause_that_nothing_ends_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    paused = Simulator(monkeypatch, lambda now: min(now, 5.0))
    with pytest.raises(
        HarnessError, match=r"^X-Plane's time has stood still for 180 s, 4\.9 s into the flight: .* pauses"
    ):
        flight._record(FlightPlan(tmp_path, 600.0), paused.flight, Mock())


def test_pauses_that_end_are_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    paused = Simulator(monkeypatch, lambda now: 4.0 * (now // 170.0) + min(now % 170.0, 4.0))
    flight._record(FlightPlan(tmp_path, 12.0), paused.flight, Mock())
    assert paused.flight.elapsed == pytest.approx(12.0, abs=0.2)


def test_a_slow_simulator_is_no_pause(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    slow = Simulator(monkeypatch, lambda now: 0.01 * now)
    flight._record(FlightPlan(tmp_path, 10.0), slow.flight, Mock())
    assert slow.flight.elapsed == pytest.approx(10.0, abs=0.1)


def test_a_flight_that_is_broken_off_leaves_nothing_of_an_earlier_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    written = ("flight.bag", "truth.csv", "played.json", "scores.json", "report.html", "logs/ros/flight.bag")
    kept = ("scenario.yaml", "logs/bridge.log")
    (tmp_path / "logs" / "ros").mkdir(parents=True)
    for name in (*written, *kept):
        (tmp_path / name).write_text("of an earlier flight", encoding="utf-8")
    monkeypatch.setattr(flight, "EmulatorProcess", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        flight.fly(FlightPlan(tmp_path, 10.0))
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()} == set(kept)


def test_a_folder_that_is_there_and_takes_no_files_is_said(tmp_path: Path) -> None:
    (tmp_path / "logs").symlink_to("/proc/self/task")  # where not even root may write
    with pytest.raises(HarnessError, match=r"/logs cannot be written to: .*; --output takes a folder of yours"):
        FlightPlan(tmp_path, 10.0).make_folders()


def test_nothing_is_left_of_looking_whether_folders_take_files(tmp_path: Path) -> None:
    FlightPlan(tmp_path / "out", 10.0).make_folders()
    assert sorted(path.name for path in (tmp_path / "out").rglob("*")) == ["logs"]
