"""What is written for a pose is the pose that X-Plane shows, also far from the scenery's origin."""

from __future__ import annotations

import numpy as np
import pytest

from xplane_bridge.harness.pose_sender import Scenery

RADIUS = 6378145.0
POSITION = "sim/flightmodel/position/"
POSE = {
    "latitude": 37.5, "longitude": 126.5, "altitude_msl": 800.0,
    "orientation.x": 0.0, "orientation.y": 0.0, "orientation.z": 0.0, "orientation.w": 1.0,
    "velocity_ned.x": 60.0, "velocity_ned.y": 5.0, "velocity_ned.z": -2.0,
}  # fmt: skip


def written(scenery=None, **pose):
    found = (scenery or Scenery(37.5, 126.5, RADIUS)).datarefs({**POSE, **pose})
    return {name[len(POSITION) :]: value for name, value in found.items()}


def quaternion(values):
    return [values[f"q[{k}]"] for k in range(4)]


def test_above_the_origin_local_axes_are_east_up_south():
    values = written()
    assert [values[f"local_{axis}"] for axis in "xyz"] == pytest.approx([0.0, 800.0, 0.0], abs=1e-6)
    assert [values[f"local_v{axis}"] for axis in "xyz"] == pytest.approx([5.0, 2.0, -60.0])
    assert quaternion(values) == pytest.approx([1.0, 0.0, 0.0, 0.0])


def test_north_and_east_of_the_origin():
    step = np.degrees(1000.0 / RADIUS)
    assert written(latitude=37.5 + step, altitude_msl=0.0)["local_z"] == pytest.approx(-1000.0, abs=0.01)
    east = written(longitude=126.5 + step / np.cos(np.radians(37.5)), altitude_msl=0.0)
    assert east["local_x"] == pytest.approx(1000.0, abs=0.01)
    assert east["local_y"] == pytest.approx(-(1000.0**2) / (2 * RADIUS), abs=0.01)  # the Earth falls away


@pytest.mark.parametrize("heading", [0.0, 90.0, 180.0, 300.0])
@pytest.mark.parametrize("roll", [-60.0, 0.0, 30.0])
def test_attitude_goes_through_as_it_is(heading, roll):
    h, r = np.radians(heading) / 2, np.radians(roll) / 2
    wanted = np.array([np.cos(h) * np.cos(r), np.cos(h) * np.sin(r), np.sin(h) * np.sin(r), np.sin(h) * np.cos(r)])
    attitude = {f"orientation.{axis}": value for axis, value in zip("wxyz", wanted)}
    values = written(**attitude)
    assert abs(np.dot(quaternion(values), wanted)) == pytest.approx(1.0)
    # the angles are all that is shown while the flight model is off
    assert (values["theta"], values["phi"]) == pytest.approx((0.0, roll), abs=1e-9)
    assert (values["psi"] - heading + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-9)


def test_far_away_level_is_tilted_against_the_origins_axes():
    degrees = 2.0
    q = quaternion(written(latitude=37.5 + degrees))
    tilt = 2.0 * np.degrees(np.arccos(q[0]))
    assert tilt == pytest.approx(degrees)
    assert written(latitude=37.5 + degrees)["theta"] == pytest.approx(-degrees)
    assert q[2] < 0.0  # further north, the nose of a level aircraft points below the horizon of the origin
