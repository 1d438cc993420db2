"""tx_node against X-Plane's stand-in: commands, modes, aircraft, services."""

from __future__ import annotations

import math
import signal
import threading

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    FLAPS,
    MANUAL,
    PITCH,
    ROLL,
    THROTTLE,
    YAW,
    CommandSource,
    WatchedDatarefs,
    call,
    journal_entries,
    pause,
)
from support.nodes.tx_node_fixtures import (
    FLAP_HANDLE,
    LEVER,
    OVERRIDE,
    STICK,
    THROTTLES,
    content_of,
    fixture_tx,  # noqa: F401
)
from xplane_bridge.constants import ResultCode
from xplane_bridge.harness import wait_until

OK, TIMEOUT = ResultCode.OK, ResultCode.TIMEOUT
MODE = 6  # of Event.kind
AXES = {OVERRIDE[: -len("roll")] + axis for axis in ("roll", "pitch", "heading")}
VERTICAL_OFFSET, HORIZONTAL_OFFSET = "field_of_view_vertical_deg", "field_of_view_horizontal_deg"
THROTTLE_OVERRIDE = "sim/flightmodel/engine/ENGN_thro_override[0]"


def request_mode(world, mode, sequence=1, requester="test"):
    import rospy
    from xplane_bridge.msg import ModeRequest

    publisher = rospy.Publisher(f"{world.namespace}/control/mode_request", ModeRequest, queue_size=10)
    wait_until(lambda: publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")
    publisher.publish(ModeRequest(mode=mode, sequence=sequence, requester=requester))


def set_view(world, **request):
    """Calls set_view; again where X-Plane has not shown in the second that it is given what it was asked for."""

    def shown():
        answer = call(world, "set_view", "SetView", **request)
        assert answer.result.code in (OK, TIMEOUT), answer.result.message
        return answer if answer.success else None

    return wait_until(shown, WAIT_S, f"the view {request}").result.message


def test_nothing_is_touched_before_the_first_command(tx, world):
    tx()
    world.wait_for_diagnostics("control", lambda s: s.level == 0 and "DA62" in world.values_of(s)["Aircraft loaded"])
    world.wire.wait(OVERRIDE, 0.0)
    assert not world.applied.messages
    assert not journal_entries(world)


def test_command_reaches_xplane_and_is_read_back(tx, world):
    tx()
    world.manual.fly(fields=ROLL | PITCH | YAW | THROTTLE, roll=0.25, pitch=-0.125, throttle=0.75)
    world.wire.wait(STICK, 0.25)
    world.wire.wait(LEVER, 0.75)
    assert world.wire.value(OVERRIDE) == 1.0
    assert world.wire.value(THROTTLES) == 0.0, "levers need no override"
    # One that follows a silence blends in.
    seen = world.applied.wait_for(lambda a: a.read_back and a.sequence > 0 and (a.roll, a.pitch) == (0.25, -0.125))
    assert seen.fields == ROLL | PITCH | YAW | THROTTLE
    assert seen.engine_count == 2
    assert seen.mode == seen.source == MANUAL
    assert 0.0 < seen.read_back_frames < 60.0
    again = [world.applied.wait_for_next(lambda a: a.read_back) for _ in range(10)]
    assert min(a.read_back_frames for a in again) > 0.0, "an unchanged command is not shown before it has arrived"
    assert seen.read_back_sim_time > 0.0
    assert "override:" + OVERRIDE in journal_entries(world)


def test_modes_are_switched_by_request_and_said(tx, world):
    tx()
    world.manual.fly(fields=ROLL, roll=0.125)
    world.auto.fly(fields=ROLL, roll=-0.25)
    world.wire.wait(STICK, 0.125)
    request_mode(world, AUTO, sequence=7)
    mode = world.mode.wait_for(lambda m: m.mode == AUTO)
    assert (mode.previous, mode.requested_by, mode.request_sequence, mode.accepted) == (MANUAL, "test", 7, True)
    world.wire.wait(STICK, -0.25)
    response = call(world, "set_mode", "SetMode", mode=MANUAL)
    assert response.success
    assert response.mode == MANUAL
    world.wire.wait(STICK, 0.125)


def test_auto_without_a_source_flies_the_failsafe(tx, world):
    tx()
    world.manual.fly(fields=ROLL | THROTTLE, roll=0.2, throttle=0.5)
    world.wire.wait(STICK, 0.2)
    request_mode(world, AUTO)
    world.wire.wait(STICK, 0.0)
    assert world.mode.wait_for(lambda m: m.mode == AUTO and m.failsafe).auto_alive is False
    assert world.wire.value(LEVER) == 0.5, "at idle it would glide down: it holds"
    assert world.applied.last.source == 3


def test_stick_takes_over(tx, world):
    tx(command_timeout=5.0)  # a stick that comes back from a silence does not take over
    world.manual.fly(fields=ROLL, roll=0.1)
    world.auto.fly(fields=ROLL, roll=-0.2)
    request_mode(world, AUTO)
    world.wire.wait(STICK, -0.2)
    world.mode.skip_to_now()
    world.manual.fly(roll=0.6)
    mode = world.mode.then_wait_for(lambda m: m.mode == MANUAL)
    assert mode.reason.startswith("stick take-over")

    def changes(log):  # a busy machine's source may be silent for long enough to be taken as failed
        return [event for event in log.events if event.kind == MODE and "failsafe" not in event.text]

    log = world.events.wait_for(lambda e: len(changes(e)) == 2)
    reported = [(e.text.split(":")[0], e.requested_by) for e in changes(log)]
    assert reported == [("AUTO", "test"), ("MANUAL", "control/manual")]
    world.wire.wait(STICK, 0.6)


def test_silent_stick_goes_to_its_failsafe(tx, world):
    tx()
    world.manual.fly(fields=ROLL, roll=0.4)
    world.wire.wait(STICK, 0.4)
    world.manual.stop()
    world.wire.wait(STICK, 0.0)
    assert world.mode.wait_for(lambda m: m.failsafe).reason == "timeout of control/manual"
    world.wait_for_diagnostics("control", lambda s: s.level == 1 and "failsafe" in s.message)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"fields": ROLL, "roll": math.nan}, "roll is nan"),
        ({"fields": ROLL | PITCH, "roll": 0.9, "pitch": 1.5}, "pitch is 1.5"),
        ({"fields": 1 << 20}, "0x100000"),
    ],
)
def test_refused_command_changes_nothing_and_is_named(tx, world, values, named):
    tx()
    world.auto.fly(fields=ROLL, roll=0.0)  # the other source's commands are judged as well
    world.manual.fly(fields=ROLL, roll=0.3)
    world.wire.wait(STICK, 0.3)
    other = CommandSource(world, "control/manual")
    other.fly(**values)  # again and again: with queues of one, each may be overtaken by one of the good ones
    status = world.wait_for_diagnostics(
        "control", lambda s: named in world.values_of(s).get("control/manual last refusal", "")
    )
    other.stop()
    assert int(world.values_of(status)["control/manual refused (-)"]) > 0
    assert all(a.roll <= 0.3 + 1e-6 for a in world.applied.messages)
    world.wire.wait(STICK, 0.3)


def test_pause_stops_the_timers(tx, world):
    tx(resume_grace=0.3, command_timeout=2.0)
    world.manual.fly(fields=ROLL, roll=0.4)
    world.wire.wait(STICK, 0.4)
    pause(world, True)
    world.manual.stop()
    world.applied.wait_for_count(200)  # four seconds of refreshes, twice the time-out
    assert not world.mode.last.failsafe
    world.mode.skip_to_now()
    pause(world, False)
    world.mode.then_wait_for(lambda m: m.failsafe)
    world.wire.wait(STICK, 0.0)


def test_another_aircraft_is_not_flown(tx, world):
    tx("--aircraft", "multirotor", aircraft="fixed_wing")
    world.manual.fly(fields=ROLL, roll=0.4)
    status = world.wait_for_diagnostics("control", lambda s: "QUAD" in s.message)
    assert "config/aircraft/fixed_wing.yaml is for DA62" in status.message
    assert "scripts/aircraft_config" in status.message
    assert not world.applied.messages
    assert world.wire.value(OVERRIDE) == 0.0


def test_motors_take_the_throttle_override_and_give_it_back(tx, world):
    tx("--aircraft", "multirotor", aircraft="multirotor")
    world.auto.fly(fields=32, engine_count=4, motors=[0.5] * 4 + [0.0] * 4)
    world.manual.fly(fields=THROTTLE, throttle=0.5)
    request_mode(world, AUTO)
    world.wire.wait(THROTTLES, 1.0)
    request_mode(world, MANUAL, sequence=2)
    world.wire.wait(THROTTLES, 0.0)
    wait_until(lambda: "override:" + THROTTLES not in journal_entries(world), WAIT_S, "the journal entry's end")


def test_axes_without_commands_stay_with_xplane(tx, world):
    tx("--auto-coordination")
    whole, heading = OVERRIDE[: -len("_roll")], OVERRIDE[: -len("roll")] + "heading"
    pedals = "sim/joystick/yoke_heading_ratio"
    wire = WatchedDatarefs(world.xplane.port, whole, heading, pedals)
    world.manual.fly(fields=ROLL | PITCH, roll=0.3, pitch=0.1)
    world.wire.wait(STICK, 0.3)
    wait_until(lambda: abs(wire.value(pedals)) > 1e-3, WAIT_S, "a rudder that follows the sideslip")
    assert wire.value(whole) == wire.value(heading) == 0.0
    assert set(journal_entries(world)) == {"override:" + path for path in AXES - {heading}}
    world.manual.fly(fields=ROLL | PITCH | YAW, yaw=-0.5)
    wire.wait(heading, 1.0)
    wire.wait(pedals, -0.5)
    wire.close()


def test_levers_are_where_the_motors_were_also_after_a_crash(tx, world):
    node = tx("--aircraft", "multirotor", aircraft="multirotor")
    world.manual.fly(fields=32, engine_count=4, motors=[0.55] * 4 + [0.0] * 4)
    world.wire.wait(THROTTLES, 1.0)
    wait_until(lambda: '"confirm": false' in journal_text(world), WAIT_S, "the levers in the journal")
    assert world.wire.value(LEVER) != pytest.approx(0.55, abs=1e-3), "theirs is the cockpit"
    node.send_signal(signal.SIGKILL)
    world.wire.wait(THROTTLES, 0.0)
    world.wire.wait(LEVER, 0.55, tolerance=0.02)


def journal_text(world):
    """The journals as they are."""
    return "".join(content_of(file).decode() for file in (world.folder / "ros_home" / "xplane_bridge").glob("*.json"))


def test_handles_are_sent_on_change_only(tx, world):
    tx()
    world.manual.fly(fields=ROLL | FLAPS, flaps=0.5)
    world.wire.wait(FLAP_HANDLE, 0.5, tolerance=0.02)
    world.applied.wait_for_count(50)
    response = call(world, "set_dataref", "SetDataref", name=FLAP_HANDLE, values=[0.0])
    assert response.success, response.result.message
    world.applied.wait_for_count(50)
    assert world.wire.value(FLAP_HANDLE) == pytest.approx(0.0, abs=0.02), "moved in the cockpit, it stays moved"
    world.manual.fly(flaps=1.0)
    world.wire.wait(FLAP_HANDLE, 1.0, tolerance=0.02)


def restart_and_see_flown_on(world):
    """The new X-Plane is commanded as the one before: roll 0.3, flaps 0.5."""
    world.xplane.restart()
    wire = WatchedDatarefs(world.xplane.port, OVERRIDE, STICK, FLAP_HANDLE)
    wire.wait(OVERRIDE, 1.0, timeout=WAIT_S)
    wire.wait(STICK, 0.3)
    wire.wait(FLAP_HANDLE, 0.5, tolerance=0.02)
    wire.close()


def test_restarted_xplane_is_flown_on_by_the_stick(tx, world):
    tx()
    world.manual.fly(fields=ROLL | FLAPS, roll=0.3, flaps=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    world.wire.wait(FLAP_HANDLE, 0.5, tolerance=0.02)
    restart_and_see_flown_on(world)


def test_restarted_xplane_is_not_flown_by_auto_until_it_is_asked_for(tx, world):
    tx()
    world.auto.fly(fields=ROLL, roll=0.3)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.wire.wait(STICK, 0.3)
    world.events.skip_to_now()
    world.xplane.restart()
    reported = world.events.then_wait_for(
        lambda e: any("AUTO is off until" in event.text for event in e.events), WAIT_S
    )
    assert any(e.kind == MODE and e.text.startswith("MANUAL: X-Plane was restarted") for e in reported.events)
    wait_until(lambda: world.mode.last.mode == MANUAL, WAIT_S, "the mode that the event names")
    wire = WatchedDatarefs(world.xplane.port, OVERRIDE, STICK)
    world.wait_for_diagnostics("control", lambda s: world.values_of(s)["Overrides set"] == "none")
    wire.wait(OVERRIDE, 0.0)
    assert world.mode.last.reason.startswith("X-Plane was restarted"), "not `start`"
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    wire.wait(STICK, 0.3)
    wire.close()


def test_restarted_xplane_is_flown_on_by_auto_where_that_is_asked_for(tx, world):
    tx(resume_auto=True)
    world.auto.fly(fields=ROLL | FLAPS, roll=0.3, flaps=0.5)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.wire.wait(STICK, 0.3)
    restart_and_see_flown_on(world)
    assert world.mode.last.mode == AUTO


def test_a_failsafe_is_an_event_and_a_warning(tx, world):
    node = tx()
    world.auto.fly(fields=ROLL, roll=0.3)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.wire.wait(STICK, 0.3)
    world.events.skip_to_now()
    world.auto.stop()
    begun = world.events.then_wait_for_event(lambda event: event.text == "AUTO: failsafe: timeout of control/auto")
    assert begun.kind == MODE
    world.auto.fly(roll=0.2)
    world.events.then_wait_for_event(lambda event: event.text == "AUTO: the failsafe ends: control/auto is back")

    def warned():
        return sum("failsafe" in line and "WARN" in line for line in node.output().splitlines())

    def failsafes():  # two, and two more whenever a busy machine's source is silent for too long
        return sum("failsafe" in event.text for event in world.events.last.events)

    wait_until(lambda: warned() == failsafes() >= 2, WAIT_S, "a warning for each event")


def test_restarted_xplane_is_left_alone_without_commands(tx, world):
    tx()
    world.manual.fly(fields=ROLL, roll=0.3)
    world.wire.wait(OVERRIDE, 1.0)
    world.manual.stop()
    world.mode.wait_for(lambda m: m.failsafe)  # X-Plane may be back before the last command has timed out
    world.events.skip_to_now()
    world.xplane.restart()
    world.events.then_wait_for_event(lambda event: "CONNECTED" in event.text)
    wire = WatchedDatarefs(world.xplane.port, OVERRIDE)
    world.wait_for_diagnostics("control", lambda s: world.values_of(s)["Overrides set"] == "none")
    wire.wait(OVERRIDE, 0.0)
    wire.close()


def test_x_plane_12_takes_commands_view_and_pause(tx, world):
    tx("--version", "12")
    down, rear, view = (f"sim/graphics/view/{leaf}" for leaf in (VERTICAL_OFFSET, HORIZONTAL_OFFSET, "view_type"))
    other = WatchedDatarefs(
        world.xplane.port, down, rear, view, "sim/time/paused", "sim/cockpit2/controls/flap_handle_request_ratio"
    )
    world.manual.fly(fields=ROLL | PITCH | THROTTLE | FLAPS, roll=0.25, pitch=-0.125, throttle=0.75, flaps=0.5)
    world.wire.wait(STICK, 0.25)
    world.wire.wait(LEVER, 0.75)
    other.wait("sim/cockpit2/controls/flap_handle_request_ratio", 0.5)
    assert world.applied.wait_for(lambda a: a.read_back and a.sequence > 0).flaps == 0.5
    set_view(world, view=3)
    other.wait(down, -90.0)
    other.wait(view, 1024.0)
    assert "view:camera" in journal_entries(world)
    said = set_view(world, view=5, heading_deg=30.0, pitch_deg=-45.0, roll_deg=10.0)
    assert "heading 30.0, pitch -45.0, roll 10.0 deg" in said
    set_view(world, view=4, field_of_view_deg=75.0)
    other.wait(view, 1026.0)
    for paused in (True, False):
        pause(world, paused)
        other.wait("sim/time/paused", float(paused))
    other.close()


def test_view_is_given_back(tx, world):
    node = tx()
    paths = [f"sim/graphics/view/{leaf}" for leaf in (VERTICAL_OFFSET, "view_type", "field_of_view_deg")]
    wire = WatchedDatarefs(world.xplane.port, *paths)
    set_view(world, view=3, field_of_view_deg=80.0)
    for path, value in zip(paths, (-90.0, 1024.0, 80.0)):
        wire.wait(path, value)
    node.send_signal(signal.SIGINT)
    for path, value in zip(paths, (0.0, 1000.0, 60.0)):
        wire.wait(path, value)
    node.wait(WAIT_S)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    wire.close()


def test_override_set_by_service_is_given_back(tx, world):
    node = tx()
    response = call(world, "set_dataref", "SetDataref", name=THROTTLES, values=[1.0])
    assert response.success
    assert list(response.values) == [1.0]
    assert "override:" + THROTTLES in journal_entries(world)
    # One that is not 1: it is kept up as it was given.
    assert call(world, "set_dataref", "SetDataref", name=THROTTLE_OVERRIDE, values=[0.25]).success
    wire = WatchedDatarefs(world.xplane.port, THROTTLE_OVERRIDE)
    seen = []

    def enough():  # frames, of more than a refresh
        seen.extend(wire.history(THROTTLE_OVERRIDE))
        return len(seen) >= 60

    wait_until(enough, WAIT_S, "60 frames")
    assert set(seen) == {0.25}
    node.send_signal(signal.SIGINT)
    world.wire.wait(THROTTLES, 0.0)
    wire.wait(THROTTLE_OVERRIDE, -2.0)
    wire.close()


def test_a_mode_does_not_wait_for_other_services(tx, world):
    tx()
    last = LEVER.replace("[0]", "[7]")
    wire = WatchedDatarefs(world.xplane.port, last)
    answers = []
    # X-Plane has no ninth lever, so tx_node waits to the end for what it is to show.
    waiting = threading.Thread(
        target=lambda: answers.append(call(world, "set_dataref", "SetDataref", name=last, values=[0.5, 0.5]))
    )
    waiting.start()
    wire.wait(last, 0.5)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    assert not answers, "set_dataref still waits"
    assert world.mode.wait_for(lambda mode: mode.mode == AUTO)
    waiting.join()
    assert not answers[0].success
    wire.close()


def test_services_say_what_is_wrong(tx, world):
    tx(service_timeout=0.5)
    refused = call(world, "set_dataref", "SetDataref", name="nonsense", values=[1.0])
    assert (refused.success, refused.result.code) == (False, 2)
    assert "nonsense" in refused.result.message
    silent = call(world, "set_dataref", "SetDataref", name="sim/no/such/dataref", values=[1.0])
    assert (silent.success, silent.result.code) == (False, 5)
    assert call(world, "set_view", "SetView", view=9).result.code == 2
    set_view(world, view=3)
    assert call(world, "run_command", "RunCommand", name="sim/operation/pause_toggle").result.code == 1
    assert call(world, "set_mode", "SetMode", mode=5).result.code == 2


def test_aircraft_file_is_required(world):
    node = world.start("tx_node", {"rate": 50.0})
    assert node.wait(WAIT_S) == 1
    assert "tx_node/aircraft is missing" in node.output()
