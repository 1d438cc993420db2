"""Writes bags of an analytic flight with the package's own messages: for tests and benchmarks of what reads bags.

The flight is a climbing weave of constant speed: heading 30 sin(0.3 t) deg through north, roll 20 cos(0.3 t) deg,
climb 2 m/s, 60 m/s over ground, no wind. Every number in the bag follows from `state_at`.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any, Mapping

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from xplane_bridge.resources import share_dir

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Recorded

PACKAGE = "xplane_bridge"
SPEED = 60.0  #: [m/s] over ground, horizontal
CLIMB = 2.0  #: [m/s]
START = 1_700_000_000  #: [s] host time of the first sample
_SEPARATOR = "=" * 80 + "\n"


class Definitions:
    """The package's messages and ROS's, as rosbags types, with the full text of each definition."""

    def __init__(self) -> None:
        self.store, self._texts = _parsed()
        self._known: dict[str, tuple[dict[str, tuple[int, Any]], dict[str, Any]]] = {}

    def text(self, msgtype: str) -> str:
        """Give the definition as a recorder stores it: own text with comments, then all it depends on."""
        own = self._texts.get(msgtype)
        if own is None:
            return str(self.store.generate_msgdef(msgtype)[0])
        parts, seen = [own], {msgtype}
        queue = self._needs(msgtype)
        while queue:
            name = queue.pop(0)
            if name in seen or name.startswith("builtin_interfaces/"):
                continue
            seen.add(name)
            body = self._texts.get(name) or str(self.store.generate_msgdef(name)[0]).split(_SEPARATOR)[0]
            parts.append(f"MSG: {name.replace('/msg/', '/')}\n{body}")
            queue += self._needs(name)
        return _SEPARATOR.join(part if part.endswith("\n") else part + "\n" for part in parts)

    def _needs(self, msgtype: str) -> list[str]:
        fields = _fields(self.store)[msgtype][1]
        names = []
        for _, (kind, detail) in fields:
            inner = detail[0] if int(kind) in (3, 4) else (kind, detail)
            if int(inner[0]) == 2:
                names.append(inner[1])
        return names

    def message(self, msgtype: str, values: Mapping[str, Any]) -> Any:
        """Make a message: zeros, false and empty, but for the given fields (nested ones by mapping or message)."""
        kinds, empty = self._prepared(msgtype)
        unknown = set(values) - set(kinds)
        if unknown:
            msg = f"{msgtype} has no field {sorted(unknown)}"
            raise KeyError(msg)
        kwargs = {**empty, **{name: self._value(*kinds[name], given) for name, given in values.items()}}
        return self.store.types[msgtype](**kwargs)

    def _prepared(self, msgtype: str) -> tuple[dict[str, tuple[int, Any]], dict[str, Any]]:
        """The fields of a message, and what each has where nothing is given; most of a message is not given."""
        if msgtype not in self._known:
            kinds = {name: (int(kind), detail) for name, (kind, detail) in _fields(self.store)[msgtype][1]}
            self._known[msgtype] = kinds, {name: self._value(*kinds[name], None) for name in kinds}
        return self._known[msgtype]

    def _value(self, kind: int, detail: Any, given: Any) -> Any:
        if kind == 2:
            return given if given is not None and not isinstance(given, dict) else self.message(detail, given or {})
        if kind == 1:
            base = detail[0] if isinstance(detail, tuple) else detail
            zero = {"string": "", "bool": False}.get(base, 0.0 if base.startswith("float") else 0)
            return zero if given is None else given
        (item_kind, item), size = detail
        base = item[0] if isinstance(item, tuple) else item
        if int(item_kind) == 2:
            return [self._value(2, item, g) for g in given or ()]
        if base == "string":
            return list(given or [])
        dtype = {"bool": np.bool_}.get(base) or np.dtype(base)
        if given is None:
            return np.zeros(size if kind == 3 else 0, dtype=dtype)
        return np.asarray(given, dtype=dtype)


@functools.lru_cache(maxsize=None)
def _parsed() -> tuple[Any, dict[str, str]]:
    """All messages, and the texts of the package's own; once, because that takes longer than writing a bag."""
    store, texts, types = get_typestore(Stores.ROS1_NOETIC), {}, {}
    for file in sorted((share_dir() / "msg").glob("*.msg")):
        name = f"{PACKAGE}/msg/{file.stem}"
        texts[name] = file.read_text(encoding="utf-8")
        types.update(get_types_from_msg(texts[name], name))
    store.register(types)
    return store, texts


def _fields(store: Any) -> Any:
    return store.fielddefs if hasattr(store, "fielddefs") else store.FIELDDEFS  # renamed in rosbags 0.10


def state_at(t: float) -> dict[str, float]:
    """Give the flight at `t` [s]: angles [deg], position in map_ned [m], rates [rad/s]."""
    heading = math.radians(30.0) * math.sin(0.3 * t)
    roll = math.radians(20.0) * math.cos(0.3 * t)
    heading_rate = math.radians(30.0) * 0.3 * math.cos(0.3 * t)
    roll_rate = -math.radians(20.0) * 0.3 * math.sin(0.3 * t)
    pitch = math.atan2(CLIMB, SPEED)
    return {
        "roll_deg": math.degrees(roll),
        "pitch_deg": math.degrees(pitch),
        "heading_true_deg": math.degrees(heading) % 360.0,
        "p": roll_rate - math.sin(pitch) * heading_rate,
        "q": math.sin(roll) * math.cos(pitch) * heading_rate,
        "r": math.cos(roll) * math.cos(pitch) * heading_rate,
        "velocity_north": SPEED * math.cos(heading),
        "velocity_east": SPEED * math.sin(heading),
        "velocity_down": -CLIMB,
        "altitude_msl": 1000.0 + CLIMB * t,
    }


def record_a_clock_set_back(path: Path, step: float = 0.25, order_lost: bool = False) -> None:
    """Record two seconds of states at 50 Hz; after the first, the host's clock is set back.

    Receive times go back at once, stamps when rx_node has read the clock 32 times, at two datagrams a frame: then it
    raises the epoch.

    Args:
        path: The bag to write.
        step: By how much it is set back [s].
        order_lost: Whether messages lie by their receive times, as `rosbag compress` writes them.
    """
    received = [(stamp_ns(k / 50 - (step if k >= 50 else 0.0)), k) for k in range(100)]
    with FlightBag(path) as bag:
        for receive, k in sorted(received) if order_lost else received:
            followed = k >= 66
            header = bag.header(stamp_ns(k / 50 - (step if followed else 0.0)), "base_link_frd")
            state = {**bag.state(k / 50, k), "header": header, "epoch": 1 + followed}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", receive, state)


class FlightBag:
    """A bag being written; use as a context manager."""

    def __init__(self, path: Path, compression: Any = None) -> None:
        self.definitions = Definitions()
        self._writer = Writer(path)
        if compression is not None:
            self._writer.set_compression(compression)
        self._connections: dict[tuple[str, str], Any] = {}

    def __enter__(self) -> FlightBag:
        self._writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def add(self, topic: str, msgtype: str, time_ns: int, values: Mapping[str, Any]) -> None:
        """Write one message; `msgtype` in ROS 1 form (``package/Name``)."""
        name = msgtype.replace("/", "/msg/")
        message = self.definitions.message(name, values)
        self.add_raw(topic, msgtype, time_ns, bytes(self.definitions.store.serialize_ros1(message, name)))

    def add_raw(self, topic: str, msgtype: str, time_ns: int, raw: bytes) -> None:
        """Write one serialised message."""
        key = (topic, msgtype)
        if key not in self._connections:
            name = msgtype.replace("/", "/msg/")
            md5sum = self.definitions.store.generate_msgdef(name)[1]
            self._connections[key] = self._writer.add_connection(
                topic, name, msgdef=self.definitions.text(name), md5sum=md5sum
            )
        self._writer.write(self._connections[key], time_ns, raw)

    def add_recorded(self, topic: Recorded, time_ns: int, raw: bytes) -> None:
        """Write one serialised message of a topic of another bag."""
        key = (topic.topic, topic.msgtype)
        if key not in self._connections:
            self._connections[key] = self._writer.add_connection(
                topic.topic, topic.msgtype.replace("/", "/msg/"), msgdef=topic.definition, md5sum=topic.md5sum
            )
        self._writer.write(self._connections[key], time_ns, raw)

    def header(self, time_ns: int, frame: str, seq: int = 0) -> dict[str, Any]:
        """Give a std_msgs/Header as values."""
        stamp = {"sec": time_ns // 1_000_000_000, "nanosec": time_ns % 1_000_000_000}
        return {"seq": seq, "stamp": stamp, "frame_id": frame}

    def state(self, t: float, seq: int) -> dict[str, Any]:
        """Give the FlightState at `t` [s] as values; every group valid."""
        at = state_at(t)
        ns = stamp_ns(t)
        half = [math.radians(at[name]) / 2 for name in ("roll_deg", "pitch_deg", "heading_true_deg")]
        return {
            "header": self.header(ns, "base_link_frd", seq),
            "valid": 262143,
            "sim_time": np.float32(t),
            "sim_time_unwrapped": t,
            "frame_period": np.float32(0.01),
            "epoch": 1,
            "frame_count": seq,
            "latitude": 37.5 + at["altitude_msl"] * 1e-7,
            "longitude": 127.0,
            "altitude_msl": at["altitude_msl"],
            "position_north": at["velocity_north"] * t,
            "position_east": at["velocity_east"] * t,
            "position_down": -at["altitude_msl"],
            "roll_deg": at["roll_deg"],
            "pitch_deg": at["pitch_deg"],
            "heading_true_deg": at["heading_true_deg"],
            "heading_magnetic_deg": at["heading_true_deg"],
            "orientation": _quaternion(*half),
            "angular_velocity": {"x": at["p"], "y": at["q"], "z": at["r"]},
            "velocity_ned": {"x": at["velocity_north"], "y": at["velocity_east"], "z": at["velocity_down"]},
            "ground_speed": np.float32(SPEED),
            "true_airspeed": np.float32(math.hypot(SPEED, CLIMB)),
            "indicated_airspeed": np.float32(57.0),
            "vertical_speed": np.float32(CLIMB),
            "load_factor_normal": np.float32(1.0),
            "specific_force": {"x": 0.0, "y": 0.0, "z": -9.80665},
        }


def stamp_ns(t: float) -> int:
    """Host time [ns] of flight time `t` [s]."""
    return START * 1_000_000_000 + round(t * 1e9)


def write_states(path: Path, duration: float, rate: float, topic: str = "/xplane/flight_state", **kwargs: Any) -> None:
    """Write a bag with flight states alone: `duration` [s] at `rate` [1/s]."""
    with FlightBag(path, **kwargs) as bag:
        for k in range(round(duration * rate)):
            t = k / rate
            bag.add(topic, f"{PACKAGE}/FlightState", stamp_ns(t), bag.state(t, k))


def _quaternion(roll: float, pitch: float, heading: float) -> dict[str, float]:
    """Half angles [rad] to the quaternion frd -> ned."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    ch, sh = math.cos(heading), math.sin(heading)
    return {
        "w": cr * cp * ch + sr * sp * sh,
        "x": sr * cp * ch - cr * sp * sh,
        "y": cr * sp * ch + sr * cp * sh,
        "z": cr * cp * sh - sr * sp * ch,
    }
