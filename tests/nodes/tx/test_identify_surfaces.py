"""identify_surfaces learns the mixing of the twin, and single surfaces move at once, without a mixing file."""

from __future__ import annotations

import json
import sys

import pytest

from support.again import again_until
from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import AUTO, LAW, WatchedDatarefs, call, tx_params
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.resources import program

REFUSED = 2
LEFT = "sim/flightmodel/controls/wing2l_ail1def"
BANK, HEIGHT = "sim/flightmodel/position/true_phi", "sim/flightmodel/position/elevation"
STICK, OVERRIDE = "sim/joystick/yoke_roll_ratio", "sim/operation/override/override_joystick_roll"
SURFACES = "sim/operation/override/override_control_surfaces"


def fly(world, *options):
    """The emulator's twin in the air with its own pilot, or as `options` say, and tx_node without a mixing."""
    from xplane_bridge.msg import ControlMode, EventList, ExcitationState

    world.xplane = world.emulator("--no-beacon", *options)
    world.wire = WatchedDatarefs(world.xplane.port, LEFT, BANK, HEIGHT, STICK, OVERRIDE, SURFACES)
    world.events = world.watch("events", EventList)
    world.mode = world.watch("control/mode", ControlMode)
    world.signals = world.watch("excitation/state", ExcitationState)
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params(command_timeout=5.0))  # a busy machine's law may be silent for a moment
    world.events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events))
    wait_until(lambda: world.wire.value(HEIGHT) == world.wire.value(HEIGHT), WAIT_S, "X-Plane's answers")
    return world


def identify(world, **request):
    """Asks for it until the flight is steady, and waits for the outcome."""
    answers = []

    def accepted() -> bool:
        answers.append(call(world, "identify_surfaces", "IdentifySurfaces", **request))
        return answers[-1].success

    wait_until(accepted, WAIT_S, "a steady flight")
    number = answers[-1].event_number
    found = world.events.wait_for(lambda e: any(event.number == number for event in e.events), timeout=90)
    return next(event for event in found.events if event.number == number)


@pytest.fixture
def world(new_world, tmp_path):
    world = new_world(tmp_path)
    yield world
    world.wire.close()
    world.close()


def test_identify_then_set_one_aileron_and_keep_flying(world):
    from xplane_bridge.msg import FlightState

    fly(world, "--start", "air")
    world.start("rx_node", {})
    world.watch("flight_state", FlightState).wait_for()
    hold = [sys.executable, program("attitude_hold"), "--altitude", "1000", "--engage", "--namespace", world.namespace]
    with ManagedProcess("attitude_hold", hold, world.folder, env=world.env):
        world.mode.wait_for(lambda mode: mode.mode == AUTO and mode.auto_alive)
        refused = call(world, "set_failure", "SetFailure", name="aileron1_wing2_left", kind="centred")
        assert refused.result.code == REFUSED
        assert "identify_surfaces" in refused.result.message
        # A busy machine's law may be silent for too long: a limit ends it.
        outcome = again_until(lambda ended: ended.success, lambda: identify(world), 3)
        assert outcome.success, outcome.text
        labels = [(s.kind, s.target, s.result) for s in world.signals.messages if s.id and not s.active]
        assert {target for _, target, result in labels if result == "done"} == {"roll", "pitch", "yaw"}
        broken = call(
            world, "set_failure", "SetFailure", name="aileron1_wing2_left", kind="stuck", has_value=True, value=5.0
        )
        assert broken.success, broken.result.message
        world.wire.wait(LEFT, 5.0, tolerance=0.1)
        start = world.wire.value(HEIGHT)
        for _ in range(20):
            assert abs(world.wire.value(BANK)) < 25.0
            assert abs(world.wire.value(HEIGHT) - start) < 60.0
            world.wire.wait(LEFT, 5.0, tolerance=0.1)
    kept = json.loads((world.folder / "ros_home/xplane_bridge/mixing/DA62.yaml").read_text(encoding="utf-8"))
    for name in ("aileron1_wing2_left", "elevator1_left", "rudder1_fin1"):
        for term, slope in LAW[name][0].items():
            assert kept["surfaces"][name]["slopes_deg"][term] == pytest.approx(slope, abs=0.5)


def test_without_a_controller_the_axes_are_taken_and_given_back(world):
    """The emulator's own pilot flies level; nothing is kept in a file, and single surfaces move all the same."""
    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    fly(world, "--start", "air", "--pilot", pilot)
    outcome = identify(world, do_not_save=True)
    assert outcome.success, outcome.text
    assert not (world.folder / "ros_home/xplane_bridge/mixing").exists()
    world.wire.wait(OVERRIDE, 0.0)
    broken = call(world, "set_failure", "SetFailure", name="aileron1_wing2_left", kind="hard_over_down")
    assert broken.success, broken.result.message
    world.wire.wait(LEFT, LAW["aileron1_wing2_left"][1][1], tolerance=0.5)


def test_it_works_parked(world):
    fly(world, "--start", "ground")
    outcome = identify(world)
    assert outcome.success, outcome.text
    assert (world.folder / "ros_home/xplane_bridge/mixing/DA62.yaml").exists()
