"""What the link leaves in X-Plane, and an X-Plane that sends but does not answer."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.resources import config_file

KINEMATIC = ("--model", "kinematic")
RATES, ATTITUDE, POSITION = 1 << 6, 1 << 4, 1 << 1
RELEASE = Path(__file__).resolve().parents[3] / "scripts" / "release_overrides"


def subscribed(xplane):
    """How many subscriptions X-Plane has, by `address:port` of the client."""
    return xplane.status()["subscriptions"]


@pytest.fixture
def killed_node(world):
    """An rx_node that was killed in the middle of its work; gives X-Plane and what it goes on sending."""
    from xplane_bridge.msg import FlightState

    xplane = world.emulator(*KINEMATIC)
    states = world.watch("flight_state", FlightState)
    node = world.start("rx_node")
    states.wait_for()
    wait_until(lambda: sum(subscribed(xplane).values()) > 300, WAIT_S, "all groups to be asked for")
    node.kill()
    left = subscribed(xplane)
    assert sum(left.values()) > 300, "X-Plane does not know that the node is gone"
    return xplane, left


def test_next_start_ends_what_a_killed_node_has_subscribed(world, killed_node):
    from xplane_bridge.msg import FlightState

    xplane, left = killed_node
    states = world.watch("flight_state", FlightState)
    node = world.start("rx_node")
    states.wait_for()
    wait_until(lambda: not set(left) & set(subscribed(xplane)), WAIT_S, "the dead node's subscriptions to end")
    journal = next((world.folder / "ros_home" / "xplane_bridge").glob("*.json"))
    wait_until(lambda: len(json.loads(journal.read_text())["entries"]) == 1, WAIT_S, "the dead node's entry to go")
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    wait_until(lambda: not subscribed(xplane), WAIT_S, "the living node's subscriptions to end with it")
    assert not journal.exists()
    status = xplane.status()
    if status["period_error_ms"]["max"] < 60.0:  # later frames have the requests of several come at once
        assert status["ignored"].get("flood", 0) == 0


def test_release_overrides_ends_what_a_killed_node_has_subscribed(world, killed_node):
    xplane, _ = killed_node
    done = subprocess.run([sys.executable, RELEASE], env=world.env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "/rx_node" in done.stdout
    assert done.stdout.strip().endswith(": ended"), done.stdout
    wait_until(lambda: not subscribed(xplane), WAIT_S, "the dead node's subscriptions to end")
    assert not list((world.folder / "ros_home" / "xplane_bridge").glob("*.json"))


def test_release_overrides_leaves_a_living_nodes_subscriptions_alone(world):
    from xplane_bridge.msg import FlightState

    xplane = world.emulator(*KINEMATIC)
    world.start("rx_node")
    world.watch("flight_state", FlightState).wait_for()
    done = subprocess.run([sys.executable, RELEASE], env=world.env, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("nothing to release: no entry of a process of this computer that is gone in ")
    assert subscribed(xplane)
    assert list((world.folder / "ros_home" / "xplane_bridge").glob("*.json"))


# --- one way ----------------------------------------------------------------------------------------------------------


def one_way(world, version, *arguments, **params):
    """An X-Plane of this version whose Data Output was set by hand and that answers nothing, and its rx_node.

    With arguments, rx.launch starts the node instead.
    """
    from xplane_bridge.msg import DataRows, FlightState, LinkState

    port = free_udp_port()
    rows = ("--data-target", f"127.0.0.1:{port}", "--data-rows", "0,1,3-6,8,14-21,25", "--rate", "60")
    pilot = config_file("scenarios", "demo.yaml")
    world.xplane = world.emulator(*KINEMATIC, "--version", version, "--pilot", pilot, "--deaf", *rows)
    world.set_param("transport", "data")
    world.set_param("data_port", port)
    world.states = world.watch("flight_state", FlightState)
    world.rows = world.watch("data_rows", DataRows)
    world.links = world.watch("link_state", LinkState)
    if arguments:
        where = ("host:=127.0.0.1", f"port:={world.xplane.port}", "listen_for_beacon:=false", f"data_port:={port}")
        return world.launch("rx.launch", "transport:=data", "configure_xplane:=false", *where, *arguments)
    return world.start("rx_node", {"configure_xplane": False, **params})


def row(message, index):
    """The eight values of a row."""
    start = 8 * list(message.index).index(index)
    return message.values[start : start + 8]


def test_one_way_without_a_version_publishes_what_does_not_depend_on_it(world):
    one_way(world, "11")
    state = world.states.wait_for()
    assert state.valid & (ATTITUDE | POSITION) == ATTITUDE | POSITION
    assert not state.valid & RATES, "rad/s in version 11, deg/s in 12"
    assert math.isnan(state.angular_velocity.x)
    assert state.latitude == pytest.approx(37.46, abs=0.5)
    link = world.wait_for_diagnostics("link to X-Plane", lambda status: "nothing answers" in status.message)
    assert "set the parameter xplane_version" in link.message
    assert "X-Plane never answers" not in link.message, "it is not the datarefs"
    world.wait_for_diagnostics("flight state", lambda s: "not known" in s.message and "rates" in s.message)
    said = world.links.wait_for(lambda link: link.state_name == "CONNECTED" and "does not answer" in link.reason)
    assert said.xplane_version == 0


@pytest.mark.parametrize(
    ("version", "parameter", "order", "unit"),
    [("11", 115501, (1, 0, 2), 1.0), ("12", 122015, (0, 1, 2), math.pi / 180.0)],
)
def test_one_way_with_its_version_given_publishes_rates(world, version, parameter, order, unit):
    one_way(world, version, xplane_version=parameter)

    def turns(state):
        rates = state.angular_velocity
        return state.valid & RATES and min(abs(rates.x), abs(rates.y)) > 1e-3

    def both():  # a state and its rows, of which some came before the first was connected
        states = {state.sim_time: state for state in world.states.messages[:] if turns(state)}
        rows = {row(rows, 1)[1]: rows for rows in world.rows.messages[:] if 1 in rows.index}
        return [(states[time], rows[time]) for time in states if time in rows]

    state, message = wait_until(both, WAIT_S, "a state and its rows")[0]
    raw = row(message, 16)
    expected = [raw[slot] * unit for slot in order]
    got = state.angular_velocity
    assert [got.x, got.y, got.z] == pytest.approx(expected, abs=1e-6)
    link = world.wait_for_diagnostics("link to X-Plane", lambda status: "nothing answers" in status.message)
    assert "xplane_version" not in link.message
    world.links.wait_for(lambda link: link.xplane_version == parameter)


def test_one_way_with_its_version_given_to_the_launch_file_publishes_rates(world):
    one_way(world, "11", "xplane_version:=115501")
    world.states.wait_for(lambda state: state.valid & RATES, WAIT_S)
    world.links.wait_for(lambda link: link.xplane_version == 115501)


def test_one_way_rows_show_the_engines_without_their_number(world):
    from xplane_bridge.msg import EngineStates

    throttle_command = 1 << 0
    log = world.watch("mission/engines", EngineStates)
    one_way(world, "11", xplane_version=115501)
    engines = log.wait_for(lambda message: message.valid & throttle_command, WAIT_S)
    assert engines.count == 0
    assert all(math.isfinite(lever) for lever in engines.throttle_command)
