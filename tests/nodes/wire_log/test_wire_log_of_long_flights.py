"""A long flight's wire log: lost datagrams, X-Plane restarted, then another version; replayed to what was heard."""

from __future__ import annotations

import math
import os
import sys

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
from xplane_bridge.harness import EmulatorProcess
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.resources import program
from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.own_log import OwnLog

TOPICS = ("flight_state", "odom", "imu/data", "mission/surfaces", "link_state")
FPS = 60
AT_ONCE = 30  #: [frames]
#: One after the other: the same X-Plane started again, then a newer one.
VERSIONS = ("11.55", "11.55", "12.10")


class SteppedEmulator:
    """An emulator whose frames come when the test wants them, as fast as they can.

    Args:
        world: the test's.
        version: X-Plane's.
        port: to listen on; 0: a free one.
        aircraft: that it flies.
    """

    def __init__(self, world, version: str, port: int = 0, aircraft: str = "fixed_wing") -> None:
        frames = world.folder / f"frames_{version}_{port}"
        os.mkfifo(frames)
        self._frames = os.open(frames, os.O_RDWR)
        self.flown = 0
        self._asked = 0
        self.process = EmulatorProcess(
            world.folder,
            [
                *("--stepped", "--version", version, "--fps", str(FPS), "--aircraft", aircraft),
                *("--fault", "drop=0.05,reorder", "--seed", "3"),
            ],
            name=f"stepped_{version}_{port}",
            port=port,
            command=["sh", "-c", f'exec "$@" < "{frames}"', "sh", sys.executable, str(program("xplane_emulator"))],
        )
        self.process.start()

    def fly(self, frames: int) -> None:
        """Flies these frames."""
        os.write(self._frames, f"{frames}\n".encode())
        self._asked += 1
        self.flown += frames
        wait_until(lambda: self.process.output().count("STEPPED ") >= self._asked, 60, "the frames")

    def fly_until(self, heard: RawTopics, topic: str, count: int) -> None:
        """Flies until so many messages were heard."""

        def there() -> bool:
            self.fly(2)
            return len(heard.payloads.get(topic, ())) >= count

        wait_until(there, 60, f"{count} messages on {topic}")

    def end(self) -> None:
        """Kills it, as a crash does."""
        if self.process.running:
            self.process.kill()
        os.close(self._frames)


@pytest.mark.parametrize("seconds", [20.0, pytest.param(600.0, marks=pytest.mark.nightly)])
def test_a_flight_with_drops_a_restart_and_another_version_replays(world, seconds):
    world.set_param("wire_log", str(world.folder / "wire.pcapng"))
    heard = RawTopics(world.namespace, TOPICS)
    states = f"{world.namespace}/flight_state"
    port, flown, node = 0, 0, None
    for version in VERSIONS:
        emulator = SteppedEmulator(world, version, port)
        port = emulator.process.port
        try:
            if node is None:
                world.point_to(port)
                node = world.start("rx_node", {})
            emulator.fly_until(heard, states, len(heard.payloads.get(states, ())) + 20)
            searched = emulator.flown
            while emulator.flown < seconds * FPS / len(VERSIONS):
                emulator.fly(AT_ONCE)
            flown += emulator.flown - searched
        finally:
            emulator.end()
    node.stop()
    heard.close()
    assert node.returncode == 0, node.describe("")
    log = OwnLog(log_of(world.folder, world.namespace, "rx_node"))
    received = sum(event.kind == records.RECEIVED for event in log.events())
    assert log.problem == ""
    assert received > 0.9 * flown
    bag = world.folder / "replay.bag"
    done = replay(log.path, "-o", bag)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 otherwise than recorded" in done.stdout
    replayed = payloads_in(bag)
    for topic, payloads in heard.payloads.items():
        assert_replayed(payloads, replayed[topic], topic)
    # A busy machine's subscriber may miss some; the replay's does not.
    assert len(replayed[states]) > 0.8 * flown
    assert len(heard.payloads[states]) > 0.5 * flown


@pytest.mark.parametrize(("aircraft", "engines"), [("fixed_wing", 2), ("multirotor", 4)])
def test_the_parts_that_were_kept_replay_without_the_first(world, aircraft, engines):
    """The oldest part is deleted for a further one: what is left shows the same flight, from where it begins."""
    from xplane_bridge.msg import EngineStates

    world.set_param("wire_log", str(world.folder / "wire.pcapng"))
    world.set_param("wire_log_size", 1)
    first = log_of(world.folder, world.namespace, "rx_node")
    heard = RawTopics(world.namespace, TOPICS)
    emulator = SteppedEmulator(world, VERSIONS[0], aircraft=aircraft)
    try:
        world.point_to(emulator.process.port)
        node = world.start("rx_node", {})

        def parts() -> int:
            emulator.fly(AT_ONCE)
            return len(list(world.folder.glob(f"{first.stem}*.pcapng")))

        wait_until(lambda: parts() >= 4, 120, "four parts")
        node.stop()
    finally:
        emulator.end()
    heard.close()
    first.unlink()
    bag = world.folder / "rest.bag"
    done = replay(first.with_name(f"{first.stem}_part2.pcapng"), "-o", bag)
    assert done.returncode == 0, done.stdout + done.stderr
    topic = f"{world.namespace}/flight_state"
    replayed = payloads_in(bag)
    there, here = (states_by_run_and_time(payloads[topic]) for payloads in (heard.payloads, replayed))
    # It finds X-Plane first, as at every start; from there on all is there but what was lost on the wire.
    assert len(here) > max(100, 0.8 * FPS * (max(here)[1] - min(here)[1]))
    common = sorted(set(there) & set(here))
    assert len(common) > 0.8 * len(here)
    for moment in common:
        assert_same_values(here[moment], there[moment])
    # It asks for two engines first, then for as many as there are.
    states = [EngineStates().deserialize(payload) for payload in replayed[f"{world.namespace}/mission/engines"]]
    assert len(states) > 10
    assert {state.count for state in states} == {engines}
    assert not any(math.isnan(command) for command in states[-1].throttle_command[:engines])
