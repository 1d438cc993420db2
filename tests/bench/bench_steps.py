"""Benchmarks of the emulator's flight and of campaigns against bare JSBSim, in CPU time of the same run."""

from __future__ import annotations

import statistics
import time
from typing import Any, Callable, Dict, List

from registry import Context, Measure, benchmark

from xplane_bridge import compiled
from xplane_bridge.campaign.definition import FlightPlan, load_campaign
from xplane_bridge.campaign.flight import Flight
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.resources import config_file

_FRAMES = 60  # of one look at a clock
_STEPS = 4  # of JSBSim in a frame at 60 fps


def _model(in_cpp: bool) -> Callable[[], Any]:
    """What flies one frame of the twin in turbulence."""
    core = compiled.core
    compiled.core = core if in_cpp else None
    try:
        model = create_model("fixed_wing", seed=1)
        controls = model.reset(InitialState(airspeed_mps=70.0))
    finally:
        compiled.core = core
    model.set_turbulence(1.0, seed=1)
    return lambda: model.step(1.0 / 60.0, controls)


def _simulator(everything: bool) -> Callable[[], Any]:
    sim = Simulator(create_model, "fixed_wing", initial=InitialState(airspeed_mps=70.0))
    sim.settings.set_weather(Weather(turbulence_mps=1.0))
    if everything:
        sim.store.watch_all()
    return lambda: sim.step(1.0 / 60.0)


def _bare() -> Callable[[], Any]:
    model = create_model("fixed_wing")
    model.reset(InitialState(airspeed_mps=70.0))
    run = model._fdm.run

    def frame() -> None:
        for _ in range(_STEPS):
            run()

    return frame


def _cpu_us(frames: Dict[str, Callable[[], Any]], seconds: float) -> Dict[str, float]:
    """Median CPU time of a frame [us] of each, taken in turn, so that all see the same machine."""
    times: Dict[str, List[float]] = {name: [] for name in frames}
    end = time.monotonic() + seconds
    while time.monotonic() < end or len(times["bare"]) < 3:
        for name, frame in frames.items():
            began = time.process_time()
            for _ in range(_FRAMES):
                frame()
            times[name].append((time.process_time() - began) / _FRAMES * 1e6)
    return {name: statistics.median(values) for name, values in times.items()}


def _flight_us(plan: FlightPlan) -> float:
    """CPU time of a campaign's flight for each of its frames [us]."""
    began = time.process_time()
    result = Flight(plan).fly()
    return (time.process_time() - began) / (result.duration * plan.frame_rate) * 1e6


@benchmark
def steps(context: Context) -> List[Measure]:
    """A frame of the twin at 60 fps in turbulence, and of a campaign's flight, against JSBSim's steps alone."""
    frames = {
        "bare": _bare(),
        "model": _model(in_cpp=True),
        "python": _model(in_cpp=False),
        "simulator": _simulator(everything=False),
        "everything": _simulator(everything=True),
    }
    us = _cpu_us(frames, context.seconds)
    campaign = load_campaign(config_file("campaigns", "stuck_aileron.yaml"))
    plan = campaign.plan(0)
    Flight(plan).fly()  # reads files and imports, which a campaign does once
    flight_us = statistics.median(_flight_us(plan) for _ in range(3))
    return [
        Measure("JSBSim alone, a frame", us["bare"], "us"),
        Measure("JSBSim alone / the twin in C++", us["bare"] / us["model"], "times", budget=0.5, at_least=True),
        Measure("JSBSim alone / the twin in Python", us["bare"] / us["python"], "times"),
        Measure("JSBSim alone / a campaign's flight", us["bare"] / flight_us, "times", budget=0.3, at_least=True),
        Measure("emulator's step without client / the twin", us["simulator"] / us["model"], "times", budget=2.0),
        Measure("emulator's step, all datarefs / none", us["everything"] / us["simulator"], "times"),
        Measure("simulated / CPU time of a campaign's flight", 1e6 / plan.frame_rate / flight_us, "times"),
    ]
