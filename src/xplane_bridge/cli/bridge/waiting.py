"""Programs that wait for a bridge say, after some seconds, what they wait for and what there is instead."""

from __future__ import annotations

import sys
import threading
import time
from types import MappingProxyType
from typing import Any, Callable, Mapping, NamedTuple, Optional, Sequence

from xplane_bridge.errors import XplaneBridgeError

#: A wait of less than this needs no words [s].
PATIENCE_S = 5.0
_POLL_S = 0.1
_LOOK_S = 1.0  # between two looks at the master: it has more to do than to answer us


class WaitError(XplaneBridgeError):
    """ROS ended before what was waited for came."""


class Surroundings(NamedTuple):
    """What the ROS master knows."""

    publishers: Mapping[str, Sequence[str]]  #: topic to the nodes that publish it
    types: Mapping[str, str]  #: topic to the type of its messages
    services: Sequence[str]
    subscribers: Mapping[str, Sequence[str]] = MappingProxyType({})  #: topic to the nodes that take it


def surroundings() -> Optional[Surroundings]:
    """Asks the master; None when it does not answer."""
    import rosgraph

    try:
        master = rosgraph.Master("/xplane_bridge_waiting")
        publishers, subscribers, services = master.getSystemState()
        types = dict(master.getTopicTypes())
    except (OSError, rosgraph.MasterException):
        return None
    return Surroundings(dict(publishers), types, [name for name, _ in services], dict(subscribers))


def about_topic(topic: str, msgtype: str, there: Optional[Surroundings], link: str = "") -> str:
    """Why no message comes on a topic, as far as the master knows.

    Args:
        topic: Full name.
        msgtype: ``package/Name``.
        there: What the master knows; None: it does not answer.
        link: What link_state says, where that was heard.
    """
    if there is None:
        return f"nothing on {topic}: the ROS master does not answer any more"
    if there.publishers.get(topic):
        text = f"nothing on {topic} ({msgtype}), though {_listed(there.publishers[topic])} would publish it"
        return f"{text}; link to X-Plane: {link}" if link else text
    others = sorted(name for name, nodes in there.publishers.items() if nodes and there.types.get(name) == msgtype)
    if others:
        return (
            f"no node publishes {topic} ({msgtype}); topics of that type: {_listed(others)} (choose with --namespace)"
        )
    return (
        f"no node publishes {topic} ({msgtype}), and there is no other topic of that type: "
        "start the bridge (roslaunch xplane_bridge bridge.launch)"
    )


def about_service(service: str, there: Optional[Surroundings]) -> str:
    """The same for a service; others of its kind are those of the same last two names (tx_node/set_mode)."""
    if there is None:
        return f"no service {service}: the ROS master does not answer any more"
    ending = "/" + "/".join(service.split("/")[-2:])
    others = sorted(name for name in there.services if name.endswith(ending))
    if others:
        return f"no service {service}; of that kind there is: {_listed(others)} (choose with --namespace)"
    return f"no service {service}: start the node that has it (bridge.launch starts tx_node unless tx:=false)"


def about_joy(topic: str, there: Optional[Surroundings]) -> str:
    """Why a joystick that is played moves nothing; empty where a node makes something of it.

    Args:
        topic: Full name of `joy`.
        there: What the master knows; None: it does not answer.
    """
    if there is None:
        return ""
    # A recorder or a plot, which publish nothing but their log, fly no aircraft.
    active = {node for name, nodes in there.publishers.items() if name != "/rosout" for node in nodes}
    if active.intersection(there.subscribers.get(topic, [])):
        return ""
    return (
        f"no node takes {topic}: start joystick_mapper_node (roslaunch xplane_bridge bridge.launch joystick:=mapper; "
        "where the bridge runs already: joystick.launch)"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


class Patience:
    """Says why something does not come: after `PATIENCE_S`, and again whenever the reason is another.

    Args:
        why: Gives the reason; called about once a second while it is due.
        say: Called with the line.
    """

    def __init__(self, why: Callable[[], str], say: Callable[[str], None]) -> None:
        self._why = why
        self._say = say
        self._said = ""
        self.restart()

    def restart(self) -> None:
        """What was waited for came: the wait begins anew."""
        self._next = time.monotonic() + PATIENCE_S

    @property
    def spoken(self) -> bool:
        """Whether anything was said."""
        return bool(self._said)

    def forget(self) -> None:
        """The next reason is said, even if it is the one said last."""
        self._said = ""

    def look(self) -> None:
        """Speaks if it is time to."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + _LOOK_S
        text = self._why()
        if text != self._said:
            self._said = text
            self._say(text)


class Listener:
    """The newest message of a topic, and why there is none.

    Args:
        topic: Full name.
        message_type: Its class.
        on_message: Called with each message.
    """

    def __init__(self, topic: str, message_type: Any, on_message: Optional[Callable[[Any], None]] = None) -> None:
        import rospy

        self.topic = topic
        self.msgtype: str = message_type._type
        self.last: Any = None
        self.came = threading.Event()
        self._on_message = on_message
        self._subscriber = rospy.Subscriber(topic, message_type, self._take, queue_size=10, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        self.last = message
        self.came.set()
        if self._on_message is not None:
            self._on_message(message)

    def why_none(self, link: str = "") -> str:
        """Why no message comes."""
        return about_topic(self.topic, self.msgtype, surroundings(), link)

    def close(self) -> None:
        """Ends the subscription."""
        self._subscriber.unregister()


def print_waiting(program: str) -> Callable[[str], None]:
    """A function that writes lines of a waiting program to stderr."""
    return lambda text: print(f"{program}: waiting: {text}", file=sys.stderr, flush=True)


def wait_until(condition: Callable[[], bool], why: Callable[[], str], say: Callable[[str], None]) -> None:
    """Waits until a condition holds, and says why it does not when that takes long.

    Raises:
        WaitError: ROS ended.
    """
    import rospy

    patience = Patience(why, say)
    while not condition():
        if rospy.is_shutdown():
            raise WaitError("ROS ended before it came: " + why())
        patience.look()
        time.sleep(_POLL_S)


def wait_for_state(namespace: str, program: str) -> None:
    """Waits for the first flight_state of a bridge.

    Raises:
        WaitError: ROS ended.
    """
    from xplane_bridge.msg import FlightState, LinkState

    link = Listener(f"{namespace}/link_state", LinkState)
    state = Listener(f"{namespace}/flight_state", FlightState)
    try:
        wait_until(state.came.is_set, lambda: state.why_none(link_text(link.last)), print_waiting(program))
    finally:
        link.close()
        state.close()


def link_text(link: Any) -> str:
    """A LinkState in words; empty for None."""
    return f"{link.state_name.lower()}, {link.reason}" if link is not None else ""


def wait_for_service(service: str, program: str) -> None:
    """Waits until a service is there.

    Raises:
        WaitError: ROS ended.
    """
    import rosservice

    def there() -> bool:
        try:
            return rosservice.get_service_node(service) is not None
        except rosservice.ROSServiceIOException:
            return False

    wait_until(there, lambda: about_service(service, surroundings()), print_waiting(program))
