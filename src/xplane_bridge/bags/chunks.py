"""A ROS 1 bag file (format 2.0) as chunks: read whole and cut into messages, also where the index was never written.

rosbags reads message by message with an object for each entry of the index; an hour of flight is millions of them. Here
the index stays the arrays that the file holds, and a chunk is read once for all messages that are wanted of it.
"""

from __future__ import annotations

import bz2
import struct
from array import array
from pathlib import Path
from typing import BinaryIO, Callable, Collection, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import lz4.frame
import numpy as np

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG_HEADER, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")
_PAIR = struct.Struct("<II")
#: An entry of a chunk's index: receive time, and where in the chunk the message's record begins.
_ENTRY = np.dtype([("sec", "<u4"), ("nsec", "<u4"), ("offset", "<u4")])
_UNPACK: Dict[bytes, Callable[[bytes], bytes]] = {b"none": bytes, b"bz2": bz2.decompress, b"lz4": lz4.frame.decompress}
#: Chunks kept for messages in order of time, which hops between neighbours.
_KEPT = 4

Fields = Dict[bytes, bytes]


class DamagedError(Exception):
    """The file is not as the format says; the text says how."""


class Connection(NamedTuple):
    """A publisher's topic as it was recorded."""

    id: int
    topic: str
    msgtype: str  #: ROS 1 name
    definition: str  #: full text, with the definitions it depends on
    md5sum: str
    callerid: str  #: empty where the recorder did not write it
    latching: bool


class Chunk(NamedTuple):
    """Where a chunk's data lies in the file."""

    position: int
    size: int
    compression: bytes


class _Index(NamedTuple):
    """All messages of one connection, in the order of the file."""

    time: np.ndarray  #: int64 [ns]
    chunk: np.ndarray  #: number of the chunk
    offset: np.ndarray  #: of the record in it


class _Entries:
    """The index of one connection while it is read: in one piece, an object for each chunk takes twice its memory."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._chunks = array("I")
        self._counts = array("I")

    def add(self, chunk: int, data: bytes) -> None:
        """Adds the index of a chunk."""
        self._data += data
        self._chunks.append(chunk)
        self._counts.append(len(data) // _ENTRY.itemsize)

    def joined(self) -> _Index:
        """All of it."""
        every = np.frombuffer(self._data, dtype=_ENTRY)
        chunk = np.repeat(np.array(self._chunks, dtype=np.uint32), self._counts)
        time = every["sec"].astype(np.int64)
        time *= 1_000_000_000
        time += every["nsec"]
        return _Index(time, chunk, every["offset"].copy())


class BagFile:
    """One bag file, open for reading.

    Args:
        path: Of the file.
        probe: Whether to look for no more than one whole chunk where there is no index.

    Attributes:
        connections: By their number in the file.
        lost: Bytes after the last whole chunk, of a recording that was cut off; None where the file has its index.

    Raises:
        DamagedError: No bag of this format, or not one whole chunk in it.
        OSError: The file cannot be read.
    """

    def __init__(self, path: Path, probe: bool = False) -> None:
        self.path = path
        self._probe = probe
        self.connections: Dict[int, Connection] = {}
        self.lost: Optional[int] = None
        self._chunks: List[Chunk] = []
        self._entries: Dict[int, _Entries] = {}
        self._kept: Dict[int, bytes] = {}
        self._moves: List[Tuple[int, int]] = []
        self._file: BinaryIO = path.open("rb")
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise
        self._index = {id_: self._entries.pop(id_, _Entries()).joined() for id_ in self.connections}
        self._entries.clear()

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def times(self, id_: int) -> np.ndarray:
        """Receive times of a connection's messages, int64 [ns], in the order of the file."""
        return self._index[id_].time

    def places(self, id_: int) -> np.ndarray:
        """Where a connection's messages lie, int64, in the order of `times`: what was written later lies higher."""
        _, chunk, offset = self._index[id_]
        return _places(chunk, offset)

    def written(self) -> Tuple[int, int]:
        """Receive times [ns], as they are in the file, of the first and the last message in it; 0 without any."""
        ends: List[Tuple[int, int]] = []
        for id_, index in self._index.items():
            place = self.places(id_)
            for k in (int(place.argmin()), int(place.argmax())) if len(place) else ():
                ends.append((int(place[k]), int(self._written(index.time[k], place[k]))))
        return min(ends, default=(0, 0))[1], max(ends, default=(0, 0))[1]

    def move(self, after: int, until: int, middle: int, by: int) -> None:
        """Moves the receive times [ns] of what lies behind the place where the recorder's clock went back.

        Args:
            after: Place of a message that was written before that.
            until: Place of one that was written behind it.
            middle: Between those two, messages received before this time were written behind it.
            by: What is added to their receive times.
        """
        begin = until
        for id_, index in self._index.items():
            place = self.places(id_)
            behind = place[(place > after) & (place < until) & (index.time < middle)]
            begin = min(begin, int(behind.min())) if len(behind) else begin
        for id_, index in self._index.items():
            index.time[self.places(id_) >= begin] += by
        self._moves.append((begin, by))

    def by_chunk(self, id_: int) -> Iterator[Tuple[np.ndarray, List[bytes]]]:
        """Messages of one connection, a chunk at a time: receive times, and the messages as they were serialised.

        Raises:
            DamagedError: A chunk cannot be read.
        """
        time, chunk, offset = self._index[id_]
        edges = [0, *(np.flatnonzero(np.diff(chunk)) + 1).tolist(), len(chunk)] if len(chunk) else [0]
        for first, end in zip(edges[:-1], edges[1:]):
            data = self._data(int(chunk[first]))
            yield time[first:end], [_message(data, at) for at in offset[first:end].tolist()]

    def by_time(
        self, ids: Collection[int], spans: Optional[Sequence[Tuple[int, int]]] = None
    ) -> Iterator[Tuple[int, int, int, bytes]]:
        """Messages of several connections in order of time: connection, receive time [ns], that in the file, message.

        Args:
            ids: The connections.
            spans: First and last receive time [ns] of what is wanted; chunks that have none of it are not read.

        Raises:
            DamagedError: A chunk cannot be read.
        """
        chosen = [(id_, self._index[id_]) for id_ in ids]
        if spans is not None:
            chosen = [(id_, _within(index, spans)) for id_, index in chosen]
        for time, chunk, offset, owner in self._in_order(chosen):
            written = self._written(time, _places(chunk, offset))
            for k in np.lexsort((offset, chunk, time)):
                message = _message(self._data(int(chunk[k])), int(offset[k]))
                yield int(owner[k]), int(time[k]), int(written[k]), message

    def _written(self, time: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Receive times [ns] as they are in the file."""
        return time - sum(by * (place >= begin) for begin, by in self._moves)

    def _in_order(self, chosen: List[Tuple[int, _Index]]) -> Iterator[Tuple[np.ndarray, ...]]:
        """Entries of several connections, some at a time: none is earlier than those that were given before.

        Yields:
            Receive times [ns], numbers of chunks, offsets, connections; in any order.
        """
        never = np.iinfo(np.int64).max
        earliest = np.full(len(self._chunks), never)
        edges = []  # of each: where the entries of each chunk begin
        for _, index in chosen:
            edges.append(np.searchsorted(index.chunk, np.arange(len(self._chunks) + 1)).astype(np.uint32))
            np.minimum.at(earliest, index.chunk, index.time)
        order = np.argsort(earliest, kind="stable")
        order = order[earliest[order] < never]
        waiting: Tuple[np.ndarray, ...] = tuple(np.empty(0, kind) for kind in (np.int64, np.uint32, np.uint32, int))
        for place, number in enumerate(order):
            parts = [waiting]
            for (id_, index), edge in zip(chosen, edges):
                first, end = int(edge[number]), int(edge[number + 1])
                if end > first:
                    parts.append((*(column[first:end] for column in index), np.full(end - first, id_)))
            waiting = tuple(np.concatenate(columns) for columns in zip(*parts))
            following = earliest[order[place + 1]] if place + 1 < len(order) else never
            due = waiting[0] < following
            yield tuple(column[due] for column in waiting)
            waiting = tuple(column[~due] for column in waiting)

    # ---------------------------------------------------------------------------------------------------- opening

    def _open(self) -> None:
        if self._read(len(MAGIC)) != MAGIC:
            raise DamagedError("not a ROS 1 bag of version 2.0")
        header, _ = self._record()
        if header.get(b"encryptor"):
            raise DamagedError("it is encrypted")
        end = _number(header, b"index_pos", _U64)
        data_begin = self._file.tell()
        try:
            if not end:
                raise DamagedError("not indexed")
            self._open_by_index(end, _number(header, b"conn_count"), _number(header, b"chunk_count"))
        except DamagedError:
            self._forget()
            self._open_by_scan(data_begin)
            if not self._chunks:
                raise DamagedError("not one whole chunk of messages is in it") from None

    def _forget(self) -> None:
        self.connections.clear()
        self._chunks.clear()
        self._entries.clear()

    def _open_by_index(self, position: int, connections: int, chunks: int) -> None:
        self._file.seek(position)
        for _ in range(connections):
            header, data = self._record(_CONNECTION)
            self._add_connection(header, data)
        infos = [self._record(_CHUNK_INFO) for _ in range(chunks)]
        for header, counts in infos:
            self._file.seek(_number(header, b"chunk_pos", _U64))
            self._skip_chunk()
            for _ in range(len(counts) // _PAIR.size):
                entries, data = self._record(_INDEX)
                id_ = _number(entries, b"conn")
                if len(data) != _number(entries, b"count") * _ENTRY.itemsize or id_ not in self.connections:
                    raise DamagedError("an index does not fit its chunk")
                self._entries.setdefault(id_, _Entries()).add(len(self._chunks) - 1, data)

    def _open_by_scan(self, position: int) -> None:
        """What the chunks themselves hold, up to the first that is not whole."""
        size = self._file.seek(0, 2)
        self._file.seek(position)
        whole = position
        try:
            while self._file.tell() < size and not (self._probe and self._chunks):
                header = self._header()
                if header.get(b"op") == bytes([_CHUNK]):
                    self._scan(self._load(self._skip_chunk(header)))
                else:
                    self._read(self._length())
                whole = self._file.tell()
        except DamagedError:
            if self._chunks and self._chunks[-1].position >= whole:
                self._chunks.pop()
        self.lost = size - whole

    def _scan(self, data: bytes) -> None:
        """The messages and connections of a chunk, which is the last of `_chunks`."""
        found: Dict[int, List[Tuple[int, int, int]]] = {}
        at = 0
        while at < len(data):
            begin = at
            header, at = _fields(data, at)
            record, at = _bytes(data, at)
            kind = header.get(b"op", b"\0")[0]
            if kind == _CONNECTION:
                self._add_connection(header, record)
            elif kind == _MESSAGE:
                time = _number(header, b"time", _U64)  # seconds below, nanoseconds above
                entry = (time & 0xFFFFFFFF, time >> 32, begin)
                found.setdefault(_number(header, b"conn"), []).append(entry)
        for id_, entries in found.items():
            self._entries.setdefault(id_, _Entries()).add(
                len(self._chunks) - 1, np.array(entries, dtype=_ENTRY).tobytes()
            )

    def _add_connection(self, header: Fields, record: bytes) -> None:
        fields = _all_fields(record)
        try:
            id_ = _number(header, b"conn")
            self.connections.setdefault(
                id_,
                Connection(
                    id_,
                    header[b"topic"].decode(),
                    fields[b"type"].decode(),
                    fields[b"message_definition"].decode(),
                    fields[b"md5sum"].decode(),
                    fields.get(b"callerid", b"").decode(),
                    fields.get(b"latching", b"0") == b"1",
                ),
            )
        except (KeyError, UnicodeDecodeError) as error:
            raise DamagedError(f"a connection does not say its {error}") from None

    # ---------------------------------------------------------------------------------------------------- reading

    def _data(self, number: int) -> bytes:
        if number not in self._kept:
            while len(self._kept) >= _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[number] = self._load(self._chunks[number])
        return self._kept[number]

    def _load(self, chunk: Chunk) -> bytes:
        after = self._file.tell()
        self._file.seek(chunk.position)
        packed = self._read(chunk.size)
        self._file.seek(after)
        try:
            return _UNPACK[chunk.compression](packed)
        except (OSError, ValueError, EOFError, RuntimeError) as error:
            raise DamagedError(f"a chunk does not unpack: {error}") from None

    def _skip_chunk(self, header: Optional[Fields] = None) -> Chunk:
        """Takes a chunk's place and goes on behind it; `header` where it is read already."""
        fields = self._header() if header is None else header
        if fields.get(b"op") != bytes([_CHUNK]):
            raise DamagedError("no chunk is where the index says")
        compression = fields.get(b"compression", b"")
        if compression not in _UNPACK:
            raise DamagedError(f"compression {compression.decode(errors='replace')!r}; none, bz2, lz4 can be read")
        size = self._length()
        chunk = Chunk(self._file.tell(), size, compression)
        # Of a recording that was cut off the last chunk's length is not written yet.
        if size == 0 or self._file.seek(0, 2) < chunk.position + size:
            raise DamagedError("its last chunk is not whole")
        self._file.seek(chunk.position + size)
        self._chunks.append(chunk)
        return chunk

    def _record(self, kind: Optional[int] = None) -> Tuple[Fields, bytes]:
        header = self._header()
        if kind is not None and header.get(b"op") != bytes([kind]):
            raise DamagedError("the index is not whole")
        return header, self._read(self._length())

    def _header(self) -> Fields:
        return _all_fields(self._read(self._length()))

    def _length(self) -> int:
        (value,) = _U32.unpack(self._read(_U32.size))
        return int(value)

    def _read(self, count: int) -> bytes:
        data = self._file.read(count)
        if len(data) != count:
            raise DamagedError("it ends in the middle of a record")
        return data


def _places(chunk: np.ndarray, offset: np.ndarray) -> np.ndarray:
    places: np.ndarray = chunk.astype(np.int64) << 32 | offset
    return places


def _within(index: _Index, spans: Sequence[Tuple[int, int]]) -> _Index:
    """The messages received in one of these spans [ns], both ends included."""
    inside = np.zeros(len(index.time), dtype=bool)
    for first, last in spans:
        inside |= (index.time >= first) & (index.time <= last)
    return _Index(*(column[inside] for column in index))


def _message(data: bytes, at: int) -> bytes:
    """The message whose record begins at `at` of a chunk."""
    try:
        (header,) = _U32.unpack_from(data, at)
        (size,) = _U32.unpack_from(data, at + 4 + header)
    except struct.error:
        raise DamagedError("a message lies outside its chunk") from None
    begin = at + 8 + header
    if begin + size > len(data):
        raise DamagedError("a message is longer than its chunk")
    return data[begin : begin + size]


def _bytes(data: bytes, at: int) -> Tuple[bytes, int]:
    """A block with its length in front, and where it ends."""
    try:
        (size,) = _U32.unpack_from(data, at)
    except struct.error:
        raise DamagedError("a chunk ends in the middle of a record") from None
    end = at + 4 + size
    if end > len(data):
        raise DamagedError("a record is longer than its chunk")
    return data[at + 4 : end], end


def _fields(data: bytes, at: int) -> Tuple[Fields, int]:
    header, end = _bytes(data, at)
    return _all_fields(header), end


def _all_fields(header: bytes) -> Fields:
    """name=value pairs, each with its length in front."""
    fields: Fields = {}
    at = 0
    while at < len(header):
        pair, at = _bytes(header, at)
        name, equals, value = pair.partition(b"=")
        if not equals:
            raise DamagedError("a header's field has no value")
        fields[name] = value
    return fields


def _number(fields: Fields, name: bytes, kind: struct.Struct = _U32) -> int:
    try:
        (value,) = kind.unpack(fields[name])
    except (KeyError, struct.error):
        raise DamagedError(f"a header does not say its {name.decode()}") from None
    return int(value)
