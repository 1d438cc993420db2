"""The compiled steps of the twin against the Python ones: the same bits, whatever happens."""

from __future__ import annotations

import random
from typing import List

import pytest

from xplane_bridge import compiled
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    EngineFault,
    FlightModel,
    FlightModelError,
    InitialState,
    SurfaceFault,
    SurfaceFaultKind,
)

SHARES = (SurfaceFaultKind.REDUCED, SurfaceFaultKind.SLOW)


def stir(chance: random.Random, controls: Controls, model: FlightModel) -> None:
    """Moves everything that can be moved, and breaks some of it."""
    for axis in ("roll", "pitch", "yaw", "trim_roll", "trim_pitch", "trim_yaw", "flap_request", "speedbrake"):
        setattr(controls, axis, chance.uniform(0.0 if axis == "flap_request" else -0.4, 0.4))
    for i in range(2):
        controls.throttle[i], controls.propeller[i] = chance.random(), chance.random()
        controls.mixture[i] = chance.choice([0.0, 0.5, 0.8, 1.0, 1.0, 1.0])
        controls.throttle_use[i] = chance.random()
        controls.engine_faults[i] = chance.choice([EngineFault.NONE] * 5 + list(EngineFault))
    controls.gear_down = chance.random() < 0.5
    controls.override_throttles = chance.random() < 0.2
    controls.override_surfaces = chance.random() < 0.2
    names = [spec.name for spec in model.surfaces]
    controls.surface_deg = {name: chance.uniform(-10.0, 10.0) for name in names if chance.random() < 0.7}
    controls.surface_faults = {}
    for name in names:
        if chance.random() < 0.3:
            kind = chance.choice(list(SurfaceFaultKind))
            value = chance.random() if kind in SHARES else chance.choice([None, chance.uniform(-10.0, 10.0)])
            controls.surface_faults[name] = SurfaceFault(kind, value)
    controls.gear_fault = chance.random() < 0.2


def history(initial: InitialState, frames: int, period: float, turbulence: float) -> List[bytes]:
    """A flight as `save` has it, a few times a second, and how it ended."""
    model = create_model("fixed_wing", seed=3)
    model.set_wind(3.0, -4.0, 0.5)
    controls = model.reset(initial)
    model.set_turbulence(turbulence, seed=5)
    chance, out = random.Random(11), [model.save()]
    for frame in range(frames):
        if frame % 15 == 0:
            stir(chance, controls, model)
        try:
            state = model.step(period, controls)
        except FlightModelError as error:
            return [*out, str(error).encode()]
        if frame % 5 == 0:
            out.append(model.save() + repr(state).encode())
        if frame == frames // 2:
            model.restore(model.save())
    return out


@pytest.mark.parametrize(
    ("initial", "period", "turbulence"),
    [
        (InitialState(airspeed_mps=70.0), 1 / 60, 0.0),
        (InitialState(airspeed_mps=55.0, heading_deg=123.0, altitude_m=2500.0), 1 / 30, 2.0),
        (InitialState(airspeed_mps=60.0, altitude_m=18.0), 1 / 60, 1.0),  # hits the ground
        (InitialState(on_ground=True), 1 / 50, 1.0),
    ],
)
def test_the_same_bits_as_in_python(
    monkeypatch: pytest.MonkeyPatch, initial: InitialState, period: float, turbulence: float
) -> None:
    assert compiled.core is not None
    in_cpp = history(initial, 600, period, turbulence)
    monkeypatch.setattr(compiled, "core", None)
    assert in_cpp == history(initial, 600, period, turbulence)


def test_what_a_wrong_call_says() -> None:
    model = create_model("fixed_wing")
    loop = compiled.core.TwinLoop(model)
    frame = (1, 1 / 240, 1 / 240)
    with pytest.raises(ValueError, match="a member of EngineFault"):
        loop.fly(model, *frame, Controls(engine_faults=[EngineFault.NONE, None]))
    with pytest.raises(IndexError):
        loop.fly(model, *frame, Controls(throttle=[0.5]))
    with pytest.raises(AttributeError):
        loop.fly(model, *frame, object())
    with pytest.raises(AttributeError):
        compiled.core.TwinLoop(object())
