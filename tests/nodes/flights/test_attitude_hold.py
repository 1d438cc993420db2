"""The example controller flies the emulator's twin through the bridge."""

from __future__ import annotations

import json
import subprocess
import sys

from support.flights.disturbed import Flown, until_undisturbed
from xplane_bridge.bags import Bags
from xplane_bridge.constants import FlightMode
from xplane_bridge.resources import program

SCENARIO = """
name: controller
aircraft: fixed_wing
start: {altitude: 1000, speed: 70, heading: 10}
criteria:
  turns:  {measure: settling, of: heading, target: 40, band: 3, from: engaged, below: 20}
  height: {measure: peak, of: altitude, target: 1000, from: engaged, below: 20}
  speed:  {measure: peak, of: speed, target: 70, from: engaged, below: 5}
  rolls:  {measure: maximum, of: roll, from: engaged, above: 10, below: 35}
events:
  - {at: 0, mode: manual, stick: {roll: 0, pitch: 0, yaw: 0}}
  - {at: 1, mode: auto, label: engaged}
  - {at: 26, end: true}
"""


def test_it_turns_and_holds_altitude_and_speed(tmp_path):
    scenario = tmp_path / "controller.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    hold = f"{sys.executable} {program('attitude_hold')} --heading 40 --altitude 1000 --speed 70"
    controller = f"sh -c 'sleep 5; exec {hold}'"  # as late as on a busy machine: the scenario waits for it
    command = [sys.executable, str(program("run_scenario")), str(scenario), "--controller", controller]

    def fly(number: int) -> Flown:
        out = tmp_path / str(number)
        words = [*command, "--output", str(out)]
        return Flown.into(out, subprocess.run(words, capture_output=True, text=True, timeout=180, check=False))

    folder = until_undisturbed(fly).folder
    scores = json.loads((folder / "scores.json").read_text(encoding="utf-8"))["criteria"]
    assert len(scores) == 4
    with Bags(folder / "flight.bag") as bags:
        commands, modes = bags.read("/xplane/control/auto"), bags.read("/xplane/control/mode")
    engaged = modes.stamp[modes["mode"] == FlightMode.AUTO][0]
    assert commands.stamp[0] < engaged, "it was asked to fly before it could"
