"""run_scenario as a control researcher's CI calls it: exit codes, the recording, the scores."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys

import pytest

from support.flights.disturbed import Flown, until_undisturbed
from xplane_bridge.bags import Bags
from xplane_bridge.bags.passport import read_passports
from xplane_bridge.resources import config_file, program

MET = """
name: short
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
criteria:
  turns:   {measure: maximum, of: roll, from: turn, to: back, above: 15}
  levels:  {measure: settling, of: roll, target: 0, band: 5, from: back, below: 5}
  begins:  {measure: maximum, of: altitude, to: turn, below: 830}
events:
  - {at: 0, mode: manual, hold: {roll: 0, climb: 0, speed: 65}}
  - {at: 2, hold: {roll: 25}, label: turn}
  - {at: 5, excitation: {kind: doublet, target: pitch, amplitude: 0.05, duration: 1}}
  - {at: 6, failure: {name: pitot_1}, hold: {roll: 0}, label: back}
  - {at: 8, clear_failures: true, mode: auto}
  - {at: 9, mode: manual}
  - {at: 12, end: true}
"""
MISSED = """
name: missed
criteria:
  climbs: {measure: maximum, of: altitude, above: 5000}
events: [{at: 0, hold: {roll: 0, climb: 0}}, {at: 2, end: true}]
"""
REFUSED = """
name: refused
aircraft: tiltrotor
events:
  - {at: 1, failure: {name: aileron1_wing2_left, kind: stuck, value: 5}}
  - {at: 3, end: true}
"""


def run(tmp_path, text, *options, out=None):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(text, encoding="utf-8")
    output = str(out or tmp_path / "out")
    command = [sys.executable, str(program("run_scenario")), str(scenario), "--output", output, *options]
    # In a process of its own: one process is one ROS node.
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize("options", [(), ("--joystick", "logitech_extreme_3d_pro")], ids=["commands", "joystick"])
def test_a_flight_that_meets_its_criteria(tmp_path, options):
    def fly(number):
        out = tmp_path / str(number)
        return Flown.into(out, run(tmp_path, MET, *options, out=out))

    flight = until_undisturbed(fly)
    assert "short: 3 of 3 criteria met" in flight.said
    report = json.loads((flight.folder / "scores.json").read_text(encoding="utf-8"))
    assert report["played"]["finished"]
    assert report["played"]["labels"]["turn"] == pytest.approx(2.0, abs=0.1)
    assert {c["name"]: c["passed"] for c in report["criteria"]} == {"turns": True, "levels": True, "begins": True}
    with Bags(flight.bags) as bags:
        passport = read_passports(bags)[-1]
        aircraft = config_file("aircraft", "fixed_wing.yaml").read_bytes()
        assert (passport.flight["scenario"], passport.flight["text"]) == ("short", MET)
        assert passport.flight["options"] == (["=".join(options)] if options else [])
        assert passport.others["sha256 of the aircraft file"] == hashlib.sha256(aircraft).hexdigest()
        failures = bags.read("/xplane/failures/state")["names"]
        assert any("pitot_1" in names for names in failures)
        assert len(failures[-1]) == 0
        kinds = bags.read("/xplane/excitation/state")
        assert "doublet" in list(kinds["kind"])
        assert list(kinds["result"])[-1] == "done"
        assert set(bags.read("/xplane/control/mode")["mode"]) >= {1, 2}


WEATHER = """
name: weather
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 0, hold: {roll: 0, climb: 0, speed: 65}}
  - {at: 1, time: {date_days: 20, zulu_time: 36000}, wind: {speed: 9, from_deg: 90}}
  - {at: 4, weather: {wind: [{altitude: 0, from_deg: 180, speed: 6}], sea_level_temperature: 35, visibility: 4000}}
  - {at: 9, end: true}
"""


def test_time_wind_and_weather_of_a_scenario_come(tmp_path):
    done = run(tmp_path, WEATHER)
    assert done.returncode == 0, done.stdout + done.stderr
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        states, world = bags.read("/xplane/flight_state"), bags.read("/xplane/mission/environment")
        reported = [event for _, message in bags.messages("/xplane/events") for event in message.events]
    by = {event.requested_by.rsplit("/", 1)[-1]: event.success for event in reported}
    assert [by[service] for service in ("set_time", "set_wind", "set_weather")] == [True] * 3
    assert max(states["wind_speed"]) == pytest.approx(9.0, abs=0.1)
    assert (states["wind_speed"][-1], states["wind_from_deg"][-1]) == pytest.approx((6.0, 180.0), abs=0.5)
    assert (world["date_days"][-1], world["sea_level_temperature"][-1]) == pytest.approx((20.0, 35.0), abs=1e-3)
    assert world["zulu_time"][-1] == pytest.approx(36000.0, abs=60.0)
    assert world["visibility"][-1] == pytest.approx(4000.0, abs=1.0)


ON_THE_RUNWAY = """
name: on_the_runway
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 2, reset: {start: runway, airport: XEMU, runway_end: 1}}
  - {when: {on_ground: true}, timeout: 60, label: stands}
  - {after: 1, end: true}
"""


def test_a_scenario_starts_at_an_airport(tmp_path):
    done = run(tmp_path, ON_THE_RUNWAY)
    assert done.returncode == 0, done.stdout + done.stderr
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        states = bags.read("/xplane/flight_state")
        reported = [event for _, message in bags.messages("/xplane/events") for event in message.events]
    assert "the flight begins at runway 0, end 1 of XEMU" in [event.text for event in reported if event.success]
    assert states["on_ground"][-1]
    assert states["heading_true_deg"][-1] == pytest.approx(270.0, abs=1.0)


#: tx_node waits for a place for 120 s, which pass faster in lock-step.
@pytest.mark.parametrize(
    "options",
    [pytest.param((), id="real time", marks=pytest.mark.nightly), pytest.param(("--lockstep",), id="lock-step")],
)
def test_a_flight_that_does_not_begin_anew_is_exit_code_1_and_said(tmp_path, options):
    text = ON_THE_RUNWAY.replace("XEMU", "NOPE").replace("timeout: 60", "timeout: 180")
    done = run(tmp_path, text, *options)
    assert done.returncode == 1
    assert "on_the_runway, at 2.0 s: reset: reset_flight: " in done.stderr
    played = json.loads((tmp_path / "out" / "played.json").read_text(encoding="utf-8"))
    assert not played["finished"]


GUST_IN_WIND = """
name: gust_in_wind
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 0, hold: {roll: 0, climb: 0, speed: 65}}
  - at: 1
    wind: {speed: 5, from_deg: 270}
    disturb: {kind: gust, from_deg: 270, speed: 8, duration: 3, horizontal_only: true}
  - {at: 9, end: true}
"""


@pytest.mark.parametrize("options", [(), ("--lockstep",)], ids=["real time", "lock-step"])
def test_a_disturbance_waits_for_the_wind_before_it(tmp_path, options):
    done = run(tmp_path, GUST_IN_WIND, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        states = bags.read("/xplane/flight_state")
    assert max(states["wind_speed"]) == pytest.approx(13.0, abs=0.5)
    assert states["wind_speed"][-1] == pytest.approx(5.0, abs=0.5)


WIND_AT_THE_END = """
name: wind_at_the_end
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 2, wind: {speed: 5, from_deg: 270}}
  - {at: 2, end: true}
"""


def test_in_lock_step_a_change_under_way_does_not_decide_on_the_last_frame(tmp_path):
    stamps = []
    for turn in ("a", "b"):
        done = run(tmp_path, WIND_AT_THE_END, "--lockstep", out=tmp_path / turn)
        assert done.returncode == 0, done.stdout + done.stderr
        with Bags(tmp_path / turn / "flight.bag") as bags:
            stamps.append(bags.read("/xplane/flight_state", ["header.stamp", "sim_time"]).stamp.tolist())
    assert len(stamps[0]) == 121, "frame 0, and two seconds"
    assert stamps[0] == stamps[1]


def test_a_missed_criterion_is_exit_code_1(tmp_path):
    done = run(tmp_path, MISSED)
    assert done.returncode == 1
    assert "MISSED  climbs" in done.stdout


def test_a_refused_request_is_exit_code_1_and_said(tmp_path):
    done = run(tmp_path, REFUSED)
    assert done.returncode == 1
    assert "not identified yet" in done.stderr


def test_what_cannot_be_flown_is_said(tmp_path):
    done = run(tmp_path, MISSED.replace("name: missed", "name: missed\nrepeat_every: 10"))
    assert done.returncode == 1
    assert "give --duration" in done.stderr
    done = run(
        tmp_path, MISSED.replace("name: missed", "name: missed\naircraft: fixed_wing"), "--aircraft", "multirotor"
    )
    assert done.returncode == 1
    assert "is for fixed_wing, not for multirotor" in done.stderr
