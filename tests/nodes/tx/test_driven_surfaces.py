"""Surfaces that tx_node drives: commands, who takes them, how they are given back, their mixing."""

from __future__ import annotations

import itertools
import json
import math
import signal
import time

import pytest

from support.deadlines import WAIT_S
from support.flights.failing_twin import (  # noqa: F401
    FAILURES,
    LEFT,
    REFUSED,
    RIGHT,
    RUDDER,
    SURFACES,
    TIME,
    close,
    fail,
    fixture_healthy,
    fixture_twin,
    fly,
    follows,
    has_said,
    last_event,
    said,
    wait_ready,
)
from support.nodes.tx_fixtures import (
    AUTO,
    MANUAL,
    PITCH,
    ROLL,
    YAW,
    WatchedDatarefs,
    call,
    journal_entries,
    take_away,
)
from xplane_bridge.harness import wait_until


def test_override_that_another_client_releases_is_not_taken_again(healthy):
    world, name = healthy, "rudder1_fin1"
    assert fail(world, name, "stuck", 4.0).success
    world.wire.wait(RUDDER, 4.0)
    text = f"failure of {name} has ended: another client has released the surface override"
    before = last_event(world)
    take_away(world, SURFACES, lambda: has_said(world, text, before))
    wait_until(lambda: not world.state.last.names and not world.state.last.surrogate_mixing, WAIT_S, "an empty state")
    wait_until(lambda: "override:" + SURFACES not in journal_entries(world), WAIT_S, "the journal's entry to go")
    assert world.wire.value(SURFACES) == 0.0


def test_who_takes_the_stick_from_the_bridge_gets_the_surfaces_too(healthy):
    world, name = healthy, "rudder1_fin1"
    wait_ready(world)
    world.manual.fly(fields=ROLL, roll=0.0)
    assert fail(world, name, "stuck", 4.0).success
    world.wire.wait(RUDDER, 4.0)
    both = {"override_control_surfaces", "override_joystick_roll"}
    world.wait_for_diagnostics("control", lambda s: both <= set(world.values_of(s)["Overrides set"].split(", ")))
    text = f"failure of {name} has ended: another client has released"
    before = last_event(world)  # another test of this flight has it said as well
    take_away(world, "sim/operation/override/override_joystick_roll", lambda: has_said(world, text, before))
    world.wire.wait(SURFACES, 0.0)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    assert call(world, "set_mode", "SetMode", mode=1).success  # flies on


class Surfaces:
    """Publishes a SurfaceCommand."""

    def __init__(self, world):
        import rospy
        from xplane_bridge.msg import SurfaceCommand

        self._type = SurfaceCommand
        self._publisher = rospy.Publisher(f"{world.namespace}/control/surfaces", SurfaceCommand, queue_size=1)
        wait_until(lambda: self._publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")

    def send(self, sequence=0, **deflections):
        self._publisher.publish(
            self._type(sequence=sequence, names=list(deflections), deflections_deg=list(deflections.values()))
        )


def test_single_surfaces_by_command(healthy):
    world, wire = healthy, healthy.wire
    surfaces = Surfaces(world)
    surfaces.send(aileron1_wing2_left=3.0)
    world.wait_for_diagnostics(
        "surfaces", lambda s: "flies in AUTO" in world.values_of(s).get("control/surfaces last refusal", "")
    )
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    refusals = (
        ({"aileron1_wing2_left": 3.0, "wing": 1.0}, "no surface"),
        ({"aileron1_wing2_left": 3.0, "rudder1_fin1": math.nan}, "rudder1_fin1 is nan"),
        ({"aileron1_wing2_left": 3.0, "aileron1_wing1_left": 0.0}, "has not been seen to move"),
        ({"aileron1_wing2_left": 3.0, "elevator1_left": 40.0}, "its travel, -19.0..14.0"),
    )
    for deflections, text in refusals:
        surfaces.send(**deflections)
        world.wait_for_diagnostics(
            "surfaces", lambda s, text=text: text in world.values_of(s).get("control/surfaces last refusal", "")
        )
    assert wire.value(SURFACES) == 0.0
    assert all("aileron1_wing2_left" not in a.surface_names for a in world.applied.messages[-3:])

    def shown():
        surfaces.send(70007, aileron1_wing2_left=4.0, aileron1_wing2_right=4.0)
        return abs(wire.value(LEFT) - 4.0) < 1e-4 and abs(wire.value(RIGHT) - 4.0) < 1e-4

    count = len(world.applied.messages)
    wait_until(shown, WAIT_S, "both ailerons down")
    seen = world.applied.wait_for(lambda a: a.sequence == 70007 and a.read_back)
    assert list(seen.surface_names) == ["aileron1_wing2_left", "aileron1_wing2_right"]
    assert seen.read_back_frames > 0.9
    assert len(world.applied.messages) > count
    # One of a stream faster than X-Plane's frames is seen to be shown, too.
    numbers = itertools.count(80000)

    def streamed():
        for _ in range(10):
            surfaces.send(next(numbers), aileron1_wing2_left=3.0)
            time.sleep(0.002)
        return any(a.sequence >= 80000 and a.read_back for a in world.applied.messages)

    wait_until(streamed, WAIT_S, "a command of the stream")
    # Not repeated, the command ends after command_timeout, and the mixing flies again.
    wire.wait(SURFACES, 0.0)
    wait_until(lambda: follows(wire, LEFT) and follows(wire, RIGHT), WAIT_S, "the ailerons to follow again")
    assert call(world, "set_mode", "SetMode", mode=MANUAL).success


def test_a_stick_that_takes_over_ends_single_surfaces(healthy):
    from xplane_bridge.msg import ControlMode

    world, wire = healthy, healthy.wire
    modes = world.watch("control/mode", ControlMode)
    surfaces = Surfaces(world)
    world.manual.fly(fields=ROLL, roll=0.0)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success

    def shown():
        surfaces.send(aileron1_wing2_left=4.0, aileron1_wing2_right=4.0)
        return abs(wire.value(LEFT) - 4.0) < 1e-4 and abs(wire.value(RIGHT) - 4.0) < 1e-4

    wait_until(shown, WAIT_S, "both ailerons down")
    modes.skip_to_now()
    world.manual.fly(roll=0.5)

    def over():
        surfaces.send(aileron1_wing2_left=4.0, aileron1_wing2_right=4.0)  # it goes on commanding
        return wire.value(SURFACES) == 0.0 and follows(wire, LEFT) and follows(wire, RIGHT)

    wait_until(over, WAIT_S, "the ailerons to follow the stick")
    taken = modes.then_wait_for(lambda m: m.mode == MANUAL)
    assert taken.reason.startswith("stick take-over")
    assert taken.reason.endswith("control/surfaces ends")
    said(world, taken.reason)


def test_overrides_and_failures_are_given_back_however_it_ends(new_world, tmp_path):
    world = fly(new_world(tmp_path))
    engine = WatchedDatarefs(world.xplane.port, FAILURES + "rel_engfai1")
    for end in (signal.SIGINT, signal.SIGKILL):
        assert fail(world, "elevator1_left", "stuck", -2.0).success
        assert fail(world, "engine_2").success
        world.wire.wait(SURFACES, 1.0)
        engine.wait(FAILURES + "rel_engfai1", 6.0)
        world.node.send_signal(end)
        world.wire.wait(SURFACES, 0.0)
        engine.wait(FAILURES + "rel_engfai1", 0.0)
        world.node.wait(WAIT_S)
        if end == signal.SIGINT:  # its last word must not label what comes after
            wait_until(
                lambda: not world.state.last.names and not world.state.last.surrogate_mixing, WAIT_S, "nothing broken"
            )
        wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
        if end == signal.SIGINT:
            world.node = world.start("tx_node", world.params)
            wait_ready(world)
    engine.close()
    close(world)


def test_mixing_is_identified_from_flight_and_kept(new_world, tmp_path):
    mixing = {"excursion": 0.2, "independence": 0.03, "residual_deg": 0.5, "slope_error_deg": 1.0, "samples": 60}
    world = fly(new_world(tmp_path), known=False, mixing=mixing)
    world.wait_for_diagnostics("surfaces", lambda s: "roll right" in s.message)
    refused = fail(world, "aileron1_wing2_left", "stuck", 5.0)
    assert (refused.success, refused.result.code) == (False, REFUSED)
    assert "roll right: seen up to" in refused.result.message
    assert "need 0.20 of full stick" in refused.result.message
    assert world.wire.value(SURFACES) == 0.0

    file = world.folder / "ros_home" / "xplane_bridge" / "mixing" / "DA62.yaml"
    start = world.wire.value(TIME)

    def flying():
        t = world.wire.value(TIME) - start
        world.manual.fly(
            fields=ROLL | PITCH | YAW,
            roll=0.3 * math.sin(2.5 * t),
            pitch=0.3 * math.sin(1.9 * t),
            yaw=0.3 * math.sin(3.1 * t + 1.0),
        )
        return file.is_file()

    wait_until(flying, WAIT_S, "a mixing file")
    world.manual.stop()
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["aircraft"] == "DA62"
    for name, slopes in (("aileron1_wing2_left", (15.0, 25.0)), ("aileron1_wing2_right", (-25.0, -15.0))):
        law = found["surfaces"][name]["slopes_deg"]
        assert (law["roll+"], law["roll-"]) == pytest.approx(slopes, abs=0.5)
    assert found["surfaces"]["elevator1_right"]["slopes_deg"]["pitch+"] == pytest.approx(-18.0, abs=0.5)
    assert found["surfaces"]["rudder1_fin1"]["slopes_deg"]["yaw-"] == pytest.approx(27.0, abs=0.5)
    said(world, "the mixing of the surfaces is identified")
    wait_ready(world)
    assert fail(world, "aileron1_wing2_left", "stuck", 5.0).success
    world.wire.wait(LEFT, 5.0)

    world.node.send_signal(signal.SIGINT)
    world.node.wait(WAIT_S)
    world.node = world.start("tx_node", world.params)
    wait_ready(world)  # by the file, without any flying
    assert fail(world, "aileron1_wing2_left", "stuck", -3.0).success
    world.wire.wait(LEFT, -3.0)
    close(world)
