"""The poses of rerun_flight: what lies between two, and that they end when they are to."""

from __future__ import annotations

import socket

import numpy as np
import pytest

from xplane_bridge.cli.flights.recorded_poses import Poses
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
        assert all(xplane.recv(600).startswith(b"DREF\0") for _ in range(10))
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
