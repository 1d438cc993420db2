"""fly_controller with controllers of a user's own: engines one by one, and mistakes, in lock-step and in real time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import tx_params
from xplane_bridge.bags import Bags
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.resources import program

CONTROLLERS = """
def engines(state):
    return {"roll": -0.03 * state.roll_deg, "pitch": 0.0, "engine_throttles": [0.7, 0.6]}


class Mistaken:
    states = 0

    def fly(self, state):
        self.states += 1
        if self.states > 30:
            return {"roll": {}["gain"]}
        return {"roll": 0.0, "pitch": 0.0, "throttle": 0.6}
"""
MISTAKE = r"at (\d+\.\d\d) s of simulator time: KeyError: 'gain'; the traceback is in (\S+\.log)"


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_controller.py").write_text(CONTROLLERS, encoding="utf-8")


def flown_in_lockstep(folder: Path, name: str) -> subprocess.CompletedProcess[str]:
    scenario = {
        "name": "mine",
        "aircraft": "fixed_wing",
        "controller": f"my_controller:{name}",
        "start": {"altitude": 1000, "speed": 70},
        "criteria": {"level": {"measure": "maximum", "of": "roll", "below": 30}},
        "events": [{"at": 0, "mode": "auto"}, {"at": 3, "end": True}],
    }
    (folder / "mine.yaml").write_text(json.dumps(scenario), encoding="utf-8")  # which is YAML
    command = [sys.executable, str(program("run_scenario")), "mine.yaml", "--output", "out", "--lockstep"]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_engines_are_flown_one_by_one(tmp_path: Path) -> None:
    done = flown_in_lockstep(tmp_path, "engines")
    assert done.returncode == 0, done.stderr
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        commands = bags.read("/xplane/control/auto")
    assert len(commands.stamp) > 150
    assert set(commands["engine_count"]) == {2}
    assert commands["engine_throttles"][-1][:3] == pytest.approx([0.7, 0.6, 0.0])


def test_a_mistake_ends_a_flight_in_lock_step_and_is_said(tmp_path: Path) -> None:
    done = flown_in_lockstep(tmp_path, "Mistaken")
    assert done.returncode == 1
    assert "fly_controller: at " in done.stderr
    assert "KeyError: 'gain'" in done.stderr
    assert "was not answered" not in done.stderr


def test_a_mistake_ends_the_node_in_real_time_and_its_traceback_is_in_the_log(world, tmp_path: Path) -> None:
    world.emulator("--start", "air")
    world.start("rx_node")
    world.start("tx_node", tx_params())
    command = [str(program("fly_controller")), "my_controller:Mistaken", "--any-aircraft", "--engage"]
    command += ["--namespace", world.namespace]
    with ManagedProcess("fly_controller", command, tmp_path, env=world.env) as flying:
        found = flying.wait_for_line(f"^fly_controller: {MISTAKE}$", WAIT_S)
        assert flying.wait(WAIT_S) == 1
        said = flying.output()
    assert said.count("KeyError") == 1
    assert "Traceback" not in said
    log = Path(found.group(2)).read_text(encoding="utf-8")
    assert 'return {"roll": {}["gain"]}' in log
