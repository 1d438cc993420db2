"""The compiled reader of JSBSim's state against the Python one: the same bits, of every aircraft."""

from __future__ import annotations

import math
from typing import List

import pytest

from xplane_bridge import compiled
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import InitialState


def states(aircraft: str) -> List[str]:
    """Those of a turn through north, south of the equator, in wind and gusts, with all digits."""
    model = create_model(aircraft, seed=2)
    model.set_wind(-3.0, 7.0, 0.5)
    controls = model.reset(InitialState(latitude_deg=-31.7, longitude_deg=-64.3, heading_deg=355.0))
    model.set_turbulence(1.5, seed=4)
    out = []
    for frame in range(240):
        controls.roll, controls.pitch = 0.3 * math.sin(0.05 * frame), 0.1
        out.append(repr(model.step(1 / 60, controls)))
    return out


@pytest.mark.parametrize("aircraft", ["fixed_wing", "multirotor", "tiltrotor"])
def test_the_same_bits_as_in_python(monkeypatch: pytest.MonkeyPatch, aircraft: str) -> None:
    assert compiled.core is not None
    in_cpp = states(aircraft)
    monkeypatch.setattr(compiled, "core", None)
    assert in_cpp == states(aircraft)


def test_what_a_wrong_call_says() -> None:
    with pytest.raises(ValueError, match="expected 48 getters"):
        compiled.core.StateReader([float])
    model = create_model("fixed_wing")
    reader = compiled.core.StateReader([float] * 48)
    with pytest.raises(ValueError, match="too few numbers"):
        reader.read(model.state, (0.0, 0.0))
    with pytest.raises(AttributeError):
        reader.read(object(), (0.0, 0.0, 0.0))
