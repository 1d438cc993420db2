"""Test signals through tx_node, seen in the emulator's own stick and surfaces."""

from __future__ import annotations

import itertools

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    ROLL,
    CommandSource,
    WatchedDatarefs,
    call,
    take_away,
    tx_params,
    write_mixing,
)
from xplane_bridge.harness import wait_until

OK, ACCEPTED, REFUSED = range(3)
STICK = "sim/joystick/yoke_roll_ratio"
LEFT = "sim/flightmodel/controls/wing2l_ail1def"
RIGHT = "sim/flightmodel/controls/wing2r_ail1def"
SURFACES = "sim/operation/override/override_control_surfaces"
BANK = "sim/flightmodel/position/true_phi"


@pytest.fixture(scope="module")
def twin(new_world, tmp_path_factory):
    """One flight that all tests share: the emulator's pilot holds it level until a test takes the stick."""
    from xplane_bridge.msg import AppliedCommand, ControlMode, EventList, ExcitationState

    world = new_world(tmp_path_factory.mktemp("twin"))
    write_mixing(world)
    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    world.xplane = world.emulator("--start", "air", "--pilot", pilot)
    world.wire = WatchedDatarefs(world.xplane.port, STICK, LEFT, RIGHT, SURFACES, BANK)
    world.state = world.watch("excitation/state", ExcitationState)
    world.applied = world.watch("control/applied", AppliedCommand)
    world.mode = world.watch("control/mode", ControlMode)
    world.events = world.watch("events", EventList)
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", 5.0)  # late frames are no lost link
    # A busy machine's source may be silent for a moment, and its services slow.
    world.start("tx_node", tx_params(command_timeout=5.0))
    world.manual = CommandSource(world, "control/manual")
    world.events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events))
    world.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message)
    yield world
    world.manual.stop()
    world.wire.close()
    world.close()


@pytest.fixture
def flown(twin):
    """The shared flight with a stick in the middle, level, and nothing injected before and after."""

    def levelled() -> bool:
        bank = twin.wire.value(BANK)
        twin.manual.fly(fields=ROLL, roll=max(-0.5, min(0.5, -0.02 * bank)))
        return abs(bank) < 3.0

    wait_until(levelled, WAIT_S, "level flight")
    twin.manual.fly(roll=0.0)
    twin.wire.wait(STICK, 0.0)
    yield twin
    inject(twin, kind="stop")
    wait_until(lambda: not twin.state.last.active, WAIT_S, "the end of the excitation")
    twin.manual.stop()
    wait_until(lambda: call(twin, "set_mode", "SetMode", mode=1).success, WAIT_S, "MANUAL")


def inject(world, **request):
    defaults = {"kind": "doublet", "target": "roll", "amplitude": 0.2, "duration": 2.0}
    band = {"frequency_min": 0.5, "frequency_max": 2.0}
    return call(world, "inject_excitation", "InjectExcitation", **{**defaults, **band, **request})


def flown_until(world, paths, last):
    """Samples since some were last asked for, until `last` holds for the newest: all that came in between."""
    found = []

    def ended():
        found.extend(world.wire.samples(*paths))
        return bool(found) and last(*found[-1])

    wait_until(ended, WAIT_S, f"the end of it in {paths}")
    return found


def peaks(values, levels, tolerance):
    """Which levels the values are at, in order; what lies between them does not count."""
    at = (next((level for level in levels if abs(value - level) <= tolerance), None) for value in values)
    return [level for level, _ in itertools.groupby(level for level in at if level is not None)]


def test_a_doublet_is_added_to_the_stick(flown):
    from xplane_bridge.msg import ControlCommand

    flown.manual.fly(roll=0.1)
    flown.wire.wait(STICK, 0.1)
    flown.applied.skip_to_now()
    began = inject(flown)
    assert began.success
    assert began.result.code == ACCEPTED
    state = flown.state.wait_for(lambda s: s.id == began.id and s.active)
    assert (state.kind, state.target, state.result) == ("doublet", "roll", "running")
    assert state.amplitude == pytest.approx(0.2)
    done = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert done.result == "done"
    assert done.end_sim_time - done.start_sim_time == pytest.approx(2.0, abs=0.1)
    sticks = flown_until(flown, [STICK], lambda stick: abs(stick - 0.1) <= 1e-4)
    assert peaks((stick for (stick,) in sticks), (0.3, -0.1), 1e-4) == [0.3, -0.1]
    assert flown.applied.then_wait_for(lambda a: a.excited == ControlCommand.ROLL)
    assert any(f"excitation {began.id}" in event.text for event in flown.events.last.events)


def test_a_multisine_moves_several_axes_each_by_its_own_signal(flown):
    from xplane_bridge.msg import ControlCommand

    refused = inject(flown, target="roll,pitch", duration=20.0)
    assert "several axes at once take a multisine" in refused.result.message
    refused = inject(flown, kind="multisine", target="roll,pitch", duration=20.0)
    assert "commands pitch" in refused.result.message, "each axis needs a command to be added to"
    flown.manual.fly(fields=ControlCommand.ROLL | ControlCommand.PITCH, roll=0.0, pitch=0.0)
    flown.applied.wait_for_next(lambda a: a.fields & ControlCommand.PITCH)
    flown.applied.skip_to_now()
    began = inject(flown, kind="multisine", target="roll,pitch", duration=20.0, amplitude=0.05)
    assert began.success, began.result.message
    state = flown.state.wait_for(lambda s: s.id == began.id and s.active)
    assert state.target == "roll,pitch"
    both = ControlCommand.ROLL | ControlCommand.PITCH
    flown.applied.then_wait_for(lambda a: a.excited == both and abs(a.roll) > 0.01 and abs(a.roll - a.pitch) > 0.01)
    flown.applied.then_wait_for(lambda a: a.excited == both and abs(a.pitch) > 0.01)
    assert inject(flown, kind="stop").success
    flown.manual.fly(fields=ControlCommand.ROLL, roll=0.0)


def test_it_ends_where_the_attitude_leaves_its_limits(flown):
    began = inject(flown, amplitude=0.8, duration=20.0, max_roll_deg=15.0)
    assert began.success
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result.startswith("aborted")
    assert "roll" in ended.result
    flown.wire.wait(STICK, 0.0)


def test_a_change_of_mode_and_stop_end_it(flown):
    began = inject(flown, kind="multisine", duration=60.0, amplitude=0.05)
    assert began.success
    again = inject(flown)
    assert again.result.code == REFUSED
    assert "one at a time" in again.result.message
    assert call(flown, "set_mode", "SetMode", mode=AUTO).success
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result == "aborted: the mode changed"
    assert call(flown, "set_mode", "SetMode", mode=1).success
    began = inject(flown, kind="chirp", duration=60.0, amplitude=0.05)
    assert began.success
    assert inject(flown, kind="stop").success
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result.startswith("aborted: stopped")


def test_the_stick_that_takes_over_ends_it(flown):
    controller = CommandSource(flown, "control/auto")
    controller.fly(fields=ROLL, roll=0.0)
    try:
        assert call(flown, "set_mode", "SetMode", mode=AUTO).success
        began = inject(flown, kind="multisine", duration=60.0, amplitude=0.05)
        assert began.success
        flown.manual.fly(roll=0.6)
        ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
        assert ended.result == "aborted: the mode changed"
        flown.mode.wait_for(lambda m: m.reason.startswith("stick take-over"))
    finally:
        controller.stop()


def test_a_source_that_falls_silent_ends_it(flown):
    began = inject(flown, kind="multisine", duration=60.0, amplitude=0.05)
    assert began.success
    flown.manual.stop()
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result == "aborted: the commands of the axis have ended"
    flown.mode.wait_for(lambda m: m.failsafe)
    refused = inject(flown)
    assert (refused.success, refused.result.code) == (False, REFUSED)
    assert "no source commands roll" in refused.result.message


def test_a_surface_that_another_client_releases_is_not_taken_again(flown):
    began = inject(flown, kind="chirp", target="aileron1_wing2_left", amplitude=1.0, duration=60.0)
    assert began.success, began.result.message
    flown.wire.wait(SURFACES, 1.0)
    wait_until(lambda: abs(flown.wire.value(LEFT)) > 0.3, WAIT_S, "the left aileron to move")
    take_away(flown, SURFACES, lambda: flown.state.last.id == began.id and not flown.state.last.active)
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result == "aborted: another client has released the surface override"
    flown.wire.wait(SURFACES, 0.0)
    flown.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message)
    assert flown.wire.value(SURFACES) == 0.0


def test_a_surface_that_breaks_ends_it(flown):
    rudder = {"kind": "chirp", "target": "rudder1_fin1", "amplitude": 1.0, "duration": 60.0}
    began = inject(flown, **rudder)
    assert began.success, began.result.message
    broken = {"name": "rudder1_fin1", "kind": "stuck", "has_value": True, "value": 1.0}
    assert call(flown, "set_failure", "SetFailure", **broken).success
    ended = flown.state.wait_for(lambda s: s.id == began.id and not s.active)
    assert ended.result == "aborted: rudder1_fin1 is broken"
    refused = inject(flown, **rudder)
    assert (refused.success, refused.result.message) == (False, "rudder1_fin1 is broken")
    assert call(flown, "clear_failures", "ClearFailures").success


def test_one_surface_is_excited_while_the_others_fly(flown):
    flown.wire.samples(SURFACES)
    began = inject(flown, target="aileron1_wing2_left", amplitude=4.0, duration=3.0)
    assert began.success, began.result.message
    assert flown.state.wait_for(lambda s: s.id == began.id and not s.active).result == "done"
    shown = flown_until(flown, [SURFACES, LEFT, RIGHT], lambda override, *_: override == 0.0)
    assert peaks((left for _, left, _ in shown), (4.0, -4.0), 0.3) == [4.0, -4.0]
    excited = [(override, right) for override, left, right in shown if abs(abs(left) - 4.0) <= 0.3]
    assert {override for override, _ in excited} == {1.0}
    assert max(abs(right) for _, right in excited) <= 0.3


@pytest.mark.parametrize(
    ("request_", "part"),
    [
        ({"kind": "square"}, "expected doublet, 3-2-1-1, multisine, chirp or stop"),
        ({"target": "flaps"}, "expected roll, pitch, yaw, throttle or a surface"),
        ({"amplitude": 0.0}, "amplitude"),
        ({"amplitude": float("nan")}, "amplitude"),
        ({"amplitude": 1.5}, "at most 1"),
        ({"duration": -1.0}, "duration"),
        ({"kind": "chirp", "frequency_min": 3.0}, "frequency"),
        ({"target": "pitch"}, "no source commands pitch"),
        ({"target": "aileron2_wing4_left", "amplitude": 1.0}, "aileron2_wing4_left"),
        ({"target": "aileron1_wing2_left", "amplitude": 21.0}, "expected at most half of its travel, 20.0"),
    ],
)
def test_wrong_requests_are_refused_in_words(flown, request_, part):
    refused = inject(flown, **request_)
    assert not refused.success
    assert refused.result.code == REFUSED
    assert part in refused.result.message
    assert not flown.state.last.active
