"""rx_node survives whatever X-Plane does, and leaves X-Plane's settings as they were."""

from __future__ import annotations

import json
import signal
import sys
import xmlrpc.client

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.rx_fixtures import (
    ALL_VALID,
    KINEMATIC,
    both_transports,
    fixture_rx,  # noqa: F401
    fixture_transport,  # noqa: F401
)
from xplane_bridge import protocol
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.resources import program

#: Start type of PREL: the flight before, which is that of the emulator's options where there has been none.
THE_LAST_FLIGHT = 5


def wait_for_link(world, name):
    """Waits for a state of the link, by name, after the one waited for last; returns the message."""
    return world.links.then_wait_for(lambda link: link.state_name == name, WAIT_S, f"link state {name}")


# --- whatever X-Plane does --------------------------------------------------------------------------------------------


def rx_before_emulator(world, rx, *options):
    """Starts an emulator whose options count from its start, once rx_node looks for it; gives it."""
    port = free_udp_port()
    world.point_to(port)
    rx()
    link = wait_for_link(world, "SEARCHING")
    assert link.reason
    assert not world.states.messages
    return world.emulator(*options, port=port)


@both_transports
def test_bridge_first(world, rx):
    rx_before_emulator(world, rx, *KINEMATIC)
    wait_for_link(world, "CONNECTED")
    world.states.wait_for(lambda state: state.valid == ALL_VALID)


def test_search_in_vain_is_said_on_the_console_in_link_state_and_in_diagnostics(world, rx):
    port = free_udp_port()
    world.point_to(port)
    node = rx()
    node.wait_for_line(rf"looking for X-Plane at 127\.0\.0\.1:{port}", WAIT_S)
    # Nothing listens there, and this computer's kernel says so.
    sentence = f"no answer from 127.0.0.1:{port}: that computer is there, but nothing listens on the port"
    world.links.wait_for(lambda link: link.state_name == "SEARCHING" and link.reason.startswith(sentence))
    node.wait_for_line(rf"WARN.*{sentence}", WAIT_S)
    status = world.wait_for_diagnostics("link to X-Plane", lambda status: sentence in status.message)
    assert status.message.count(sentence) == 1, status.message
    assert node.output().count(sentence) == 1


@both_transports
def test_no_flight_loaded_yet(world, rx):
    emulator = rx_before_emulator(world, rx, *KINEMATIC, "--load-time", 3600)
    world.wait_for_diagnostics("flight state", lambda s: "no flight is loaded" in s.message)
    assert not world.states.messages
    world.wire(emulator.port).send(protocol.Placement(THE_LAST_FLIGHT))
    state = world.states.wait_for(timeout=WAIT_S)
    assert state.valid == ALL_VALID
    assert state.altitude_msl > 100.0


@both_transports
def test_x_plane_killed_and_restarted(world, rx):
    # A restart differs from a gap by simulator time that runs anew, however late it is seen.
    emulator = world.emulator(*KINEMATIC, "--sim-time-start", 1000)
    rx()
    before = world.states.wait_for(timeout=WAIT_S)
    epoch = wait_for_link(world, "CONNECTED").link_epoch
    emulator.kill()
    world.states.skip_to_now()
    wait_for_link(world, "STALE")
    world.emulator(*KINEMATIC, port=emulator.port)
    world.links.then_wait_for(lambda link: link.state_name == "CONNECTED" and link.link_epoch > epoch, WAIT_S)
    after = world.states.then_wait_for(lambda state: state.valid == ALL_VALID and state.sim_time < before.sim_time)
    assert after.epoch > before.epoch
    world.states.wait_for_count(20)


def test_lost_when_silent_for_long(world, rx):
    world.set_param("lost_after", 1.0)
    emulator = world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for()
    emulator.kill()
    link = wait_for_link(world, "LOST")
    assert link.silence >= 1.0
    assert wait_for_link(world, "LOST").silence > link.silence, "each second meanwhile"
    world.wait_for_diagnostics("link to X-Plane", lambda s: s.level == 2 and "LOST" in s.message)
    for name in ("clock", "position"):  # no more what they were
        assert world.wait_for_diagnostics(name, lambda s: s.level == 1).message == "not connected"


def test_found_by_beacon_and_again_on_another_port(world, rx):
    beacon_port = free_udp_port()
    world.set_param("beacon_port", beacon_port)

    def x_plane(name):
        command = [sys.executable, program("xplane_emulator"), *KINEMATIC, "--bind", "127.0.0.1", "--port", "0"]
        command += ["--beacon-target", f"239.255.1.1:{beacon_port}"]
        process = ManagedProcess(name, command, world.folder, env=world.env)
        process.start()
        ready = process.wait_for_line(r"^READY (\{.*\})", 60.0).group(1)
        return process, json.loads(ready)["port"]

    first, first_port = x_plane("first")
    try:
        rx()
        assert wait_for_link(world, "CONNECTED").port == first_port
        world.states.wait_for()
        first.kill()
        wait_for_link(world, "LOST")
    finally:
        first.stop()
    second, second_port = x_plane("second")
    try:
        link = world.links.then_wait_for(lambda m: m.state_name == "CONNECTED" and m.port == second_port, WAIT_S)
        assert link.host == "127.0.0.1"
        world.states.wait_for_next(timeout=WAIT_S)
    finally:
        second.stop()


@both_transports
def test_pause_and_resume(world, rx):
    emulator = world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for_count(20)
    wire = world.wire(emulator.port)
    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_link(world, "PAUSED")
    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_link(world, "CONNECTED")
    states = world.states.wait_for_count(20)
    assert not states[-1].paused
    stamps = [state.header.stamp.to_sec() for state in world.states.messages]
    assert np.all(np.diff(stamps) > 0)


def test_another_aircraft_is_reported_and_starts_an_epoch(world, rx):
    emulator = world.emulator()
    rx()
    link = world.links.wait_for(lambda m: m.aircraft_icao)
    before = world.states.wait_for()
    world.wire(emulator.port).send(protocol.AircraftLoad(0, "Aircraft/xplane_bridge/multirotor/multirotor.acf"))
    other = world.links.then_wait_for(lambda m: m.aircraft_icao not in ("", link.aircraft_icao), WAIT_S)
    assert other.aircraft_description != link.aircraft_description
    world.states.wait_for_next(lambda state: state.epoch > before.epoch, WAIT_S)


@both_transports
def test_gap_of_seconds_is_survived(world, rx):
    rx_before_emulator(world, rx, *KINEMATIC, "--fault", "freeze=2s@8")
    wait_for_link(world, "STALE")
    wait_for_link(world, "CONNECTED")
    state = world.states.wait_for_next(lambda s: s.valid == ALL_VALID)
    stamps = [s.header.stamp.to_sec() for s in world.states.messages if s.epoch == state.epoch]
    assert np.all(np.diff(stamps) > 0)


@both_transports
def test_bad_network(world, rx):
    world.emulator(*KINEMATIC, "--fault", "drop=0.05,dup=0.05,reorder=0.05,truncate=0.02,jitter=5ms")
    rx()
    states = world.states.wait_for_count(300, 60.0)
    stamps = [state.header.stamp.to_sec() for state in states]
    assert np.all(np.diff(stamps) > 0)
    assert {state.epoch for state in states} == {states[0].epoch}
    counts = [state.frame_count for state in states]
    assert counts == sorted(set(counts))


# --- leaving everything as it was -------------------------------------------------------------------------------------


ROW_3 = "sim/network/dataout/data_to_internet[3]"
ROW_21 = "sim/network/dataout/data_to_internet[21]"
ROW_133 = "sim/network/dataout/data_to_internet[133]"
RATE = "sim/network/dataout/network_data_rate"


@pytest.fixture
def users_data_output(world):
    """An X-Plane whose user has selected rows 3 and 133 at 33 Hz."""
    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    emulator = world.emulator(*KINEMATIC)
    wire = world.wire(emulator.port)
    wire.send(protocol.RowSelection("DSEL", (3, 133)), protocol.DrefWrite(RATE, 33.0))
    wire.wait_until_reads(RATE, 33.0)
    wire.wait_until_reads(ROW_133, 1.0)
    return wire


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "rosnode kill"])
def test_data_output_is_restored_at_the_end(world, rx, users_data_output, how):
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 1.0
    assert users_data_output.read(RATE) == 99.0
    if how == "rosnode kill":
        with xmlrpc.client.ServerProxy(world.master.uri) as master:
            uri = master.lookupNode("/tests", f"{world.namespace}/rx_node")[2]
        with xmlrpc.client.ServerProxy(uri) as slave:
            slave.shutdown("/tests", "user request")
    else:
        node.send_signal(getattr(signal, how))
    assert node.wait(WAIT_S) == 0
    # At once, not in the end: it was read back before the process ended.
    assert users_data_output.read(RATE) == 33.0
    assert users_data_output.read(ROW_3) == 1.0
    assert users_data_output.read(ROW_133) == 1.0
    assert users_data_output.read(ROW_21) == 0.0
    last = wait_for_link(world, "LOST")
    assert last.reason == "rx_node has stopped"
    assert not list(world.folder.glob("ros_home/xplane_bridge/*.json"))


def test_data_output_is_restored_at_the_next_start_after_a_crash(world, rx, users_data_output):
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 1.0
    node.kill()
    assert users_data_output.read(ROW_21) == 1.0
    world.set_param("transport", "rref")
    rx()
    users_data_output.wait_until_reads(ROW_21, 0.0)
    users_data_output.wait_until_reads(RATE, 33.0)
    assert users_data_output.read(ROW_3) == 1.0


def test_nothing_is_touched_with_rref(world, rx, users_data_output):
    world.set_param("transport", "rref")
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 0.0
    assert users_data_output.read(RATE) == 33.0
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0


def test_nothing_is_configured_when_the_user_has_done_it(world, rx, users_data_output):
    port = free_udp_port()
    world.set_param("data_port", port)
    users_data_output.send(
        protocol.NetworkTarget(64, "127.0.0.1", port, True),
        protocol.RowSelection("DSEL", (1, 16, 17, 20, 21)),
    )
    users_data_output.wait_until_reads(ROW_21, 1.0)
    node = rx(configure_xplane=False)
    state = world.states.wait_for()
    assert state.valid != ALL_VALID
    assert state.latitude == pytest.approx(37.46, abs=0.5)
    assert users_data_output.read(RATE) == 33.0
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    assert users_data_output.read(ROW_21) == 1.0
