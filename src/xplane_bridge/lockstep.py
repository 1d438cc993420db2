"""A node's part in lock-step (docs/experiments/lockstep.md): an answer to every flight_state, commanding or not."""

from __future__ import annotations

import threading
import warnings
from collections import deque
from typing import Any, Callable, Deque, Dict, Optional

from xplane_bridge.topics import NAMESPACE

#: What publishers of answers need at least: none may be lost before tx_node listens, nor where a recorder is slow.
PUBLISHER = {"queue_size": 100, "latch": True, "tcp_nodelay": True}


def advertise(topic: str, message_type: Any) -> Any:
    """Gives a publisher of answers: as with `**PUBLISHER`, but what is published is written at once.

    With a queue rospy has a thread for each subscriber, which costs more time than the message; without one a
    subscriber that is slow slows down the flight and misses nothing.

    Args:
        topic: Full name.
        message_type: Its class.
    """
    import rospy

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The publisher should be created with", SyntaxWarning)  # with a queue
        return rospy.Publisher(topic, message_type, latch=True, tcp_nodelay=True)


def is_on(namespace: str = NAMESPACE) -> bool:
    """Whether the bridge flies in lock-step. Needs a ROS master."""
    import rospy

    return bool(rospy.get_param(f"{namespace.rstrip('/')}/lockstep/enabled", False))


def node_options(namespace: str = NAMESPACE) -> Dict[str, Any]:
    """Options of `rospy.init_node` for a node that goes by the stamps of states, and so needs no `/clock`.

    With `use_sim_time` rospy takes every message of it, which costs such a node a third of its time.
    """
    try:
        return {"disable_rostime": is_on(namespace)}
    except (OSError, ImportError):  # no master yet, for which init_node waits; no ROS, which start_node reports
        return {}


class Participant:
    """Answers every frame, in a ROS node of this process; the node is to be named in `lockstep/participants`.

    Args:
        answer: Called with each FlightState; gives the message that answers it, or None. Its stamp is set here. What it
            does before it returns belongs to the frame: the simulator waits for it.
        publisher: Where answers go, made by `advertise`. None: nowhere.
        namespace: Of the bridge.
    """

    def __init__(
        self, answer: Callable[[Any], Optional[Any]], publisher: Optional[Any] = None, namespace: str = NAMESPACE
    ) -> None:
        import rospy
        from std_msgs.msg import Header

        from xplane_bridge.msg import FlightState

        topic = namespace.rstrip("/") + "/"
        self._answer, self._publisher, self._header = answer, publisher, Header
        self._closed = False
        self._done = advertise(topic + "lockstep/done", Header)
        self._states = rospy.Subscriber(topic + "flight_state", FlightState, self._on_state, tcp_nodelay=True)

    @property
    def connected(self) -> bool:
        """Whether a node publishes flight states for it."""
        return bool(self._states.get_num_connections())

    def close(self) -> None:
        """Answers no more, nor what `answer` returns from now on."""
        self._closed = True
        self._states.unregister()
        self._done.unregister()

    def _on_state(self, state: Any) -> None:
        message = self._answer(state)
        if self._closed:
            return
        if message is None or self._publisher is None:
            self._done.publish(self._header(stamp=state.header.stamp))
            return
        message.header.stamp = state.header.stamp
        self._publisher.publish(message)


class TopicInStep:
    """What a topic has said up to a time, the same in every run.

    A message may come after later states: connections are not ordered. One that is stamped later shows that all before
    it have come, so the topic must bring messages again and again.

    Args:
        topic: Full name.
        message_type: Its class, with a header.
    """

    def __init__(self, topic: str, message_type: Any) -> None:
        import rospy

        self._topic = topic
        self._last: Any = None  # of those asked for
        self._kept: Deque[Any] = deque()
        self._changed = threading.Condition()
        rospy.Subscriber(topic, message_type, self._take, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        with self._changed:
            self._kept.append(message)
            self._changed.notify_all()

    def before(self, stamp: Any) -> Any:
        """The newest message stamped before `stamp`, which must not go back; None: there is none.

        Waits for one that is not, as long as ROS runs.
        """
        import rospy

        with self._changed:
            while not rospy.is_shutdown():
                while self._kept and self._kept[0].header.stamp < stamp:
                    self._last = self._kept.popleft()
                if self._kept:
                    break
                self._changed.wait(0.2)
        return self._last


class ModeInStep:
    """Who flies, for a participant: as of the end of the frame before the last one, which every run knows alike.

    Args:
        namespace: Of the bridge.
    """

    def __init__(self, namespace: str = NAMESPACE) -> None:
        from xplane_bridge.msg import ControlMode

        self._manual = ControlMode.MANUAL
        self._topic = TopicInStep(namespace.rstrip("/") + "/lockstep/mode", ControlMode)
        self._previous: Any = None  # stamp of the last state

    def at(self, state: Any) -> int:
        """The mode (ControlMode) that counts for a FlightState; to be asked for each, in their order."""
        previous, self._previous = self._previous, state.header.stamp
        known = None if previous is None else self._topic.before(previous)
        return int(self._manual if known is None else known.mode)
