"""Every topic and field named in the README's live commands and in the view files exists."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from support.synthetic_flight import Definitions
from xplane_bridge.topics import NAMESPACE, TOPICS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def definitions() -> Definitions:
    return Definitions()


def check(definitions: Definitions, name: str) -> None:
    """Follow a full field name through the message definitions down to a number."""
    topics = [f"{NAMESPACE}/{t}" for t in TOPICS if name.startswith(f"{NAMESPACE}/{t}/")]
    assert topics, f"{name}: no such topic"
    topic = max(topics, key=len)
    message = definitions.message(TOPICS[topic[len(NAMESPACE) + 1 :]].replace("/", "/msg/"), {})
    for part in name[len(topic) + 1 :].split("/"):
        field, index = re.match(r"^(\w+)(?:\[(\d+)\])?$", part).groups()
        assert hasattr(message, field), f"{name}: no field {field}"
        message = getattr(message, field)
        if index is not None:
            assert int(index) < len(message), f"{name}: index {index} is out of range"
            message = message[int(index)]
    assert isinstance(float(message), float)


def readme_fields(program: str) -> list:
    names = []
    for line in (ROOT / "README.md").read_text().splitlines():
        words = line.split("#")[0].split()
        if words[:1] == [program]:
            for word in words[1:]:
                first, *others = re.split("[:,]", word)
                names += [first, *(first.rpartition("/")[0] + "/" + other for other in others)]
    return names


@pytest.mark.parametrize("program", ["rqt_plot", "scripts/live_plot"])
def test_the_readme_plots_what_exists(definitions: Definitions, program: str) -> None:
    names = readme_fields(program)
    assert len(names) >= 4
    for name in names:
        check(definitions, name)


def test_the_readme_shows_an_image_topic() -> None:
    (name,) = readme_fields("rqt_image_view")
    assert TOPICS[name[len(NAMESPACE) + 1 :]] == "sensor_msgs/Image"


def test_the_plotjuggler_layout_plots_what_exists(definitions: Definitions) -> None:
    curves = [c.attrib["name"] for c in ET.parse(ROOT / "config/views/plotjuggler.xml").iter("curve")]
    assert len(curves) >= 15
    for name in curves:
        check(definitions, name)


def test_the_rviz_configuration_shows_what_exists() -> None:
    displays = yaml.safe_load((ROOT / "config/views/flight.rviz").read_text())["Visualization Manager"]["Displays"]
    wanted = {"rviz/Odometry": ("Topic", "nav_msgs/Odometry"), "rviz/Image": ("Image Topic", "sensor_msgs/Image")}
    seen = 0
    for display in displays:
        if display["Class"] in wanted:
            key, msgtype = wanted[display["Class"]]
            assert TOPICS[display[key][len(NAMESPACE) + 1 :]] == msgtype
            seen += 1
    assert seen == len(wanted)


def test_every_topic_has_a_type_that_exists(definitions: Definitions) -> None:
    for msgtype in TOPICS.values():
        assert msgtype.replace("/", "/msg/") in definitions.store.types, msgtype
