"""The report of a recording with several cameras: a strip of each with the same frames, pairing of each, their join."""

from __future__ import annotations

import base64
import re
from typing import TYPE_CHECKING, NamedTuple, Sequence

import cv2
import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.cli import flight_report

if TYPE_CHECKING:
    from pathlib import Path

RATE = 20.0
STATE_MISSING, BORDERLINE, POSE_UNSURE = 1, 16384, 32768
OWN, BELLY = "/xplane/camera", "/xplane/belly/camera"


class Sight(NamedTuple):
    """What was recorded of a camera."""

    topics: str
    colour: int  #: channel of its pictures, whose brightness is the frame's number
    frames: Sequence[int]  #: that it has a picture of
    quality: int = 0  #: of every fifth picture
    late_ms: int = 0  #: of its stamps, as each window has a delay of its own
    kind: str = "CompressedImage"
    pictures_every: int = 1  #: pictures were recorded of every so many of these frames
    error: float = 0.001  #: sim_time_error [s]


def write(path: Path, *sights: Sight, count: int = 60) -> Path:
    with FlightBag(path) as bag:
        for k in range(count):
            state = bag.state(k / RATE, k)
            ns = stamp_ns(k / RATE)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, state)
            for sight in sights:
                if k in sight.frames:
                    add_picture(bag, sight, k, state, ns + sight.late_ms * 1_000_000)
    return path


def add_picture(bag: FlightBag, sight: Sight, k: int, state: dict, ns: int) -> None:
    header = bag.header(ns, "camera_optical", k)
    quality = sight.quality if k % 5 == 0 else 0
    frame = {"header": header, "state": state, "quality": quality, "frame_sim_time": k / RATE}
    frame["sim_time_error"] = sight.error
    bag.add(f"{sight.topics}/frame_state", "xplane_bridge/FrameState", ns + 40_000_000, frame)
    if sight.frames.index(k) % sight.pictures_every:
        return
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :, sight.colour] = 4 * k % 256
    if sight.kind == "Image":
        image = {"header": header, "height": 48, "width": 64, "encoding": "bgr8", "step": 192, "data": pixels.ravel()}
        bag.add(f"{sight.topics}/image_raw", "sensor_msgs/Image", ns + 70_000_000, image)
        return
    image = {"header": header, "format": "jpeg", "data": cv2.imencode(".jpg", pixels)[1].reshape(-1)}
    # Encoded when its FrameState is out, and more than a picture later.
    bag.add(f"{sight.topics}/image_raw/compressed", "sensor_msgs/CompressedImage", ns + 130_000_000, image)


def sections(bag: Path) -> tuple[str, str]:
    """Pictures and quality on the page of a bag."""
    page = bag.with_suffix(".html")
    assert flight_report.main([str(bag), "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    images, quality = (text.split(f'<section id="{key}">')[1].split("</section>")[0] for key in ("images", "quality"))
    return images, quality


def shown(strip: str) -> list[tuple[int, int]]:
    """Channel and frame of each picture on a strip."""
    out = []
    for data in re.findall(r'src="data:image/jpeg;base64,([^"]+)"', strip):
        picture = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
        mean = picture.mean(axis=(0, 1))
        out.append((int(mean.argmax()), round(float(mean.max()) / 4)))
    return out


def captions(strip: str) -> list[tuple[str, str]]:
    """Time and words below each picture on a strip."""
    return re.findall(r"<figcaption>([\d.]+) s &middot; (.*?)</figcaption>", strip)


def test_strips_of_two_cameras_show_the_same_frames_with_their_states(tmp_path: Path) -> None:
    # The second comes 10 frames later, its stamps are 3 ms later, and it has every second frame.
    belly = Sight(BELLY, 2, range(10, 60, 2), late_ms=3)
    images, _ = sections(write(tmp_path / "two.bag", Sight(OWN, 0, range(60)), belly))
    head, *strips = images.split("<h3>Camera ")
    assert [strip.split("<")[0] for strip in strips] == ["camera", "belly"]
    assert "41.7 % of the frames with a picture have one of every camera: 25 of 60, 25 of them without" in head
    assert "The strips show the same frames." in head
    frames = [frame for _, frame in shown(strips[0])]
    assert set(frames) <= set(range(10, 60, 2))
    assert (frames[0], frames[-1], len(frames)) == (10, 58, 12)
    assert shown(strips[0]) == [(0, frame) for frame in frames]
    assert shown(strips[1]) == [(2, frame) for frame in frames]
    for strip in strips:
        assert [time for time, _ in captions(strip)] == [f"{frame / RATE:.1f}" for frame in frames]
    assert [text for _, text in captions(strips[0])] == [text for _, text in captions(strips[1])]


def test_each_camera_has_its_pairing_and_its_quality_in_words(tmp_path: Path) -> None:
    belly = Sight(BELLY, 2, range(40), quality=BORDERLINE | POSE_UNSURE)
    tail = Sight("/xplane/tail/camera", 1, range(20, 60), quality=STATE_MISSING)
    _, quality = sections(write(tmp_path / "three.bag", Sight(OWN, 0, range(60)), belly, tail))
    own, second, third, together = re.split("<h3>(?:Images of camera |Frames of several cameras</h3>)", quality)[1:]
    assert own.startswith("camera</h3><p>60 images, 100.0 % with a state, 100.0 % without any remark")
    assert "<table>" not in own
    assert second.startswith("belly</h3><p>40 images, 100.0 % with a state, 80.0 % without any remark")
    assert "<td>borderline</td><td>half way between two frames, or seen late" in second
    assert (
        "<td>pose unsure</td><td>where the camera was in the aircraft is not settled</td><td class=n>20.0 %" in second
    )
    assert third.startswith("tail</h3><p>40 images, 80.0 % with a state, 80.0 % without any remark")
    assert "<td>state missing</td><td>no state could be paired with it</td>" in third
    # Frames 20 to 39; those that 5 divides have no state in the third.
    assert "26.7 % of the frames with a picture have one of every camera: 16 of 60, 16 of them without" in together
    rows = re.findall(r"<tr><td>(\w+)</td><td class=n>(\d+)</td><td class=n>([\d.]+) %</td></tr>", together)
    assert rows == [("camera", "60", "26.7"), ("belly", "40", "40.0"), ("tail", "32", "50.0")]


def test_cameras_that_share_few_frames_have_strips_of_their_own(tmp_path: Path) -> None:
    pair = Sight(OWN, 0, range(30)), Sight(BELLY, 2, range(25, 60))
    images, _ = sections(write(tmp_path / "apart.bag", *pair))
    head, *strips = images.split("<h3>Camera ")
    assert "8.3 % of the frames with a picture have one of every camera: 5 of 60" in head
    assert "same frames" not in head
    for strip, (colour, first, last) in zip(strips, ((0, 0, 29), (2, 25, 59))):
        pictures = shown(strip)
        assert len(pictures) == 12
        assert (pictures[0], pictures[-1]) == ((colour, first), (colour, last))


def test_a_camera_without_compressed_pictures_is_named_and_the_other_shown(tmp_path: Path) -> None:
    pair = Sight(OWN, 0, range(60)), Sight(BELLY, 2, range(60), kind="Image")
    images, quality = sections(write(tmp_path / "raw.bag", *pair))
    own, belly = images.split("<h3>Camera ")[1:]
    assert len(shown(own)) == 12
    assert "Not shown: no compressed images of this camera were recorded" in belly
    assert "belly</h3><p>60 images" in quality


def test_pictures_that_were_recorded_seldom_stand_for_their_neighbours(tmp_path: Path) -> None:
    images, _ = sections(write(tmp_path / "seldom.bag", Sight(OWN, 0, range(60), pictures_every=6)))
    assert "<h3>" not in images, "a camera alone needs no name"
    assert shown(images) == [(0, frame) for frame in range(0, 60, 6)], "each once"
    assert [time for time, _ in captions(images)] == [f"{frame / RATE:.1f}" for frame in range(0, 60, 6)]


def test_only_pictures_near_those_of_the_strip_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    messages = Bags.messages

    def counted(self: Bags, topic: str, *args: object) -> object:
        for item in messages(self, topic, *args):
            read.append("image_raw" in topic)
            yield item

    monkeypatch.setattr(Bags, "messages", counted)
    pair = Sight(OWN, 0, range(600)), Sight(BELLY, 2, range(600))
    sections(write(tmp_path / "long.bag", *pair, count=600))
    assert 24 <= sum(read) <= 24 * 16


def test_a_time_error_that_is_not_known_is_left_out(tmp_path: Path) -> None:
    pictures, _ = sections(write(tmp_path / "one.bag", Sight(OWN, 0, range(20), error=float("nan"))))
    assert "IAS" in pictures
    assert "time error" not in pictures
