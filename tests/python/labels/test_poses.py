"""A picture's pose out of a recording in which not all of it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.labels.flight import _pose

#: A row of camera/frame_state: level at 60 m/s to the north, a picture that may be a frame off.
ROW = {
    "quality": 16384,
    "frame_period": 0.02,
    "camera_pose_uncertainty": 0.1,
    "camera_pose_uncertainty_deg": 0.2,
    "state.latitude": 47.0,
    "state.longitude": 8.0,
    "state.altitude_msl": 500.0,
    **{f"state.orientation.{axis}": float(axis == "w") for axis in "xyzw"},
    **{f"body_to_camera.rotation.{axis}": float(axis == "w") for axis in "xyzw"},
    **{f"body_to_camera.translation.{axis}": 0.0 for axis in "xyz"},
    **{f"state.angular_velocity.{axis}": 0.0 for axis in "xyz"},
    **{f"state.velocity_ned.{axis}": 60.0 * (axis == "x") for axis in "xyz"},
}


def pose(**changes: float):
    return _pose({name: np.array([value]) for name, value in {**ROW, **changes}.items()}, 0)  # type: ignore[arg-type]


def test_a_frame_lasts_as_long_as_x_plane_says() -> None:
    assert pose().period == 0.02
    assert pose().may_be_neighbour


@pytest.mark.parametrize("unknown", [math.nan, 0.0])
def test_a_frame_of_unknown_length_is_as_long_as_one_can_be(unknown: float) -> None:
    assert pose(frame_period=unknown).period == 0.05
