"""The poses of rerun_flight: what lies between two, and that they end when they are to."""

from __future__ import annotations

import math
import socket

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.cli.flights.recorded_poses import Poses, read_poses
from xplane_bridge.harness.pose_sender import PoseSender, Scenery

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
