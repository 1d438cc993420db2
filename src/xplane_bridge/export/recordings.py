"""Whole recordings for other tools: MCAP with ROS 1 messages as they were recorded, and ROS 2 bags."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Mapping, NamedTuple, Sequence

from xplane_bridge import __version__
from xplane_bridge.bags import BagError
from xplane_bridge.export.flight import ExportError, full_names

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags, Recorded

_HEADER = "std_msgs/msg/Header"
#: Types that ROS 2 calls otherwise.
_RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}


class Counts(NamedTuple):
    """What the manifest says of a recording."""

    topics: int
    messages: int


def write_mcap(bags: Bags, path: Path, only: Sequence[str] = ()) -> Counts:
    """Copy a recording into an MCAP file of the profile ``ros1``: bytes, times and definitions as they are in the bag.

    Args:
        bags: Open bags of one flight.
        path: The file to write.
        only: The topics to copy; all when empty.

    Raises:
        ExportError: The package mcap is not installed.
        BagError: No such topic, or damaged data.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        msg = "--format mcap needs the package mcap: pip install mcap (or this package with its extra [export])"
        raise ExportError(msg) from None
    schemas: dict[tuple[str, str], int] = {}
    channels: dict[Recorded, int] = {}
    sequences: dict[int, int] = {}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1", library=f"xplane_bridge {__version__}")
        for source, time, raw in bags.recorded(full_names(bags, only), as_written=True):
            if source not in channels:
                schema = (source.msgtype, source.definition)
                if schema not in schemas:
                    text = source.definition.encode("utf-8")
                    schemas[schema] = writer.register_schema(source.msgtype, "ros1msg", text)
                about = {"topic": source.topic, "md5sum": source.md5sum, "callerid": source.callerid}
                about["latching"] = "true" if source.latching else "false"
                channels[source] = writer.register_channel(source.topic, "ros1", schemas[schema], about)
            channel = channels[source]
            sequences[channel] = sequences.get(channel, -1) + 1
            writer.add_message(channel, time, bytes(raw), time, sequences[channel])
        writer.finish()
    return Counts(len({source.topic for source in channels}), sum(number + 1 for number in sequences.values()))


def write_ros2(bags: Bags, path: Path, only: Sequence[str] = ()) -> Counts:
    """Convert a recording into a ROS 2 bag (SQLite, version 8: what Humble and later read).

    Messages have the bag's own definitions, without the header's `seq`; where ROS 2 has a type of that name whose data
    lie alike, its names of the fields are taken (``CameraInfo.K`` is ``k`` there).

    Args:
        bags: Open bags of one flight.
        path: The folder to make.
        only: The topics to convert; all when empty.

    Raises:
        BagError: No such topic, damaged data, or a topic with two definitions.
    """
    from rosbags.convert.converter import LATCH
    from rosbags.typesys import Stores, TypesysError, get_typestore

    known = get_typestore(Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.EMPTY)
    writing: dict[Recorded, tuple[str, Any]] = {}  # to the type's name and the connection
    connections: dict[tuple[str, str], Any] = {}
    messages = 0
    with _ros2_writer(path) as writer:
        for source, time, raw in bags.recorded(full_names(bags, only), as_written=True):
            if source not in writing:
                msgtype = source.msgtype.replace("/", "/msg/")
                name = _RENAMED.get(msgtype, msgtype)
                types = dict(bags.types(source))
                types[name] = types[msgtype]
                try:
                    store.register(_for_ros2(types, _fields(known)))
                except TypesysError as error:
                    msg = f"{source.topic}: its messages have two definitions ({error}); export the bags one by one"
                    raise BagError(msg) from None
                if (source.topic, name) not in connections:
                    latched = {"offered_qos_profiles": LATCH} if source.latching else {}
                    connection = writer.add_connection(source.topic, name, typestore=store, **latched)
                    connections[source.topic, name] = connection
                writing[source] = (name, connections[source.topic, name])
            name, connection = writing[source]
            writer.write(connection, time, store.ros1_to_cdr(raw, name))
            messages += 1
    return Counts(len({topic for topic, _ in connections}), messages)


def _ros2_writer(path: Path) -> Any:
    from rosbags.rosbag2 import Writer

    try:
        return Writer(path, version=8)
    except TypeError:  # rosbags before 0.9.22 or so writes this version only
        older: Any = Writer
        return older(path)


def _fields(store: Any) -> Mapping[str, Any]:
    fields: Mapping[str, Any] = store.fielddefs if hasattr(store, "fielddefs") else store.FIELDDEFS  # before 0.10
    return fields


def _for_ros2(own: Mapping[str, Any], known: Mapping[str, Any]) -> dict[str, Any]:
    """Give the definitions to write: ROS 2's own where they lie alike, else those of the bag."""
    return {name: known[name] if name in known and _alike(own, known, name) else own[name] for name in own}


def _alike(own: Mapping[str, Any], known: Mapping[str, Any], name: str) -> bool:
    """Returns whether a type's data lie alike in ROS 1 and in ROS 2, whatever the fields are called."""
    if name == _HEADER:
        return True  # the conversion leaves out `seq`
    if name not in own or name not in known:
        return name not in own and name in known  # times are in no definition
    fields, other = [desc for _, desc in own[name][1]], [desc for _, desc in known[name][1]]
    return len(fields) == len(other) and all(
        a == b and (not _nested(a) or _alike(own, known, _nested(a))) for a, b in zip(fields, other)
    )


def _nested(desc: Any) -> str:
    """Give the name of the message type that a field holds, one or several; empty for numbers and texts."""
    detail = desc[1]
    if not isinstance(detail, str) and not isinstance(detail[0], str):
        detail = detail[0][1]
    return detail if isinstance(detail, str) and "/" in detail else ""
