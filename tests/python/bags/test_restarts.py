"""Recordings over a restart of X-Plane, or of rx_node too: two flights, one behind the other."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Dict, List, NamedTuple, Tuple

import numpy as np
import pandas as pd
import pytest

from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.bags.restarts import falls

if TYPE_CHECKING:
    from pathlib import Path

S = 10**9
CLOCK = 10**9 * S  #: lockstep/start_time
HOST = 1_700_000_000 * S
LOADING_S = 30
EACH = 80  #: states of a flight
BOTH = 2 * EACH
STATE, ODOM, MODE, IMAGE = "/xplane/flight_state", "/xplane/odom", "/xplane/control/mode", "/xplane/camera/image_raw"
FRAME, TRAFFIC = "/xplane/camera/frame_state", "/xplane/traffic/state"


class Received(NamedTuple):
    """One state with what came beside it."""

    number: int
    flight: int
    stamp: int
    receive: int


def flights(by_clock: bool) -> List[Received]:
    """Two flights of 4 s at 20 Hz, the second from 3 s before the first's beginning on, received by one of the clocks.

    Two states of each overtake each other.
    """
    out = []
    for flight in (0, 1):
        for k in range(EACH):
            stamp = CLOCK + (40 - 3 * flight) * S + k * S // 20
            receive = stamp if by_clock else HOST + flight * LOADING_S * S + k * S // 20
            out.append(Received(len(out), flight, stamp, receive))
        k = flight * EACH + 20
        early, late = out[k].stamp, out[k + 1].stamp
        out[k], out[k + 1] = out[k]._replace(stamp=late), out[k + 1]._replace(stamp=early)
    return out


def time_of(stamp: int) -> Dict[str, int]:
    return dict(zip(("sec", "nanosec"), divmod(stamp, S)))


def write(
    path: Path,
    received: List[Received],
    happened: List[Dict[str, object]],
    epochs: Tuple[int, int] = (1, 2),
    host_stamps: bool = False,
) -> None:
    """Writes these states into a bag; the list of events, latched, goes on from bag to bag."""
    with FlightBag(path) as bag:
        for k, flight, stamp, receive in received:
            header = bag.header(receive if host_stamps else stamp, "")
            sim_time, epoch = (stamp - CLOCK) / S, epochs[flight]
            state = {**bag.state(sim_time, k), "header": header, "epoch": epoch, "altitude_msl": 1e3 * (flight + 1)}
            pose = {"position": {"x": float(flight)}, "orientation": {"w": 1.0}}
            image = {"header": header, "encoding": "mono8", "height": 1, "width": 1, "step": 1, "data": [flight]}
            for topic, msgtype, values in (
                (ODOM, "nav_msgs/Odometry", {"header": header, "pose": {"pose": pose}}),
                (STATE, "xplane_bridge/FlightState", state),
                (IMAGE, "sensor_msgs/Image", image),
                (FRAME, "xplane_bridge/FrameState", {"header": header, "state": state}),
                (TRAFFIC, "xplane_bridge/TrafficState", {"header": header, "epoch": epoch, "sim_time": sim_time}),
            ):
                bag.add(topic, msgtype, receive, values)
            if k in (30, BOTH - 10):  # a stamp of the second flight that is later than that of the first
                mode = {"header": header, "mode": 1 + flight}
                bag.add(MODE, "xplane_bridge/ControlMode", receive, mode)
                happened.append({"number": len(happened) + 1, "stamp": time_of(stamp), "text": f"of flight {flight}"})
                bag.add("/xplane/events", "xplane_bridge/EventList", receive, {"header": header, "events": happened})


@pytest.fixture(params=["host", "clock", "host, split", "clock, split", "clock, rx_node", "clock, split, rx_node"])
def recording(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Where rx_node is started anew with X-Plane, its epochs begin anew."""
    epochs = (0, 0) if "rx_node" in request.param else (0, 1)
    received = flights("clock" in request.param)
    (tmp_path / "bags").mkdir()
    happened: List[Dict[str, object]] = []
    cuts = [0, 50, 100, BOTH] if "split" in request.param else [0, BOTH]
    for n, (first, end) in enumerate(zip(cuts[:-1], cuts[1:])):
        write(tmp_path / "bags" / f"flight_{n}.bag", received[first:end], happened, epochs)
    return tmp_path / "bags"


def test_two_flights_lie_behind_each_other(recording: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING), Bags(recording) as bags:
        flight = read_flight(bags)
        pictures = [(m.header.stamp.sec * S + m.header.stamp.nanosec, int(m.data[0])) for _, m in bags.messages(IMAGE)]
    state, odom = flight.tables["state"], flight.tables["odom"]
    assert state["epoch"].tolist() == [0] * EACH + [1] * EACH
    assert odom["pose.pose.position.x"].tolist() == [0.0] * EACH + [1.0] * EACH
    assert (np.diff(state.stamp) > 0).all()
    assert (np.diff(state.time[[0, EACH - 1, EACH, BOTH - 1]]) > 0).all()
    np.testing.assert_array_equal(state.stamp, odom.stamp)
    assert sorted(pictures) == [(stamp, int(k >= EACH)) for k, stamp in enumerate(state.stamp.tolist())]
    assert state.stamp[0] == CLOCK + 40 * S  # the first flight as recorded, the second as it was flown
    np.testing.assert_array_equal(np.diff(state.stamp[EACH:]), S // 20)
    assert [(event.stamp, event.text) for event in flight.events] == [
        (int(state.stamp[30]), "of flight 0"),
        (int(state.stamp[BOTH - 10]), "of flight 1"),
    ]
    assert flight.parts == [slice(0, EACH), slice(EACH, BOTH)]
    assert "stamps go back where X-Plane was restarted" in caplog.text


def test_an_rx_node_started_anew_counts_on(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "flight.bag"
    received = [each for each in flights(by_clock=False) if each.number % EACH not in (20, 21)]  # none overtakes
    write(path, received, [], epochs=(1, 1), host_stamps=True)
    count = len(received) // 2
    with caplog.at_level(logging.WARNING), Bags(path) as bags:
        counted = [bags.read(FRAME)["state.epoch"], bags.read(TRAFFIC)["epoch"], bags.read(STATE, ["epoch"])["epoch"]]
        pieces = np.concatenate([piece["epoch"] for piece in bags.pieces(STATE, ["epoch"])])
        flight = read_flight(bags)
    assert [each.tolist() for each in (*counted, pieces)] == [[1] * count + [3] * count] * 4
    assert flight.parts == [slice(0, count), slice(count, 2 * count)]
    assert caplog.text == ""


def test_a_recording_of_more_than_ten_parts_is_in_their_order(tmp_path: Path) -> None:
    received = flights(by_clock=True)
    happened: List[Dict[str, object]] = []
    for n in range(12):
        write(tmp_path / f"flight_{n}.bag", received[14 * n : 14 * (n + 1)], happened)
    for given in (tmp_path, sorted(tmp_path.glob("*.bag"))):  # the second as a shell gives flight_*.bag
        with Bags(given) as bags:
            assert [path.stem for path in bags.paths] == [f"flight_{n}" for n in range(12)]
            state = bags.read(STATE).by_stamp()
        assert state["epoch"].tolist() == [1] * EACH + [2] * EACH


def test_a_table_joins_what_was_of_one_flight(recording: Path, tmp_path: Path) -> None:
    assert export(recording, "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "bags.csv")
    assert table["altitude_msl_m"].tolist() == [1e3] * EACH + [2e3] * EACH
    assert table["mode"].tolist()[31:] == [1] * (BOTH - 10 - 31) + [2] * 10
    assert (np.diff(table["time_s"]) > 0).all()


def test_the_stamps_go_on_as_the_host_s_time_did(tmp_path: Path) -> None:
    write(tmp_path / "flight.bag", flights(by_clock=False), [])
    with Bags(tmp_path / "flight.bag") as bags:
        stamp = bags.read(STATE, ["header.stamp"]).by_stamp().stamp
    assert stamp[EACH] - stamp[0] == LOADING_S * S


@pytest.mark.parametrize("epochs", [(1, 1), (1, 2)])
def test_bags_in_disorder_are_put_in_order(tmp_path: Path, epochs: tuple) -> None:
    received = flights(by_clock=True)[:EACH]
    write(tmp_path / "b.bag", [each._replace(flight=epochs[0] - 1) for each in received[:40]], [])
    write(tmp_path / "a.bag", [each._replace(flight=epochs[1] - 1) for each in received[40:]], [])
    with Bags([tmp_path / "a.bag", tmp_path / "b.bag"]) as bags:
        state = bags.read(STATE)
    assert state.by_stamp().stamp.tolist() == sorted(each.stamp for each in received)
    assert state["epoch"].tolist() == [epochs[0]] * 40 + [epochs[1]] * 40


def test_what_overtakes_or_stands_alone_is_no_restart() -> None:
    time = np.arange(100) * S
    assert falls(time).tolist() == []
    time[[50, 51]] = time[[51, 50]]
    time[20], time[80] = 900 * S, 0
    assert falls(time).tolist() == []
    assert falls(np.concatenate([time, time])).tolist() == [100]
    assert falls(time[:3]).tolist() == []
