"""A flight's wire, logged, read and replayed by the programs that users run."""

from __future__ import annotations

import hashlib
import json
import struct

import pytest

from support.nodes.wire_replays import (
    RawTopics,
    assert_replayed,
    assert_same_values,
    log_of,
    payloads_in,
    replay,
    states_by_run_and_time,
)
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import Capture
from xplane_bridge.wire_log.datagrams import USER0
from xplane_bridge.wire_log.own_log import OwnLog

TOPICS = (
    "flight_state",
    "odom",
    "imu/data",
    "wind",
    "link_state",
    "mission/surfaces",
    "mission/engines",
    "datarefs",
    "traffic/state",
)


@pytest.fixture(scope="module")
def flight(new_world, tmp_path_factory):
    """A flight with datagrams lost and overtaken, and X-Plane ended and started again: its log, and what was heard."""
    folder = tmp_path_factory.mktemp("wire")
    world = new_world(folder)
    try:
        emulator = world.emulator("--fps", 60, "--fault", "drop=0.05,reorder", "--seed", 3, "--traffic", 2)
        world.set_param("wire_log", str(folder / "wire.pcapng"))
        heard = RawTopics(world.namespace, TOPICS)
        node = world.start("rx_node", {"datarefs": [{"name": "sim/cockpit2/gauges/indicators/airspeed_kts_pilot"}]})
        states = f"{world.namespace}/flight_state"

        def count() -> int:
            return len(heard.payloads.get(states, ()))

        wait_until(lambda: count() >= 300, 60, "300 states")
        emulator.restart()
        before = count()
        wait_until(lambda: count() >= before + 200, 60, "200 states after the restart")
        node.stop()
        heard.close()
        log = log_of(folder, world.namespace, "rx_node")
        assert node.returncode == 0, node.describe("")
        yield world.namespace, log, heard.payloads, folder
    finally:
        world.close()


def test_the_log_holds_the_flight(flight):
    _, path, _, _ = flight
    log = OwnLog(path)
    events = list(log.events())
    assert log.problem == ""
    assert log.is_ordered
    kinds = {event.kind for event in events}
    assert {records.OPENED, records.RECEIVED, records.SENT, records.WAITED, records.INPUT} <= kinds
    assert {name for name, _ in log.sources} >= {"control", "flight"}
    steady = [event.steady_ns for event in events if event.kind in (records.RECEIVED, records.WAITED)]
    assert steady == sorted(steady)
    flight_source = [name for name, _ in log.sources].index("flight")
    answers = [e for e in events if e.kind == records.RECEIVED and e.source == flight_source]
    assert len(answers) > 300
    # While it stops, it waits for datagrams of ended subscriptions no more often than there is something to do.
    close = next(i for i, e in enumerate(events) if e.kind == records.INPUT and e.payload.startswith(b"close\0"))
    at_the_end = events[close:]
    assert sum(e.kind == records.WAITED for e in at_the_end) < 10 * len([e for e in at_the_end if e.source]) + 1000
    assert all(e.kernel_ns and 0 <= e.wall_ns - e.kernel_ns < 30e9 for e in answers)


@pytest.fixture(scope="module")
def replayed_flight(flight):
    """What wire_replay says of the flight, and the bag of the replay: it has the names of the flight's publisher, as a
    recording of the flight has."""
    _, path, _, folder = flight
    bag = folder / "replay.bag"
    done = replay(path, "-o", bag, "--logs", folder / "logs")
    assert done.returncode == 0, done.stdout + done.stderr
    return done, bag


def test_the_replay_is_the_flight_byte_for_byte(flight, replayed_flight):
    namespace, _, live, _ = flight
    done, bag = replayed_flight
    assert " 0 otherwise than recorded" in done.stdout
    replayed = payloads_in(bag)
    for topic in (f"{namespace}/{name}" for name in TOPICS):
        assert_replayed(live[topic], replayed[topic], topic)
    # Its own summary says the same.
    line = next(line for line in done.stdout.splitlines() if line.startswith(f"{namespace}/flight_state "))
    digest = hashlib.sha256()
    for payload in replayed[f"{namespace}/flight_state"]:
        digest.update(len(payload).to_bytes(4, "little") + payload)
    assert line.split()[2] == digest.hexdigest()[:16]


def test_a_replay_is_judged_also_where_ros_logs_warnings_only(flight, replayed_flight):
    namespace, path, _, folder = flight
    config = folder / "rosconsole.config"
    config.write_text("log4j.logger.ros=WARN\n")
    done = replay(path, "--against", replayed_flight[1], env={"ROSCONSOLE_CONFIG_FILE": str(config)})
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 otherwise than recorded" in done.stdout
    assert f"same    {namespace}/traffic/state\n" in done.stdout


def test_a_changed_byte_is_noticed(flight, replayed_flight):
    namespace, path, live, folder = flight
    # One bit of the time of a frame that was published: an overtaken datagram would be left out with it or without.
    states = states_by_run_and_time(live[f"{namespace}/flight_state"])
    time = struct.pack("<f", list(states)[-50][1])
    log = OwnLog(path)
    answers = [e.payload for e in log.events() if e.kind == records.RECEIVED and log.sources[e.source][0] == "flight"]
    answer = next(payload for payload in reversed(answers) if time in payload)
    data = bytearray(path.read_bytes())
    data[data.rindex(answer) + answer.index(time)] ^= 0x01
    other = folder / "other.rx_node.pcapng"
    other.write_bytes(data)
    done = replay(other, "--against", replayed_flight[1])
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"DIFFERS {namespace}/flight_state" in done.stdout


def test_a_strangers_capture_gives_the_same_values(flight):
    """The flight's traffic as tcpdump would have written it: Ethernet, microseconds, without numbers and clocks."""
    namespace, path, live, folder = flight
    capture = Capture.open(path)
    out = [struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)]
    for packet in capture.packets():
        if capture.interfaces[packet.interface].link_type != USER0:
            frame = bytes(12) + b"\x08\x00" + packet.data
            out.append(
                struct.pack("<IIII", packet.time_ns // 10**9, packet.time_ns % 10**9 // 1000, len(frame), len(frame))
            )
            out.append(frame)
    file, bag = folder / "tcpdump.pcap", folder / "tcpdump.bag"
    file.write_bytes(b"".join(out))
    done = replay(file, "-o", bag, "--logs", folder / "tcpdump_logs")
    assert done.returncode == 0, done.stdout + done.stderr
    there, here = (
        states_by_run_and_time(live[f"{namespace}/flight_state"]),
        states_by_run_and_time(payloads_in(bag)["/xplane/flight_state"]),
    )
    common = sorted(set(there) & set(here))
    assert {run for run, _ in common} == {0, 1}
    assert len(common) > 0.6 * len(there)
    for moment in common:
        assert_same_values(here[moment], there[moment])


def test_a_recording_becomes_a_regression_test(flight):
    _, path, _, folder = flight
    kept = folder / "kept"
    done = replay(path, "--regression", kept)
    assert done.returncode == 0, done.stdout + done.stderr
    recording, file = kept / path.name, kept / path.with_suffix(".json").name
    expected = json.loads(file.read_text(encoding="utf-8"))
    assert expected["options"] == {"xplane": None, "set": {}}
    done = replay(recording, "--expect", file)
    assert done.returncode == 0, done.stdout + done.stderr
    topic = next(name for name in expected["topics"] if name.endswith("/odom"))
    expected["topics"][topic]["sha256"] = "0" * 64
    file.write_text(json.dumps(expected), encoding="utf-8")
    done = replay(recording, "--expect", file)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"DIFFERS {topic}" in done.stdout
