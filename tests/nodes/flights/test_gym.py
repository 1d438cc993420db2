"""An environment flies over the nodes what it flies in process."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Tuple

import numpy as np
import pytest

from support.deadlines import PROGRAM_S
from support.room_table import ROOT
from xplane_bridge.emulator.flight.flight_model import ModelState
from xplane_bridge.gym import FlyEnv
from xplane_bridge.gym.spaces import FIELDS


def flown(**arguments: Any) -> Tuple[np.ndarray, Tuple[str, ...], ModelState]:
    env = FlyEnv(fields=tuple(FIELDS), **arguments)
    rows = [env.reset(seed=11)[0]]
    actions = np.random.default_rng(3).uniform(-0.4, 0.4, (60, *env.action_space.shape)).astype(np.float32)
    rows += [env.step(action)[0] for action in actions]
    names, truth = env.field_names, env.truth
    env.close()
    return np.array(rows), names, truth


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    "arguments",
    [
        {"aircraft": "fixed_wing", "episode": {"roll": 20.0, "payload": 120.0}},
        {"aircraft": "multirotor", "episode": {"altitude": 100.0}},
        {"aircraft": "multirotor", "axes": ("motors",)},
        {"aircraft": "tiltrotor", "frames": 1, "frame_rate": 50.0},
    ],
)
def test_an_episode_over_the_nodes_is_the_one_in_process(arguments: dict) -> None:
    weather = {"wind_speed": 6.0, "wind_from": 200.0, "turbulence": 1.5}
    arguments["episode"] = {**arguments.get("episode", {}), **weather}
    alone, names, truth = flown(**arguments)
    bridged, _, bridged_truth = flown(**arguments, bridge="ros")
    assert bridged_truth == truth
    for i, name in enumerate(names):
        assert np.array_equal(bridged[:, i], alone[:, i]), name


#: Flies in two processes, each with a ROS master of its own; on a busy machine their nodes take long to end.
TWO_PROCESSES = """
from xplane_bridge.gym import FlyVectorEnv, vector
vector._PATIENCE_S = 60.0
envs = FlyVectorEnv(2, workers=2, bridge="ros")
envs.reset(seed=1)
envs.close()
"""


def test_flights_of_several_processes_over_the_nodes_leave_no_folders(tmp_path: Path) -> None:
    env = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", TWO_PROCESSES], env=env, timeout=PROGRAM_S, check=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_what_the_worked_example_has_trained_flies_over_the_bridge_as_in_process(tmp_path: Path) -> None:
    policy = str(tmp_path / "policy.npy")

    def run(*arguments: str) -> str:
        command = [sys.executable, str(ROOT / "docs/examples/wings_level/wings_level"), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("train", policy, "--generations", "1", "--workers", str(os.cpu_count() or 1))
    alone, bridged = run("fly", policy).splitlines(), run("fly", policy, "--bridge", "ros").splitlines()
    assert len(alone) == 10
    assert bridged == alone[:1]
    trained, free = map(float, re.findall(r"([\d.]+) deg", bridged[0]))
    assert trained != free
