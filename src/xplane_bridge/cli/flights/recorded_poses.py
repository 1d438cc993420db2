"""Plays the poses of a recording into the simulator of a running bridge, whose flight model stands still meanwhile."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple

import numpy as np

from xplane_bridge import lockstep
from xplane_bridge.bags import FLIGHT_STATE, Bags
from xplane_bridge.cli.bridge.waiting import wait_for_service, wait_for_state
from xplane_bridge.cli.entry import start_node
from xplane_bridge.cli.flights.borrowed import Borrowed, ReplayError, answered
from xplane_bridge.cli.flights.recorded_commands import NotAsAskedError, elapsed_of, fields_of, first_of, place
from xplane_bridge.harness.pose_sender import PATH_OVERRIDE, SCENERY, PoseSender, Scenery
from xplane_bridge.units import EARTH_RADIUS_M

_NODE = "rerun_flight"
_COLUMNS = ("latitude", "longitude", "altitude_msl", *(f"orientation.{axis}" for axis in "xyzw"))
_VELOCITY = tuple(f"velocity_ned.{axis}" for axis in "xyz")
_LINK_S = 30.0
_GIVEN_BACK_S = 10.0
_STATE_S = 10.0
_NEAR_M = 100.0  # of its place, the scenery there is loaded
_LOST_M = 10000.0  # further from where it was put, local coordinates mean another place


class Poses(NamedTuple):
    """Where the aircraft was."""

    time: np.ndarray  #: [s] of simulated time since the first
    columns: Dict[str, np.ndarray]
    start: Any  #: fields of the flight state with the first, by name

    def at(self, time: float) -> Dict[str, float]:
        """The pose at a time, linear between two; the first or last one outside."""
        k = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2))
        span = self.time[k + 1] - self.time[k]
        share = float(np.clip((time - self.time[k]) / span, 0.0, 1.0)) if span > 0.0 else 0.0
        ends = [np.array([column[i] for column in self.columns.values()], dtype=float) for i in (k, k + 1)]
        names = list(self.columns)
        turn = slice(names.index("orientation.x"), names.index("orientation.w") + 1)
        if ends[0][turn] @ ends[1][turn] < 0.0:  # both signs are the same attitude
            ends[1][turn] *= -1.0
        east = names.index("longitude")  # the shorter way round
        ends[1][east] = ends[0][east] + math.remainder(ends[1][east] - ends[0][east], 360.0)
        pose = ends[0] + share * (ends[1] - ends[0])
        pose[east] = math.remainder(pose[east], 360.0)
        pose[turn] /= np.linalg.norm(pose[turn])
        return dict(zip(names, map(float, pose)))


def read_poses(bag: Path) -> Poses:
    """Reads where the aircraft was.

    Raises:
        BagError: The bag cannot be read.
        ReplayError: There are no two valid poses in it.
    """
    with Bags(bag) as bags:
        topic = bags.topic_of_type(FLIGHT_STATE)
        state = bags.read(topic) if topic is not None and bags.topics[topic].count else None
    if state is not None:
        elapsed = elapsed_of(state)
        columns = {name: np.asarray(state[name], dtype=float) for name in _COLUMNS + _VELOCITY}
        good = np.all([np.isfinite(column) for column in columns.values()], axis=0)
        good[: first_of(state)] = False
        if good.sum() >= 2:
            time = elapsed[good]
            start = fields_of(state, int(np.argmax(good)))
            return Poses(time - time[0], {name: column[good] for name, column in columns.items()}, start)
    raise ReplayError(f"{bag}: no two flight states with a valid pose in it")


def play_poses(poses: Poses, namespace: str, say: Callable[[str], None]) -> None:
    """Plays them, and gives the flight model back, whatever ends it; where it is killed, tx_node does on its exit.

    Raises:
        ReplayError: The bridge refuses, or does not know its simulator.
    """
    rospy = start_node(_NODE, anonymous=True, disable_signals=True)
    from xplane_bridge.msg import FlightState, LinkState
    from xplane_bridge.srv import GetDataref, SetDataref

    if lockstep.is_on(namespace):
        raise ReplayError(f"{namespace} is in lock-step, where only tx_node may write; --pose needs real time")
    wait_for_state(namespace, _NODE)
    for service in ("tx_node/set_dataref", "tx_node/reset_flight", "get_dataref"):
        wait_for_service(f"{namespace}/{service}", _NODE)
    read = rospy.ServiceProxy(f"{namespace}/get_dataref", GetDataref)
    # By the simulator's own way first: it loads the scenery there, which moves the origin of its coordinates.
    _place_near(poses.start, namespace, say)
    answers = [read(name=name, timeout=0.0) for name in SCENERY]
    for name, answer in zip(SCENERY, answers):
        if not answer.success:
            raise ReplayError(f"{name}: {answer.result.message}")
    try:
        link = rospy.wait_for_message(f"{namespace}/link_state", LinkState, _LINK_S)
    except rospy.ROSException as error:
        raise ReplayError(f"{namespace}/link_state: {error}") from None
    service = f"{namespace}/tx_node/set_dataref"
    proxy = rospy.ServiceProxy(service, SetDataref)

    def write(value: float) -> Any:
        return answered(service, lambda: proxy(name=PATH_OVERRIDE, values=[value]))

    def shown() -> Any:  # X-Plane may be slow to show it
        return answered(f"{namespace}/get_dataref", lambda: read(name=PATH_OVERRIDE, timeout=_GIVEN_BACK_S))

    def give_back() -> None:
        give_flight_model_back(lambda: write(0.0), shown)
        say("the flight model flies again")

    sender = PoseSender(link.host, link.port, Scenery(*(answer.values[0] for answer in answers)))
    over = threading.Event()
    begin: List[float] = []
    sent: List[Dict[str, float]] = []
    lost: List[Dict[str, float]] = []

    def on_state(state: Any) -> None:
        if not begin:
            begin.append(state.sim_time_unwrapped)
        time = state.sim_time_unwrapped - begin[0]
        if sent and far(state, sent[-1]) > _LOST_M:
            lost.append(sent[-1])
        if lost or time > poses.time[-1]:
            over.set()
            return
        sent[:] = [poses.at(time)]
        sender.send(sent[-1])

    with Borrowed(_NODE, rospy, give_back) as borrowed:
        taken = write(1.0)
        if not taken.success:
            raise ReplayError(f"{PATH_OVERRIDE}: {taken.result.message}")
        states = rospy.Subscriber(f"{namespace}/flight_state", FlightState, on_state, queue_size=1, tcp_nodelay=True)
        try:
            say(f"playing {len(poses.time)} poses, {poses.time[-1]:.1f} s")
            borrowed.wait(over)
        finally:
            states.unregister()
            sender.close()
    if lost:
        raise ReplayError("the aircraft is not shown where it was put: the simulator has moved its scenery's origin")
    say("played")


def _place_near(start: Any, namespace: str, say: Callable[[str], None]) -> None:
    """Places the aircraft; its attitude and speed may be others than asked for, as each pose sets them.

    Raises:
        ReplayError: It is refused, does not come about, or the aircraft is not shown near its place.
        WaitError: ROS ended.
    """
    import rospy

    from xplane_bridge.msg import FlightState

    try:
        place(start, namespace)
    except NotAsAskedError as error:
        try:
            state = rospy.wait_for_message(f"{namespace}/flight_state", FlightState, _STATE_S)
        except rospy.ROSException:
            raise error from None
        if not far(state, start) < _NEAR_M:  # also where its place is not known
            raise
        say(f"{error}; its place is near enough for poses")


def far(state: Any, start: Any) -> float:
    """[m] from a flight state to where another one (fields by name) was."""
    north = np.radians(state.latitude - start["latitude"])
    turn = math.remainder(state.longitude - start["longitude"], 360.0)
    east = np.radians(turn) * np.cos(np.radians(start["latitude"]))
    return float(np.hypot(np.hypot(north, east) * EARTH_RADIUS_M, state.altitude_msl - start["altitude_msl"]))


def give_flight_model_back(write: Callable[[], Any], shown: Callable[[], Any]) -> None:
    """Releases the flight model.

    Args:
        write: writes 0; gives the answer of set_dataref, which reads back.
        shown: gives the answer of get_dataref, which is asked where that has not seen it, or tx_node is gone.

    Raises:
        ReplayError: It is not seen given back; says what stays, and what to do.
    """
    try:
        written = write()
        if written.success:
            return
        problem = str(written.result.message)
    except ReplayError as error:
        problem = str(error)
    try:
        answer = shown()
        if answer.success and answer.values[0] == 0.0:
            return
    except ReplayError as error:
        problem = f"{problem}; {error}"
    raise ReplayError(
        f"{PATH_OVERRIDE} is not seen given back, and the flight model may stand still: {problem}. tx_node gives "
        "it back when it ends; if it has ended already, or is to go on: scripts/release_overrides"
    )
