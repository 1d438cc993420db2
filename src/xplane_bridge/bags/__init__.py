"""Reads ROS 1 bags: topics into numpy columns, images one at a time. Needs rosbags, not ROS; nothing else reads bags.

Messages are decoded with the definitions that the bag itself carries, so bags recorded with older versions of the
messages read as they were. Messages of one serialised layout (all lengths inside equal) are decoded together by
numpy; a topic whose lengths vary is split into its layouts, and only messages that hold lists of messages or of
strings are decoded one by one.

Columns are named by path: ``header.stamp``, ``angular_velocity.x``, ``gear_deploy_ratio``. Times and durations are
int64 nanoseconds. A fixed array is a column of shape (n, k); strings, lists of varying length and lists of messages
are object columns. Units are those of the message definition.
"""

from __future__ import annotations

import struct
from contextlib import ExitStack
from dataclasses import dataclass
from heapq import merge
from pathlib import Path
from typing import Any, Iterator, NamedTuple, Sequence, Union

import numpy as np
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from xplane_bridge.bags.decoding import NeedsObjectsError, Types, decode_bulk, decode_objects, wanted
from xplane_bridge.bags.units import Unit, parse_units
from xplane_bridge.errors import XplaneBridgeError

PathLike = Union[str, Path]


class BagError(XplaneBridgeError):
    """A bag cannot be read; the text is one line with the remedy."""


class TopicInfo(NamedTuple):
    """One topic of the open bags."""

    topic: str
    msgtype: str  #: ROS 1 name, e.g. ``xplane_bridge/FlightState``
    count: int
    first_time: int  #: [ns] receive time of the first message
    last_time: int  #: [ns] receive time of the last message


@dataclass
class Table:
    """All messages of one topic as columns of equal length, in receive order."""

    topic: str
    msgtype: str
    time: np.ndarray  #: int64 [ns] when the recorder received the message
    columns: dict[str, np.ndarray]

    def __len__(self) -> int:
        """Give the number of messages."""
        return len(self.time)

    def __contains__(self, name: str) -> bool:
        """Tell whether there is a column of this name."""
        return name in self.columns

    def __getitem__(self, name: str) -> np.ndarray:
        """Give one column.

        Raises:
            BagError: The topic has no such column; the text lists what it has.
        """
        try:
            return self.columns[name]
        except KeyError:
            have = ", ".join(sorted(self.columns))
            msg = f"{self.topic} ({self.msgtype}) has no column {name!r}; it has: {have}"
            raise BagError(msg) from None

    @property
    def stamp(self) -> np.ndarray:
        """int64 [ns]: header.stamp where the message has one, else the receive time."""
        return self.columns.get("header.stamp", self.time)


class Bags:
    """One flight in one bag or in several (split) bags, read as one. Use as a context manager.

    Args:
        paths: Bag files; a directory stands for the bags in it.

    Raises:
        BagError: A path is missing, is no bag, is damaged or is not indexed.
    """

    def __init__(self, paths: PathLike | Sequence[PathLike]) -> None:
        """Check the paths; the files are opened by ``with``."""
        given = [paths] if isinstance(paths, (str, Path)) else list(paths)
        self.paths: list[Path] = []
        for item in (Path(p) for p in given):
            if item.is_dir():
                found = sorted(item.glob("*.bag"))
                if not found:
                    msg = f"{item}: a directory without any .bag file"
                    raise BagError(msg)
                self.paths += found
            else:
                self.paths.append(item)
        if not self.paths:
            msg = "no bag given: name at least one .bag file"
            raise BagError(msg)
        self._stack: ExitStack | None = None
        self._readers: list[Reader] = []
        self._definitions: dict[tuple[str, str], tuple[Types, Any]] = {}

    def __enter__(self) -> Bags:
        """Open all files."""
        stack = ExitStack()
        try:
            for path in self.paths:
                reader = _open_reader(path)
                stack.callback(reader.close)
                self._readers.append(reader)
        except BaseException:
            stack.close()
            self._readers = []
            raise
        self._stack = stack
        return self

    def __exit__(self, *_: object) -> None:
        """Close all files."""
        if self._stack:
            self._stack.close()
        self._stack = None
        self._readers = []

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Every topic of the bags, by name; topics without a message included."""
        infos: dict[str, TopicInfo] = {}
        for reader in self._readers:
            for connection in reader.connections:
                times = [entry.time for entry in _ends(reader.indexes.get(connection.id, []))]
                msgtype = connection.msgtype.replace("/msg/", "/")
                old = infos.get(connection.topic)
                if old is not None:
                    msgtype = old.msgtype
                    if old.count:
                        times += [old.first_time, old.last_time]
                infos[connection.topic] = TopicInfo(
                    connection.topic,
                    msgtype,
                    connection.msgcount + (old.count if old else 0),
                    min(times, default=0),
                    max(times, default=0),
                )
        return infos

    def times(self, topic: str) -> np.ndarray:
        """Give the receive times of a topic's messages, int64 [ns], sorted; read from the index, not from the data."""
        found = [[entry.time for entry in reader.indexes[c.id]] for reader, c in self._connections(topic)]
        return np.sort(np.concatenate([np.array(times, dtype=np.int64) for times in found]))

    def topic_of_type(self, msgtype: str, suffix: str = "") -> str | None:
        """Find the topic of a message type (``package/Name``); of several, the first whose name ends in `suffix`."""
        for info in sorted(self.topics.values()):
            if info.msgtype == msgtype and info.topic.endswith(suffix):
                return info.topic
        return None

    def constants(self, topic: str) -> dict[str, Any]:
        """Give the constants of a topic's message, from the bag's own definition (e.g. ``VALID_POSITION``)."""
        connection = self._connections(topic)[0][1]
        types, _ = self._definition(connection)
        return {name: value for name, _, value in types[connection.msgtype][0]}

    def units(self, topic: str) -> dict[str, Unit]:
        """Give the unit of every column of a topic, from the comments of the bag's own definition."""
        connection = self._connections(topic)[0][1]
        return parse_units(_definition_text(connection), connection.msgtype.replace("/msg/", "/"))

    def read(self, topic: str, columns: Sequence[str] | None = None) -> Table:
        """Read one topic into arrays.

        Args:
            topic: Name as in `topics`.
            columns: Column names, or the name of a group of them (``angular_velocity``); all when omitted.

        Raises:
            BagError: No such topic or column, or damaged data.
        """
        parts = []
        msgtype = ""
        for reader, connection in self._connections(topic):
            msgtype = connection.msgtype.replace("/msg/", "/")
            times, raws = _raw(reader, connection)
            parts.append((times, self._decode(connection, raws, columns)))
        return _joined(topic, msgtype, parts, columns)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield (receive time [ns], message) of one topic one at a time, in time order: for images and lists."""
        streams = []
        for reader, connection in self._connections(topic):
            streams.append(self._stream(reader, connection))
        yield from merge(*streams, key=lambda pair: pair[0])

    def _stream(self, reader: Reader, connection: Any) -> Iterator[tuple[int, Any]]:
        _, store = self._definition(connection)
        try:
            for _, time, raw in reader.messages(connections=[connection]):
                yield time, store.deserialize_ros1(raw, connection.msgtype)
        except (ReaderError, SerdeError, struct.error, AssertionError) as err:
            raise _damaged(reader, err) from None

    def _connections(self, topic: str) -> list[tuple[Reader, Any]]:
        found = [(reader, c) for reader in self._readers for c in reader.connections if c.topic == topic]
        if not found:
            have = ", ".join(sorted(self.topics)) or "no topic at all"
            msg = f"no topic {topic} in {', '.join(str(p) for p in self.paths)}; there is: {have}"
            raise BagError(msg)
        return found

    def _definition(self, connection: Any) -> tuple[Types, Any]:
        definition = _definition_text(connection)
        key = (connection.msgtype, definition)
        if key not in self._definitions:
            store = get_typestore(Stores.EMPTY)
            try:
                types = get_types_from_msg(definition, connection.msgtype)
                store.register(types)
            except (TypesysError, SyntaxError) as err:
                msg = f"{connection.topic}: the bag's definition of {connection.msgtype} does not parse: {err}"
                raise BagError(msg) from None
            self._definitions[key] = (types, store)
        return self._definitions[key]

    def _decode(self, connection: Any, raws: list[bytes], columns: Sequence[str] | None) -> dict[str, np.ndarray]:
        types, store = self._definition(connection)
        msgtype = connection.msgtype
        try:
            try:
                return decode_bulk(types, msgtype, raws, columns)
            except NeedsObjectsError:
                return decode_objects(types, lambda raw: store.deserialize_ros1(raw, msgtype), msgtype, raws, columns)
        except (SerdeError, AssertionError, struct.error, ValueError, IndexError) as err:
            msg = f"{connection.topic}: a message does not fit its definition {msgtype}: {err}"
            raise BagError(msg) from None


def _definition_text(connection: Any) -> str:
    return str(getattr(connection.msgdef, "data", connection.msgdef))  # a plain string before rosbags 0.10


def _open_reader(path: Path) -> Reader:
    try:
        with path.open("rb") as file:
            magic = file.read(9)
    except OSError as err:
        msg = f"{path}: {err.strerror}"
        raise BagError(msg) from None
    if not magic:
        msg = f"{path}: the file is empty; the recording never wrote to it"
        raise BagError(msg)
    if not magic.startswith(b"#ROSBAG V"):
        msg = f"{path}: not a ROS 1 bag (it does not start with '#ROSBAG V')"
        raise BagError(msg)
    try:
        reader = Reader(path)
        reader.open()
    except ReaderError as err:
        text = str(err)
        if "not indexed" in text:
            msg = f"{path}: not indexed, the recording was cut off; run `rosbag reindex {path}` and call again"
        elif "damaged" in text or "Header" in text or "read" in text:
            msg = f"{path}: damaged or truncated ({text}); run `rosbag reindex {path}` to save what is there"
        else:
            msg = f"{path}: {text}"
        raise BagError(msg) from None
    except (AssertionError, struct.error, ValueError, KeyError, EOFError) as err:
        msg = f"{path}: damaged or truncated ({err!r}); run `rosbag reindex {path}` to save what is there"
        raise BagError(msg) from None
    return reader


def _damaged(reader: Reader, err: Exception) -> BagError:
    return BagError(f"{reader.path}: damaged data ({err}); run `rosbag reindex {reader.path}` to save what is there")


def _ends(entries: Sequence[Any]) -> Sequence[Any]:
    return [entries[0], entries[-1]] if entries else []


def _raw(reader: Reader, connection: Any) -> tuple[np.ndarray, list[bytes]]:
    times: list[int] = []
    raws: list[bytes] = []
    try:
        for _, time, raw in reader.messages(connections=[connection]):
            times.append(time)
            raws.append(raw)
    except (ReaderError, AssertionError, struct.error, OSError, EOFError, RuntimeError) as err:
        raise _damaged(reader, err) from None
    return np.array(times, dtype=np.int64), raws


def _joined(
    topic: str,
    msgtype: str,
    parts: list[tuple[np.ndarray, dict[str, np.ndarray]]],
    columns: Sequence[str] | None,
) -> Table:
    """Put the parts of several files in receive order; a column that a part lacks is NaN or None there."""
    filled = [part for part in parts if len(part[0])]
    names: list[str] = []
    seen: set[str] = set()
    for _, part in filled:
        for name in part:
            if name not in seen:
                seen.add(name)
                names.append(name)
    for column in columns or ():
        if filled and not any(wanted(name, [column]) for name in names):
            have = sorted({n for _, part in filled for n in part}) if columns is None else []
            msg = f"{topic} ({msgtype}) has no column {column!r}" + (f"; it has: {', '.join(have)}" if have else "")
            raise BagError(msg)
    if len(filled) == 1:
        return Table(topic, msgtype, filled[0][0], filled[0][1])
    if not filled:
        return Table(topic, msgtype, np.empty(0, dtype=np.int64), {})
    time = np.concatenate([part[0] for part in filled])
    order = np.argsort(time, kind="stable")
    out = {name: _stacked(name, filled)[order] for name in names}
    return Table(topic, msgtype, time[order], out)


def _stacked(name: str, parts: list[tuple[np.ndarray, dict[str, np.ndarray]]]) -> np.ndarray:
    have = [part[name] for _, part in parts if name in part]
    shapes = {column.shape[1:] for column in have}
    if len(have) == len(parts) and len(shapes) == 1:
        return np.concatenate(have)
    if len(shapes) == 1 and all(np.issubdtype(c.dtype, np.number) or c.dtype == bool for c in have):
        shape = next(iter(shapes))
        return np.concatenate(
            [
                part[name].astype(np.float64) if name in part else np.full((len(time), *shape), np.nan)
                for time, part in parts
            ]
        )
    out = np.empty(sum(len(time) for time, _ in parts), dtype=object)
    at = 0
    for time, part in parts:
        for k in range(len(time)):
            out[at + k] = part[name][k] if name in part else None
        at += len(time)
    return out
