"""Test signals of scenarios: those of tx_node, and refused where tx_node would refuse them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xplane_bridge.compiled import core
from xplane_bridge.constants import EXCITATION_KINDS
from xplane_bridge.scenario import ScenarioError, excitations, parse_scenario
from xplane_bridge.surfaces import SURFACES

GIVEN = {
    "kind": "multisine",
    "target": "roll",
    "amplitude": 0.3,
    "duration": 7.0,
    "frequency": 0.2,
    "frequency_end": 2.0,
    "seed": 0,
}


def played(times: np.ndarray, **changes: Any) -> list[float]:
    parameters = {**GIVEN, **changes}
    return [excitations.value(parameters, float(time)) for time in times]


@pytest.mark.parametrize(
    ("kind", "times", "values"),
    [
        ("doublet", (0.0, 0.9, 1.1, 1.9, 2.1), (1, 1, -1, -1, 0)),
        ("3-2-1-1", (0.1, 0.8, 0.9, 1.4, 1.5, 1.7, 1.75, 1.99), (1, 1, -1, -1, 1, 1, -1, -1)),
    ],
)
def test_steps(kind: str, times: tuple[float, ...], values: tuple[int, ...]) -> None:
    assert played(np.array(times), kind=kind, amplitude=1.0, duration=2.0) == list(values)


@pytest.mark.parametrize("changes", [{}, {"seed": 4}, {"frequency": 2.0}, {"frequency_end": 9.7, "duration": 31.3}])
@pytest.mark.parametrize("kind", EXCITATION_KINDS)
def test_they_are_the_signals_of_tx_node(kind: str, changes: dict[str, Any]) -> None:
    p = {**GIVEN, **changes, "kind": kind}
    numbers = (p[key] for key in ("amplitude", "duration", "frequency", "frequency_end", "seed"))
    signal = core.Excitation(kind, *numbers, 45.0, 20.0, 100.0)
    times = np.arange(0.0, p["duration"], 0.013)
    theirs = [signal.step(100.0 + time, 0.0, 0.0) for time in times]
    assert played(times, **p) == pytest.approx(theirs, abs=1e-9)
    assert max(map(abs, theirs)) == pytest.approx(0.3, rel=0.01)
    assert signal.step(100.0 + p["duration"], 0.0, 0.0) is None
    assert played(np.array([-0.1, p["duration"]]), **p) == [0.0, 0.0]


def test_another_seed_is_another_multisine() -> None:
    times = np.arange(0.0, 7.0, 0.1)
    assert played(times, seed=1) != played(times, seed=2)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"amplitude": 1.5}, r"amplitude: 1\.5; expected a number above 0, up to 1"),
        ({"amplitude": 0.0, "target": "aileron1_wing2_left"}, r"amplitude: 0; expected a number above 0$"),
        ({"kind": "chirp", "frequency": 2.5}, r"frequency_end: 2; expected a number not below frequency \(2\.5\)"),
        ({"kind": "chirp", "duration": 0.9}, r"duration: 0\.9; expected 1 s or more: a chirp fades in and out"),
        ({"frequency": 1.99, "duration": 1.3}, r"frequency_end: 2; expected 1 to 2000 multiples of 1/duration"),
        ({"target": "roll,pitch", "frequency": 1.99}, r"frequency_end: 2; expected 2 to 4000 multiples of 1/dur"),
        ({"frequency_end": 10.0, "duration": 600.0}, r"frequency_end: 10; expected 1 to 2000 multiples"),
        ({"kind": "square"}, r"kind: 'square'; expected"),
        ({"target": "rol"}, r"target: 'rol'; expected roll, pitch, yaw, throttle or one surface"),
        ({"target": "roll,"}, r"target: 'roll,'; expected roll, pitch, yaw, throttle or one surface"),
        ({"target": "aileron1_wing1_left,roll"}, r"target: 'aileron1_wing1_left,roll'; expected .* or one surface"),
        ({"target": "aileron1_wing5_left"}, r"target: 'aileron1_wing5_left'; expected .* or one surface"),
        ({"target": "yaw, roll, yaw"}, r"target: 'yaw, roll, yaw'; expected each axis once"),
    ],
)
def test_what_tx_node_would_refuse_in_flight_is_refused_at_the_start(changes: dict[str, Any], text: str) -> None:
    excitation = {**GIVEN, **changes}
    with pytest.raises(ScenarioError, match=r"events\[0\]\.excitation\." + text):
        parse_scenario({"name": "test", "events": [{"at": 0.0, "excitation": excitation}]})


def test_what_tx_node_takes_as_a_target_is_taken() -> None:
    for target in ("roll, yaw", "throttle,pitch", *SURFACES):
        parse_scenario({"name": "test", "events": [{"at": 0.0, "excitation": {**GIVEN, "target": target}}]})


def test_an_unknown_kind_is_not_played_as_a_multisine() -> None:
    with pytest.raises(ScenarioError, match="'square'; expected doublet, 3-2-1-1, multisine or chirp"):
        excitations.value({**GIVEN, "kind": "square"}, 0.5)
