"""What tests of the wire log share: topics as bytes, and scripts/wire_replay."""

from __future__ import annotations

import os
import struct
import subprocess
from pathlib import Path
from typing import Any, Callable, Mapping, Sequence

from support.deadlines import WAIT_S
from xplane_bridge.bags.chunks import BagFile
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.resources import program

REPLAY_S = 300.0


def log_of(folder: Path, namespace: str, node: str, stem: str = "wire") -> Path:
    """The file that a node of a test's namespace writes with `wire_log` at STEM.pcapng: other than in /xplane, it has
    the namespace in its name."""
    return folder / f"{stem}.{namespace.strip('/').replace('/', '.')}.{node}.pcapng"


class RawTopics:
    """The payloads of topics, as a recorder gets them.

    Args:
        namespace: of the bridge.
        topics: below it.
    """

    def __init__(self, namespace: str, topics: Sequence[str]) -> None:
        import rospy

        self.payloads: dict[str, list[bytes]] = {}
        self._subscribers = [
            rospy.Subscriber(f"{namespace}/{topic}", rospy.AnyMsg, self._take, f"{namespace}/{topic}", tcp_nodelay=True)
            for topic in topics
        ]

    def _take(self, message: Any, topic: str) -> None:
        payloads = self.payloads.setdefault(topic, [])
        # roscpp sends a latched message twice to who subscribes in the moment in which it is published.
        if payloads[-1:] != [message._buff]:
            payloads.append(message._buff)

    def wait_for(self, topic: str, message_type: Any, condition: Callable[[Any], bool], timeout: float = WAIT_S) -> Any:
        """Waits for a message, from the first one on, that fulfils `condition`, and returns it."""
        seen = 0

        def look() -> Any:
            nonlocal seen
            payloads = self.payloads.get(topic, [])
            while seen < len(payloads):
                message = message_type().deserialize(payloads[seen])
                seen += 1
                if condition(message):
                    return message
            return None

        return wait_until(look, timeout, f"fitting message on {topic}")

    def close(self) -> None:
        """Once the publishers have ended: reads to its end what they have sent, and hears no more."""
        connections = [each for subscriber in self._subscribers for each in list(subscriber.impl.connections)]
        read: set[int] = set()

        def all_read() -> bool:  # rospy makes a connection whose end it has read anew, in vain
            read.update(i for i, each in enumerate(connections) if each.done or each.socket is None)
            return len(read) == len(connections)

        wait_until(all_read, WAIT_S, "end of the topics that were heard")
        for subscriber in self._subscribers:
            subscriber.unregister()


def replay(*args: str | Path, env: Mapping[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Runs scripts/wire_replay, with these variables beside those of this process."""
    return subprocess.run(
        [str(program("wire_replay")), *map(str, args)],
        capture_output=True,
        text=True,
        timeout=REPLAY_S,
        check=False,
        env={**os.environ, **(env or {})},
    )


def payloads_in(bag: Path) -> dict[str, list[bytes]]:
    """All messages of a bag by topic."""
    file = BagFile(bag)
    out: dict[str, list[bytes]] = {}
    for id_, connection in file.connections.items():
        out[connection.topic] = [each for _, chunk in file.by_chunk(id_) for each in chunk]
    file.close()
    return out


def by_number(messages: Sequence[bytes]) -> dict[int, bytes]:
    """Messages that begin with a header, by header.seq."""
    return {struct.unpack_from("<I", message)[0]: message for message in messages}


def assert_replayed(live: Sequence[bytes], replayed: Sequence[bytes], topic: str) -> None:
    """Each message that was heard is in the replay; a busy machine's subscriber may have missed some."""
    there, here = by_number(live), by_number(replayed)
    assert there, topic
    assert {number: here.get(number) for number in there} == there, topic


def states_by_run_and_time(payloads: list[bytes]) -> dict[tuple[int, float], Any]:
    """Flight states by X-Plane's run and simulator time; of the same time in one run, the first. Each run is an epoch,
    and there must be states of the first.
    """
    from xplane_bridge.msg import FlightState

    out: dict[tuple[int, float], Any] = {}
    epochs: list[int] = []
    for payload in payloads:
        state = FlightState().deserialize(payload)
        if state.epoch not in epochs:
            epochs.append(state.epoch)
        out.setdefault((epochs.index(state.epoch), state.sim_time), state)
    return out


def assert_same_values(mine: Any, theirs: Any) -> None:
    """What a FlightState shows of X-Plane is the same, and its stamp is nearly."""
    assert (mine.roll_deg, mine.pitch_deg, mine.latitude) == (theirs.roll_deg, theirs.pitch_deg, theirs.latitude)
    assert abs((mine.header.stamp - theirs.header.stamp).to_sec()) < 1.0
