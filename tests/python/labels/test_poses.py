"""A picture's pose out of a recording in which not all of it is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from support.flights.drawn_approach import FORWARD, PERIOD, add_picture, frame_state, scene
from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.white_lines import flight_of
from xplane_bridge.bags import Bags
from xplane_bridge.constants import ImageQuality
from xplane_bridge.labels.flight import _pose

if TYPE_CHECKING:
    from pathlib import Path

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


def test_a_frame_at_the_edge_of_an_epoch_may_be_its_neighbour() -> None:
    assert pose(quality=ImageQuality.EPOCH_EDGE).may_be_neighbour
    assert not pose(quality=ImageQuality.PAUSED).may_be_neighbour


@pytest.mark.parametrize("states", [True, False])
def test_pictures_of_a_pauses_beginning_may_show_what_was_before_it(tmp_path: Path, states: bool) -> None:
    """As earlier versions recorded it: from the pause on, each picture has the pause's state, also while older show."""
    delay, begins = 0.1, 1.0
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(75):
            t = k * PERIOD
            stood = scene(min(t, begins))
            frame = frame_state(bag, stood, stamp_ns(t), display_delay=delay)
            if states:
                bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), frame["state"])
            if k % 2:
                continue
            paused = t >= begins
            shown = stood if paused else scene(max(t - delay, 0.0))
            frame = frame_state(bag, shown, stamp_ns(t), display_delay=delay, quality=128 * paused)
            add_picture(bag, FORWARD, np.zeros((2, 2, 3), np.uint8), frame)
    with Bags(path) as bags:
        poses = {frame.stamp: frame.camera.pose for frame in flight_of(bags).frames()}
    unsure = {
        round((stamp - stamp_ns(begins)) / 1e9, 3): pose.period
        for stamp, pose in poses.items()
        if pose.may_be_neighbour
    }
    if states:  # at the beginning by all of the delay, then by what is left of it
        assert unsure == pytest.approx({0.0: 0.1, 0.067: 0.0333}, abs=1e-3)
    else:
        assert len(unsure) == 23
        assert set(unsure.values()) == {delay}


def test_a_state_between_two_received_ones_is_as_unsure_as_half_their_spacing(tmp_path: Path) -> None:
    """Every sixth is received; that of 30 was lost."""
    delay, received = 0.1, {0, 6, 12, 18, 24, 36, 42, 48, 54}
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(60):
            t = k * PERIOD
            quality = ImageQuality.INTERPOLATED.value * (k not in received)
            frame = frame_state(bag, scene(t), stamp_ns(t + delay), display_delay=delay, quality=quality)
            add_picture(bag, FORWARD, np.zeros((2, 2, 3), np.uint8), frame)
            if k in received:
                bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), frame["state"])
    with Bags(path) as bags:
        poses = [frame.camera.pose for frame in flight_of(bags).frames()]
    assert len(poses) == 60
    for k, pose in enumerate(poses):
        assert pose.may_be_neighbour == (k not in received)
        half = 6 if 24 < k < 36 else 3
        assert pose.period == pytest.approx(PERIOD if k in received else half * PERIOD, rel=1e-3)
