"""Serialised ROS 1 messages into numpy columns, driven by the bag's own message definitions."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Callable, Dict, Iterator, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from rosbags.interfaces import Nodetype

from xplane_bridge.bags.later_fields import LATER_FIELDS

_DTYPES = {
    "bool": np.dtype("?"),
    "byte": np.dtype("i1"),  # signed in ROS 1
    "octet": np.dtype("i1"),  # as earlier versions of rosbags call it
    "char": np.dtype("u1"),
    "int8": np.dtype("i1"),
    "uint8": np.dtype("u1"),
    "int16": np.dtype("<i2"),
    "uint16": np.dtype("<u2"),
    "int32": np.dtype("<i4"),
    "uint32": np.dtype("<u4"),
    "int64": np.dtype("<i8"),
    "uint64": np.dtype("<u8"),
    "float32": np.dtype("<f4"),
    "float64": np.dtype("<f8"),
}
_TIME, _DURATION = "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"
_TIME_TYPES = {
    _TIME: np.dtype([("sec", "<u4"), ("nanosec", "<u4")]),
    _DURATION: np.dtype([("sec", "<i4"), ("nanosec", "<i4")]),
}
#: Message definitions by type name: (constants, fields), as rosbags parses them.
Types = Dict[str, Tuple[Any, Any]]
_UINT32 = struct.Struct("<I")
#: More layouts than this in one topic (strings of ever new lengths) are not worth a numpy call each.
_MAX_LAYOUTS = 64


@dataclass(frozen=True)
class _Leaf:
    name: str
    dtype: np.dtype
    offset: int
    count: int  # -1: scalar
    kind: str  # base, string, sequence, or a key of _TIME_TYPES


class _Layout(NamedTuple):
    size: int
    leaves: list[_Leaf]
    guards: list[tuple[int, int]]  # (offset, value): the length prefixes this layout holds for


class MessageList(Sequence[Any]):
    """The messages in a list of a message, decoded each time it is looked into: so they take a tenth of the memory."""

    __slots__ = ("_raw", "_read")

    def __init__(self, raw: bytes, read: Callable[[bytes], Sequence[Any]]) -> None:
        self._raw = raw
        self._read = read

    def __len__(self) -> int:
        """Give the number of messages in the list."""
        return len(self._read(self._raw))

    def __getitem__(self, index: Any) -> Any:
        """Give one message of the list, or a list of several."""
        return self._read(self._raw)[index]

    def __iter__(self) -> Iterator[Any]:
        """The messages."""
        return iter(self._read(self._raw))

    def __eq__(self, other: object) -> bool:
        """Returns whether another list holds the same messages."""
        return isinstance(other, (list, MessageList)) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """As a list shows itself."""
        return repr(list(self))


class NeedsObjectsError(Exception):
    """The message holds a list of messages."""


def wanted(name: str, columns: Optional[Sequence[str]]) -> bool:
    """Returns whether the column `name` is, or lies below, one of `columns` (None: all)."""
    return columns is None or any(name == c or name.startswith((c + ".", c + "[")) for c in columns)


def _layout(types: Types, msgtype: str, raw: bytes) -> _Layout:
    """Walk one serialised message along its definition and note where everything lies."""
    leaves: list[_Leaf] = []
    guards: list[tuple[int, int]] = []

    def length(at: int) -> int:
        (value,) = _UINT32.unpack_from(raw, at)
        guards.append((at, value))
        return int(value)

    def walk(typename: str, prefix: str, at: int) -> int:
        for field, (kind, detail) in types[typename][1]:
            name = f"{prefix}{field}"
            if kind == Nodetype.BASE:
                at = base(name, detail, at)
            elif kind == Nodetype.NAME:
                at = nested(name, detail, at)
            else:
                (item_kind, item), size = detail
                at = several(name, kind, item_kind, item, size, at)
        return at

    def base(name: str, detail: Any, at: int) -> int:
        basename = _basename(detail)
        if basename == "string":
            size = length(at)
            leaves.append(_Leaf(name, np.dtype(f"S{size}") if size else np.dtype("S1"), at + 4, size, "string"))
            return at + 4 + size
        dtype = _DTYPES[basename]
        leaves.append(_Leaf(name, dtype, at, -1, "base"))
        return at + dtype.itemsize

    def nested(name: str, typename: str, at: int) -> int:
        if typename in _TIME_TYPES:
            leaves.append(_Leaf(name, _TIME_TYPES[typename], at, -1, typename))
            return at + 8
        return walk(typename, name + ".", at)

    def several(name: str, kind: Any, item_kind: Any, item: Any, size: int, at: int) -> int:
        if kind == Nodetype.SEQUENCE:
            if item_kind == Nodetype.NAME or _basename(item) == "string":
                raise NeedsObjectsError
            size = length(at)
            at += 4
            dtype = _DTYPES[_basename(item)]
            leaves.append(_Leaf(name, dtype, at, size, "sequence"))
            return at + size * dtype.itemsize
        if item_kind == Nodetype.NAME:
            for k in range(size):
                at = nested(f"{name}[{k}]", item, at)
            return at
        if _basename(item) == "string":
            for k in range(size):
                at = base(f"{name}[{k}]", item, at)
            return at
        dtype = _DTYPES[_basename(item)]
        leaves.append(_Leaf(name, dtype, at, size, "base"))
        return at + size * dtype.itemsize

    end = walk(msgtype, "", 0)
    if end != len(raw):
        msg = f"{len(raw)} bytes, its definition takes {end}"
        raise ValueError(msg)
    return _Layout(end, leaves, guards)


def _basename(detail: Any) -> str:
    # rosbags gives (name, string limit) since 0.9.21, the bare name before.
    return str(detail[0]) if isinstance(detail, tuple) else str(detail)


def add_later_fields(
    msgtype: str, total: int, columns: Optional[Sequence[str]], found: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Add the fields that a message of the package has got after the recording: NaN, 0, false or empty."""
    for name, (kind, size, _) in LATER_FIELDS.get(msgtype, {}).items():
        if name in found or not wanted(name, columns) or not total:
            continue
        if size < 0 or kind == "string":
            found[name] = np.array([None] * total, dtype=object)
            for row in range(total):
                found[name][row] = "" if kind == "string" else np.empty(0, _DTYPES[kind])
        else:
            dtype = _DTYPES[kind]
            shape = (total, size) if size else (total,)
            found[name] = np.full(shape, np.nan if dtype.kind == "f" else 0, dtype)
    return found


def decode_bulk(
    types: Types, msgtype: str, raws: list[bytes], columns: Optional[Sequence[str]]
) -> dict[str, np.ndarray]:
    """Decode all messages of one layout at a time.

    Raises:
        NeedsObjectsError: The messages hold lists of messages or strings, or vary too much.
        ValueError, struct.error: A message does not fit the definition.
    """
    total = len(raws)
    if not total:
        return {}
    by_size: dict[int, list[int]] = {}
    for k, raw in enumerate(raws):
        by_size.setdefault(len(raw), []).append(k)
    pieces: list[tuple[np.ndarray, dict[str, np.ndarray]]] = []
    layouts = 0
    for size, members in by_size.items():
        rest = np.array(members, dtype=np.int64)
        block = np.frombuffer(b"".join([raws[k] for k in members]), dtype=np.uint8).reshape(len(members), size)
        while len(rest):
            layouts += 1
            if layouts > _MAX_LAYOUTS:
                raise NeedsObjectsError
            layout = _layout(types, msgtype, raws[rest[0]])
            same = np.ones(len(rest), dtype=bool)
            for at, value in layout.guards:
                same &= _view(block, at, np.dtype("<u4"), -1) == value
            chosen = block if same.all() else block[same]
            pieces.append((rest[same], _extract(chosen, layout, columns)))
            rest, block = rest[~same], block[~same]
    return _scatter(total, pieces)


def _view(block: np.ndarray, offset: int, dtype: np.dtype, count: int) -> np.ndarray:
    """View bytes [offset, ...) of every row as dtype; count -1 gives a vector, else (n, count)."""
    width = dtype.itemsize * (1 if count < 0 else count)
    cut = np.ascontiguousarray(block[:, offset : offset + width])
    out = cut.view(dtype) if width else np.empty((len(block), 0), dtype=dtype)
    return out.reshape(len(block)) if count < 0 else out.reshape(len(block), count)


def _extract(block: np.ndarray, layout: _Layout, columns: Optional[Sequence[str]]) -> dict[str, np.ndarray]:
    out: dict[str, np.ndarray] = {}
    for leaf in layout.leaves:
        if not wanted(leaf.name, columns):
            continue
        if leaf.kind in _TIME_TYPES:
            raw = _view(block, leaf.offset, leaf.dtype, -1)
            out[leaf.name] = _instant(raw["sec"].astype(np.int64), raw["nanosec"].astype(np.int64), leaf.kind)
        elif leaf.kind == "string":
            out[leaf.name] = _strings(block, leaf)
        elif leaf.kind == "sequence":
            values = _view(block, leaf.offset, leaf.dtype, leaf.count)
            column = np.empty(len(block), dtype=object)
            for k in range(len(block)):
                column[k] = values[k]
            out[leaf.name] = column
        else:
            out[leaf.name] = _view(block, leaf.offset, leaf.dtype, leaf.count)
    return out


def _instant(sec: Any, nanosec: Any, typename: str) -> Any:
    """Give times in [ns], which floats do not hold, and durations in [s], as the messages say of them."""
    return sec + nanosec / 1e9 if typename == _DURATION else sec * 1_000_000_000 + nanosec


def _strings(block: np.ndarray, leaf: _Leaf) -> np.ndarray:
    column = np.empty(len(block), dtype=object)
    if not leaf.count:
        column[:] = ""
        return column
    known: dict[bytes, str] = {}  # frame names and the like repeat: decode each once
    cut = np.ascontiguousarray(block[:, leaf.offset : leaf.offset + leaf.count])
    for k in range(len(block)):
        raw = cut[k].tobytes()
        if raw not in known:
            known[raw] = raw.decode("utf-8", errors="replace")
        column[k] = known[raw]
    return column


def _scatter(total: int, pieces: list[tuple[np.ndarray, dict[str, np.ndarray]]]) -> dict[str, np.ndarray]:
    if len(pieces) == 1:
        return pieces[0][1]
    out: dict[str, np.ndarray] = {}
    for name, first in pieces[0][1].items():
        column = np.empty((total, *first.shape[1:]), dtype=first.dtype)
        for index, columns in pieces:
            column[index] = columns[name]
        out[name] = column
    return out


def decode_objects(
    types: Types, deserialise: Callable[[bytes], Any], msgtype: str, raws: list[bytes], columns: Optional[Sequence[str]]
) -> dict[str, np.ndarray]:
    """Decode one by one; used for messages with lists of messages or of strings."""
    rows: dict[str, list[Any]] = {}
    raw = b""

    def put(name: str, value: Any) -> None:
        if wanted(name, columns) or any(c.startswith(name) for c in columns or ()):
            rows.setdefault(name, []).append(value)

    def walk(message: Any, typename: str, prefix: str) -> None:
        for field, (kind, detail) in types[typename][1]:
            name, value = f"{prefix}{field}", getattr(message, field)
            if kind == Nodetype.NAME and detail in _TIME_TYPES:
                put(name, _instant(int(value.sec), int(value.nanosec), detail))
            elif kind == Nodetype.NAME:
                walk(value, detail, name + ".")
            elif kind != Nodetype.BASE and detail[0][0] == Nodetype.NAME:
                put(name, MessageList(raw, readers.setdefault(name, _Reader(deserialise, name))))
            elif isinstance(value, list):
                put(name, known.setdefault(tuple(value), value))
            elif isinstance(value, np.ndarray):
                put(name, value.copy())  # it is a view that keeps the whole message
                if kind == Nodetype.ARRAY:
                    fixed.add(name)
            else:
                put(name, value)

    readers: dict[str, _Reader] = {}
    fixed: set[str] = set()  # lists do not become a matrix because they happen to be of one length
    known: dict[tuple[str, ...], list[str]] = {}  # lists of names repeat: keep each once
    for raw in raws:
        walk(deserialise(raw), msgtype, "")
    return {name: _column(values, name in fixed) for name, values in rows.items()}


class _Reader:
    """Reads one list of a message."""

    def __init__(self, deserialise: Callable[[bytes], Any], name: str) -> None:
        self._deserialise = deserialise
        self._list = attrgetter(name)

    def __call__(self, raw: bytes) -> Sequence[Any]:
        found: Sequence[Any] = self._list(self._deserialise(raw))
        return found


def _column(values: list[Any], fixed: bool) -> np.ndarray:
    if fixed:
        return np.stack(values)
    if isinstance(values[0], (bool, int, float)):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        column[k] = value
    return column
