"""However tx_node ends, hangs or is killed: what it holds in X-Plane is released."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from pathlib import Path

import pytest

from support import process_tree
from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    FLAPS,
    MANUAL,
    ROLL,
    CommandSource,
    WatchedDatarefs,
    call,
    journal_entries,
    tx_params,
)
from support.nodes.tx_node_fixtures import (
    LEVER,
    OVERRIDE,
    STICK,
    THROTTLES,
    content_of,
    fixture_tx,  # noqa: F401
    has,
)
from xplane_bridge import protocol
from xplane_bridge.harness import ManagedProcess, wait_until

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, "rosnode kill"])
def test_overrides_are_released_however_it_ends(tx, world, end):
    node = tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    if end == "rosnode kill":
        kill = ManagedProcess("kill", ["rosnode", "kill", f"{world.namespace}/tx_node"], world.folder, env=world.env)
        kill.start()
        assert kill.wait(WAIT_S) == 0, kill.output()
    else:
        node.send_signal(end)
    world.wire.wait(OVERRIDE, 0.0)
    code = node.wait(WAIT_S)
    if end != signal.SIGKILL:
        assert code == 0
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")


def test_a_guardian_that_is_killed_is_started_again(tx, world):
    from diagnostic_msgs.msg import DiagnosticArray

    node = tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)

    def guardians():
        found = process_tree.named(process_tree.descendants(node.pid), "override_guard")
        return [pid for pid in found if process_tree.alive(pid)]

    # A single message says that it was started again: it must find this subscriber there.
    heard = world.watch("/diagnostics", DiagnosticArray)
    world.wait_for_diagnostics("guardian", lambda status: "runs" in status.message, heard=heard)
    (first,) = guardians()
    os.kill(first, signal.SIGKILL)
    world.wait_for_diagnostics("guardian", lambda status: "started again" in status.message, heard=heard)
    assert guardians() not in ([], [first])
    assert "its guardian process had ended" in node.output()
    node.send_signal(signal.SIGKILL)
    world.wire.wait(OVERRIDE, 0.0)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")


def test_overrides_are_released_on_ctrl_c_of_roslaunch(world):
    world.xplane = world.emulator("--no-beacon", "--start", "air")
    wire = WatchedDatarefs(world.xplane.port, OVERRIDE)
    args = {"ns": world.namespace.lstrip("/"), "host": "127.0.0.1", "port": world.xplane.port, "required": "true"}
    assignments = [f"{key}:={value}" for key, value in {**args, "listen_for_beacon": "false"}.items()]
    command = ["roslaunch", "--wait", "xplane_bridge", "tx.launch", *assignments]
    launch = ManagedProcess("roslaunch", command, world.folder, env=world.env)
    launch.start()
    manual = CommandSource(world, "control/manual")
    manual.fly(fields=ROLL, roll=0.5)
    wire.wait(OVERRIDE, 1.0, timeout=WAIT_S)
    launch.send_signal(signal.SIGINT)
    wire.wait(OVERRIDE, 0.0)
    assert launch.wait(WAIT_S) == 0, launch.output()
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    manual.stop()
    wire.close()


def test_killed_together_with_its_guardian_the_next_start_releases(tx, world):
    node = tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    world.manual.stop()
    (guardian,) = guardians_of(node)
    os.kill(guardian, signal.SIGKILL)
    node.send_signal(signal.SIGKILL)
    node.wait(WAIT_S)
    assert world.wire.value(OVERRIDE) == 1.0
    assert journal_entries(world)
    world.start("tx_node", world.params)
    world.wire.wait(OVERRIDE, 0.0)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    world.events.wait_for(lambda e: has(e, "released override_joystick_roll left by a run that crashed"))


def test_a_second_bridge_learns_whose_the_stick_is(tx, world, new_world):
    tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    second = new_world(world.folder)
    second.point_to(world.xplane.port)
    second.set_param("aircraft", "fixed_wing")
    node = second.start("tx_node", tx_params())
    stick = CommandSource(second, "control/manual")
    stick.fly(fields=ROLL, roll=-0.5)
    wait_until(
        lambda: "commands are not sent: another bridge is at this X-Plane" in node.output(), WAIT_S, "the warning"
    )
    assert f"belongs to {world.namespace}/tx_node" in node.output()
    stick.stop()
    second.close()
    assert "crash" not in node.output()
    assert world.wire.value(OVERRIDE) == 1.0


def test_xplane_that_went_first_is_no_crash(tx, world):
    node = tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    world.manual.stop()
    world.xplane.kill()
    world.events.wait_for(lambda e: has(e, "STALE"))
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    assert "override_joystick_roll could not be released, because X-Plane went first, or is silent" in node.output()
    wait_until(lambda: not guardians_of(node), WAIT_S, "the end of its guardian")
    assert journal_entries(world), "it may only have been silent"
    world.xplane.restart()
    again = world.start("tx_node", world.params)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    world.events.wait_for(lambda e: has(e, "released override_joystick_roll left because X-Plane went first"))
    again.stop()
    assert "crash" not in node.output() + again.output()


def guardians_of(node):
    """The processes that watch over a node."""
    mark = f"override_guardian\0{node.pid}\0".encode()
    return [int(path.parent.name) for path in Path("/proc").glob("[0-9]*/cmdline") if mark in content_of(path)]


def test_a_node_that_hangs_is_relieved_and_flies_again_only_on_request(tx, world):
    node = tx(hang_timeout=1.0)
    world.auto.fly(fields=ROLL, roll=0.5)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.wire.wait(OVERRIDE, 1.0)
    node.send_signal(signal.SIGSTOP)
    world.wire.wait(OVERRIDE, 0.0)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    assert "has not run for 1.0 s: giving back what it has set" in node.output()
    world.mode.skip_to_now()
    world.wire.history(OVERRIDE)
    node.send_signal(signal.SIGCONT)  # commands that have come meanwhile are the first that it reads
    said = world.mode.then_wait_for(lambda m: "hung" in m.reason)
    assert said.mode == MANUAL
    for _ in range(2):  # longer than overrides take to be sent again, with commands coming all the time
        status = world.wait_for_diagnostics("control", lambda s: "ask for a mode" in s.message)
        assert world.values_of(status)["Overrides set"] == "none"
    assert set(world.wire.history(OVERRIDE)) == {0.0}
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.wire.wait(OVERRIDE, 1.0)
    world.wire.wait(STICK, 0.5)


def test_a_busy_computer_is_no_hang(tx, world):
    node = tx(hang_timeout=1.0)
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    loops = [ManagedProcess(f"busy{i}", [sys.executable, "-c", "while True: pass"], world.folder) for i in range(2)]
    for loop in loops:
        loop.start()
    for _ in range(4):  # diagnostics come once a second
        world.wait_for_diagnostics("control")
    for loop in loops:
        loop.kill()
    assert world.wire.value(OVERRIDE) == 1.0
    assert "has not run" not in node.output()


def test_killed_in_the_middle_of_a_reset_it_leaves_xplane_running(tx, world):
    node = tx("--version", "12")
    paused = "sim/time/paused"
    wire = WatchedDatarefs(world.xplane.port, paused)
    # X-Plane never shows such a height, so tx_node still waits for it, with X-Plane paused, when it is killed.
    place = {"latitude": 47.5, "longitude": 8.5, "altitude_msl": -400.0, "true_airspeed": 60.0}
    assert call(world, "reset_flight", "ResetFlight", **place).success
    wire.wait(paused, 1.0)
    node.send_signal(signal.SIGKILL)
    wire.wait(paused, 0.0)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    wire.close()


def test_release_overrides_resumes_what_was_left_paused(world):
    world.xplane = world.emulator("--no-beacon", "--start", "air")
    paused, lever = "sim/time/paused", LEVER
    wire = WatchedDatarefs(world.xplane.port, paused, lever, THROTTLES)
    type(world).wire(world.xplane.port).send(
        protocol.CommandRequest("sim/operation/pause_toggle"), protocol.DrefWrite(THROTTLES, 1.0)
    )
    wire.wait(paused, 1.0)
    motors = [{"op": "dref", "path": lever, "value": 0.625, "confirm": False}]
    motors.append({"op": "dref", "path": THROTTLES, "value": 0.0})
    left_by_a_crash(world, {"override:" + THROTTLES: ("override", motors), "pause:x": ("pause", [{"op": "resume"}])})
    release_overrides(world)
    wire.wait(paused, 0.0)
    wire.wait(lever, 0.625)
    assert not journal_entries(world)
    wire.close()


def left_by_a_crash(world, entries):
    """A journal with these entries, id: purpose and operations, of a process that is gone."""
    folder = world.folder / "ros_home" / "xplane_bridge"
    folder.mkdir(parents=True)
    process = {"pid": 1, "start_ticks": 1, "boot_id": "another boot", "computer": socket.gethostname()}
    owner = {"node": "/crashed", **process}
    listed = [{"id": i, "purpose": purpose, "owner": owner, "undo": undo} for i, (purpose, undo) in entries.items()]
    text = json.dumps({"format": "xplane_bridge journal", "version": 1, "entries": listed})
    (folder / f"127.0.0.1_{world.xplane.port}.json").write_text(text, encoding="utf-8")


def test_what_a_crash_left_and_xplane_does_not_know_is_said_once(world):
    from xplane_bridge.msg import EventList

    world.xplane = world.emulator("--no-beacon", "--start", "air")
    undo = [{"op": "dref", "path": "sim/operation/failures/rel_of_another_version", "value": 0.0}]
    entry = "override:rel_of_another_version"
    left_by_a_crash(world, {entry: ("override", undo)})
    events = world.watch("events", EventList)
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", 5.0)  # of an X-Plane that is silent for a moment it is not said
    world.start("tx_node", tx_params())
    events.wait_for(lambda e: has(e, "could not be seen released"))
    for _ in range(4):  # seconds, in which it is tried again
        world.wait_for_diagnostics("control")
    assert sum("could not be seen released" in event.text for event in events.last.events) == 1
    assert journal_entries(world) == [entry]


def release_overrides(world):
    """Runs the panic tool; again, as it says, where X-Plane has not answered within its two seconds."""

    def done():
        panic = ManagedProcess(
            "release", ["/usr/bin/python3", ROOT / "scripts" / "release_overrides"], world.folder, env=world.env
        )
        panic.start()
        code = panic.wait(WAIT_S)
        assert code == 0 or "X-Plane does not show it" in panic.output(), panic.output()
        return code == 0

    wait_until(done, WAIT_S, "a release that X-Plane shows")


def test_release_overrides_frees_what_a_crash_left(tx, world):
    node = tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    world.manual.stop()
    node.send_signal(signal.SIGSTOP)  # it hangs: no process ends, nothing releases by itself
    release_overrides(world)
    world.wire.wait(OVERRIDE, 0.0)
    assert not journal_entries(world)
    node.send_signal(signal.SIGKILL)


def test_release_overrides_stops_a_node_that_flies_until_a_mode_is_asked_for(tx, world):
    tx()
    world.manual.fly(fields=ROLL | FLAPS, roll=0.5, flaps=0.0)
    world.wire.wait(OVERRIDE, 1.0)
    # Shown as set for a while, as it is when a user panics.
    world.wait_for_diagnostics("control", lambda s: world.values_of(s)["Overrides set"] == "override_joystick_roll")
    release_overrides(world)
    world.events.wait_for(lambda e: has(e, "override_joystick_roll was released by another client"))
    reported = world.events.then_wait_for_event(lambda event: "nothing is sent any more" in event.text)
    assert "ask for a mode" in reported.text
    world.wait_for_diagnostics("control", lambda s: s.level == 1)  # by then what was under way has come
    count = len(world.applied.messages)
    for _ in range(2):  # longer than overrides take to be sent again, with commands coming all the time
        status = world.wait_for_diagnostics("control", lambda s: s.level == 1)
        assert "another client has released" in status.message
    assert world.wire.value(OVERRIDE) == 0.0
    assert not journal_entries(world)
    assert len(world.applied.messages) == count
    assert call(world, "set_mode", "SetMode", mode=MANUAL).success
    world.wire.wait(OVERRIDE, 1.0)
    world.wire.wait(STICK, 0.5)
    assert "override:" + OVERRIDE in journal_entries(world)


def test_what_x_plane_releases_with_a_new_flight_is_taken_again(tx, world):
    tx()
    world.manual.fly(fields=ROLL, roll=0.5)
    world.wire.wait(OVERRIDE, 1.0)
    world.wait_for_diagnostics("control", lambda s: world.values_of(s)["Overrides set"] == "override_joystick_roll")
    other = type(world).wire(world.xplane.port)
    world.events.skip_to_now()
    other.send(protocol.CommandRequest("sim/operation/reset_flight"), protocol.DrefWrite(OVERRIDE, 0.0))
    world.events.then_wait_for_event(lambda event: event.text == "the flight began anew")
    for _ in range(2):  # longer than it takes to see who has released it; 0 may be shown for one frame only
        status = world.wait_for_diagnostics("control")
        assert world.values_of(status)["Overrides set"] == "override_joystick_roll", status.message
    world.wire.wait(OVERRIDE, 1.0)
    assert "override:" + OVERRIDE in journal_entries(world)
    world.manual.fly(roll=0.25)
    world.wire.wait(STICK, 0.25)
