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


@pytest.mark.parametrize("step", [0.6, 0.9, 2.0, 3.0, 10.0])
@pytest.mark.parametrize("seed", range(4))
def test_where_the_order_was_lost_no_time_is_added(tmp_path: Path, step: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    back = step + draw.uniform(0.0, 0.02)  # states before and behind the step lie in any phase to each other
    recorded = []
    for k in range(1000):
        flown, late = k / 50, 0.001 + draw.uniform(0.0, 0.012)
        recorded.append(Recorded(flown, flown + late - back * (k >= 600), flown - back * (k >= 616), 1 + (k >= 616)))
    frames = sorted(range(1000), key=lambda k: recorded[k].received)
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in frames:
            flown, received, stamp, epoch = recorded[k]
            state = {**bag.state(flown, k), "header": bag.header(stamp_ns(stamp), ""), "epoch": epoch}
            bag.add(STATE, "xplane_bridge/FlightState", stamp_ns(received), state)
    stamp = states_of(tmp_path / "flight.bag").stamp
    assert stamp.tolist() == sorted(stamp_ns(each.stamp) for each in recorded)


@pytest.mark.parametrize("off", [0.0009, 0.0019])
def test_a_reset_in_a_pause_is_no_clock_set_back(tmp_path: Path, off: float, caplog: pytest.LogCaptureFixture) -> None:
    """With `publish_clock`, after three hours: unwrapped time begins anew at the raw one, which is in steps of 1 ms."""
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(200):
            raw = np.float32(10800 + (min(k, 90) if k < 110 else k - 20) / 50)
            unwrapped = float(raw) + off * (k < 100)
            stamp = stamp_ns(unwrapped - 10800)
            times = {"sim_time": raw, "sim_time_unwrapped": unwrapped, "header": bag.header(stamp, "")}
            state = {**bag.state(k / 50, k), **times, "epoch": 1 + (k >= 100)}
            bag.add(STATE, "xplane_bridge/FlightState", stamp, state)
    with caplog.at_level(logging.WARNING), Bags(tmp_path / "flight.bag") as bags:
        assert len(read_flight(bags).parts) == 4
    assert caplog.text == ""


def test_the_next_file_is_not_of_an_earlier_run_of_x_plane(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name, start, begin, first in (("earlier", 0.0, 500.0, 10000), ("later", 100.0, 0.0, 0)):
        with FlightBag(tmp_path / f"{name}.bag") as bag:
            for k in range(100):
                received = stamp_ns(start + k / 50)
                state = {**bag.state(begin + k / 50, first + k), "header": bag.header(received, "")}
                bag.add(STATE, "xplane_bridge/FlightState", received, state)
    given = [tmp_path / "later.bag", tmp_path / "earlier.bag"]
    with caplog.at_level(logging.WARNING), Bags(given) as bags:
        flight = read_flight(bags)
    assert (flight.start, flight.end) == (stamp_ns(0.0), stamp_ns(101.98))
    assert caplog.text == ""


def test_the_times_in_the_file_of_what_was_recorded_first_and_last(tmp_path: Path) -> None:
    record_a_clock_set_back(tmp_path / "flight.bag", 3.0)
    with Bags(tmp_path / "flight.bag") as bags:
        assert bags.written == (stamp_ns(0.0), stamp_ns(1.98 - 3.0))
