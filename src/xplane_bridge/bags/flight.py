"""A recorded flight as a whole: every topic of the bridge that the bag has, found by message type."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Optional

import numpy as np

from xplane_bridge.bags import FLIGHT_STATE, BagError, Bags, Table, TopicInfo
from xplane_bridge.bags.cameras import Camera, cameras
from xplane_bridge.bags.events import RecordedEvent, events_of
from xplane_bridge.bags.once import warn_once
from xplane_bridge.bags.segments import disordered, segments

if TYPE_CHECKING:
    from xplane_bridge.bags.columns import ColumnFile
    from xplane_bridge.bags.units import Unit

ODOMETRY = "nav_msgs/Odometry"
LABEL = "std_msgs/String"
#: Role in a flight to message type.
ROLES = {
    "state": FLIGHT_STATE,
    "controls": "xplane_bridge/ControlStates",
    "surfaces": "xplane_bridge/SurfaceStates",
    "engines": "xplane_bridge/EngineStates",
    "fuel": "xplane_bridge/FuelState",
    "sim": "xplane_bridge/SimStatus",
    "applied": "xplane_bridge/AppliedCommand",
    "mode": "xplane_bridge/ControlMode",
    "failures": "xplane_bridge/FailureState",
    "excitation": "xplane_bridge/ExcitationState",
    "disturbance": "xplane_bridge/DisturbanceState",
    "link": "xplane_bridge/LinkState",
    "events": "xplane_bridge/EventList",
    "odom": ODOMETRY,
    "label": LABEL,
}


class CameraFrames(NamedTuple):
    """What was recorded of a camera, but for its pictures."""

    camera: Camera
    table: Table  #: its FrameStates
    constants: dict[str, Any]  #: of FrameState


@dataclass
class Flight:
    """Tables by role; a role without messages in the bag is absent."""

    name: str
    topics: dict[str, TopicInfo]
    times: dict[str, np.ndarray]  #: receive times [ns] of every topic that has messages
    tables: dict[str, Table] = field(default_factory=dict)
    units: dict[str, dict[str, Unit]] = field(default_factory=dict)
    constants: dict[str, dict[str, Any]] = field(default_factory=dict)
    parts: list[slice] = field(default_factory=list)  #: segments of the state: not to be bridged
    events: list[RecordedEvent] = field(default_factory=list)  #: in the order of their stamps
    cameras: list[CameraFrames] = field(default_factory=list)  #: the bridge's own first

    @property
    def start(self) -> int:
        """[ns] stamp of the first state, or of the first message where there is no state."""
        if "state" in self.tables:
            return int(self.tables["state"].stamp[0])
        return min(int(t[0]) for t in self.times.values())

    @property
    def end(self) -> int:
        """[ns] stamp of the last state, or of the last message."""
        if "state" in self.tables:
            return int(self.tables["state"].stamp[-1])
        return max(int(t[-1]) for t in self.times.values())


def odometry_topic(bags: Bags) -> Optional[str]:
    """Find the bridge's odometry: `odom` beside the flight state, else where mavros.launch has it; None without.

    Estimators publish the same type, so that it is found by its name. Without a flight state to be beside of, that name
    must be the only one.
    """
    found = [name for name, info in bags.topics.items() if info.msgtype == ODOMETRY and info.count]
    beside = f"{bags.name_space}/odom"
    if beside in found:
        return beside
    ending = "/odom" if bags.topic_of_type(FLIGHT_STATE) is None else "/local_position/odom"
    named = [name for name in found if name.endswith(ending)]
    return named[0] if len(named) == 1 else None


def _topic(bags: Bags, msgtype: str) -> Optional[str]:
    """The bridge's topic of a type; types that others publish as well are found by name."""
    if msgtype == ODOMETRY:
        return odometry_topic(bags)
    if msgtype == LABEL:
        return f"{bags.name_space}/scenario/label"
    return bags.topic_of_type(msgtype)


def read_flight(bags: Bags, store: Optional[ColumnFile] = None) -> Flight:
    """Read everything but images.

    Args:
        bags: Open bags of one flight.
        store: Where the columns are kept (`Bags.read`); in memory when omitted.

    Raises:
        BagError: The bags hold no message at all, or are damaged.
    """
    topics = bags.topics
    filled = [name for name, info in topics.items() if info.count]
    if not filled:
        names = ", ".join(str(path) for path in bags.paths)
        msg = f"{names}: no message in it; nothing was recorded"
        raise BagError(msg)
    flight = Flight(bags.paths[0].stem, topics, {name: bags.times(name) for name in filled})
    for role, msgtype in ROLES.items():
        topic = _topic(bags, msgtype)
        if topic is None or topic not in filled:
            continue
        flight.tables[role] = bags.read(topic, store=store).by_stamp()
        flight.units[role] = bags.units(topic)
        flight.constants[role] = bags.constants(topic)
    if "events" in flight.tables:
        flight.events = events_of(flight.tables["events"])
    for camera in cameras(bags):
        table = bags.read(camera.frames, store=store).by_stamp()
        flight.cameras.append(CameraFrames(camera, table, bags.constants(camera.frames)))
    if "state" in flight.tables:
        state = flight.tables["state"]
        flight.parts = segments(state.stamp, state_epochs(bags, state))
    return flight


def state_epochs(bags: Bags, state: Table) -> np.ndarray:
    """Count anew the epochs of flight states that are sorted by stamp: a part of one epoch has one time that goes on.

    What a clock that was set back has laid among each other has an epoch of its own, each state; the log says so. It is
    found in a recording that does not show the order in which states came, as `rosbag compress` writes it; elsewhere
    time goes on over the step (`bags.restarts`).

    Args:
        bags: From which the states were read.
        state: With ``epoch`` and ``sim_time_unwrapped``.
    """
    epoch = state["epoch"].astype(np.int64)
    mixed = disordered(epoch, state["sim_time_unwrapped"])
    if not mixed.any():
        return epoch
    warn_once(
        f"{bags.paths[0]}: the host's clock was set back in flight: by their stamps {mixed.sum()} flight states lie "
        "among others of another time, and each stands for itself; let the clock be slewed, not stepped, while flights "
        "are recorded"
    )
    return np.cumsum(np.append(False, (np.diff(epoch) != 0) | mixed[1:] | mixed[:-1]))
