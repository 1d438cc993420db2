"""record_watch: warns of what a recording lacks, states or a camera; record.launch starts it beside the recorder."""

from __future__ import annotations

import argparse
import time
from typing import Any, Callable, Optional, Sequence

from xplane_bridge import lockstep
from xplane_bridge.cli.bridge.waiting import Listener, Patience, Surroundings, link_text, surroundings
from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.topics import NAMESPACE, absolute

_POLL_S = 0.1
_LOOK_S = 2.0  # between two looks at the master
_FRAMES = "camera/frame_state"


class StateWatch:
    """Reports when flight states stop coming, and when they come again.

    Args:
        patience: Says why there are none.
        say: Called when they come, after that was said.
    """

    def __init__(self, patience: Patience, say: Any) -> None:
        self._patience = patience
        self._say = say
        self._seen: Any = None

    def look(self, newest: Any) -> None:
        """Takes the newest state, or None; called a few times a second."""
        if newest is self._seen:
            self._patience.look()
            return
        self._seen = newest
        self._patience.restart()
        if self._patience.spoken:
            self._patience.forget()
            self._say("flight states are recorded now")


class CameraWatch:
    """Warns of cameras that are not recorded while the bridge's own is: their pictures would be missed only later.

    Args:
        namespace: Of the bridge, without a slash at its end.
        say: Called once for each.
    """

    def __init__(self, namespace: str, say: Callable[[str], None]) -> None:
        self._namespace = namespace
        self._say = say
        self._said: set[str] = set()

    def look(self, there: Optional[Surroundings]) -> None:
        """Takes what the master knows, or None."""
        if there is None:
            return
        recorder, place = f"{self._namespace}/record", f"{self._namespace}/"
        recorded = {topic for topic, nodes in there.subscribers.items() if recorder in nodes}
        if place + _FRAMES not in recorded:
            return
        for topic in sorted(topic for topic, nodes in there.publishers.items() if nodes and topic not in recorded):
            name = topic[len(place) : -len(_FRAMES) - 1]
            of_camera = name and topic.startswith(place) and topic.endswith(f"/{_FRAMES}")
            another_bridge = f"{place}{name}/flight_state" in there.publishers
            if of_camera and not another_bridge and name not in self._said:
                self._said.add(name)
                self._say(f"camera {name} is not recorded: record.launch takes it with cameras:={name}")


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    p = argparse.ArgumentParser(
        prog="record_watch",
        description="Warns while no flight states come, because a recording has no flight then, and of cameras that "
        "are not recorded.",
    )
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    args = p.parse_args(ros_arguments(argv))
    rospy = start_node("record_watch", anonymous=True)
    namespace = args.namespace.rstrip("/")
    if lockstep.is_on(namespace):
        return 0  # who keeps a frame waiting is tx_node's to say, and a listener to each frame slows the flight down
    from xplane_bridge.msg import FlightState, LinkState

    link = Listener(f"{namespace}/link_state", LinkState)
    states = Listener(f"{namespace}/flight_state", FlightState)
    patience = Patience(
        lambda: f"no flight is recorded: {states.why_none(link_text(link.last))}",
        lambda text: rospy.logwarn("%s", text),
    )
    watch = StateWatch(patience, lambda text: rospy.loginfo("%s", text))
    cameras = CameraWatch(namespace, lambda text: rospy.logwarn("%s", text))
    next_look = 0.0
    while not rospy.is_shutdown():
        watch.look(states.last)
        if time.monotonic() >= next_look:
            cameras.look(surroundings())
            next_look = time.monotonic() + _LOOK_S
        time.sleep(_POLL_S)
    return 0
