"""Recordings over a step of the host's clock: one flight, whose time goes on."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Iterator, List, NamedTuple

import numpy as np
import pandas as pd
import pytest

from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, record_a_clock_set_back, stamp_ns
from xplane_bridge.analysis.frames import frames_of
from xplane_bridge.bags import Bags, Table
from xplane_bridge.bags.flight import read_flight

if TYPE_CHECKING:
    from pathlib import Path

STATE, LABEL = "/xplane/flight_state", "/xplane/scenario/label"


class Recorded(NamedTuple):
    """A flight state as the recorder got it."""

    flown: float  #: [s]
    received: float  #: [s]
    stamp: float  #: [s]
    epoch: int


def states_of(path: Path) -> Table:
    with Bags(path) as bags:
        return read_flight(bags).tables["state"]


def write(path: Path, recorded: List[Recorded], first: int = 0) -> None:
    """Writes these states into a bag, and with every tenth a label, which has no stamp."""
    with FlightBag(path) as bag:
        for number, (flown, received, stamp, epoch) in enumerate(recorded, first):
            state = {**bag.state(flown, number), "header": bag.header(stamp_ns(stamp), ""), "epoch": epoch}
            bag.add(STATE, "xplane_bridge/FlightState", stamp_ns(received), state)
            if number % 10 == 0:
                bag.add(LABEL, "std_msgs/String", stamp_ns(received + 0.001), {"data": f"{flown:.2f}"})


def recorded_with(steps: List[float]) -> Iterator[Recorded]:
    """A flight at 50 Hz; each second the clock is set back by one of these [s], and rx_node follows 0.32 s later."""
    for k in range(50 * (len(steps) + 1)):
        followed = max(k - 16, 0) // 50
        flown = k / 50
        yield Recorded(flown, flown - sum(steps[: k // 50]), flown - sum(steps[:followed]), 1 + followed)


@pytest.mark.parametrize("step", [0.03, 0.25, 0.9, 10.0])
def test_time_goes_on_as_it_was_simulated(tmp_path: Path, step: float, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "flight.bag"
    record_a_clock_set_back(path, step)
    with caplog.at_level(logging.WARNING), Bags(path) as bags:
        flight = read_flight(bags)
    state = flight.tables["state"]
    flown = [stamp_ns(k / 50) for k in range(100)]
    np.testing.assert_allclose(state.stamp - flown[0], np.subtract(flown, flown[0]), atol=1000)
    np.testing.assert_allclose(state.time - flown[0], np.subtract(flown, flown[0]), atol=1000)
    np.testing.assert_allclose(state["sim_time_unwrapped"], np.arange(100) / 50)
    assert flight.parts == [slice(0, 66), slice(66, 100)]
    assert frames_of(state["epoch"], state["sim_time_unwrapped"]).elapsed[-1] == pytest.approx(1.96)
    assert caplog.messages == [
        f"{path}: the host's clock was set back in flight; what was recorded behind that is read with stamps "
        f"{step:.3f} s later; let the clock be slewed, not stepped, while flights are recorded"
    ]


def test_what_has_no_stamp_goes_on_too_over_several_steps_and_files(tmp_path: Path) -> None:
    recorded = list(recorded_with([0.3, 4.0, 0.05]))
    for n, first in enumerate((0, 100)):  # the second step lies where a file begins
        write(tmp_path / f"flight_{n}.bag", recorded[first : first + 100], first)
    with Bags(tmp_path) as bags:
        flight = read_flight(bags)
    state, label = flight.tables["state"], flight.tables["label"]
    np.testing.assert_allclose((state.stamp - stamp_ns(0.0)) / 1e9, np.arange(200) / 50, atol=1e-5)
    np.testing.assert_allclose((label.time - stamp_ns(0.001)) / 1e9, np.arange(20) / 5, atol=1e-5)
    assert label["data"].tolist() == [f"{k / 5:.2f}" for k in range(20)]


def test_a_clock_set_back_while_x_plane_is_paused_adds_no_time(tmp_path: Path) -> None:
    recorded = [each._replace(flown=min(each.flown, 0.5)) for each in recorded_with([3.0])]
    write(tmp_path / "flight.bag", recorded)
    state = states_of(tmp_path / "flight.bag")
    assert state["frame_count"].tolist() == list(range(100))
    assert np.diff(state.stamp).min() >= 0
    assert (state.stamp[-1] - state.stamp[0]) / 1e9 == pytest.approx(99 / 50 - 0.02)


def test_only_the_recorder_s_clock_was_set_back(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    recorded = [each._replace(stamp=each.flown, epoch=1) for each in recorded_with([3.0])]
    write(tmp_path / "flight.bag", recorded)
    with caplog.at_level(logging.WARNING):
        state = states_of(tmp_path / "flight.bag")
    np.testing.assert_allclose(state.time, state.stamp, atol=1000)
    assert caplog.text == ""


def test_a_time_base_lies_in_the_time_that_was_flown(tmp_path: Path) -> None:
    record_a_clock_set_back(tmp_path / "flight.bag")
    assert export(tmp_path / "flight.bag", "--rate", "200", "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "flight.csv")
    np.testing.assert_allclose(table["sim_time_unwrapped_s"], table["time_s"], atol=1e-6)
    assert table["time_s"].iloc[-1] == pytest.approx(1.98)


@pytest.mark.parametrize("step", [0.25, 6.0])
def test_copies_have_the_times_of_the_file_in_the_order_of_recording(tmp_path: Path, step: float) -> None:
    record_a_clock_set_back(tmp_path / "flight.bag", step)
    with Bags(tmp_path / "flight.bag") as bags:
        copied = [(time, bytes(raw)) for _, time, raw in bags.recorded(as_written=True)]
        read = [(time, bytes(raw)) for _, time, raw in bags.recorded()]
    assert [time for time, _ in copied] == [stamp_ns(k / 50 - (step if k >= 50 else 0.0)) for k in range(100)]
    assert [raw for _, raw in copied] == [raw for _, raw in read]
    np.testing.assert_allclose(np.diff([time for time, _ in read]), 2e7, atol=1000)
