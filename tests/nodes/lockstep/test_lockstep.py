"""Whole-loop lock-step: the same flight twice is the same bytes on every topic, however the processes are delayed."""

from __future__ import annotations

import hashlib
import os
import random
import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from support.deadlines import WAIT_S
from support.nodes.connections import is_connected
from support.nodes.tx_fixtures import tx_params
from xplane_bridge.harness.processes import ManagedProcess, wait_until

FRAMES = 600
#: Not promised to be the same: diagnostics, and the log.
NOT_COMPARED = {"/diagnostics", "/rosout", "/rosout_agg"}


class Recording:
    """The payloads of all topics of a namespace, as bytes."""

    def __init__(self, namespace):
        import rospy

        self.payloads = {}
        self._subscribers = []
        for topic, _ in rospy.get_published_topics():
            if topic in NOT_COMPARED or not (topic.startswith(namespace + "/") or topic == "/clock"):
                continue
            kept = self.payloads.setdefault(topic, [])
            self._subscribers.append(
                rospy.Subscriber(topic, rospy.AnyMsg, lambda m, kept=kept: kept.append(m._buff), tcp_nodelay=True)
            )

    def connected(self):
        return all(map(is_connected, self._subscribers))

    def wait_for(self, topic, count):
        wait_until(lambda: len(self.payloads.get(topic, ())) >= count, WAIT_S, f"{count} messages on {topic}")

    def wait_until_complete(self, expected):
        """Waits for so many messages a topic, and until nothing further has come for a second: the simulator stands."""
        for topic, count in expected.items():
            self.wait_for(topic, count)
        before = -1
        while before != sum(map(len, self.payloads.values())):
            before = sum(map(len, self.payloads.values()))
            time.sleep(1.0)

    def hashes(self):
        return {topic: (len(kept), hashlib.sha256(b"".join(kept)).hexdigest()) for topic, kept in self.payloads.items()}

    def close(self):
        for subscriber in self._subscribers:
            subscriber.unregister()


def start(world, **lockstep):
    emulator = world.emulator("--stepped", "lockstep", "--seed", 3, "--turbulence", 1)
    world.set_param("lockstep", {"enabled": True, "participants": ["controller"], "hold": True, **lockstep})
    # All parameters before the first node, as roslaunch does it: rx_node reads them as it starts, for `experiment`.
    world.set_param("tx_node", tx_params())
    return [emulator, world.start("rx_node"), world.start("tx_node")]


def start_controller(world, *arguments):
    tests = Path(__file__).resolve().parents[2]
    env = {**world.env, "PYTHONPATH": f"{tests}{os.pathsep}{world.env.get('PYTHONPATH', '')}"}
    command = [sys.executable, "-m", "support.flights.lockstep_controller", world.namespace, *map(str, arguments)]
    controller = ManagedProcess("controller", command, world.folder, env=env)
    controller.start()
    controller.wait_for_line("^ready", 60.0)
    return controller


def step(world, frames):
    from xplane_bridge.srv import LockstepStep

    return world.call("lockstep/step", LockstepStep, frames=frames)


def shake(processes, ended, seed):
    """Stops and continues processes at random."""
    dice = random.Random(seed)
    while not ended.wait(dice.uniform(0.0, 0.05)):
        process = dice.choice(processes)
        os.kill(process.pid, signal.SIGSTOP)
        time.sleep(dice.uniform(0.0, 0.1))
        os.kill(process.pid, signal.SIGCONT)


def fly(world, shaken, expected):
    """Flies with mode changes, a failure and an excitation; gives what each topic brought.

    Args:
        world: The test's own.
        shaken: Whether its processes are stopped at random.
        expected: How many messages topics bring at least.
    """
    import rospy

    processes = start(world)
    controller = start_controller(world)
    processes.append(controller)
    for service in ("get_dataref", "tx_node/load_state"):  # advertised after all topics
        rospy.wait_for_service(f"{world.namespace}/{service}", WAIT_S)
    recording = Recording(world.namespace)
    ended = threading.Event()
    shaker = threading.Thread(target=shake, args=(processes, ended, 5))
    try:
        wait_until(recording.connected, WAIT_S, "all topics")
        if shaken:
            shaker.start()
        began = time.monotonic()
        answer = step(world, FRAMES)
        took = time.monotonic() - began
    finally:
        ended.set()
        if shaken:
            shaker.join()
    assert (answer.success, answer.flown) == (True, FRAMES), controller.describe("has failed")
    assert answer.sim_time == pytest.approx(FRAMES / 60, abs=1e-4)
    recording.wait_until_complete(expected)
    recording.close()
    controller.stop()
    print(f"{'shaken' if shaken else 'quiet'}: {FRAMES / 60 / took:.1f} times real time")
    return recording.hashes()


def test_a_flight_is_the_same_bytes_under_random_stops(new_world, tmp_path):
    flights = []
    known = {
        "/clock": FRAMES + 1,  # and before the flight
        "/lockstep/flight_state": FRAMES,
        "/lockstep/control/auto": FRAMES,
        "/lockstep/experiment": 1,
        "/lockstep/mission/surfaces": FRAMES // 3,
    }
    expected = known
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        world = new_world(folder)
        world.namespace = "/lockstep"  # names of nodes are in some messages
        try:
            flights.append(fly(world, number == 1, expected))
        finally:
            world.close()
        expected = {topic: count for topic, (count, _) in flights[0].items()}
    for topic, count in known.items():
        assert flights[0][topic][0] == count, topic
    assert flights[0]["/lockstep/events"][0] >= 8  # modes, failure, dataref, excitation, repair
    differing = {topic for topic, seen in flights[0].items() if flights[1].get(topic) != seen}
    assert not differing, {topic: (flights[0][topic], flights[1].get(topic)) for topic in differing}
    assert flights[0].keys() == flights[1].keys()


def test_a_participant_that_dies_ends_the_run_by_name(world):
    from std_srvs.srv import Trigger

    _, _, tx_node = start(world, watchdog=15.0)
    controller = start_controller(world, 30)
    try:
        assert world.call("lockstep/run", Trigger).success
        wait_until(lambda: not tx_node.running, 60, "end of tx_node")
    finally:
        controller.stop()
    assert tx_node.returncode == 2
    log = tx_node.describe("")
    assert "frame 31 was not answered by controller" in log, log


def test_it_holds_and_flies_on_as_asked(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.msg import FlightState

    start(world, participants=[])
    states = world.watch("flight_state", FlightState)
    wait_until(lambda: states.connected, WAIT_S, "rx_node's connection")
    answer = step(world, 5)
    assert (answer.flown, answer.sim_time) == (5, pytest.approx(5 / 60))
    last = states.wait_for(lambda state: state.frame_count == 5)
    assert last.header.stamp.to_sec() == pytest.approx(1e9 + 5 / 60, abs=1e-5)
    assert last.stamp_uncertainty == 0.0
    assert step(world, 7).flown == 7
    assert world.call("lockstep/run", Trigger).success
    states.wait_for(lambda state: state.frame_count > 100)
    assert world.call("lockstep/hold", Trigger).success


def test_a_bridge_that_is_started_again_flies_on_where_the_one_before_ended(world):
    _, *nodes = start(world, participants=[], watchdog=30.0)
    assert step(world, 5).flown == 5
    for node in nodes:
        node.stop()
    for name in ("rx_node", "tx_node"):
        world.start(name)
    answer = step(world, 7)
    assert answer.flown == 7
    assert answer.sim_time > 11.9 / 60  # some frames more have flown while the first one gave back what it had taken


def test_hold_ends_however_many_steps_wait(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.msg import FlightState

    start(world, participants=[])
    states = world.watch("flight_state", FlightState)
    wait_until(lambda: states.connected, WAIT_S, "rx_node's connection")
    answers = []
    waiting = [threading.Thread(target=lambda: answers.append(step(world, 1000000))) for _ in range(2)]
    for thread in waiting:
        thread.start()
    states.wait_for(lambda state: state.frame_count > 20)
    assert world.call("lockstep/hold", Trigger).success
    for thread in waiting:
        thread.join()
    replaced, held = answers  # the first one at once
    assert not replaced.success
    assert "has taken its place" in replaced.result.message
    assert held.success
    assert 0 < held.flown < 1000000


def test_ros_time_of_a_node_is_that_of_the_frame(world):
    from diagnostic_msgs.msg import DiagnosticArray
    from xplane_bridge.msg import FlightState

    world.master.set_param("/use_sim_time", True)
    try:
        start(world, participants=[])
        states, diagnostics = world.watch("flight_state", FlightState), world.watch("/diagnostics", DiagnosticArray)
        wait_until(lambda: states.connected and diagnostics.connected, WAIT_S, "rx_node's connections")
        for number in (1, 2):
            step(world, 50)
            last = states.wait_for(lambda state, count=50 * number: state.frame_count == count)
            for node in ("rx_node", "tx_node"):
                diagnostics.wait_for(
                    lambda message, node=node, stamp=last.header.stamp: (
                        message.header.stamp == stamp and node in message.status[0].name
                    )
                )
    finally:
        world.master.set_param("/use_sim_time", False)


def example(world, language):
    """The controller of docs/experiments/lockstep.md, started as it stands there."""
    page = (Path(__file__).resolve().parents[3] / "docs/experiments/lockstep.md").read_text(encoding="utf-8")
    code = page.partition(f"```{language}\n")[2].partition("```")[0]
    if language == "cpp":
        assert code == Path(__file__).with_name("lockstep_controller.cpp").read_text(encoding="utf-8")
        command = [world.program("lockstep_controller")]
    else:
        file = world.folder / "controller.py"
        file.write_text(code, encoding="utf-8")
        command = [sys.executable, file]
    return ManagedProcess("controller", command, world.folder, env=world.env)


@pytest.mark.parametrize("language", ["python", "cpp"])
def test_the_controllers_of_the_page_answer_every_frame(new_world, tmp_path, language):
    from xplane_bridge.msg import ControlCommand, FlightState

    world = new_world(tmp_path)
    world.namespace = "/xplane"
    try:
        start(world)
        with example(world, language):
            states, commands = world.watch("flight_state", FlightState), world.watch("control/auto", ControlCommand)
            wait_until(lambda: states.connected and commands.connected, WAIT_S, "both topics")
            assert step(world, 60).flown == 60
            states.wait_for(lambda state: state.frame_count == 60)
            wait_until(lambda: len(commands.messages) == 60, WAIT_S, "60 commands")
    finally:
        world.close()
    law = [min(max(-0.03 * state.roll_deg, -1.0), 1.0) for state in states.messages]
    assert [command.roll for command in commands.messages] == pytest.approx(law, abs=1e-6)
    stamps = [command.header.stamp for command in commands.messages]
    assert stamps == [state.header.stamp for state in states.messages]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("transport", "data", "rref with lockstep/enabled"),
        ("host", "", "the simulator's address with lockstep/enabled"),
        ("lockstep/watchdog", 0.0, "lockstep/watchdog"),
    ],
)
def test_what_lockstep_cannot_work_with_is_refused(world, key, value, message):
    world.point_to(49000)
    world.set_param("lockstep", {"enabled": True})
    world.set_param("listen_for_beacon", True)
    world.set_param(key, value)
    node = world.start("rx_node")
    wait_until(lambda: not node.running, WAIT_S, "end of rx_node")
    assert node.returncode == 1
    assert message in node.describe("")
