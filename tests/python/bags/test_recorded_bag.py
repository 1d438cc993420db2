"""A bag of every topic of version 0.1.0 stays readable, and its messages are still the beginning of today's."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from xplane_bridge.bags import Bags
from xplane_bridge.cli import bag_export, flight_report
from xplane_bridge.topics import NAMESPACE, TOPICS

ROOT = Path(__file__).resolve().parents[3]
BAG = ROOT / "tests/data/bags/every_topic_0.1.0.bag"

#: Topics that came after 0.1.0.
LATER = {
    "mission/navigation",
    "mission/instruments",
    "mission/environment",
    "experiment",
    "traffic/state",
    "traffic/command",
    "disturbance/state",
}
OLD_TOPICS = {name: msgtype for name, msgtype in TOPICS.items() if name not in LATER}

# As ROS's own rosbag counts and reads them.
COUNTS = {
    "flight_state": 45,
    "mission/fuel": 1,
    "camera/frame_state": 45,
    "control/surfaces": 15,
    "events": 1,
    "joy": 20,
}
FIRST_STATE = {"roll_deg": -0.10362374782562256, "altitude_msl": 695.9550930513069, "sim_time": 41.692100524902344}


def old_definitions():
    """Definition text of each message of the package in the bag, by name."""
    with Bags(BAG) as bags:
        connections = [c for file in bags._files for c in file.connections.values()]
    texts = {}
    for connection in connections:
        parts = re.split(r"^=+\nMSG: (.*)\n", connection.definition, flags=re.MULTILINE)
        found = [(connection.msgtype, parts[0]), *zip(parts[1::2], parts[2::2])]
        texts.update({name: body for name, body in found if name.startswith("xplane_bridge/")})
    return texts


def lines_of(text):
    """(type, name) of each field, and constants with their values, without comments."""
    fields, constants = [], {}
    for line in text.splitlines():
        code = line.split("#")[0].split()
        if not code:
            continue
        if "=" in line.split("#")[0]:
            name, value = " ".join(code[1:]).split("=")
            constants[name.strip()] = (code[0], value.strip())
        else:
            fields.append((re.sub(r"^(std_msgs/|xplane_bridge/)", "", code[0]), code[1]))
    return fields, constants


def test_it_holds_every_topic_with_its_type():
    with Bags(BAG) as bags:
        there = {name: info.msgtype for name, info in bags.topics.items() if info.count}
    assert {f"{NAMESPACE}/{name}": msgtype for name, msgtype in OLD_TOPICS.items()}.items() <= there.items()


@pytest.mark.parametrize("topic", sorted(OLD_TOPICS))
def test_every_topic_decodes_with_the_definition_in_the_bag(topic):
    with Bags(BAG) as bags:
        info = bags.topics[f"{NAMESPACE}/{topic}"]
        table = bags.read(f"{NAMESPACE}/{topic}")
    assert len(table) == info.count == COUNTS.get(topic, info.count)
    assert table.columns


def test_values_are_those_that_were_recorded():
    with Bags(BAG) as bags:
        states = bags.read(f"{NAMESPACE}/flight_state")
        paired = bags.read(f"{NAMESPACE}/camera/frame_state", ["state.sim_time", "header.stamp"])
        images = bags.read(f"{NAMESPACE}/camera/camera_info", ["header.stamp"])
    assert {name: states[name][0] for name in FIRST_STATE} == FIRST_STATE
    assert np.array_equal(paired["header.stamp"], images["header.stamp"])
    assert set(paired["state.sim_time"][2:-2]) <= set(states["sim_time"])


def test_no_field_has_changed_its_name_type_or_place():
    old = old_definitions()
    assert len(old) >= 20
    for name, text in old.items():
        today = (ROOT / "msg" / f"{name.split('/')[1]}.msg").read_text(encoding="utf-8")
        fields, constants = lines_of(text)
        fields_now, constants_now = lines_of(today)
        assert fields_now[: len(fields)] == fields, name
        kept = {name: value for name, value in constants.items() if not name.endswith("_ALL")}  # grows with the bits
        assert kept.items() <= constants_now.items(), name


def test_fields_that_came_later_are_there_without_a_value():
    with Bags(BAG) as bags:
        sim, fuel = (
            bags.read(f"{NAMESPACE}/mission/sim"),
            bags.read(f"{NAMESPACE}/mission/fuel", ["fuel_total", "tank_pump_on"]),
        )
        units = bags.units(f"{NAMESPACE}/mission/electrical")
        constants = bags.constants(f"{NAMESPACE}/mission/fuel")
    assert sim["frames_missed"].dtype == np.uint32
    assert not sim["frames_missed"].any()
    assert fuel["fuel_total"][0] == pytest.approx(199.627, abs=1e-3)
    assert list(fuel.columns) == ["fuel_total", "tank_pump_on"]
    assert fuel["tank_pump_on"].shape == (1, 9)
    assert np.isnan(fuel["tank_pump_on"]).all()
    assert units["oxygen_pressure"].symbol == "Pa"
    assert "VALID_SELECTORS" not in constants  # what the recording says of its bits


def test_the_report_and_the_tables_read_it(tmp_path):
    assert flight_report.main([str(BAG), "-o", str(tmp_path / "report.html")]) == 0
    assert "aileron1_wing2_left" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert bag_export.main([str(BAG), "--format", "csv", "-o", str(tmp_path / "tables")]) == 0
    header, first = (tmp_path / "tables/every_topic_0.1.0.csv").read_text(encoding="utf-8").splitlines()[:2]
    row = dict(zip(header.split(","), first.split(",")))
    assert float(row["altitude_msl_m"]) == pytest.approx(FIRST_STATE["altitude_msl"], abs=1e-6)
