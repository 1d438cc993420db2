from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import Any, Iterator

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.gym import FlyEnv, FlyVectorEnv, Task, WingsLevel
from xplane_bridge.gym.errors import GymError
from xplane_bridge.gym.vector import WorkerError

GUSTY = {"task": WingsLevel, "episode": {"wind_speed": {"uniform": [0, 8]}, "turbulence": 2.0}, "duration": 0.5}


class Fragile(Task):
    """Fails in the worker."""

    def reward(self, state: Any, command: Any) -> float:
        return command["roll"] / (0.0 if state.sim_time_unwrapped > 0.1 else 1.0)


def actions_of(steps: int, count: int) -> np.ndarray:
    return np.random.default_rng(2).uniform(-1, 1, (steps, count, 1)).astype(np.float32)


def fly_on(envs: FlyVectorEnv) -> None:
    for _ in range(100):
        envs.step(np.zeros(envs.action_space.shape, np.float32))


@pytest.fixture(params=[1, 2, 3])
def vector(request: pytest.FixtureRequest) -> Iterator[FlyVectorEnv]:
    envs = FlyVectorEnv(5, workers=request.param, **GUSTY)
    yield envs
    envs.close()


def test_each_flies_as_it_does_alone_also_into_the_next_episode(vector: FlyVectorEnv) -> None:
    steps = 20  # an episode has 15
    actions = actions_of(steps, 5)
    observed, infos = vector.reset(seed=40)
    seen = [observed]
    rewards, truncations, outcomes = [], [], []
    for action in actions:
        observed, reward, terminated, truncated, infos = vector.step(action)
        assert not terminated.any()
        seen.append(observed)
        rewards.append(reward)
        truncations.append(truncated)
        outcomes.append(infos.get("outcome"))
    assert [t.any() for t in truncations].index(True) == 14
    assert list(outcomes[14]) == ["time is up"] * 5
    assert outcomes[13] is None
    for index in range(5):
        env = FlyEnv(**GUSTY)
        alone, _ = env.reset(seed=40 + index)
        assert np.array_equal(seen[0][index], alone)
        for step in range(steps):
            if step == 15:  # the action of the step after the last is not flown
                alone, _ = env.reset()
                reward = 0.0
            else:
                alone, reward, *_ = env.step(actions[step, index])
            assert np.array_equal(seen[step + 1][index], alone), (index, step)
            assert rewards[step][index] == reward


def test_what_was_returned_is_not_changed_by_the_next_step(vector: FlyVectorEnv) -> None:
    first, _ = vector.reset(seed=1)
    kept = first.copy()
    observed, reward, *_ = vector.step(np.ones((5, 1), np.float32))
    assert np.array_equal(first, kept)
    assert not np.array_equal(observed, kept)
    kept_reward = reward.copy()
    vector.step(-np.ones((5, 1), np.float32))
    assert np.array_equal(reward, kept_reward)


def test_infos_are_those_of_gymnasiums_vectors(vector: FlyVectorEnv) -> None:
    _, infos = vector.reset(seed=1, options={"payload": 100.0})
    assert infos["conditions"]["payload"].tolist() == [100.0] * 5
    assert infos["_conditions"].all()
    assert infos["sim_time"] == pytest.approx([1 / 60] * 5)  # the first state is that of the first frame
    *_, infos = vector.step(np.zeros((5, 1), np.float32))
    assert "conditions" not in infos
    assert infos["sim_time"] == pytest.approx([3 / 60] * 5)


def test_make_vec_gives_it_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = gymnasium.make_vec("xplane_bridge/Multirotor-v0", num_envs=3, workers=2, image=(32, 24))
        observed, _ = envs.reset(seed=1)
        assert isinstance(envs, FlyVectorEnv)
        assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
        assert observed in envs.observation_space
        assert envs.step(envs.action_space.sample())[0]["image"].shape == (3, 24, 32, 3)
        envs.close()
        envs.close()
    with pytest.raises(GymError, match="closed"):
        envs.step(envs.action_space.sample())


def test_a_recording_wrapper_of_gymnasium_goes_round_it() -> None:
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(FlyVectorEnv(2, workers=1, **GUSTY))
    envs.reset(seed=1)
    for _ in range(15):
        *_, infos = envs.step(np.zeros((2, 1), np.float32))
    assert infos["episode"]["l"].tolist() == [15, 15]
    envs.close()


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_in_a_worker_is_raised_here(workers: int) -> None:
    envs = FlyVectorEnv(2, workers=workers, task=Fragile, axes=("roll",))
    envs.reset(seed=1)
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        fly_on(envs)
    assert envs.closed


def interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("during", ["vector._Worker.step", "vector._Inbox.receive"])
def test_no_answer_of_an_interrupted_call_is_taken_for_that_of_the_next(
    during: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    envs = FlyVectorEnv(2, workers=2, **GUSTY)
    envs.reset(seed=1)
    with monkeypatch.context() as patched:  # in this process; the worker runs already
        patched.setattr(f"xplane_bridge.gym.{during}", interrupt)
        with pytest.raises(KeyboardInterrupt):
            envs.step(np.zeros((2, 1), np.float32))
    assert not any(process.is_alive() for process in envs._processes)
    with pytest.raises(GymError, match="the environments are closed; make new ones"):
        envs.reset(seed=5)


def test_environments_whose_closing_was_interrupted_are_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    envs = FlyVectorEnv(3, workers=3, **GUSTY)
    closed = []
    monkeypatch.setattr(envs._own, "close", lambda: closed.append(True))
    with monkeypatch.context() as patched:
        patched.setattr(envs._processes[0], "join", lambda timeout=None: interrupt() if timeout else None)
        with pytest.raises(KeyboardInterrupt):
            envs.close()
    assert closed == [True]
    for process in envs._processes:
        process.join()
        assert not process.is_alive()
    with pytest.raises(GymError, match="closed"):
        envs.reset(seed=5)


@pytest.mark.parametrize("workers", [1, 2])
def test_pictures_are_those_of_each_alone(workers: int) -> None:
    envs = FlyVectorEnv(3, workers=workers, render_mode="rgb_array", **GUSTY)
    assert envs.render_mode == "rgb_array"
    with pytest.raises(GymError, match="render: no episodes are being flown; call reset first"):
        envs.render()
    envs.reset(seed=7)
    envs.step(np.ones((3, 1), np.float32))
    pictures = envs.render()
    assert len(pictures) == 3
    for index, picture in enumerate(pictures):
        alone = FlyEnv(render_mode="rgb_array", **GUSTY)
        alone.reset(seed=7 + index)
        alone.step(np.ones(1, np.float32))
        assert np.array_equal(picture, alone.render())
    *_, infos = envs.step(np.ones((3, 1), np.float32))
    assert infos["sim_time"] == pytest.approx([5 / 60] * 3)
    envs.close()


def test_there_are_no_pictures_where_none_were_asked_for(vector: FlyVectorEnv) -> None:
    vector.reset(seed=1)
    assert vector.render() is None


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"speed": 200}, FlightModelError, "airspeed 200"),
        ({"speeds": 70}, GymError, "episode.speeds: unknown key"),
        ({"speed": {"uniform": [9, 5]}}, CampaignError, "episode.speed.uniform"),
        ({"failures": [{"name": "engine_9"}]}, GymError, "engine_9"),
    ],
)
def test_wrong_options_are_refused_and_the_next_are_flown(workers: int, options: Any, error: Any, text: str) -> None:
    envs = FlyVectorEnv(3, workers=workers, **GUSTY)
    envs.reset(seed=1)
    with pytest.raises(error, match=text):
        envs.reset(options=options)
    with pytest.raises(GymError, match="no episodes are being flown; call reset first"):
        envs.step(np.zeros((3, 1), np.float32))
    observed, _ = envs.reset(seed=1)
    assert np.array_equal(observed[0], FlyEnv(**GUSTY).reset(seed=1)[0])
    envs.step(np.zeros((3, 1), np.float32))
    envs.close()


@pytest.mark.parametrize("wrong", [1.5, math.nan])
def test_an_action_out_of_range_is_refused_before_any_is_flown(vector: FlyVectorEnv, wrong: float) -> None:
    vector.reset(seed=1)
    actions = np.zeros((5, 1), np.float32)
    actions[3] = wrong
    with pytest.raises(GymError, match=rf"environment 3: action roll is {wrong}: expected -1\.\.1"):
        vector.step(actions)
    *_, infos = vector.step(np.zeros((5, 1), np.float32))
    assert infos["sim_time"] == pytest.approx([3 / 60] * 5)


def test_an_action_that_is_not_flown_may_be_anything(vector: FlyVectorEnv) -> None:
    vector.reset(seed=1)
    for _ in range(15):
        vector.step(np.zeros((5, 1), np.float32))
    *_, infos = vector.step(np.full((5, 1), math.nan, np.float32))
    assert "conditions" in infos


@pytest.mark.parametrize("workers", [1, 2])
def test_a_drawn_start_that_cannot_be_flown_is_drawn_again(workers: int) -> None:
    """Of two speeds one is far beyond what the aircraft can fly."""
    episode = {"speed": {"choice": [70, 200]}}
    envs = FlyVectorEnv(4, workers=workers, task=WingsLevel, episode=episode, duration=1 / 30)
    envs.reset(seed=3)
    alone = FlyEnv(task=WingsLevel, episode=episode, duration=1 / 30)
    alone.reset(seed=3)
    for _ in range(10):
        envs.step(np.zeros((4, 1), np.float32))
        observed, *_ = envs.step(np.zeros((4, 1), np.float32))
        assert np.array_equal(observed[0], alone.reset()[0])
    envs.close()


def test_a_killed_worker_is_named() -> None:
    vector = FlyVectorEnv(5, workers=3, **GUSTY)
    vector.reset(seed=1)
    os.kill(vector._processes[-1].pid, signal.SIGKILL)
    with pytest.raises(WorkerError, match=r"worker (\d) of \d: it has ended by itself, with exit code -9"):
        fly_on(vector)
    assert not any(process.is_alive() for process in vector._processes)


_ORPHANS = """
import time
from xplane_bridge.gym import FlyVectorEnv
envs = FlyVectorEnv(3, workers=3)
envs.reset(seed=1)
print(*(process.pid for process in envs._processes), flush=True)
time.sleep(1000)
"""


def test_workers_end_when_their_parent_is_killed() -> None:
    parent = subprocess.Popen([sys.executable, "-c", _ORPHANS], stdout=subprocess.PIPE, text=True)
    workers = [Path(f"/proc/{pid}") for pid in parent.stdout.readline().split()]
    assert len(workers) == 2
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 60.0
    while any(runs(worker) for worker in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(runs(worker) for worker in workers)


def runs(process: Path) -> bool:
    """Whether it is there, and not only as one that was not waited for."""
    try:
        return (process / "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"num_envs": 0}, "num_envs: 0"),
        ({"num_envs": 2, "workers": 0}, "workers: 0"),
        ({"num_envs": 2, "fields": ("x",)}, "fields: ['x']"),
    ],
)
def test_wrong_arguments_are_reported_before_a_process_starts(arguments: dict, text: str) -> None:
    with pytest.raises(GymError) as raised:
        FlyVectorEnv(**arguments)
    assert text in str(raised.value)


def test_wrong_actions_and_seeds_are_reported() -> None:
    envs = FlyVectorEnv(2, workers=1, **GUSTY)
    with pytest.raises(GymError, match="seed: 3 of them; expected one number, or 2"):
        envs.reset(seed=[1, 2, 3])
    for wrong in (-1, [1, -2], [1.5, 2], ["a", None]):
        with pytest.raises(GymError, match=r"seed: .*; expected whole numbers from 0, or None"):
            envs.reset(seed=wrong)
    assert np.array_equal(envs.reset(seed=np.array([3, 4]))[0], envs.reset(seed=3)[0])
    assert np.array_equal(envs.reset(seed=[np.int64(3), None])[0][0], envs.reset(seed=np.int32(3))[0][0])
    envs.reset(seed=[5, None])
    with pytest.raises(GymError, match=r"actions of shape \(2,\); expected \(2, 1\)"):
        envs.step(np.zeros(2, np.float32))
    envs.close()


@pytest.mark.parametrize("context", ["spawn", "forkserver"])
def test_processes_may_be_started_in_any_way(context: str) -> None:
    envs = FlyVectorEnv(2, workers=2, context=context, **GUSTY)
    observed, _ = envs.reset(seed=3)
    envs.close()
    assert np.array_equal(observed[0], FlyEnv(**GUSTY).reset(seed=3)[0])  # of the process
    assert np.array_equal(observed[1], FlyEnv(**GUSTY).reset(seed=4)[0])
