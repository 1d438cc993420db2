"""The cameras of a recording are found by where their topics are, and called as camera.launch calls them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import BagError, Bags
from xplane_bridge.bags.cameras import Camera, cameras, chosen_cameras

if TYPE_CHECKING:
    from pathlib import Path


def write(path: Path, frames: Sequence[str], state: str = "", images: Sequence[str] = ()) -> Path:
    """A bag with one FrameState on each of some topics, a flight state and images."""
    with FlightBag(path) as bag:
        ns = stamp_ns(0.0)
        header = bag.header(ns, "camera")
        if state:
            bag.add(state, "xplane_bridge/FlightState", ns, bag.state(0.0, 0))
        for topic in frames:
            bag.add(topic, "xplane_bridge/FrameState", ns, {"header": header, "state": bag.state(0.0, 0)})
        for topic in images:
            values = {"header": header, "format": "jpeg", "data": [1]}
            kind = "CompressedImage" if topic.endswith("compressed") else "Image"
            if kind == "Image":
                values = {"header": header, "height": 1, "width": 1, "encoding": "mono8", "step": 1, "data": [1]}
            bag.add(topic, f"sensor_msgs/{kind}", ns, values)
    return path


def found(path: Path) -> list[Camera]:
    with Bags(path) as bags:
        return cameras(bags)


def test_the_bridges_own_comes_first_and_each_has_its_own_topics(tmp_path: Path) -> None:
    own, belly = "/xplane/camera", "/xplane/belly/camera"
    images = [f"{belly}/image_raw", f"{own}/image_raw", f"{own}/image_raw/compressed"]
    path = write(tmp_path / "a.bag", [f"{belly}/frame_state", f"{own}/frame_state"], "/xplane/flight_state", images)
    assert found(path) == [
        Camera("camera", f"{own}/frame_state", f"{own}/camera_info", f"{own}/image_raw/compressed"),
        Camera("belly", f"{belly}/frame_state", f"{belly}/camera_info", f"{belly}/image_raw"),
    ]
    with Bags(path) as bags:
        assert bags.topic_of_type("xplane_bridge/FrameState") == f"{own}/frame_state", "what reads one camera, reads it"


@pytest.mark.parametrize(
    ("frames", "state", "names"),
    [
        (["/xplane/belly/camera/frame_state"], "/xplane/flight_state", ["belly"]),
        (["/xplane/belly/camera/frame_state"], "", ["belly"]),
        (["/xplane/camera/frame_state"], "", ["camera"]),
        (["/camera/frame_state"], "", ["camera"]),
        (["/camera/frame_state", "/tail/camera/frame_state"], "/flight_state", ["camera", "tail"]),
        # Two bridges: the cameras of the first, as with all other topics.
        (["/a/camera/frame_state", "/b/camera/frame_state"], "/a/flight_state", ["camera"]),
        (["/a/camera/frame_state", "/b/camera/frame_state"], "", ["a", "b"]),
        (["/b/camera/frame_state"], "/a/flight_state", []),
        (["/x/a/b/camera/frame_state"], "/x/flight_state", ["a_b"]),
        (["/my/own_frames"], "", ["own_frames"]),
        # No two are called alike: files and labels take them apart by their names.
        (["/x/camera/camera/frame_state", "/x/camera/frame_state"], "/x/flight_state", ["x", "x_camera"]),
        (
            ["/x/a/b/camera/frame_state", "/x/a_b/camera/frame_state", "/x/camera/frame_state"],
            "/x/flight_state",
            ["x", "x-a-b", "x-a_b"],
        ),
        (
            ["/z/camera/frame_state", "/z/camera/camera/frame_state", "/z/a/camera/frame_state"],
            "/z/flight_state",
            ["z", "z_a", "z_camera"],
        ),
        (
            ["/camera/frame_state", "/camera/camera/frame_state"],
            "/flight_state",
            ["camera-frame_state", "camera-camera-frame_state"],
        ),
        (
            ["/camera/frame_state", "/camera/camera/frame_state"],
            "",
            ["camera-camera-frame_state", "camera-frame_state"],
        ),
        ([], "/x/flight_state", []),
    ],
)
def test_names(tmp_path: Path, frames: list, state: str, names: list) -> None:
    assert [camera.name for camera in found(write(tmp_path / "a.bag", frames, state))] == names


def test_pictures_of_an_only_camera_may_have_any_name(tmp_path: Path) -> None:
    path = write(tmp_path / "a.bag", ["/xplane/camera/frame_state"], images=["/elsewhere/pictures"])
    assert found(path)[0].images == "/elsewhere/pictures"


def test_a_camera_that_is_not_there_is_named(tmp_path: Path) -> None:
    topics = ["/xplane/camera/frame_state", "/xplane/belly/camera/frame_state"]
    with Bags(write(tmp_path / "a.bag", topics, "/xplane/flight_state")) as bags:
        assert [camera.name for camera in chosen_cameras(bags, ["belly"])] == ["belly"]
        with pytest.raises(BagError, match="no camera tail; expected some of: camera, belly"):
            chosen_cameras(bags, ["belly", "tail"])
    with Bags(write(tmp_path / "b.bag", [], "/xplane/flight_state")) as bags, pytest.raises(
        BagError, match="record cam"
    ):
        chosen_cameras(bags)
