"""Shipped flights through the bridge: emulator, nodes, player and fly_controller; in real time and in lock-step."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from support.flights.disturbed import Flown, until_undisturbed
from xplane_bridge.bags import Bags
from xplane_bridge.resources import program

#: A third of the frames: the controllers meet the same limits as with 60 a second in process (docs/control/flights.md).
IN_LOCK_STEP = ("--lockstep", "--emulator=--fps 20")


def flown(name: str, folder: Path, *options: str) -> Flown:
    """Flies a scenario, which may miss its criteria."""
    command = [sys.executable, str(program("run_scenario")), name, "--output", str(folder), *options]
    return Flown.into(folder, subprocess.run(command, capture_output=True, text=True, timeout=550, check=False))


def fly(name: str, folder: Path, *options: str) -> dict:
    """Flies a scenario; gives its report. Every criterion is met."""
    return report_of(flown(name, folder, *options))


def report_of(flight: Flown) -> dict:
    """The report of a flight, which has met every criterion."""
    assert flight.code == 0, flight.said + flight.errors
    folder = flight.folder
    assert f"scripts/flight_report {folder / 'flight.bag'} -o {folder / 'report.html'}" in flight.said.splitlines()[-1]
    report = json.loads((folder / "scores.json").read_text(encoding="utf-8"))
    assert report["played"]["finished"]
    assert report["criteria"]
    return report


def test_the_quadrotor_flies_its_square_through_the_bridge_in_real_time(tmp_path):
    flight = until_undisturbed(lambda number: flown("quadrotor_square", tmp_path / str(number)))
    labels = report_of(flight)["played"]["labels"]
    assert labels["touchdown"] > labels["hover"] + 20.0


def test_a_function_in_the_folder_one_is_in_flies_a_scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = "def level(state):\n    return {'roll': 0.03 * (10.0 - state.roll_deg), 'pitch': 0.0, 'throttle': 0.6}\n"
    (tmp_path / "my_controller.py").write_text(law, encoding="utf-8")
    flown = {
        "name": "banks",
        "aircraft": "fixed_wing",
        "controller": "my_controller:level",
        "start": {"altitude": 1000, "speed": 70},
        "criteria": {"banks": {"measure": "maximum", "of": "roll", "above": 3}},
        "events": [{"at": 0, "mode": "auto"}, {"at": 3, "end": True}],
    }
    (tmp_path / "banks.yaml").write_text(json.dumps(flown), encoding="utf-8")  # which is YAML
    fly("banks.yaml", tmp_path / "out", *IN_LOCK_STEP)


#: In process (tests/python/controllers) all of them fly by default, and see the same numbers as through the nodes
#: (test_campaign_through_nodes.py).
@pytest.mark.parametrize(
    "name",
    [
        "engine_out_after_takeoff",
        *(pytest.param(name, marks=pytest.mark.nightly) for name in ("tiltrotor_conversion", "twin_circuit")),
    ],
)
@pytest.mark.full
def test_flights_meet_their_criteria_in_lock_step(tmp_path, name):
    fly(name, tmp_path / "out", *IN_LOCK_STEP)


def test_a_blocked_pitot_misleads_the_pilots_indicator_and_not_the_controller(tmp_path):
    fly("blocked_pitot", tmp_path / "out", *IN_LOCK_STEP)
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        shown, true = bags.read("/xplane/mission/instruments"), bags.read("/xplane/flight_state")
    time = shown["sim_time"] - true["sim_time"][0]
    speeds = np.interp(shown["sim_time"], true["sim_time"], true["calibrated_airspeed"])
    pilot, copilot = (np.abs(shown["airspeed"][:, seat] - speeds) for seat in (0, 1))
    assert pilot[time < 14.0].max() < 1.0
    assert pilot[(time > 60.0) & (time < 200.0)].max() > 8.0  # the total pressure of another height
    assert copilot.max() < 1.0  # a tube of its own


def test_a_bus_that_fails_is_seen_and_flown_without(tmp_path):
    fly("bus_failure", tmp_path / "out", *IN_LOCK_STEP)
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        electrical, began = bags.read("/xplane/mission/electrical"), bags.read("/xplane/flight_state")["sim_time"][0]
    time, volts = electrical["sim_time"] - began, electrical["bus_voltage"]
    assert volts[time < 9.0, 0].min() > 20.0
    assert volts[(time > 12.0) & (time < 55.0), 0].max() < 0.1
    assert volts[:, 1].min() > 20.0
