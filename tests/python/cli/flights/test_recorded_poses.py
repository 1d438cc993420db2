"""The poses of rerun_flight end when they are to."""

from __future__ import annotations

import socket

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
