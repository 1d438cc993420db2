"""Other aircraft of scenarios: what is read of them, and where they fly."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from xplane_bridge.emulator.scenario_pilot import ScenarioPilot
from xplane_bridge.scenario import ScenarioError, load_scenario, parse_scenario
from xplane_bridge.scenario.traffic import ScenarioTraffic
from xplane_bridge.xplane_names import NEWEST

ROOT = Path(__file__).resolve().parents[3]
DEGREE_M = 6378145.0 * math.pi / 180.0
#: On the equator, heading east at 1000 m.
STATE = SimpleNamespace(latitude=0.0, longitude=10.0, altitude_msl=1000.0, heading_true_deg=90.0)


def read(value):
    scenario = parse_scenario({"name": "t", "events": [{"at": 0, "traffic": value}]})
    return dict(scenario.events[0].actions)["traffic"]


def test_an_aircraft_begins_relative_to_the_own_one_and_flies_straight_on():
    traffic = ScenarioTraffic()
    traffic.begin(
        read([{"number": 4, "ahead": 3000, "right": 1000, "above": 50, "turned": -90, "speed": 60, "climb": 2}]),
        STATE,
        20.0,
    )
    command = traffic.command(30.0)
    # Heading east, ahead is east and right is south; turned by 90 deg to the left it flies north: 600 m in 10 s.
    assert command["number"] == [4]
    assert command["latitude"][0] * DEGREE_M == pytest.approx(-1000.0 + 600.0, abs=0.1)
    assert (command["longitude"][0] - 10.0) * DEGREE_M == pytest.approx(3000.0, abs=0.1)
    assert command["altitude_msl"] == [pytest.approx(1000.0 + 50.0 + 20.0)]
    assert command["heading_true_deg"] == [pytest.approx(0.0)]
    velocity = [command[f"velocity_{axis}"][0] for axis in ("north", "east", "down")]
    assert velocity == pytest.approx([60.0, 0.0, -2.0], abs=1e-9)
    assert all(len(array) == 1 for array in command.values())


def test_it_is_sent_ten_times_a_second_and_its_end_once():
    traffic = ScenarioTraffic()
    assert not traffic.due(0.0)
    traffic.begin([{"number": 1.0}], STATE, 1.0)
    assert [now for now in range(100, 200) if traffic.due(now / 100.0)] == list(range(100, 200, 10))
    traffic.begin([], STATE, 2.0)
    assert [traffic.due(2.0), traffic.due(3.0)] == [True, False]
    assert traffic.command(2.0)["number"] == []


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ({"number": 1}, "expected a list of up to 19 aircraft"),
        ([{"ahead": 100}], r"traffic\[0\].number: None; expected a whole number"),
        ([{"number": 1}, {"number": 1}], r"traffic\[1\].number: 1.0; expected a whole number from 1 to 19, each once"),
        ([{"number": 20}], "a whole number from 1 to 19"),
        ([{"number": 1, "speed": 700}], "speed"),
        ([{"number": 1, "behind": 700}], "behind: unknown key"),
    ],
)
def test_what_is_wrong_is_said(value, said):
    with pytest.raises(ScenarioError, match=said):
        read(value)


def test_the_emulators_pilot_refuses_it():
    scenario = parse_scenario({"name": "t", "events": [{"at": 0, "traffic": []}]})
    with pytest.raises(ScenarioError, match="traffic/command"):
        ScenarioPilot(scenario, NEWEST["11"])


def test_the_conflict_scenario_would_be_a_collision():
    """Who holds heading and speed meets the intruder: at the same time at the same place."""
    scenario = load_scenario(ROOT / "config/scenarios/conflict.yaml")
    (intruder,) = next(
        value for event in scenario.events for kind, value in event.actions if kind == "traffic" and value
    )
    speed = scenario.start["speed"]
    assert intruder["turned"] == -90.0
    assert intruder["right"] / intruder["speed"] == pytest.approx(intruder["ahead"] / speed, rel=0.01)
    assert intruder.get("above", 0.0) == 0.0
