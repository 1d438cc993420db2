"""The worked example learns, in seconds, and the same for the same seed."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import warnings
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from support.room_table import ROOT
from xplane_bridge.gym import FlyEnv, WingsLevel

PROGRAM = ROOT / "docs/examples/wings_level/wings_level"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    loader = importlib.machinery.SourceFileLoader("wings_level", str(PROGRAM))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("wings_level", loader))
    loader.exec_module(module)
    return module


def test_a_linear_policy_learns_to_level_the_wings(example: ModuleType, capsys: pytest.CaptureFixture) -> None:
    weights = example.train(generations=6, seed=1, workers=2)
    assert "generation   6" in capsys.readouterr().out
    env = FlyEnv(task=WingsLevel, duration=10.0)
    seeds = range(example.TESTS_FROM, example.TESTS_FROM + 5)
    trained = [example.bank(env, weights, seed) for seed in seeds]
    free = [example.bank(env, 0.0 * weights, seed) for seed in seeds]
    assert max(trained) < 2.0  # [deg] rms
    assert np.median(free) > 10.0


def test_what_is_learned_follows_from_the_seed_alone(example: ModuleType) -> None:
    first = example.train(generations=2, seed=3, workers=1, say=False)
    assert np.array_equal(example.train(generations=2, seed=3, workers=3, say=False), first)
    assert not np.array_equal(example.train(generations=2, seed=4, workers=2, say=False), first)


@pytest.mark.nightly
def test_stable_baselines_checker_is_content_and_ppo_learns() -> None:
    pytest.importorskip("stable_baselines3", reason="pip install -r requirements-full.txt to have it checked")
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_checker import check_env

    for aircraft in ("fixed_wing", "multirotor", "tiltrotor"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_env(FlyEnv(aircraft), warn=True)
    torch.set_num_threads(1)  # for networks this small, more only wait for each other
    env = FlyEnv(task=WingsLevel, duration=5.0)
    learner = PPO("MlpPolicy", scaled(env), n_steps=600, batch_size=100, seed=1, device="cpu")
    learner.learn(20_000)

    def earned(policy: Any) -> float:
        total = 0.0
        for seed in range(5):
            observed, _ = env.reset(seed=1000 + seed)
            ended = False
            while not ended:
                observed, reward, terminated, truncated, _ = env.step(policy(observed))
                total += reward
                ended = terminated or truncated
        return total / (5 * 150)

    trained = earned(lambda observed: learner.predict(observed / SCALE, deterministic=True)[0])
    assert trained > 0.9
    assert earned(lambda _: np.zeros(1, np.float32)) < 0.8


SCALE = np.array([30.0, 1.0, 1.0, 0.1], np.float32)


def scaled(env: FlyEnv) -> Any:
    """Observations of about 1, as a network wants them."""
    import gymnasium

    low, high = env.observation_space.low / SCALE, env.observation_space.high / SCALE
    return gymnasium.wrappers.TransformObservation(
        env, lambda observed: observed / SCALE, gymnasium.spaces.Box(low, high, dtype=np.float32)
    )
