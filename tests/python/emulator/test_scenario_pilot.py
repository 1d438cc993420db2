"""What the emulator's pilot refuses before it flies."""

from __future__ import annotations

import pytest

from xplane_bridge.emulator.scenario_pilot import ScenarioPilot
from xplane_bridge.scenario import Scenario, ScenarioError, parse_scenario


def scenario(*events: dict) -> Scenario:
    return parse_scenario({"name": "t", "events": list(events)})


def test_pilot_refuses_what_it_cannot_do() -> None:
    with pytest.raises(ScenarioError, match="surfaces fail through tx_node"):
        ScenarioPilot(scenario({"at": 0, "failure": {"name": "aileron1_wing2_left", "kind": "stuck", "value": 5}}))
    for more in ({"kind": "reduced", "value": 0.5}, {"value": 1}):
        with pytest.raises(ScenarioError, match=r"engine_1.*expected kind failed, and no value: a system works"):
            ScenarioPilot(scenario({"at": 0, "failure": {"name": "engine_1", **more}}))


@pytest.mark.parametrize("target", ["throttle", "aileron1_wing2_left", "roll,pitch"])
def test_the_emulators_pilot_refuses_excitations_that_it_does_not_fly(target: str) -> None:
    excitation = {"kind": "multisine", "amplitude": 0.1, "duration": 2}
    for axis in ("roll", "pitch", "yaw"):
        ScenarioPilot(scenario({"at": 0, "excitation": {**excitation, "target": axis}}))
    with pytest.raises(ScenarioError, match=r"excitation.*: the emulator's pilot moves .*; tx_node moves"):
        ScenarioPilot(scenario({"at": 0, "excitation": {**excitation, "target": target}}))
