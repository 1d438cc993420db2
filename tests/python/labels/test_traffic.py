"""Other aircraft in pictures: where the emulator draws them, from states recorded at other times than the pictures."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Callable, Optional, Sequence

import cv2
import numpy as np
import pytest

from support.flights.drawn_approach import (
    ANCHOR,
    HEADING_DEG,
    PERIOD,
    SIZE,
    geodetic,
    scene,
    traffic_state,
    write_approach,
)
from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.white_lines import airport_file, flight_of
from xplane_bridge.bags import Bags
from xplane_bridge.cli.sight.label_images import main as label_images
from xplane_bridge.emulator.view.renderer.painter import Painter
from xplane_bridge.export.image_labels import ImageLabels
from xplane_bridge.labels.traffic import RecordedTraffic
from xplane_bridge.plotting.overlay import draw

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.emulator.view.renderer.scene import Pose

EVERY, PICTURES = 7, 16
NOWHERE = (math.nan,) * 6


def crossing(t: float) -> list[Pose]:
    """Ahead of our own aircraft, from the left to the right at 60 m/s, in a turn."""
    along = -1800.0 + 55.0 * t + 350.0 - 4.0 * t * t
    return [(*geodetic(along, -100.0 + 60.0 * t), scene(t).altitude_m + 15.0, 10.0, 0.0, HEADING_DEG + 90.0)]


def drawn_box(t: float, others: Sequence[Pose]) -> np.ndarray:
    """Left, top, right, bottom of what the emulator draws of others."""
    painter = Painter(*SIZE, ANCHOR, HEADING_DEG)
    without = painter.paint(scene(t)).astype(int)
    drawn = painter.paint(replace(scene(t), others=tuple(others))).astype(int)
    rows, columns = np.nonzero(np.abs(drawn - without).max(axis=2) > 6)
    return np.array((columns.min(), rows.min(), columns.max(), rows.max()), float)


def labelled(path: Path) -> list[dict[str, Any]]:
    with Bags(path) as bags:
        return list(flight_of(bags).labels())


def aircraft(line: dict[str, Any]) -> list[dict[str, Any]]:
    return [thing for thing in line["objects"] if thing["kind"] == "aircraft"]


def test_other_aircraft_are_where_they_are_drawn(tmp_path: Path) -> None:
    lines = labelled(write_approach(tmp_path / "flight.bag", PICTURES, every=EVERY, traffic=crossing))
    assert all(line["others_known"] for line in lines)
    off, seen = [], 0
    for k, line in enumerate(lines):
        (pose,) = crossing(k * EVERY * PERIOD)
        for thing in aircraft(line):
            assert (thing["name"], thing["seen"]) == ("1", "geometric")
            if thing["state"] != "visible":
                continue
            seen += 1
            drawn = drawn_box(k * EVERY * PERIOD, [pose])
            error = np.array(thing["centre"]) - 0.5 * (drawn[:2] + drawn[2:])
            off.append(float(np.linalg.norm(error)) / thing["sigma_px"])
            left, top, right, bottom = thing["box"]
            assert left - 2.0 <= drawn[0]
            assert top - 2.0 <= drawn[1]
            assert drawn[2] <= right + 2.0
            assert drawn[3] <= bottom + 2.0
            assert 1.0 < thing["sigma_px"] < 4.0
    assert seen >= 8
    assert max(off) < 1.5, "the nearest recorded state would be up to 8 m beside it"


class Recorded:
    """Traffic of a bag with the states of one time after the other."""

    def __init__(self, path: Path, moments: Sequence[float], poses: Callable[[float], Sequence[Pose]]) -> None:
        with FlightBag(path) as bag:
            for t in moments:
                state = traffic_state(bag, t, poses(t))
                bag.add("/xplane/traffic/state", "xplane_bridge/TrafficState", stamp_ns(t), state)
        with Bags(path) as bags:
            self.traffic = RecordedTraffic(bags, 12.0)


def test_a_turn_is_less_sure_than_a_straight_line(tmp_path: Path) -> None:
    east = math.degrees(1.0 / 6378145.0)

    def flying(t: float) -> list[Pose]:
        straight = (0.0, 60.0 * t * east, 500.0 + 2.0 * t, 0.0, 0.0, 90.0)
        turning = (10.0 * t * t * east, 60.0 * t * east, 500.0, 0.0, 0.0, 90.0)  # 20 m/s^2
        return [straight, turning]

    recorded = Recorded(tmp_path / "a.bag", [0.0, 0.5, 1.0, 1.5, 2.0], flying).traffic
    found = recorded.at(1, 0.75)
    assert found is not None
    straight, turning = found
    assert (straight.name, straight.span) == ("1", 12.0)
    assert straight.longitude == pytest.approx(45.0 * east, abs=1e-3 * east)
    assert straight.altitude == pytest.approx(501.5)
    assert straight.sigma == pytest.approx(1.0, abs=0.01)
    # Its place is wrong by a dt^2 / 8, and that is its sigma beside the metre of what is its middle.
    assert turning.latitude == pytest.approx((10.0 * 0.75**2 + 20.0 * 0.25 / 8.0) * east, abs=1e-3 * east)
    assert turning.sigma == pytest.approx(math.hypot(1.0, 20.0 * 0.25 / 8.0), abs=0.01)


def test_what_is_not_known_is_said(tmp_path: Path) -> None:
    def flying(t: float) -> list[Pose]:
        stays = (0.0, 179.9999 + 0.0002 * t, 100.0, 0.0, 0.0, 0.0)
        leaves = (0.0, 0.0, 100.0, 0.0, 0.0, 0.0) if t < 2.5 else NOWHERE
        placed = (0.0, 1.0 if t < 4.5 else 1.5, 100.0, 0.0, 0.0, 0.0)
        return [stays, leaves, placed]

    recorded = Recorded(tmp_path / "a.bag", [1.0, 2.0, 3.0, 4.0, 5.0, 9.0], flying).traffic
    assert recorded.at(1, 0.9) is None, "before the first state"
    assert recorded.at(1, 9.1) is None, "after the last one"
    assert recorded.at(2, 1.5) is None, "of another epoch"
    assert recorded.at(1, 2.5) is None, "one has gone meanwhile"
    assert recorded.at(1, 4.5) is None, "one was placed anew"
    assert recorded.at(1, 7.0) is None, "too long without a state"
    assert [other.name for other in recorded.at(1, 2.0) or ()] == ["1", "2", "3"]
    across, standing = recorded.at(1, 3.5) or ()
    assert (across.name, standing.name) == ("1", "3")
    assert across.longitude == pytest.approx(-179.9994), "over the date line"


def test_what_changes_in_a_pause_is_not_known_at_its_time_and_new_after_it(tmp_path: Path) -> None:
    """Simulator time stands in a pause, while states go on coming."""
    stays, old, new, further = ((0.0, place, 100.0, 0.0, 0.0, 0.0) for place in (0.0, 1.0, 1.0003, 2.0))
    moments = [9.0, 9.5, 10.0, 10.0, 10.0, 10.5, 11.0]

    def places(name: str, number: str, in_pause: Sequence[list[Pose]]) -> list[Optional[list[float]]]:
        poses = iter([[stays, old]] * 3 + [*in_pause] + [in_pause[-1]] * 2)
        traffic = Recorded(tmp_path / name, moments, lambda _: next(poses)).traffic
        found = [traffic.at(1, time) for time in (9.75, 10.0, 10.25, 11.0)]
        return [
            None if others is None else [round(other.longitude, 6) for other in others if other.name == number]
            for others in found
        ]

    assert places("moved.bag", "2", [[stays, new]] * 2) == [[1.0], None, [1.0003], [1.0003]]
    assert places("added.bag", "3", [[stays, old, further]] * 2) == [[], None, [2.0], [2.0]]
    assert places("gone.bag", "2", [[stays, NOWHERE]] * 2) == [[1.0], None, [], []]
    assert places("back.bag", "2", [[stays, new], [stays, old]]) == [[1.0], None, [1.0], [1.0]]
    assert places("still.bag", "2", [[stays, old]] * 2) == [[1.0]] * 4


def test_a_flight_without_them_says_that_nothing_is_known(tmp_path: Path) -> None:
    lines = labelled(write_approach(tmp_path / "flight.bag", 2))
    assert [line["others_known"] for line in lines] == [False, False]


def test_they_go_from_the_program_into_exports_and_overlay(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = write_approach(tmp_path / "flight.bag", PICTURES, every=EVERY, traffic=crossing)
    arguments = ["--apt", str(airport_file()), "--airport", "XEMU", "--flat-world", "--span", "9"]
    assert label_images([str(bag), *arguments]) == 0
    assert "other aircraft: known in 16 of 16 pictures" in capsys.readouterr().out
    with Bags(bag) as bags:
        labels = ImageLabels(bags, tmp_path / "flight.labels.jsonl")
    assert (labels.about["other_aircraft"], labels.about["others_unknown"], labels.about["span"]) == (True, 0, 9.0)
    keys = [("camera", stamp_ns(k * EVERY * PERIOD)) for k in range(PICTURES)]
    assert labels.counts(keys)["objects"]["aircraft"] >= 8
    frame = labels.frame(next(key for key in keys if "aircraft" in labels.boxes(key)["category"]))
    assert frame is not None
    plain = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    without = {**frame, "objects": [thing for thing in frame["objects"] if thing["kind"] != "aircraft"]}
    changed = cv2.absdiff(draw(plain, frame), draw(plain, without)).max(axis=2)
    rows, columns = np.nonzero(changed)
    (thing,) = aircraft(frame)
    scale = changed.shape[1] / SIZE[0]
    assert (columns.mean() / scale, rows.mean() / scale) == pytest.approx(thing["centre"], abs=3.0)
    for form in ("coco", "yolo"):
        assert export(bag, "--format", form, "--labels", tmp_path / "flight.labels.jsonl", "-o", tmp_path) == 0
    found = 0
    for file in (tmp_path / "flight.coco" / "annotations").glob("*.json"):
        content = json.loads(file.read_text())
        assert all(image["others_known"] for image in content["images"])
        (number,) = (kind["id"] for kind in content["categories"] if kind["name"] == "aircraft")
        found += sum(note["category_id"] == number and note["sigma_px"] > 1.0 for note in content["annotations"])
    lines = [line for file in (tmp_path / "flight.yolo" / "labels").rglob("*.txt") for line in file.open()]
    assert found == sum(line.startswith("2 ") for line in lines) == labels.counts(keys)["objects"]["aircraft"]
