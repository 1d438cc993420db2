"""A scenario that waits for the stall warning, where rx_node asks for it more rarely, or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import tx_params
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.resources import program

SCENARIO = {
    "name": "calm",
    "aircraft": "fixed_wing",
    "events": [
        {"at": 0, "stick": {"roll": 0, "pitch": 0, "yaw": 0, "throttle": 0.5}},
        {"at": 1.5, "when": {"stall_warning": False}, "label": "calm"},
        {"at": 2, "end": True},
    ],
}
WATCHDOG_S = 30.0


def player(world, rate: int, lockstep: bool = True) -> ManagedProcess:
    """The bridge at a rate of warnings, and the scenario's player, which has not begun."""
    world.emulator(*(("--stepped", "lockstep") if lockstep else ()), "--start", "air")
    participants = {"participants": ["scenario_player"], "hold": True, "watchdog": WATCHDOG_S}
    world.set_param("lockstep", {"enabled": True, **participants} if lockstep else {"enabled": False})
    world.set_param("tx_node", tx_params())
    world.start("rx_node", {"rates": {"warnings": rate}})
    world.start("tx_node")
    file = world.folder / "calm.yaml"
    file.write_text(json.dumps(SCENARIO), encoding="utf-8")  # which is YAML
    log = ["--log", str(world.folder / "played.json")]
    command = [str(program("scenario_player")), str(file), "--namespace", world.namespace, *log]
    return ManagedProcess("scenario_player", command, world.folder, env=world.env)


@pytest.mark.parametrize("rate", [2, 4])
def test_slow_warnings_do_not_keep_a_frame_waiting(world, rate: int) -> None:
    from std_srvs.srv import Trigger

    with player(world, rate) as playing:
        playing.wait_for_line("^ready for calm", WAIT_S)
        assert world.call("lockstep/run", Trigger).success
        assert playing.wait(WAIT_S) == 0, playing.output()
    played = json.loads(Path(world.folder / "played.json").read_text(encoding="utf-8"))
    assert played["labels"] == {"calm": pytest.approx(1.5, abs=0.02)}


@pytest.mark.parametrize("lockstep", [True, False], ids=["lockstep", "real time"])
def test_without_warnings_it_is_refused_before_the_first_frame(world, lockstep: bool) -> None:
    with player(world, 0, lockstep=lockstep) as playing:
        assert playing.wait(WAIT_S) == 1
        said = playing.output()
    name = f"{world.namespace}/rx_node/rates/warnings"
    assert f"scenario_player: calm waits for stall_warning, but {name} is 0" in said
