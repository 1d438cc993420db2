"""Benchmarks of the environments for learning against the flight model that they fly, and of many against one."""

from __future__ import annotations

import statistics
import time
from typing import Any, Callable, Dict, List

import numpy as np
from registry import Context, Measure, benchmark

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.gym import FlyEnv, FlyVectorEnv

_STEPS = 30  # of one look at a clock
_WORKERS, _ENVS = 2, 8  # of the many, all together
_LONG = 1e9  # [s] of an episode: none ends meanwhile
_PICTURE = (84, 84)


def _model(frames: int) -> Callable[[], Any]:
    model = create_model("fixed_wing", seed=1)
    controls = model.reset(InitialState(airspeed_mps=70.0))
    model.set_turbulence(1.0, seed=1)

    def fly() -> None:
        for _ in range(frames):
            model.step(1.0 / 60.0, controls)

    return fly


def _env(**arguments: Any) -> Callable[[], Any]:
    env = FlyEnv(duration=_LONG, episode={"speed": 70.0, "turbulence": 1.0}, **arguments)
    _, info = env.reset(seed=1)
    action = info["trim_action"]
    return lambda: env.step(action)


def _seconds(runs: Dict[str, Callable[[], Any]], clock: Callable[[], float], seconds: float) -> Dict[str, float]:
    """Median time of a call [s] of each, taken in turn, so that all see the same machine."""
    times: Dict[str, List[float]] = {name: [] for name in runs}
    end = time.monotonic() + seconds
    while time.monotonic() < end or min(map(len, times.values())) < 3:
        for name, run in runs.items():
            began = clock()
            for _ in range(_STEPS):
                run()
            times[name].append((clock() - began) / _STEPS)
    return {name: statistics.median(values) for name, values in times.items()}


@benchmark
def gym(context: Context) -> List[Measure]:
    """A step of an environment against the model's, and two processes of environments against one environment."""
    runs = {
        "model": _model(2),
        "env": _env(),
        "frame of the model": _model(1),
        "frame of an env": _env(frames=1),
        "picture": _env(frames=1, image=_PICTURE),
    }
    cpu = _seconds(runs, time.process_time, context.seconds / 2)
    many = FlyVectorEnv(_ENVS, workers=_WORKERS, duration=_LONG, episode={"speed": 70.0, "turbulence": 1.0})
    _, info = many.reset(seed=1)
    actions = np.asarray(info["trim_action"])
    wall = _seconds({"one": _env(), "many": lambda: many.step(actions)}, time.perf_counter, context.seconds / 2)
    many.close()
    pictures = 1.0 / (cpu["picture"] - cpu["frame of an env"])
    return [
        Measure("env's step of 2 frames / the model's", cpu["env"] / cpu["model"], "times", budget=1.3),
        Measure("env's step of 1 frame / the model's", cpu["frame of an env"] / cpu["frame of the model"], "times"),
        Measure("env's steps of 2 frames", 1.0 / cpu["env"], "1/s of CPU"),
        Measure(
            f"{_ENVS} envs in {_WORKERS} processes / one env",
            _ENVS * wall["one"] / wall["many"],
            "times",
            budget=1.6,
            at_least=True,
        ),
        Measure(f"pictures of {_PICTURE[0]}x{_PICTURE[1]}", pictures, "1/s of CPU", budget=250.0, at_least=True),
    ]
