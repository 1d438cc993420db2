"""rerun_flight: a flight of run_scenario once more, the same; and recorded commands through a bridge that runs."""

from __future__ import annotations

import hashlib
import signal
import subprocess
import sys

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.nodes.tx_fixtures import AUTO, MANUAL, tx_params
from xplane_bridge.bags import Bags
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.resources import program

OVERRIDE = "sim/operation/override/override_planepath[0]"
SCENARIO = """
name: turning
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
criteria:
  turns: {measure: maximum, of: roll, above: 10}
events:
  - {at: 0, mode: manual, hold: {roll: 0, climb: 0, speed: 65}}
  - {at: 1, hold: {roll: 25}}
  - {at: 6, end: true}
"""


def run(name, *arguments, **kwargs):
    command = [sys.executable, str(program(name)), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, **kwargs)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flown")
    scenario = folder / "turning.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    options = ["--lockstep", "--seed", "3", "--emulator=--turbulence 1", "--output", folder / "out"]
    done = run("run_scenario", scenario, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    scenario.unlink()  # the passport has its text
    return folder / "out" / "flight.bag"


def states(bag):
    with Bags(bag) as bags:
        return hashlib.sha256(b"".join(raw for _, _, raw in bags.recorded(["/xplane/flight_state"]))).hexdigest()


def test_a_flight_of_run_scenario_is_flown_again_to_the_last_bit(flown, tmp_path):
    done = run("rerun_flight", flown, "--output", tmp_path / "again")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "turning: 1 of 1 criteria met" in done.stdout
    assert "made otherwise" not in done.stdout
    assert states(tmp_path / "again" / "flight.bag") == states(flown)


def test_it_does_not_write_over_the_recording(flown):
    done = run("rerun_flight", flown, "--output", flown.parent)
    assert done.returncode == 1
    assert "the recording itself is there" in done.stderr


def test_recorded_commands_fly_a_running_bridge_which_has_its_stick_back_afterwards(world, flown):
    from xplane_bridge.msg import AppliedCommand, ControlMode, FlightState

    world.emulator("--alt", 1500, "--heading", 200)
    world.start("rx_node")
    world.start("tx_node", tx_params())
    flights = world.watch("flight_state", FlightState)
    applied = world.watch("control/applied", AppliedCommand)
    modes = world.watch("control/mode", ControlMode)
    flights.wait_for(timeout=60.0)
    done = run("rerun_flight", flown, "--commands", "--namespace", world.namespace, env=world.env)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "played"
    assert any(abs(state.altitude_msl - 800.0) < 50.0 for state in flights.messages)
    assert max(state.roll_deg for state in flights.messages) > 10.0
    assert any(command.roll > 0.1 for command in applied.messages)
    assert modes.last.mode == ControlMode.MANUAL


def test_recorded_poses_move_the_aircraft_and_the_flight_model_is_given_back(world, flown):
    from xplane_bridge.msg import FlightState

    emulator = world.emulator("--alt", 1500, "--heading", 200, "--lat", 37.6, "--lon", 126.6)
    world.start("rx_node")
    world.start("tx_node", tx_params())
    flights = world.watch("flight_state", FlightState)
    flights.wait_for(timeout=60.0)
    done = run("rerun_flight", flown, "--pose", "--namespace", world.namespace, env=world.env)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-2:] == ["the flight model flies again", "played"]
    world.wire(emulator.port).wait_until_reads(OVERRIDE, 0.0)
    with Bags(flown) as bags:
        recorded = bags.read("/xplane/flight_state")
    # A busy machine skips poses; those that are shown are recorded ones.
    shown = [(state, nearest(state, recorded)) for state in flights.messages]
    shown = [(state, row) for state, row in shown if distance(state, recorded, row) < 100.0]
    assert len(shown) > 30
    assert np.median([distance(state, recorded, row) for state, row in shown]) < 2.0  # [m] of 1 m a frame
    for name in ("roll_deg", "pitch_deg", "heading_true_deg", "true_airspeed"):
        assert np.median([abs(getattr(state, name) - recorded[name][row]) for state, row in shown]) < 1.0, name
    assert max(state.roll_deg for state, _ in shown) > 10.0
    last = flights.last.sim_time
    flights.wait_for_next(lambda state: state.sim_time > last + 1.0, WAIT_S)
    assert distance(flights.last, recorded, -1) > 20.0  # it flies on


def nearest(state, recorded):
    """The row of the recorded state that is nearest to a state."""
    return int(np.argmin(distance(state, recorded, slice(None))))


def distance(state, recorded, row):
    """[m] between a state and a recorded one."""
    north = np.radians(state.latitude - recorded["latitude"][row]) * 6378145.0
    east = np.radians(state.longitude - recorded["longitude"][row]) * 6378145.0 * np.cos(np.radians(37.5))
    return np.sqrt(north**2 + east**2 + (state.altitude_msl - recorded["altitude_msl"][row]) ** 2)


@pytest.fixture(scope="module")
def steered(tmp_path_factory):
    """A flight of ten minutes, flown in AUTO from its third second on."""
    bag = tmp_path_factory.mktemp("steered") / "flight.bag"
    with FlightBag(bag) as writing:
        for k in range(600):
            writing.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k), writing.state(float(k), k))
            writing.add("/xplane/control/auto", "xplane_bridge/ControlCommand", stamp_ns(k + 0.5), {"fields": 1})
            if k == 2:
                writing.add("/xplane/control/mode", "xplane_bridge/ControlMode", stamp_ns(k), {"mode": int(AUTO)})
    return bag


@pytest.fixture(scope="module")
def bridge(new_world, tmp_path_factory):
    """A bridge for the tests of how it ends."""
    world = new_world(tmp_path_factory.mktemp("bridge"))
    world.xplane = world.emulator("--alt", 1500, "--lat", 37.5, "--lon", 127.0)
    world.nodes = [world.start("rx_node"), world.start("tx_node", tx_params())]
    yield world
    world.close()


@pytest.fixture
def rerun(bridge, steered):
    """Starts rerun_flight on that bridge."""
    started = []

    def start(option):
        command = [sys.executable, program("rerun_flight"), steered, option, "--namespace", bridge.namespace]
        started.append(ManagedProcess("rerun_flight", command, bridge.folder, env=bridge.env))
        started[-1].start()
        started[-1].wait_for_line("^playing", WAIT_S)
        return started[-1]

    yield start
    for process in started:
        process.stop()


def end(world, process, how):
    """Ends a rerun_flight; returns its exit status."""
    if isinstance(how, signal.Signals):
        process.send_signal(how)
        return process.wait(WAIT_S)
    listed = subprocess.run(
        ["rosnode", "list"], capture_output=True, text=True, timeout=WAIT_S, check=True, env=world.env
    )
    (name,) = (line for line in listed.stdout.splitlines() if line.startswith(f"/rerun_flight_{process.pid}_"))
    subprocess.run(["rosnode", "kill", name], capture_output=True, timeout=WAIT_S, check=True, env=world.env)
    return process.wait(WAIT_S)


ENDS = pytest.mark.parametrize(
    ("how", "status"),
    [
        (signal.SIGINT, 130),
        (signal.SIGTERM, 130),
        pytest.param(signal.SIGHUP, 130, marks=pytest.mark.nightly),
        pytest.param("rosnode kill", 1, marks=pytest.mark.nightly),
    ],
)


@ENDS
def test_poses_that_are_broken_off_give_the_flight_model_back(bridge, rerun, how, status):
    process = rerun("--pose")
    wire = bridge.wire(bridge.xplane.port)
    wire.wait_until_reads(OVERRIDE, 1.0)
    assert end(bridge, process, how) == status
    assert wire.read(OVERRIDE) == 0.0
    assert "the flight model flies again" in process.output()
    assert "Traceback" not in process.output()


@ENDS
def test_commands_that_are_broken_off_leave_mode_manual(bridge, rerun, how, status):
    from xplane_bridge.msg import ControlMode

    process = rerun("--commands")
    modes = bridge.watch("control/mode", ControlMode)
    modes.wait_for(lambda mode: mode.mode == AUTO)
    assert end(bridge, process, how) == status
    wait_until(lambda: modes.last.mode == MANUAL, WAIT_S, "mode MANUAL")
    modes.close()
    assert "Traceback" not in process.output()


def test_a_reset_ends_the_commands(bridge, rerun):
    from xplane_bridge.msg import ControlMode
    from xplane_bridge.srv import ResetFlight

    process = rerun("--commands")
    modes = bridge.watch("control/mode", ControlMode)
    modes.wait_for(lambda mode: mode.mode == AUTO)
    place = {"latitude": 37.6, "longitude": 127.1, "altitude_msl": 900.0, "true_airspeed": 70.0}
    assert bridge.call("tx_node/reset_flight", ResetFlight, **place).success
    assert process.wait(WAIT_S) == 1
    assert "the flight was reset or placed anew" in process.output()
    wait_until(lambda: modes.last.mode == MANUAL, WAIT_S, "mode MANUAL")
    modes.close()


@pytest.fixture(scope="module")
def hovered(tmp_path_factory):
    """Six seconds of a flight that stands, flown in AUTO from the first state on."""
    bag = tmp_path_factory.mktemp("hovered") / "flight.bag"
    still = {"roll_deg": 0.0, "pitch_deg": 0.0, "true_airspeed": 0.0, "flight_path_angle_deg": 0.0}
    with FlightBag(bag) as writing:
        for k in range(60):
            state = {**writing.state(k / 10, k), "latitude": 37.5, "altitude_msl": 1000.0, **still}
            writing.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), state)
            writing.add("/xplane/control/auto", "xplane_bridge/ControlCommand", stamp_ns(k / 10), {"fields": 1})
            if k == 0:
                writing.add("/xplane/control/mode", "xplane_bridge/ControlMode", stamp_ns(k), {"mode": int(AUTO)})
    return bag


@pytest.mark.parametrize("version", ["11", "12"])
def test_commands_from_near_the_recorded_start_are_flown_in_auto(world, hovered, version):
    from xplane_bridge.msg import ControlMode, FlightState

    place = ("--alt", 1000, "--lat", 37.5, "--lon", 127.0)
    world.emulator("--aircraft", "multirotor", "--version", version, *place)
    world.set_param("aircraft", "multirotor")
    world.start("rx_node")
    world.start("tx_node", tx_params("multirotor"))
    flights = world.watch("flight_state", FlightState)
    modes = world.watch("control/mode", ControlMode)
    flights.wait_for(timeout=60.0)
    done = run("rerun_flight", hovered, "--commands", "--namespace", world.namespace, env=world.env)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "played"
    assert "has ended" not in done.stdout
    shown = [mode.mode for mode in modes.messages]
    began = shown.index(AUTO)
    ended = shown.index(MANUAL, began)
    assert modes.messages[ended].sim_time - modes.messages[began].sim_time > 4.0


def test_where_the_bridge_is_gone_it_says_what_to_do(bridge, rerun):
    """The last test of this bridge."""
    process = rerun("--pose")
    for node in bridge.nodes:
        node.stop()
    assert end(bridge, process, signal.SIGINT) == 130
    assert "is not seen given back" in process.output()
    assert "scripts/release_overrides" in process.output()
    assert "Traceback" not in process.output()
    bridge.wire(bridge.xplane.port).wait_until_reads(OVERRIDE, 0.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no topic experiment in it"),
        (("--commands", "--output", "x"), "not with --commands or --pose"),
        (("--commands", "--pose"), "not allowed with"),
        (("--pose", "--output", "x"), "not with --commands or --pose"),
        (("--namespace", "/other"), "without --commands or --pose"),
        (("--commands",), "no command in it"),
    ],
)
def test_what_cannot_be_flown_again_is_said(tmp_path, arguments, message):
    bag = tmp_path / "bare.bag"
    with FlightBag(bag) as writing:
        for k in range(3):
            state = writing.state(k / 10, k)
            writing.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), state)
    done = run("rerun_flight", bag, *arguments, cwd=tmp_path)
    assert done.returncode in (1, 2)
    assert message in done.stderr
    assert "Traceback" not in done.stderr
