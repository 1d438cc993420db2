"""Reads ROS 1 bags: topics into numpy columns, images one at a time. Needs rosbags, not ROS; nothing else reads bags.

A recording that was cut off (a full disk, kill -9) is read to its last whole chunk, and a warning says so; so is
``NAME.bag.active`` in a folder, where there is no ``NAME.bag``.

Messages are decoded with the definitions that the bag itself carries, so bags recorded with older versions of the
messages read as they were; fields that came later are there too: NaN, 0, false or empty. Messages of one serialised
layout (all lengths inside equal) are decoded together by numpy; a topic whose lengths vary is split into its layouts,
and only messages that hold lists of messages or of strings are decoded one by one.

Stamps that go back, by a host's clock that was set back or over a restart of X-Plane by whose time they go
(`publish_clock`), are read as going on, and so are receive times of such a recorder (`bags.restarts`). A warning says
by how much. Where rx_node was restarted, epochs are counted on.

A long recording needs little memory in pieces (`Bags.pieces`), or with its columns in a temporary file (`ColumnFile`).

Columns are named by path: ``header.stamp``, ``angular_velocity.x``, ``gear_deploy_ratio``. Times are int64 nanoseconds,
durations float64 seconds. A fixed array is a column of shape (n, k); strings, lists of varying length and lists of
messages (`MessageList`) are object columns. Units are those of the message definition.
"""

from __future__ import annotations

import functools
import struct
from dataclasses import dataclass
from heapq import merge
from pathlib import Path
from typing import Any, Iterable, Iterator, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from xplane_bridge.bags.chunks import BagFile, Connection, DamagedError
from xplane_bridge.bags.columns import ColumnFile, Filling, StoredColumns
from xplane_bridge.bags.decoding import (
    NeedsObjectsError,
    Types,
    add_later_fields,
    decode_bulk,
    decode_objects,
    wanted,
)
from xplane_bridge.bags.files import bags_in, ending, part_order, recording_of
from xplane_bridge.bags.once import warn_once
from xplane_bridge.bags.restarts import STATE_COLUMNS, Restarts, States
from xplane_bridge.bags.units import Unit, later_units, parse_units
from xplane_bridge.errors import XplaneBridgeError

PathLike = Union[str, Path]
#: The message beside which the bridge publishes all others.
FLIGHT_STATE = "xplane_bridge/FlightState"
#: Messages are decoded so many at a time: bytes, and number of them.
_PIECE_BYTES = 4 << 20
_PIECE_MESSAGES = 8192


class BagError(XplaneBridgeError):
    """A bag cannot be read; the text is one line with the remedy."""


@dataclass(frozen=True)
class TopicInfo:
    """One topic of the open bags."""

    topic: str
    msgtype: str  #: ROS 1 name, e.g. ``xplane_bridge/FlightState``
    count: int
    first_time: int  #: [ns] receive time of the first message
    last_time: int  #: [ns] receive time of the last message


class Recorded(NamedTuple):
    """One topic of one definition as it was recorded, undecoded: for what copies a recording."""

    topic: str
    msgtype: str  #: ROS 1 name
    definition: str  #: full text, with the definitions it depends on
    md5sum: str
    callerid: str  #: of the publisher; empty where the recorder did not write it
    latching: bool


@dataclass
class Table:
    """All messages of one topic as columns of equal length, in receive order."""

    topic: str
    msgtype: str
    time: np.ndarray  #: int64 [ns] when the recorder received the message
    columns: Mapping[str, np.ndarray]  #: a dict; of a table in a `ColumnFile`, loaded each time one is asked for

    def __len__(self) -> int:
        """Give the number of messages."""
        return len(self.time)

    def __contains__(self, name: str) -> bool:
        """Returns whether there is a column of this name."""
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
        """int64 [ns]: header.stamp of each message that has one, else its receive time. 0 is none: rospy leaves it."""
        stamp = self.columns.get("header.stamp", self.time)
        return stamp if stamp.all() else np.where(stamp == 0, self.time, stamp)

    def by_stamp(self) -> Table:
        """Give the table in the order of its stamps; messages of one stamp stay in receive order."""
        stamp = self.stamp
        if (np.diff(stamp) >= 0).all():
            return self
        order = np.argsort(stamp, kind="stable")
        if isinstance(self.columns, StoredColumns):
            return Table(self.topic, self.msgtype, self.time[order], self.columns.in_order(order))
        return Table(self.topic, self.msgtype, self.time[order], {k: v[order] for k, v in self.columns.items()})


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
                found = sorted(bags_in(item), key=part_order)
                if not found:
                    msg = f"{item}: a directory without any .bag file"
                    raise BagError(msg)
                self.paths += found
            else:
                self.paths.append(item)
        if not self.paths:
            msg = "no bag given: name at least one .bag file"
            raise BagError(msg)
        if len(set(map(recording_of, self.paths))) == 1:
            self.paths.sort(key=part_order)  # a shell gives them in the order of texts
        self._open: Optional[list[BagFile]] = None
        self._restarts = Restarts(self.paths[0], self._states, self._states_of)

    def __enter__(self) -> Bags:
        """Open all files."""
        self._open = []
        try:
            for path in self.paths:
                self._open.append(_opened(path))
            self._restarts.let_receive_times_go_on(self._files)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Close all files."""
        for file in self._open or ():
            file.close()
        self._open = None
        self._restarts = Restarts(self.paths[0], self._states, self._states_of)

    @property
    def _files(self) -> list[BagFile]:
        if self._open is None:
            msg = f"{', '.join(map(str, self.paths))}: not open; expected `with Bags(...) as bags:` around it"
            raise BagError(msg)
        return self._open

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Every topic of the bags, by name; topics without a message included."""
        infos: dict[str, TopicInfo] = {}
        for file in self._files:
            for connection in file.connections.values():
                recorded = file.times(connection.id)
                times = [int(recorded.min()), int(recorded.max())] if len(recorded) else []
                msgtype = connection.msgtype
                old = infos.get(connection.topic)
                if old is not None:
                    msgtype = old.msgtype
                    if old.count:
                        times += [old.first_time, old.last_time]
                count = len(recorded) + (old.count if old else 0)
                infos[connection.topic] = TopicInfo(
                    connection.topic, msgtype, count, min(times, default=0), max(times, default=0)
                )
        return infos

    @property
    def written(self) -> tuple[int, int]:
        """Receive times [ns], as they are in the files, of the first and the last message recorded; 0 without any."""
        return self._files[0].written()[0], self._files[-1].written()[1]

    def times(self, topic: str) -> np.ndarray:
        """Give the receive times of a topic's messages, int64 [ns], sorted; read from the index, not from the data."""
        return np.sort(np.concatenate([file.times(c.id) for file, c in self._connections(topic)]))

    def before_first(self, topic: str, other: str) -> np.ndarray:
        """Give for each message of a topic, in receive order, whether it was written to its file before any of another.

        So are the messages of latched topics that ``rosbag record --repeat-latched`` writes anew to each file.
        """
        places = [(file, file.places(c.id)) for file, c in self._connections(other)]
        rows = []
        for file, c in self._connections(topic):
            firsts = [int(own.min()) for holder, own in places if holder is file and len(own)]
            rows.append((file.times(c.id), file.places(c.id) < min(firsts, default=np.iinfo(np.int64).max)))
        time, before = (np.concatenate(columns) for columns in zip(*rows))
        ordered: np.ndarray = before[np.argsort(time, kind="stable")]
        return ordered

    def topic_of_type(self, msgtype: str, suffix: str = "") -> Optional[str]:
        """Find the topic of a message type (``package/Name``) whose name ends in `suffix`.

        Of several, one of the bridge's own, below the name space of the flight state: other nodes publish common types
        too. Then the one in the fewest name spaces: the bridge's own camera before a further one's; then by name. The
        bridge's own types are of another aircraft elsewhere: beside a flight state they are taken from nowhere else.
        """
        found = [info.topic for info in self.topics.values() if info.msgtype == msgtype and info.topic.endswith(suffix)]
        own = self.own(found)
        only_own = msgtype.startswith("xplane_bridge/") and self._name_spaces
        return min(own if own or only_own else found, key=_rank, default=None)

    def own(self, topics: Iterable[str]) -> list[str]:
        """Give those of some topics that are below `name_space`, and not below that of a further bridge in there."""
        return [topic for topic, space in self.bridges_of(topics).items() if space == self.name_space]

    def bridges_of(self, topics: Iterable[str]) -> dict[str, Optional[str]]:
        """Give the name space of each topic's bridge, the innermost around it; None where it is below none."""
        spaces = self._name_spaces or [""]
        around = {topic: [space for space in spaces if topic.startswith(f"{space}/")] for topic in topics}
        return {topic: max(found, key=len, default=None) for topic, found in around.items()}

    @property
    def name_space(self) -> str:
        """What precedes the bridge's topics, e.g. ``/xplane``; empty where there is no flight state."""
        return next(iter(self._name_spaces), "")

    @property
    def _name_spaces(self) -> list[str]:
        """Of each flight state, the first is the bridge's that is read."""
        states = sorted((info.topic for info in self.topics.values() if info.msgtype == FLIGHT_STATE), key=_rank)
        return [state.rpartition("/")[0] for state in states]

    def constants(self, topic: str) -> dict[str, Any]:
        """Give the constants of a topic's message, from the bag's own definition (e.g. ``VALID_POSITION``)."""
        connection = self._connections(topic)[0][1]
        types, _ = self._definition(connection)
        return {name: value for name, _, value in types[_type_name(connection.msgtype)][0]}

    def units(self, topic: str) -> dict[str, Unit]:
        """Give the unit of every column of a topic, from the comments of the bag's own definition."""
        connection = self._connections(topic)[0][1]
        return {**later_units(connection.msgtype), **parse_units(connection.definition, connection.msgtype)}

    def read(self, topic: str, columns: Optional[Sequence[str]] = None, store: Optional[ColumnFile] = None) -> Table:
        """Read one topic into arrays.

        Args:
            topic: Name as in `topics`.
            columns: Column names, or the name of a group of them (``angular_velocity``); all when omitted.
            store: Where the columns of numbers are kept, to be loaded one at a time; in memory when omitted.

        Raises:
            BagError: No such topic or column, or damaged data.
        """
        connections = self._connections(topic)
        filling = Filling(sum(len(file.times(c.id)) for file, c in connections), store)
        for time, found in self._going_on(topic, columns):
            filling.add(time, found)
        return _table(topic, connections[-1][1].msgtype, filling, columns)

    def pieces(self, topic: str, columns: Optional[Sequence[str]] = None) -> Iterator[Table]:
        """Read one topic some thousand messages at a time, in the order of the files: for what needs each value once.

        Args:
            topic: Name as in `topics`.
            columns: As for `read`.

        Raises:
            BagError: No such topic or column, or damaged data.
        """
        msgtype = self._connections(topic)[-1][1].msgtype
        for time, found in self._going_on(topic, columns):
            filling = Filling(len(time), None)
            filling.add(time, found)
            yield _table(topic, msgtype, filling, columns)

    def messages(self, topic: str, spans: Optional[Sequence[tuple[int, int]]] = None) -> Iterator[tuple[int, Any]]:
        """Yield (receive time [ns], message) of one topic one at a time, in time order: for images and lists.

        Args:
            topic: Name as in `topics`.
            spans: First and last receive time [ns] of those wanted: the rest of the file is not read; all when omitted.
        """
        streams = [self._stream(file, connection, spans) for file, connection in self._connections(topic)]
        yield from merge(*streams, key=lambda pair: pair[0])

    def recorded(self, topics: Sequence[str] = (), as_written: bool = False) -> Iterator[tuple[Recorded, int, bytes]]:
        """Yield every message undecoded: (topic, receive time [ns], serialised message), in the order of `times`.

        Args:
            topics: The topics wanted; all when empty.
            as_written: Give the receive times that are in the files, for copies: those may go back.

        Raises:
            BagError: No such topic, or damaged data.
        """
        chosen = [pair for topic in topics or self.topics for pair in self._connections(topic)]
        streams = [self._undecoded(file, [c for other, c in chosen if other is file]) for file in self._files]
        for source, time, written, raw in merge(*streams, key=lambda item: item[1]):
            yield source, written if as_written else time, raw

    def types(self, recorded: Recorded) -> Types:
        """Give the message types of a topic, as rosbags parses them: (constants, fields) by ``package/msg/Name``."""
        return self._parsed(recorded.topic, recorded.msgtype, recorded.definition)[0]

    def _going_on(
        self, topic: str, columns: Optional[Sequence[str]]
    ) -> Iterator[tuple[np.ndarray, dict[str, np.ndarray]]]:
        """Receive times and columns of a topic; stamps and epochs go on over restarts."""
        own = bool(self.own([topic]))
        for file, connection in self._connections(topic):
            for time, found in self._pieces(file, connection, columns):
                moved = self._restarts.columns(time, found)
                yield time, self._restarts.epochs(time, moved) if own else moved

    def _pieces(
        self, file: BagFile, connection: Connection, columns: Optional[Sequence[str]]
    ) -> Iterator[tuple[np.ndarray, dict[str, np.ndarray]]]:
        """Receive times and columns, so many messages at a time that they need little memory."""
        times: list[np.ndarray] = []
        raws: list[bytes] = []
        size = 0
        try:
            for time, messages in file.by_chunk(connection.id):
                times.append(time)
                raws += messages
                size += sum(map(len, messages))
                if size > _PIECE_BYTES or len(raws) > _PIECE_MESSAGES:
                    yield np.concatenate(times), self._decode(connection, raws, columns)
                    times, raws, size = [], [], 0
        except (DamagedError, OSError) as error:
            raise _damaged(file, error) from None
        if raws:
            yield np.concatenate(times), self._decode(connection, raws, columns)

    def _states(self) -> list[tuple[BagFile, int]]:
        """The connections of the flight state: file, number of the connection."""
        topic = self.topic_of_type(FLIGHT_STATE)
        return [] if topic is None else [(file, connection.id) for file, connection in self._connections(topic)]

    def _states_of(self, file: BagFile, id_: int) -> States:
        return States.of(self._pieces(file, file.connections[id_], list(STATE_COLUMNS)))

    def _undecoded(self, file: BagFile, connections: list[Connection]) -> Iterator[tuple[Recorded, int, int, bytes]]:
        known = {c.id: Recorded(*c[1:]) for c in connections}
        try:
            for id_, time, written, raw in file.by_time(known):
                yield known[id_], time, written, raw
        except (DamagedError, OSError) as error:
            raise _damaged(file, error) from None

    def _stream(
        self, file: BagFile, connection: Connection, spans: Optional[Sequence[tuple[int, int]]]
    ) -> Iterator[tuple[int, Any]]:
        _, store = self._definition(connection)
        name = _type_name(connection.msgtype)
        try:
            for _, time, _, raw in file.by_time([connection.id], spans):
                message = store.deserialize_ros1(raw, name)
                self._restarts.message(time, message)
                yield time, message
        except (DamagedError, OSError, SerdeError, struct.error, AssertionError) as error:
            raise _damaged(file, error) from None

    def _connections(self, topic: str) -> list[tuple[BagFile, Connection]]:
        found = [(file, c) for file in self._files for c in file.connections.values() if c.topic == topic]
        if not found:
            have = ", ".join(sorted(self.topics)) or "no topic at all"
            msg = f"no topic {topic} in {', '.join(str(p) for p in self.paths)}; there is: {have}"
            raise BagError(msg)
        return found

    def _definition(self, connection: Connection) -> tuple[Types, Any]:
        return self._parsed(connection.topic, connection.msgtype, connection.definition)

    def _parsed(self, topic: str, msgtype: str, definition: str) -> tuple[Types, Any]:
        try:
            return _types_of(msgtype, definition)
        except (TypesysError, SyntaxError) as error:
            msg = f"{topic}: the bag's definition of {msgtype} does not parse: {error}"
            raise BagError(msg) from None

    def _decode(
        self, connection: Connection, raws: list[bytes], columns: Optional[Sequence[str]]
    ) -> dict[str, np.ndarray]:
        types, store = self._definition(connection)
        name = _type_name(connection.msgtype)
        try:
            try:
                found = decode_bulk(types, name, raws, columns)
            except NeedsObjectsError:
                found = decode_objects(types, lambda raw: store.deserialize_ros1(raw, name), name, raws, columns)
        except (SerdeError, AssertionError, struct.error, ValueError, IndexError) as error:
            msg = f"{connection.topic}: a message does not fit its definition {connection.msgtype}: {error}"
            raise BagError(msg) from None
        return add_later_fields(connection.msgtype, len(raws), columns, found)


@functools.lru_cache(maxsize=256)
def _types_of(msgtype: str, definition: str) -> tuple[Types, Any]:
    """A definition parsed, and the store that decodes it; kept, because programs open a flight's bag several times."""
    store = get_typestore(Stores.EMPTY)
    types = get_types_from_msg(definition, _type_name(msgtype))
    store.register(types)
    return types, store


def _rank(topic: str) -> tuple[int, str]:
    """By which topics of a type are ordered."""
    return topic.count("/"), topic


def _type_name(msgtype: str) -> str:
    """The name of a type as rosbags has it."""
    return "/msg/".join(msgtype.rsplit("/", 1))


def _opened(path: Path) -> BagFile:
    try:
        with path.open("rb") as file:
            magic = file.read(9)
    except OSError as error:
        msg = f"{path}: {error.strerror}"
        raise BagError(msg) from None
    if not magic:
        msg = f"{path}: the file is empty; the recording never wrote to it"
        raise BagError(msg)
    if not magic.startswith(b"#ROSBAG V"):
        msg = f"{path}: not a ROS 1 bag (it does not start with '#ROSBAG V')"
        raise BagError(msg)
    try:
        bag = BagFile(path)
    except DamagedError as error:
        msg = f"{path}: damaged or truncated ({error}); `rosbag reindex {path}` saves what can be saved"
        raise BagError(msg) from None
    if bag.lost is not None:
        happened = f"the recording {ending(path)}"
        warn_once(f"{path}: {happened}; read to its last whole chunk, without {bag.lost} bytes behind it")
    return bag


def _damaged(file: BagFile, err: Exception) -> BagError:
    return BagError(f"{file.path}: damaged data ({err}); `rosbag reindex {file.path}` saves what can be saved")


def _table(topic: str, msgtype: str, filling: Filling, columns: Optional[Sequence[str]]) -> Table:
    """What was read, in receive order.

    Raises:
        BagError: A column that was asked for is not there.
    """
    if not len(filling):
        return Table(topic, msgtype, filling.time, {})
    for column in columns or ():
        if not any(wanted(name, [column]) for name in filling.names):
            msg = f"{topic} ({msgtype}) has no column {column!r}"
            raise BagError(msg)
    time = filling.time
    order = None if np.all(time[1:] >= time[:-1]) else np.argsort(time, kind="stable")
    return Table(topic, msgtype, time if order is None else time[order], filling.columns(order))
