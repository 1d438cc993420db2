"""Commands of starters and magnetos, and the ignition key that they turn."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol

KEYS = [f"sim/cockpit2/engine/actuators/ignition_key[{engine}]" for engine in (0, 1)]
RUNNING = [f"sim/flightmodel/engine/ENGN_running[{engine}]" for engine in (0, 1)]


@pytest.mark.parametrize(
    ("off", "starter", "left_on"),
    [
        ("sim/magnetos/magnetos_off", "sim/engines/engage_starters", 0.0),
        ("sim/magnetos/magnetos_off_1", "sim/starters/engage_starter_1", 1.0),
    ],
)
def test_magnetos_and_starters_turn_the_ignition_key(off: str, starter: str, left_on: float) -> None:
    with EmulatorFixture(aircraft="fixed_wing") as emulator:
        client = emulator.client()
        client.send(protocol.CommandRequest(off))
        assert emulator.read(*KEYS, *RUNNING) == [0.0, 3.0 * left_on, 0.0, left_on]
        emulator.write(dict.fromkeys(KEYS, 3.0))
        emulator.step(2)
        assert emulator.read(*KEYS, *RUNNING) == [3.0, 3.0, 1.0, 1.0]  # the propellers turn them
        for on in (starter, off.replace("_off", "_both")):
            client.send(protocol.CommandRequest(off))
            emulator.step(2)
            assert emulator.read(*RUNNING) == [0.0, left_on]
            client.send(protocol.CommandRequest(on))
            emulator.step(2)
            assert emulator.read(*KEYS, *RUNNING) == [3.0, 3.0, 1.0, 1.0]


@pytest.mark.parametrize("aircraft", ["multirotor", "tiltrotor", "kinematic"])
def test_engines_without_magnetos_run_on(aircraft: str) -> None:
    with EmulatorFixture(aircraft=aircraft) as emulator:
        emulator.client().send(protocol.CommandRequest("sim/magnetos/magnetos_off"))
        emulator.step(2)
        assert emulator.read(KEYS[0], RUNNING[0]) == [0.0, 1.0]
