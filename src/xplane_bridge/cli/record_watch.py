"""record_watch: warns while a recording gets no flight states; launch/record.launch starts it beside the recorder."""

from __future__ import annotations

import argparse
import time
from typing import Any, Optional, Sequence

from xplane_bridge import lockstep
from xplane_bridge.cli.bridge.waiting import Listener, Patience, link_text
from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.topics import NAMESPACE

_POLL_S = 0.1


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


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    p = argparse.ArgumentParser(
        prog="record_watch", description="Warns while no flight states come, because a recording has no flight then."
    )
    p.add_argument("--namespace", default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    args = p.parse_args(ros_arguments(argv))
    rospy = start_node("record_watch", anonymous=True)
    from xplane_bridge.msg import FlightState, LinkState

    namespace = args.namespace.rstrip("/")
    if lockstep.is_on(namespace):
        return 0  # who keeps a frame waiting is tx_node's to say, and a listener to each frame slows the flight down
    link = Listener(f"{namespace}/link_state", LinkState)
    states = Listener(f"{namespace}/flight_state", FlightState)
    patience = Patience(
        lambda: f"no flight is recorded: {states.why_none(link_text(link.last))}",
        lambda text: rospy.logwarn("%s", text),
    )
    watch = StateWatch(patience, lambda text: rospy.loginfo("%s", text))
    while not rospy.is_shutdown():
        watch.look(states.last)
        time.sleep(_POLL_S)
    return 0
