"""Plays the modes and commands of a recording through a running bridge, by simulated time."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Callable, List, NamedTuple, Optional

import numpy as np

from xplane_bridge import lockstep
from xplane_bridge.bags import FLIGHT_STATE, Bags, Table
from xplane_bridge.cli.bridge.waiting import Listener, print_waiting, wait_for_service, wait_for_state, wait_until
from xplane_bridge.cli.entry import start_node
from xplane_bridge.cli.flights.borrowed import Borrowed, ReplayError, answered
from xplane_bridge.constants import FlightMode, words

_NODE = "rerun_flight"
#: Topics that are played, with their types.
_PLAYED = {
    "control/manual": "ControlCommand",
    "control/auto": "ControlCommand",
    "control/surfaces": "SurfaceCommand",
    "control/mode": "ControlMode",
}
#: Fields of a flight state by which an aircraft is placed as in it.
PLACED_BY = (
    "latitude", "longitude", "altitude_msl", "roll_deg", "pitch_deg", "heading_true_deg", "true_airspeed",
    "flight_path_angle_deg",
)  # fmt: skip
_PLACED_S = 180.0  # tx_node waits for its load_timeout, of 120 s, and for pauses
_MODE_S = 0.1  # between two looks whether another mode is recorded
_MODE_NAMES = words(FlightMode)


class NotAsAskedError(ReplayError):
    """The outcome of reset_flight is that not all is as it was asked to be; the aircraft may be placed."""


class Played(NamedTuple):
    """One message to send."""

    time: float  #: [s] of simulated time since the state `start`; what was sent before is sent with it
    topic: str
    raw: bytes
    md5sum: str


class Commands(NamedTuple):
    """What a recording holds of who flew, and how."""

    messages: List[Played]  #: by time
    start: Any  #: fields, by name, of the flight state as which the aircraft is placed
    duration: float  #: [s] of simulated time from there


def read_commands(bag: Path) -> Commands:
    """Reads modes and commands.

    Raises:
        BagError: The bag cannot be read.
        ReplayError: There is no flight, or no command in it.
    """
    with Bags(bag) as bags:
        topic = bags.topic_of_type(FLIGHT_STATE)
        if topic is None or not bags.topics[topic].count:
            raise ReplayError(f"{bag}: no flight state in it, by whose simulated time commands are played")
        namespace = topic[: -len("/flight_state")]
        state = bags.read(topic)
        first = first_of(state)
        elapsed = elapsed_of(state)
        elapsed = np.maximum(elapsed - elapsed[first], 0.0)
        there = [f"{namespace}/{name}" for name in _PLAYED if f"{namespace}/{name}" in bags.topics]
        messages = []
        for recorded, time_ns, raw in bags.recorded(there) if there else ():
            time = float(np.interp(time_ns - state.time[0], state.time - state.time[0], elapsed))
            messages.append(Played(time, recorded.topic[len(namespace) + 1 :], raw, recorded.md5sum))
    if not any(message.topic != "control/mode" for message in messages):
        raise ReplayError(f"{bag}: no command in it: {', '.join(_PLAYED)} were not recorded, or no command was sent")
    return Commands(messages, fields_of(state, first), float(elapsed[-1]))


def first_of(state: Table) -> int:
    """The row of the first flight state as which an aircraft can be placed; else of the first one."""
    known = np.all([np.isfinite(state[name]) for name in PLACED_BY if name in state], axis=0)
    return int(np.argmax(known))


def fields_of(state: Table, row: int) -> Any:
    """Fields of one flight state, by name."""
    return {name: column[row] for name, column in state.columns.items() if column.ndim == 1}


def elapsed_of(state: Table) -> np.ndarray:
    """Simulated time [s] since the first flight state, which stands where it jumps."""
    steps = np.diff(state["sim_time_unwrapped"])
    steps = np.where((np.diff(state["epoch"]) == 0) & (steps > 0.0), steps, 0.0)
    return np.concatenate(([0.0], np.cumsum(steps)))


def play(commands: Commands, namespace: str, say: Callable[[str], None]) -> None:
    """Places the aircraft, plays, and gives the stick back, whatever ends it.

    That is mode MANUAL, from which its commands time out.

    Raises:
        ReplayError: The bridge refuses, its messages are others than the recorded ones, or the flight is reset.
    """
    rospy = start_node(_NODE, anonymous=True, disable_signals=True)
    from xplane_bridge import msg
    from xplane_bridge.srv import SetMode

    if lockstep.is_on(namespace):
        raise ReplayError(f"{namespace} is in lock-step, where commands answer frames: rerun_flight without --commands")
    types = {topic: getattr(msg, name) for topic, name in _PLAYED.items()}
    for message in commands.messages:
        if message.md5sum != types[message.topic]._md5sum:
            raise ReplayError(f"{message.topic} of the recording is of another version; `rosbag fix` brings it to this")
    publishers = {
        topic: rospy.Publisher(f"{namespace}/{topic}", types[topic], queue_size=100, tcp_nodelay=True)
        for topic in _PLAYED
        if topic != "control/mode"
    }
    wait_for_state(namespace, _NODE)
    wait_for_service(f"{namespace}/tx_node/reset_flight", _NODE)
    service = f"{namespace}/tx_node/set_mode"
    proxy = rospy.ServiceProxy(service, SetMode)

    def set_mode(mode: int) -> Any:
        return answered(service, lambda: proxy(mode=mode))

    def give_back() -> None:
        give_stick_back(lambda: set_mode(SetMode._request_class.MANUAL), service)

    player = _Player(commands, publishers, types, set_mode, say)
    place(commands.start, namespace)
    with Borrowed(_NODE, rospy, give_back) as borrowed:
        topics = (("control/mode", msg.ControlMode, player.on_mode), ("flight_state", msg.FlightState, player.on_state))
        heard = [rospy.Subscriber(f"{namespace}/{topic}", *rest, tcp_nodelay=True) for topic, *rest in topics]
        try:
            say(f"playing {len(commands.messages)} messages, {commands.duration:.1f} s")
            while not borrowed.wait(player.over, _MODE_S):
                player.change_mode()
        finally:
            player.over.set()
            for each in heard:
                each.unregister()
        if player.problem:
            raise ReplayError(player.problem)
    say("played")


def give_stick_back(set_manual: Callable[[], Any], service: str) -> None:
    """Asks for mode MANUAL.

    Args:
        set_manual: asks for it; gives the answer of set_mode.
        service: its name.

    Raises:
        ReplayError: It is not seen set; says what stays, and what to do.
    """
    try:
        answer = set_manual()
        problem = "" if answer.success else f"{service}: {answer.result.message}"
    except ReplayError as error:
        problem = str(error)
    if problem:
        raise ReplayError(
            f"mode MANUAL is not set: {problem}. If tx_node runs, it keeps its mode, and in AUTO the failsafe flies: "
            f'rosservice call {service} "mode: 1". If it has ended, and X-Plane does not get its controls back: '
            "scripts/release_overrides"
        )


def place(start: Any, namespace: str) -> None:
    """Places the aircraft as a flight state (fields by name) says, and waits until it is: that also ends AUTO.

    Raises:
        NotAsAskedError: tx_node says that not all of it has come about.
        ReplayError: It is refused, or its outcome is not shown.
        WaitError: ROS ended.
    """
    import rospy

    from xplane_bridge.msg import EventList
    from xplane_bridge.srv import ResetFlight

    answer = rospy.ServiceProxy(f"{namespace}/tx_node/reset_flight", ResetFlight)(
        **{**{name: start[name] for name in PLACED_BY}, "heading_true_deg": start["heading_true_deg"] % 360.0}
    )
    if not answer.success:
        raise ReplayError(f"the aircraft is not placed: {answer.result.message}")
    events = Listener(f"{namespace}/events", EventList)  # latched: one that has come is heard, too
    deadline = time.monotonic() + _PLACED_S

    def outcome() -> Any:
        there = events.last.events if events.last is not None else ()
        return next((event for event in there if event.number == answer.event_number), None)

    def waits_for() -> str:
        return f"reset_flight, whose event {answer.event_number} is not on {events.topic} yet"

    try:
        wait_until(lambda: outcome() or time.monotonic() > deadline, waits_for, print_waiting(_NODE))
    finally:
        events.close()
    event = outcome()
    if event is None:
        raise ReplayError(
            f"no end of reset_flight (event {answer.event_number}) on {events.topic} within {_PLACED_S:g} s: start "
            "rerun_flight again when X-Plane has loaded the place; if tx_node has ended, start it first"
        )
    if not event.success:
        raise NotAsAskedError(event.text)


class _Player:
    """Sends what is due at each state of a flight that begins with the first one."""

    def __init__(
        self, commands: Commands, publishers: Any, types: Any, set_mode: Any, say: Callable[[str], None]
    ) -> None:
        self._commands, self._publishers, self._types = commands, publishers, types
        self._set_mode, self._say = set_mode, say
        self._next = 0
        self._begin = 0.0
        self._epoch: Any = None
        self._wanted = self._asked = 0  # none yet
        self._shown: Optional[int] = None
        self.over = threading.Event()
        self.problem = ""  #: why it is over before its time

    def on_state(self, state: Any) -> None:
        """Takes a state of the flight."""
        if self.over.is_set():
            return
        if self._epoch is None:
            self._begin, self._epoch = state.sim_time_unwrapped, state.epoch
        if state.epoch != self._epoch:
            self.problem = (
                "simulated time was interrupted while the recording was played: the flight was reset or placed anew, "
                "X-Plane was lost, its own replay began or ended, or the clock of rx_node's computer was set back. The "
                "rest is not played; start rerun_flight again"
            )
            self.over.set()
            return
        now = state.sim_time_unwrapped - self._begin
        messages = self._commands.messages
        while self._next < len(messages) and messages[self._next].time <= now:
            due = messages[self._next]
            message = self._types[due.topic]().deserialize(due.raw)
            if due.topic == "control/mode":
                self._wanted = message.mode
            else:
                self._publishers[due.topic].publish(message)
            self._next += 1
        if now >= self._commands.duration:
            self.over.set()

    def on_mode(self, message: Any) -> None:
        """Takes the mode that is shown; says where it ends before the recording has another one."""
        shown, self._shown = self._shown, message.mode
        if shown == self._asked != message.mode and not self.over.is_set():
            self._say(f"mode {_MODE_NAMES[shown]} of the recording has ended: {message.reason}")

    def change_mode(self) -> None:
        """Asks for the recorded mode, where it is another; not from the thread of the states, as it waits."""
        if self._wanted != self._asked:
            self._asked = self._wanted
            answer = self._set_mode(self._asked)
            if not answer.success:  # the flight goes on: the stick may have taken over, as it did when recorded
                self._say(f"mode {_MODE_NAMES[self._asked]} of the recording is not set: {answer.result.message}")
