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

from support.room_table import ROOT
from xplane_bridge.emulator.flight.flight_model import ModelState
from xplane_bridge.gym import FlyEnv
from xplane_bridge.gym.spaces import FIELDS

#: Fields that rx_node works out, from numbers that are float32 or in other units on the wire, and how far off they may
#: be (docs/gym.md). All others are the same float32.
WORKED_OUT = {
    "latitude": 1e-5, "longitude": 1e-5, "altitude_msl": 1e-2, "angular_acceleration": 1e-5, "velocity_ned": 2e-5,
    "velocity_body": 5e-5, "ground_speed": 2e-5, "track_deg": 2e-6, "flight_path_angle_deg": 2e-5,
    "vertical_speed": 2e-5, "alpha_deg": 5e-5, "beta_deg": 5e-5, "calibrated_airspeed": 1e-3,
    "equivalent_airspeed": 1e-3, "dynamic_pressure": 1e-3, "wind_ned": 2e-6, "wind_speed": 2e-6, "wind_from_deg": 2e-6,
}  # fmt: skip


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
        field = name.split(" ")[-1].partition(".")[0]
        if field in WORKED_OUT:
            assert bridged[:, i] == pytest.approx(alone[:, i], rel=0.0, abs=WORKED_OUT[field]), name
        else:
            assert np.array_equal(bridged[:, i], alone[:, i]), name


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
