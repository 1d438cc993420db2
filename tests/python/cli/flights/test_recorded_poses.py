"""The poses of rerun_flight: what lies between two, and that they end when they are to."""

from __future__ import annotations

import math
import socket
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.cli.flights import recorded_poses
from xplane_bridge.cli.flights.recorded_commands import NotAsAskedError
from xplane_bridge.cli.flights.recorded_poses import Poses, _place_near, far, read_poses
from xplane_bridge.harness.pose_sender import PoseSender, Scenery
from xplane_bridge.units import EARTH_RADIUS_M

POSE = {
    "latitude": 37.5, "longitude": 126.5, "altitude_msl": 800.0,
    "orientation.x": 0.0, "orientation.y": 0.0, "orientation.z": 0.0, "orientation.w": 1.0,
    "velocity_ned.x": 60.0, "velocity_ned.y": 5.0, "velocity_ned.z": -2.0,
}  # fmt: skip


def test_once_closed_it_moves_nothing_whichever_thread_is_about_to():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as xplane:
        xplane.bind(("127.0.0.1", 0))
        xplane.settimeout(10.0)
        sender = PoseSender(*xplane.getsockname(), Scenery(37.5, 126.5, 6378145.0))
        sender.send(POSE)
        assert all(xplane.recv(600).startswith(b"DREF\0") for _ in range(13))
        sender.close()
        sender.send(POSE)  # a flight state that was on its way


@pytest.mark.parametrize(
    ("first", "second", "between"),
    [
        (179.9999, -179.9997, -179.9999),
        (-179.9999, 179.9997, 179.9999),
        (-179.9997, 179.9999, -179.9999),
        (-0.0001, 0.0003, 0.0001),
        (126.5, 126.7, 126.6),
    ],
)
def test_a_pose_between_two_lies_on_the_shorter_way_also_across_the_date_line(first, second, between):
    columns = {name: np.array([value, value]) for name, value in POSE.items()}
    columns["longitude"] = np.array([first, second])
    poses = Poses(np.array([0.0, 0.5]), columns, None)
    found = [poses.at(time)["longitude"] for time in (0.0, 0.25, 0.5)]
    assert found == pytest.approx([first, between, second], rel=0.0, abs=1e-9)


@pytest.mark.parametrize(("shown", "placed"), [(179.9999, -179.9999), (-179.9999, 179.9999), (0.0001, -0.0001)])
def test_how_far_it_is_from_where_it_was_placed_is_known_also_across_the_date_line(shown: float, placed: float):
    there = SimpleNamespace(latitude=60.0, longitude=shown, altitude_msl=900.0)
    start = {"latitude": 60.0, "longitude": placed, "altitude_msl": 900.0}
    assert far(there, start) == pytest.approx(math.radians(0.0002) * EARTH_RADIUS_M * 0.5, rel=1e-6)


def test_where_not_all_is_as_asked_for_a_place_nearby_suffices(monkeypatch: pytest.MonkeyPatch):
    text = "reset_flight: the aircraft is placed, but X-Plane does not show that it goes on"

    def place(*_):
        raise NotAsAskedError(text)

    def heard(*_):
        altitude = heights.pop(0)
        if altitude is None:
            raise TimeoutError
        return SimpleNamespace(**{**POSE, "altitude_msl": altitude})

    heights = [None, 901.0, math.nan, 899.0]
    said: list = []
    rospy = SimpleNamespace(wait_for_message=heard, ROSException=TimeoutError)
    monkeypatch.setitem(sys.modules, "rospy", rospy)  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "xplane_bridge.msg", SimpleNamespace(FlightState=None))  # type: ignore[arg-type]
    monkeypatch.setattr(recorded_poses, "place", place)
    for _ in range(3):
        with pytest.raises(NotAsAskedError, match=text):
            _place_near(POSE, "/xplane", said.append)
    assert said == []
    _place_near(POSE, "/xplane", said.append)
    assert said == [f"{text}; its place is near enough for poses"]


def test_they_begin_where_the_place_is_first_known(tmp_path):
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(100):
            state = {**bag.state(k / 10, k), "flight_path_angle_deg": 2.0}
            if k < 50:
                state.update(latitude=math.nan, longitude=math.nan, altitude_msl=math.nan)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), state)
    poses = read_poses(tmp_path / "flight.bag")
    assert poses.time == pytest.approx(np.arange(50) / 10)
    assert poses.at(1.0)["altitude_msl"] == pytest.approx(1000.0 + 2.0 * 6.0)
    assert poses.start["altitude_msl"] == poses.at(0.0)["altitude_msl"]
