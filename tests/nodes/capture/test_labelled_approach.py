"""Labels of an approach as it is flown, captured and recorded: lines and aircraft are where the pictures show them."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Iterator, List, Tuple

import numpy as np
import pytest
import yaml

from support.flights.approach_flight import FPS
from support.flights.drawn_approach import geodetic
from support.white_lines import MEDIAN_PX, P95_PX, flight_of, measure_flight
from xplane_bridge.bags import Bags
from xplane_bridge.bags.cameras import COMPRESSED
from xplane_bridge.bags.pictures import grey_pictures, image_topic
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.harness.ros import ros_environment
from xplane_bridge.resources import config_file

TESTS = Path(__file__).parents[2]
TIMEOUT_S = 240.0
#: Flies in a process of its own: rospy knows one master a process, and the tests' process has its own already.
FLY = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from support.flights.approach_flight import fly_approach
fly_approach(Path(sys.argv[2]), Path(sys.argv[3]), lockstep=True)
"""
#: The last seconds of the approach: from 800 m before the threshold.
START_ALONG, END_S = -900.0 - 800.0, 13
#: Pictures of it in lock-step: of every frame, that of its end too; and those that are measured.
PICTURES = END_S * FPS + 1
EVERY = 4
#: How far lines may be off the labels of the very frame that a picture shows. Of the frame before or after, which is
#: what the promised limits leave room for, they are twice as far off and more.
OWN_MEDIAN_PX, OWN_P95_PX = 0.15, 0.45
#: 300 m before the aircraft, 60 m to the right.
AHEAD = {"number": 1, "ahead": 300, "right": 60, "turned": 0, "speed": 40}


def scenario(file: Path) -> Path:
    """Shortens the scenario that is shipped; livelier, so that frames differ, and with another aircraft."""
    content = yaml.safe_load(config_file("scenarios", "approach.yaml").read_text(encoding="utf-8"))
    latitude, longitude = geodetic(START_ALONG, 0.0)
    content["start"].update(latitude=latitude, longitude=longitude, altitude=60)
    wind, final, roll, *_ = content["events"]
    roll["at"] = 1
    roll["excitation"]["amplitude"] = 0.25
    content["events"] = [wind, final, roll, {"at": 1, "traffic": [AHEAD]}, {"at": END_S, "end": True}]
    del content["criteria"]
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return file


def flown(folder: Path) -> Path:
    """The recording of it."""
    arguments = [str(TESTS), folder / "out", scenario(folder / "short.yaml")]
    with ManagedProcess("flight", [sys.executable, "-c", FLY, *arguments], folder, env=ros_environment()) as flight:
        assert flight.wait(TIMEOUT_S) == 0, flight.output()
    return folder / "out" / "flight.bag"


@pytest.fixture(scope="module", name="bags")
def fixture_bags(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bags]:
    with Bags(flown(tmp_path_factory.mktemp("approach"))) as bags:
        yield bags


def test_white_lines_lie_where_the_labels_say(bags: Bags) -> None:
    flight = flight_of(bags)
    assert len(list(flight.frames())) == PICTURES
    lines = measure_flight(bags, flight, EVERY)
    assert lines.unsure == 0
    assert lines.pictures > 0.8 * PICTURES / EVERY, "but for those with the lines at an edge"
    assert len(lines.error) > 20 * lines.pictures
    assert lines.median <= OWN_MEDIAN_PX < MEDIAN_PX
    assert lines.p95 <= OWN_P95_PX < P95_PX


@pytest.mark.parametrize("late", [-1, 1])
def test_pictures_that_are_paired_a_frame_wrong_are_found(bags: Bags, late: int) -> None:
    lines = measure_flight(bags, flight_of(bags), EVERY, late=late)
    assert len(lines.error) > 20 * lines.pictures
    assert lines.median > MEDIAN_PX or lines.p95 > P95_PX
    assert lines.median > 2 * OWN_MEDIAN_PX
    assert lines.p95 > 2 * OWN_P95_PX


def contrast(grey: np.ndarray, centre: Tuple[float, float], size: float) -> float:
    """How much brighter it is in the middle of a label than around it."""
    u, v = (round(part) for part in centre)
    around = max(math.ceil(size), 12)
    near = grey[max(v - 3, 0) : v + 4, max(u - 3, 0) : u + 4]
    wide = grey[max(v - around, 0) : v + around, max(u - around, 0) : u + around]
    return float(near.max()) - float(np.median(wide))


def test_the_other_aircraft_is_where_its_label_says(bags: Bags) -> None:
    there: List[float] = []
    beside: List[float] = []
    lines = {line["stamp_ns"]: line for line in flight_of(bags).labels()}
    known = [line["others_known"] for line in lines.values()]
    assert sum(known) > 0.8 * len(known)
    for stamp, grey in grey_pictures(bags, image_topic(bags, (COMPRESSED, "sensor_msgs/Image"))):
        for thing in lines[stamp]["objects"]:
            if thing["kind"] == "aircraft" and thing["state"] == "visible" and 15.0 < thing["size_px"] < 80.0:
                u, v = thing["centre"]
                there.append(contrast(grey, (u, v), thing["size_px"]))
                beside.append(contrast(grey, (u, v - thing["size_px"]), thing["size_px"]))
    assert len(there) > 50
    assert np.median(there) > np.median(beside) + 20.0
