"""Every topic and field named in the README's live commands and in the view files exists."""

from __future__ import annotations

import ast
import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yaml

from support.flights.synthetic_flight import Definitions
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


def test_the_rqt_perspective_plots_what_the_paper_does_and_shows_the_picture(definitions: Definitions) -> None:
    document = json.loads((ROOT / "config/views/flight.perspective").read_text(encoding="utf-8"))
    manager = document["groups"]["pluginmanager"]
    running = ast.literal_eval(manager["keys"]["running-plugins"]["repr"])
    assert running == {"rqt_plot/Plot": [1, 2, 3], "rqt_image_view/ImageView": [1]}
    settings = {}
    for plugin, numbers in running.items():
        for number in numbers:
            keys = manager["groups"][f"plugin__{plugin.replace('/', '__')}__{number}"]["groups"]["plugin"]["keys"]
            settings[plugin, number] = {name: ast.literal_eval(key["repr"]) for name, key in keys.items()}
    assert len(settings) == len(manager["groups"])
    plotted = [settings["rqt_plot/Plot", number]["topics"] for number in (1, 2, 3)]
    state = f"{NAMESPACE}/flight_state/"
    paper = (["roll_deg", "pitch_deg"], ["heading_true_deg"], ["true_airspeed"])  # Fig. 10 b
    assert plotted == [[state + field for field in fields] for fields in paper]
    for name in (name for names in plotted for name in names):
        check(definitions, name)
    image = settings["rqt_image_view/ImageView", 1]["topic"]
    assert TOPICS[image[len(NAMESPACE) + 1 :]] == "sensor_msgs/Image"


def panels_of(node: Any) -> list:
    return [node] if isinstance(node, str) else [*panels_of(node["first"]), *panels_of(node["second"])]


def test_the_foxglove_layout_shows_what_exists(definitions: Definitions) -> None:
    document = json.loads((ROOT / "config/views/foxglove.json").read_text(encoding="utf-8"))
    panels = document["configById"]
    assert sorted(panels_of(document["layout"])) == sorted(panels)  # each once
    fields, topics = [], []
    for panel in panels.values():
        fields += [path["value"] for path in panel.get("paths", [])]
        topics += [panel[key] for key in ("topicPath", "topicToRender") if key in panel]
        topics += [panel["imageMode"]["imageTopic"]] if "imageMode" in panel else []
    assert len(fields) >= 10
    for field in fields:
        check(definitions, field.replace(".", "/"))
    assert len(topics) == 3
    for topic in topics:
        assert topic == "/diagnostics" or topic[len(NAMESPACE) + 1 :] in TOPICS, topic


def test_every_topic_has_a_type_that_exists(definitions: Definitions) -> None:
    for msgtype in TOPICS.values():
        assert msgtype.replace("/", "/msg/") in definitions.store.types, msgtype
