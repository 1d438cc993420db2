"""tx_node's wire log: what it sent for messages, services and its own threads comes out of the replay byte for byte."""

from __future__ import annotations

import hashlib
import threading

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    PITCH,
    ROLL,
    CommandSource,
    WatchedDatarefs,
    call,
    pause,
    tx_params,
    write_mixing,
)
from support.nodes.wire_replays import RawTopics, assert_replayed, by_number, log_of, payloads_in, replay
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.own_log import OwnLog

TOPICS = ("control/applied", "control/mode", "failures/state", "excitation/state")
STICK = "sim/joystick/yoke_roll_ratio"
SURFACES = "sim/operation/override/override_control_surfaces"


class Surfaces:
    """Publishes a SurfaceCommand."""

    def __init__(self, world) -> None:
        import rospy
        from xplane_bridge.msg import SurfaceCommand

        self._type = SurfaceCommand
        self._publisher = rospy.Publisher(f"{world.namespace}/control/surfaces", SurfaceCommand, queue_size=1)
        wait_until(lambda: self._publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")

    def send(self, **deflections_deg) -> None:
        self._publisher.publish(
            self._type(names=list(deflections_deg), deflections_deg=list(deflections_deg.values()), sequence=1)
        )


def request_mode(world, mode):
    import rospy
    from xplane_bridge.msg import ModeRequest

    publisher = rospy.Publisher(f"{world.namespace}/control/mode_request", ModeRequest, queue_size=10)
    wait_until(lambda: publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")
    publisher.publish(ModeRequest(mode=mode, sequence=7, requester="test"))


@pytest.fixture(scope="module")
def flight(new_world, tmp_path_factory):
    """A flight in which tx_node does all that it can: its log, and what was heard."""
    from xplane_bridge.msg import AppliedCommand, ControlMode, EventList, ExcitationState

    folder = tmp_path_factory.mktemp("wire_tx")
    world = new_world(folder)
    sources = [CommandSource(world, "control/manual"), CommandSource(world, "control/auto")]
    try:
        write_mixing(world)
        world.xplane = world.emulator("--start", "air", "--fault", "drop=0.02,reorder", "--seed", 3)
        world.wire = WatchedDatarefs(world.xplane.port, STICK, SURFACES)
        world.set_param("wire_log", str(folder / "wire.pcapng"))
        world.set_param("aircraft", "fixed_wing")
        heard = RawTopics(world.namespace, (*TOPICS, "events"))

        def wait_for(topic, kind, condition, timeout=WAIT_S):
            return heard.wait_for(f"{world.namespace}/{topic}", kind, condition, timeout)

        # Late frames are no lost link, and a busy machine's source may be silent for a moment.
        world.set_param("stale_after", 5.0)
        node = world.start("tx_node", tx_params(command_timeout=5.0))
        wait_for("events", EventList, lambda e: any(event.text.startswith("aircraft:") for event in e.events))
        world.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message)
        manual, auto = sources
        manual.fly(fields=ROLL | PITCH, roll=0.1, pitch=0.05)
        world.wire.wait(STICK, 0.1)
        auto.fly(fields=ROLL | PITCH, roll=-0.2)
        request_mode(world, AUTO)
        wait_for("control/mode", ControlMode, lambda m: m.mode == AUTO)
        wait_for("control/applied", AppliedCommand, lambda a: a.mode == AUTO)
        began = call(
            world,
            "inject_excitation",
            "InjectExcitation",
            kind="doublet",
            target="roll",
            amplitude=0.2,
            duration=1.0,
            frequency_min=0.5,
            frequency_max=2.0,
        )
        assert began.success
        wait_for("excitation/state", ExcitationState, lambda s: s.id == began.id and not s.active)
        surfaces = Surfaces(world)

        def driven():
            surfaces.send(aileron1_wing2_left=4.0)
            return world.wire.value(SURFACES) == 1.0

        wait_until(driven, WAIT_S, "driven surfaces")
        surfaces.send()
        world.wire.wait(SURFACES, 0.0)
        broken = call(world, "set_failure", "SetFailure", name="rudder1_fin1", kind="stuck")
        assert broken.success, broken.result
        assert call(world, "clear_failures", "ClearFailures").success
        assert call(world, "set_dataref", "SetDataref", name="sim/cockpit2/controls/flap_ratio", values=[0.5]).success
        pause(world, True)
        pause(world, False)
        reset = call(world, "reset_flight", "ResetFlight", **reset_request())
        assert reset.success, reset.result
        wait_for("events", EventList, lambda e: any(event.number == reset.event_number for event in e.events), 60.0)
        node.stop()
        heard.close()
        assert node.returncode == 0, node.describe("")
        world.wire.wait(SURFACES, 0.0)
        yield world.namespace, log_of(folder, world.namespace, "tx_node"), heard.payloads, folder
    finally:
        for source in sources:
            source.stop()
        world.close()


def reset_request():
    return {"latitude": 47.5, "longitude": 8.5, "altitude_msl": 1500.0, "heading_true_deg": 90.0, "true_airspeed": 60.0}


def sent_in(log):
    return [(event.source, event.peer, event.payload) for event in log.events() if event.kind == records.SENT]


def test_the_replay_sends_the_flights_datagrams(flight):
    namespace, path, live, folder = flight
    log = OwnLog(path)
    inputs = {event.payload.partition(b"\0")[0].decode() for event in log.events() if event.kind == records.INPUT}
    assert log.problem == ""
    assert log.is_ordered
    assert {
        "topic control/manual",
        "topic control/auto",
        "topic control/mode_request",
        "topic control/surfaces",
    } <= inputs
    node = f"{namespace}/tx_node"
    assert {f"service {node}/{name}" for name in ("set_failure", "inject_excitation", "reset_flight")} <= inputs
    bag, again = folder / "replay.bag", folder / "again.pcapng"
    done = replay(path, "-o", bag, "--sent", again, "--logs", folder / "logs")
    assert done.returncode == 0, done.stdout + done.stderr
    recorded = sent_in(log)
    sent = sent_in(OwnLog(log_of(folder, namespace, "tx_node", "again")))
    assert len(recorded) > 300
    first = next((i for i, pair in enumerate(zip(recorded, sent)) if pair[0] != pair[1]), None)
    assert first is None, f"datagram {first} of {len(recorded)}: {recorded[first]} was sent as {sent[first]}"
    assert len(sent) == len(recorded)
    assert " 0 otherwise than recorded" in done.stdout
    replayed = payloads_in(bag)
    for topic in (f"{namespace}/{name}" for name in TOPICS):
        assert_replayed(live[topic], replayed[topic], topic)
    # Of the list of events only the newest waits for a slow subscriber.
    there, here = (by_number(topics[f"{namespace}/events"]) for topics in (live, replayed))
    assert max(there) == max(here)
    assert {number: there[number] for number in here if number in there} == {n: here[n] for n in here if n in there}


def test_two_replays_are_the_same(flight):
    namespace, path, _, folder = flight
    digests = []
    for name in ("one", "two"):
        done = replay(path, "--sent", folder / f"{name}.pcapng")
        assert done.returncode == 0, done.stdout + done.stderr
        sent = sent_in(OwnLog(log_of(folder, namespace, "tx_node", name)))
        digests.append(hashlib.sha256(repr(sent).encode()).hexdigest())
    assert digests[0] == digests[1]


def test_a_log_that_is_cut_off_replays_up_to_there(flight):
    namespace, path, _, folder = flight
    data = path.read_bytes()
    cut = folder / "cut.tx_node.pcapng"
    cut.write_bytes(data[: len(data) // 2 + 1])
    done = replay(cut, "--sent", folder / "cut_again.pcapng", "--logs", folder / "cut_logs")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "is cut off; the replay ends there" in done.stdout
    recorded = sent_in(OwnLog(cut))
    assert sent_in(OwnLog(log_of(folder, namespace, "tx_node", "cut_again")))[: len(recorded)] == recorded


def test_hold_ends_a_step_also_where_the_threads_of_the_node_take_turns(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.srv import LockstepStep

    paused = "sim/time/paused"
    world.xplane = world.emulator("--start", "air")
    world.wire = WatchedDatarefs(world.xplane.port, paused)
    world.set_param("wire_log", str(world.folder / "wire.pcapng"))
    world.start("tx_node", tx_params())
    wait_until(lambda: world.call("lockstep/hold", Trigger).success, WAIT_S, "pause")
    world.wire.wait(paused, 1.0)
    answers = []

    def ask(*call, **fields):
        """By a thread, as one that is never answered would not end the test."""
        asking = threading.Thread(target=lambda: answers.append(world.call(*call, **fields).success), daemon=True)
        asking.start()
        return asking

    step = ask("lockstep/step", LockstepStep, frames=1000000)
    world.wire.wait(paused, 0.0)
    for asking in (ask("lockstep/hold", Trigger), step):
        asking.join(WAIT_S)
    assert answers == [True, True]
    world.wire.wait(paused, 1.0)
