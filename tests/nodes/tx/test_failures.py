"""Failures through tx_node: of surfaces and systems, triggers, the simulator's menu."""

from __future__ import annotations

import math
import signal
import threading

import pytest

from support.deadlines import WAIT_S
from support.flights.failing_twin import (  # noqa: F401
    ACCEPTED,
    ALPHA,
    BANK,
    BATTERY,
    BUS,
    ELEVATOR,
    ENGINE,
    FAILURES,
    GENERATOR,
    LEFT,
    NOT_SUPPORTED,
    OK,
    REFUSED,
    RIGHT,
    RUDDER,
    STICK,
    SURFACES,
    TIME,
    TOTAL,
    close,
    fail,
    fixture_healthy,
    fixture_twin,
    fly,
    follows,
    said,
    wanted,
)
from support.nodes.tx_fixtures import (
    PITCH,
    ROLL,
    YAW,
    WatchedDatarefs,
    call,
    journal_entries,
    pause,
)
from xplane_bridge import protocol
from xplane_bridge.emulator.simulator import aircraft_path
from xplane_bridge.harness import wait_until

AT_SIM_TIME, AT_ALTITUDE_ABOVE, AT_SPEED_BELOW = 1, 2, 5


def label_of(world, name):
    """How a failure stands in the newest failures/state; empty: nowhere."""
    state = world.state.last
    if state is None or name not in state.names:
        return {}
    i = list(state.names).index(name)
    keys = ("kinds", "values", "set_by", "active", "confirmed", "since_sim_time")
    return {key: getattr(state, key)[i] for key in keys}


def wait_for_label(world, name, **expected):
    wait_until(
        lambda: all(label_of(world, name).get(key) == value for key, value in expected.items()),
        WAIT_S,
        f"label of {name} {expected}, last {label_of(world, name)}",
    )


def collected(wire, paths, last, what):
    """Samples since some were last asked for, up to the first for which `last` holds."""
    found = []

    def ended():
        for sample in wire.samples(*paths):
            found.append(sample)
            if last(*sample):
                return True
        return False

    wait_until(ended, WAIT_S, what)
    return found


def test_left_aileron_stuck_rolls_the_aircraft_and_the_others_keep_flying(healthy):
    world, wire = healthy, healthy.wire
    world.manual.fly(fields=ROLL | PITCH | YAW, roll=0.0, pitch=0.0, yaw=0.0)  # hands off
    wire.wait(STICK, 0.0)
    rolling = WatchedDatarefs(world.xplane.port, TIME, LEFT, BANK)
    wait_until(lambda: rolling.samples(TIME, LEFT, BANK), WAIT_S, "X-Plane's answers")
    done = fail(world, "aileron1_wing2_left", "stuck", 5.0)
    assert done.result.code == OK, done.result.message
    wire.wait(LEFT, 5.0)
    assert wire.value(SURFACES) == 1.0
    assert "override:" + SURFACES in journal_entries(world)
    wait_for_label(
        world, "aileron1_wing2_left", kinds="stuck", values=5.0, set_by="bridge", active=True, confirmed=True
    )
    assert abs(wire.value(RIGHT)) < 2.0, "only one aileron is stuck"
    flown = collected(rolling, (TIME, LEFT, BANK), lambda _, __, bank: bank >= 30.0, "30 degrees of bank")
    rolling.close()
    began = next(time for time, left, _ in flown if abs(left - 5.0) <= 1e-4)
    assert 0.0 < label_of(world, "aileron1_wing2_left")["since_sim_time"] <= began
    # The figure: hands off, 30 degrees in about 5 s.
    assert 2.5 < flown[-1][0] - began < 8.0
    # The stick still moves all others: right aileron by its own travel, elevator, rudder.
    world.manual.fly(roll=-0.8, pitch=0.25, yaw=-0.25)
    wait_until(lambda: wire.value(RIGHT) > 4.0 and follows(wire, RIGHT), WAIT_S, "the right aileron")
    wait_until(lambda: wire.value(RUDDER) < -5.0 and wire.value(ELEVATOR) < -2.0, WAIT_S, "rudder and elevator")
    assert wire.value(LEFT) == pytest.approx(5.0, abs=1e-4)
    wait_until(lambda: wire.value(BANK) < 20.0, WAIT_S, "the stick rolls back")
    applied = world.applied.wait_for_next()
    assert list(applied.surface_names) == ["aileron1_wing2_left"]
    assert list(applied.surface_deflections_deg) == [5.0]
    wait_until(lambda: 0.9 < world.state.last.surrogate_lag_frames < 4.0, WAIT_S, "a measured lag")
    assert world.state.last.surrogate_mixing


def test_cleared_surface_follows_the_stick_again(healthy):
    world, wire = healthy, healthy.wire
    assert fail(world, "rudder1_fin1", "stuck", -8.0).success
    wire.wait(RUDDER, -8.0)
    done = call(world, "clear_failures", "ClearFailures", names=["rudder1_fin1"])
    assert done.success, done.result.message
    assert list(done.cleared) == ["rudder1_fin1"]
    wire.wait(SURFACES, 0.0)
    wait_until(lambda: "override:" + SURFACES not in journal_entries(world), WAIT_S, "the journal's entry to go")
    world.manual.fly(fields=ROLL | PITCH | YAW, yaw=0.25)
    wire.wait(RUDDER, 27.0 * 0.25, tolerance=1.5)
    wait_until(lambda: not world.state.last.names and not world.state.last.surrogate_mixing, WAIT_S, "an empty state")
    assert math.isnan(world.state.last.surrogate_lag_frames)


def test_every_kind_of_a_surface(healthy):
    world, wire = healthy, healthy.wire
    name = "aileron1_wing2_left"
    world.manual.fly(fields=ROLL, roll=0.4)
    wire.wait(STICK, 0.4)
    wait_until(lambda: follows(wire, LEFT), WAIT_S, "the stick")
    healthy_deg = wire.value(LEFT)

    assert fail(world, name, "stuck").success  # where it is
    wait_for_label(world, name, confirmed=True)
    world.manual.fly(roll=-0.2)
    wire.wait(RIGHT, 15.0 * 0.2, tolerance=1.0)
    assert wire.value(LEFT) == pytest.approx(healthy_deg, abs=0.2)
    assert label_of(world, name)["values"] == pytest.approx(healthy_deg, abs=0.2)

    assert fail(world, name, "hard_over_up").success
    wire.wait(LEFT, -25.0)
    assert fail(world, name, "hard_over_down").success
    wire.wait(LEFT, 15.0)
    assert fail(world, name, "centred").success
    wire.wait(LEFT, 0.0, tolerance=0.05)

    world.manual.fly(roll=0.3)
    assert fail(world, name, "reduced", 0.5).success
    wait_until(lambda: wire.value(LEFT) == pytest.approx(7.5 * wire.value(TOTAL), abs=0.05), WAIT_S, "half of it")

    assert fail(world, name, "floating").success
    wait_until(lambda: wire.value(LEFT) == pytest.approx(-0.3 * wire.value(ALPHA), abs=0.1), WAIT_S, "trailing")

    assert fail(world, name, "slow", 5.0).success
    wire.samples(TIME)
    world.manual.fly(roll=-0.3)

    def arrived(_, angle, total):
        return angle < -3.0 and angle == pytest.approx(wanted(LEFT, total), abs=0.02)

    flown = collected(wire, (TIME, LEFT, TOTAL), arrived, "the slow surface")
    angles = [angle for _, angle, _ in flown]
    falling = flown[angles.index(max(angles)) :]
    moving = [(time, angle) for time, angle, _ in falling if angles[-1] + 0.5 < angle < max(angles) - 0.5]
    assert (moving[0][1] - moving[-1][1]) / (moving[-1][0] - moving[0][0]) == pytest.approx(5.0, rel=0.2)
    assert wire.value(SURFACES) == 1.0
    assert sum(name in text.text and "failure:" in text.text for text in world.events.last.events) >= 7


@pytest.mark.parametrize(
    ("name", "leaf", "where", "shows"),
    [
        ("engine_1", "rel_engfai0", ENGINE, lambda v: v == 0.0),
        ("bus_1", "rel_esys", BUS, lambda v: v == 0.0),
        ("generator_2", "rel_genera1", GENERATOR, lambda v: v == 0.0),
        ("battery_1", "rel_batter0", BATTERY, lambda v: v == 0.0),
        ("pitot_1", "rel_pitot", FAILURES + "rel_pitot", lambda v: v == 6.0),
        ("static_1", "rel_static", FAILURES + "rel_static", lambda v: v == 6.0),
        ("gyro_1", "rel_ss_ahz", FAILURES + "rel_ss_dgy", lambda v: v == 6.0),
        ("rel_smoke_cpit", "rel_smoke_cpit", FAILURES + "rel_smoke_cpit", lambda v: v == 6.0),
    ],
)
def test_systems_fail_and_are_repaired(healthy, name, leaf, where, shows):
    world = healthy
    wire = WatchedDatarefs(world.xplane.port, where, FAILURES + leaf)
    wait_until(lambda: not math.isnan(wire.value(where)) and not shows(wire.value(where)), WAIT_S, f"{where} before")
    done = fail(world, name)
    assert done.result.code == OK, done.result.message
    wire.wait(FAILURES + leaf, 6.0)
    wait_until(lambda: shows(wire.value(where)), WAIT_S, f"{where} to show it")
    wait_for_label(world, name, set_by="bridge", active=True, confirmed=True, kinds="failed")
    assert world.wire.value(SURFACES) == 0.0, "no surface is concerned"
    assert call(world, "clear_failures", "ClearFailures", names=[name]).success
    wire.wait(FAILURES + leaf, 0.0)
    wait_for_label(world, name)
    wire.close()


@pytest.mark.parametrize(
    ("request_", "code", "text"),
    [
        ({"name": "engine_9"}, REFUSED, "engine_1 to engine_8"),
        ({"name": "aileron1_wing2_left", "kind": "bent"}, REFUSED, "expected stuck"),
        ({"name": "aileron1_wing2_left", "kind": "reduced", "value": 2.0}, REFUSED, "0..1"),
        ({"name": "aileron1_wing4_left", "kind": "stuck"}, REFUSED, "has not been seen to move"),
        ({"name": "engine_1", "trigger": 9}, REFUSED, "trigger is 9"),
        ({"name": "engine_1", "value": 0.5}, REFUSED, "value is 0.5: expected none"),
        ({"name": "engine_1", "trigger_value": 3000.0}, REFUSED, "trigger_value is 3000: expected 0"),
        ({"name": "aileron1_wing2_left", "kind": "gone"}, NOT_SUPPORTED, "X-Plane 11"),
        ({"name": "rel_no_such_thing"}, NOT_SUPPORTED, "rel_no_such_thing"),
    ],
)
def test_what_cannot_be_failed_is_said(healthy, request_, code, text):
    done = fail(healthy, **request_)
    assert (done.success, done.result.code) == (False, code), done.result.message
    assert text in done.result.message
    assert not healthy.state.last.names


def test_triggers(healthy):
    world, wire = healthy, healthy.wire
    began = world.state.wait_for_next().sim_time  # tx_node had come so far: a busy machine's may be behind X-Plane
    done = fail(world, "engine_1", trigger=AT_SIM_TIME, trigger_value=1.0)
    assert (done.success, done.result.code) == (True, ACCEPTED)
    asked = wire.value(TIME)
    assert fail(world, "bus_1", trigger=AT_ALTITUDE_ABOVE, trigger_value=9000.0).success
    assert fail(world, "battery_1", trigger=AT_SPEED_BELOW, trigger_value=300.0).success
    wait_for_label(world, "bus_1", active=False, confirmed=False)
    wait_for_label(world, "battery_1", active=True, confirmed=True)  # at once: the twin is slower than that
    wait_for_label(world, "engine_1", active=True, confirmed=True)
    some_frames = 0.2
    assert began <= label_of(world, "engine_1")["since_sim_time"] - 1.0 <= asked + some_frames
    wire.wait(ENGINE, 0.0)
    assert label_of(world, "bus_1")["active"] is False
    assert wire.value(BUS) > 0.0
    done = call(world, "clear_failures", "ClearFailures")
    assert sorted(done.cleared) == ["battery_1", "bus_1", "engine_1"]


def test_the_simulators_menu(healthy):
    world = healthy
    other = type(world).wire(world.xplane.port)  # as the menu does, past the bridge
    other.send(protocol.DrefWrite(FAILURES + "rel_genera0", 6.0))
    wait_for_label(world, "rel_genera0", set_by="simulator", active=True, confirmed=True)
    said(world, "rel_genera0 was failed in the simulator")
    done = call(world, "clear_failures", "ClearFailures")
    assert done.success
    assert not done.cleared
    assert label_of(world, "rel_genera0")
    assert call(world, "clear_failures", "ClearFailures", names=["rel_genera0"]).result.code == REFUSED
    assert call(world, "clear_failures", "ClearFailures", names=["engine_7"]).result.code == REFUSED
    done = call(world, "clear_failures", "ClearFailures", include_simulator=True)
    assert list(done.cleared) == ["rel_genera0"]
    other.wait_until_reads(FAILURES + "rel_genera0", 0.0)
    # What is failed there already can be taken over, under another name too; one dataref is one failure.
    other.send(protocol.DrefWrite(FAILURES + "rel_static", 6.0))
    wait_for_label(world, "rel_static", set_by="simulator")
    assert fail(world, "static_1").success
    wait_for_label(world, "static_1", set_by="bridge", confirmed=True)
    assert not label_of(world, "rel_static")
    refused = fail(world, "rel_static")
    assert (refused.success, refused.result.code) == (False, REFUSED)
    assert "broken already as static_1" in refused.result.message
    assert call(world, "clear_failures", "ClearFailures", names=["static_1"]).success
    # What the bridge has set can be repaired in the menu.
    assert fail(world, "generator_1").success
    other.send(protocol.DrefWrite(FAILURES + "rel_genera0", 0.0))
    said(world, "generator_1 was repaired in the simulator")
    wait_until(lambda: not label_of(world, "generator_1"), WAIT_S, "the label to go")


def test_xplane_12_breaks_its_surfaces_itself(new_world, tmp_path):
    world = fly(new_world(tmp_path), "--version", "12")
    wire, name = world.wire, "aileron1_wing2_left"
    locked, up = FAILURES + "rel_fcon_ailn_1_lft_lock", FAILURES + "rel_fcon_ailn_1_lft_mxup"
    fcon = WatchedDatarefs(world.xplane.port, locked, up, FAILURES + "rel_fcon_ailn_1_lft_gone")
    world.manual.fly(fields=ROLL, roll=0.3)
    wire.wait(STICK, 0.3)
    wait_until(lambda: follows(wire, LEFT), WAIT_S, "the stick")
    angle = wire.value(LEFT)
    done = fail(world, name, "stuck")
    assert done.result.code == OK, done.result.message
    assert fcon.value(locked) == 6.0
    assert wire.value(SURFACES) == 0.0
    assert not world.state.last.surrogate_mixing
    world.manual.fly(roll=-0.2)
    wait_until(lambda: wire.value(RIGHT) > 2.0 and follows(wire, RIGHT), WAIT_S, "the right aileron")
    assert wire.value(LEFT) == pytest.approx(angle, abs=0.2)
    wait_for_label(world, name, active=True, confirmed=True, kinds="stuck")
    # Another failure of the same surface takes the place of the first.
    assert fail(world, name, "hard_over_up").success
    wire.wait(LEFT, -25.0)
    assert (fcon.value(locked), fcon.value(up)) == (0.0, 6.0)
    # An angle of one's own is what X-Plane 12 cannot do: all surfaces are driven.
    assert fail(world, name, "stuck", 6.0).success
    wire.wait(LEFT, 6.0)
    assert (fcon.value(up), wire.value(SURFACES)) == (0.0, 1.0)
    assert call(world, "clear_failures", "ClearFailures").success
    wire.wait(SURFACES, 0.0)
    assert fail(world, name, "gone").success
    fcon.wait(FAILURES + "rel_fcon_ailn_1_lft_gone", 6.0)
    fcon.close()
    close(world)


def test_xplane_12_whose_own_failure_does_not_act(new_world, tmp_path):
    world = fly(new_world(tmp_path), "--version", "12", "--surface-failures", "ignored", stale_after=0.4)
    wire, name = world.wire, "aileron1_wing2_left"
    up = FAILURES + "rel_fcon_ailn_1_lft_mxup"
    fcon = WatchedDatarefs(world.xplane.port, up, TIME)
    answer = []
    asking = threading.Thread(target=lambda: answer.append(fail(world, name, "hard_over_up")))
    asking.start()
    # A gap, as X-Plane has them while it loads scenery, ends nothing.
    said_so = collected(fcon, (TIME, up), lambda _, value: value == 6.0, "X-Plane's own failure")[-1][0]
    world.events.skip_to_now()
    world.xplane.send_signal(signal.SIGSTOP)
    world.events.then_wait_for_event(lambda event: "STALE" in event.text)
    world.xplane.send_signal(signal.SIGCONT)
    asking.join(WAIT_S)
    assert answer[0].result.code == OK, answer[0].result.message
    wire.wait(LEFT, -25.0)
    assert wire.value(SURFACES) == 1.0
    fcon.wait(up, 0.0)
    said(world, "X-Plane's own failure does not act")
    wait_for_label(world, name, active=True, confirmed=True, kinds="hard_over_up")
    assert label_of(world, name)["since_sim_time"] > said_so, "not while X-Plane only said so"
    fcon.close()
    close(world)


def test_pause_restart_and_a_total_that_stands_still(new_world, tmp_path):
    world = fly(new_world(tmp_path), "--overridden-totals", "frozen")
    wire, name = world.wire, "aileron1_wing2_left"
    assert fail(world, name, "stuck", 3.0).success
    wire.wait(LEFT, 3.0)
    world.manual.fly(fields=ROLL, roll=-0.4)
    wait_until(
        lambda: wire.value(RIGHT) == pytest.approx(15.0 * 0.4, abs=1.0), WAIT_S, "the stick instead of the total"
    )

    pause(world, True)
    world.state.wait_for_next()
    world.state.wait_for_next()
    assert (wire.value(SURFACES), wire.value(LEFT)) == (1.0, 3.0)
    pause(world, False)
    world.manual.fly(roll=-0.2)
    wait_until(lambda: wire.value(RIGHT) == pytest.approx(15.0 * 0.2, abs=1.0), WAIT_S, "the right aileron to go on")
    wait_for_label(world, name, active=True, confirmed=True)

    # Another X-Plane has no failure; nothing is broken in it without being asked for, nor later.
    world.manual.stop()
    assert fail(world, "bus_1", trigger=AT_SIM_TIME, trigger_value=5.0).success
    wait_for_label(world, "bus_1", active=False)
    world.xplane.restart()
    said(world, f"failure of {name} has ended: X-Plane was restarted")
    again = WatchedDatarefs(world.xplane.port, SURFACES)
    again.wait(SURFACES, 0.0)
    wait_until(lambda: not world.state.last.names and not world.state.last.surrogate_mixing, WAIT_S, "an empty state")
    wait_until(lambda: "override:" + SURFACES not in journal_entries(world), WAIT_S, "the journal's entry to go")
    again.close()
    close(world)


def test_surfaces_of_another_aircraft_are_left_alone(new_world, tmp_path):
    from xplane_bridge.msg import ExcitationState

    world = fly(new_world(tmp_path))
    name = "aileron1_wing2_left"
    assert fail(world, name, "stuck", 5.0).success
    world.wire.wait(LEFT, 5.0)
    world.manual.fly(fields=ROLL, roll=0.0)
    world.wire.wait(STICK, 0.0)
    excitation = world.watch("excitation/state", ExcitationState)
    test_signal = {"kind": "chirp", "target": "roll", "amplitude": 0.05, "duration": 60.0}
    band = {"frequency_min": 0.5, "frequency_max": 1.0, "max_roll_deg": 180.0, "max_pitch_deg": 90.0}
    assert call(world, "inject_excitation", "InjectExcitation", **test_signal, **band).success
    type(world).wire(world.xplane.port).send(protocol.AircraftLoad(0, aircraft_path("tiltrotor")))
    said(world, f"failure of {name} has ended: another aircraft was loaded")
    ended = excitation.wait_for(lambda s: s.id == 1 and not s.active)
    assert ended.result in ("aborted: another aircraft was loaded", "aborted: the flight was reset")
    world.wire.wait(SURFACES, 0.0)
    wait_until(lambda: not world.state.last.names and not world.state.last.surrogate_mixing, WAIT_S, "an empty state")
    done = fail(world, name, "stuck", 5.0)
    assert (done.success, done.result.code) == (False, REFUSED)
    assert "config/aircraft/fixed_wing.yaml is for DA62" in done.result.message
    close(world)
