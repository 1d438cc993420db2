"""Trajectories are the bridge's own odometry, as it was recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional

import numpy as np
import pytest

from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, record_a_clock_set_back, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.export.trajectories import trajectory

if TYPE_CHECKING:
    from pathlib import Path


def add_odometry(bag: FlightBag, topic: str, t: float, x: float) -> None:
    pose = {"position": {"x": x}, "orientation": {"w": 1.0}}
    values = {"header": bag.header(stamp_ns(t), "map"), "pose": {"pose": pose}}
    bag.add(topic, "nav_msgs/Odometry", stamp_ns(t), values)


@pytest.mark.parametrize("space", ["/xplane", "/lab/aircraft/xplane", ""])
def test_the_bridges_own_odometry_is_exported_beside_that_of_other_nodes(tmp_path: Path, space: str) -> None:
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(3):
            bag.add(f"{space}/flight_state", "xplane_bridge/FlightState", stamp_ns(k), bag.state(k, k))
            for topic in ("/a_filter/odom", "/vio/odom", f"{space}/vio/odom"):
                add_odometry(bag, topic, k, 99.0)
            add_odometry(bag, f"{space}/odom", k, float(k))
    assert export(path, "--format", "tum", "-o", tmp_path) == 0
    assert np.loadtxt(tmp_path / "flight.tum")[:, 1].tolist() == [0.0, 1.0, 2.0]
    with Bags(path) as bags:
        assert bags.name_space == space
        assert read_flight(bags).tables["odom"].topic == f"{space}/odom"
        assert bags.topic_of_type("nav_msgs/Odometry", "vio/odom") == f"{space}/vio/odom"


@pytest.mark.parametrize(
    ("topics", "own"),
    [
        (["/xplane/odom", "/xplane/ekf", "/lio/local_position/odom"], "/xplane/odom"),
        (["/mavros/local_position/odom", "/vio/odometry", "/vio/odom", "/xplane/ekf"], "/mavros/local_position/odom"),
        (["/vins/odometry", "/xplane/vio/odom"], None),
        (["/lead/local_position/odom", "/wing/local_position/odom"], None),
    ],
)
def test_an_estimate_is_never_taken_for_the_bridges_odometry(
    tmp_path: Path, topics: list[str], own: Optional[str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(3):
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k), bag.state(k, k))
            for topic in topics:
                add_odometry(bag, topic, k, 1.0 if topic == own else 999.0)
    assert export(path, "--format", "tum", "-o", tmp_path) == (0 if own else 1)
    if own:
        assert np.loadtxt(tmp_path / "flight.tum")[:, 1].tolist() == [1.0, 1.0, 1.0]
    else:
        assert "no odometry of the bridge; expected odom beside flight_state" in capsys.readouterr().err
    with Bags(path) as bags:
        tables = read_flight(bags).tables
    assert (tables["odom"].topic if "odom" in tables else None) == own, "the report's check of physics"


@pytest.mark.parametrize("changed", ["epoch", "position_epoch"])
@pytest.mark.parametrize("form", ["tum", "euroc"])
def test_a_time_base_does_not_bridge_what_began_anew(tmp_path: Path, form: str, changed: str) -> None:
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(20):
            t, anew = k / 10, k >= 8
            values = {**bag.state(t, k), "position_epoch": 1}
            values[changed] = 2 if anew else 1
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), values)
            add_odometry(bag, "/xplane/odom", t, 5000.0 if anew else 0.0)
    assert export(path, "--format", form, "--rate", "50", "-o", tmp_path) == 0
    (file,) = tmp_path.glob(f"flight*.{'csv' if form == 'euroc' else 'tum'}")
    time, x = np.loadtxt(file, delimiter="," if form == "euroc" else None)[:, :2].T
    seconds = (time - time[0]) / (1e9 if form == "euroc" else 1.0)
    np.testing.assert_allclose(seconds, [k / 50 for k in range(96) if not 35 < k < 40], atol=1e-6)
    assert x.tolist() == [0.0] * 36 + [5000.0] * 56


def test_a_time_base_lies_on_no_line_between_two_times_of_a_clock_set_back(tmp_path: Path) -> None:
    paths = [tmp_path / "states.bag", tmp_path / "odometry.bag"]
    record_a_clock_set_back(paths[0], order_lost=True)
    with FlightBag(paths[1]) as bag:
        for k in range(100):
            add_odometry(bag, "/xplane/odom", k / 50 - (0.25 if k >= 66 else 0.0), 0.0 if k < 66 else 5000.0)
    with Bags(paths) as bags:
        _, position, _ = trajectory(bags, 200.0)
    assert set(position[:, 0]) == {0.0, 5000.0}
    assert len(position) > 200


def test_a_time_base_needs_no_flight_states(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(5):
            add_odometry(bag, "/xplane/odom", k / 10, float(k))
    assert export(tmp_path / "flight.bag", "--format", "tum", "--rate", "20", "-o", tmp_path) == 0
    np.testing.assert_allclose(np.loadtxt(tmp_path / "flight.tum")[:, 1], np.arange(9) / 2)


def test_without_flight_states_the_odometry_must_be_the_only_one(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for topic in ("/vio/odom", "/xplane/odom"):
            add_odometry(bag, topic, 0.0, 1.0)
    assert export(tmp_path / "flight.bag", "--format", "tum", "-o", tmp_path) == 1
