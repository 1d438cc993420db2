"""Whole flights as arrays, a table for each topic: NumPy's ``.npz`` and MATLAB's ``.mat``.

Of every topic but the pictures there is, with one row per message:

* ``stamp_ns``, host time of the message's header (of its arrival where it has none), and ``receive_ns``, when the
  recorder had it: int64 nanoseconds since 1970;
* ``time_s`` since the first flight state of the topic's bridge, the same zero in every topic below its name space;
* ``sim_time_unwrapped_s``, the simulator's time at the stamp, between flight states of that bridge interpolated, never
  across a gap or an epoch (NaN there);
* every field with its unit in the name, as in the other tables. Fixed arrays are two-dimensional. Lists of varying
  length are filled up (NaN, 0, false or empty text) beside their lengths, ``<name>_count``; lists of messages are JSON.

Beside the topics there is ``cameras``, with one row per camera (`CameraRow`).
"""

from __future__ import annotations

import re
import struct
import tempfile
import zlib
from array import array
from functools import partial
from itertools import islice
from typing import (
    TYPE_CHECKING,
    Any,
    BinaryIO,
    Callable,
    Iterable,
    Iterator,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Union,
)
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from xplane_bridge import __version__
from xplane_bridge.analysis.resampling import interpolated
from xplane_bridge.bags import FLIGHT_STATE, BagError
from xplane_bridge.bags.cameras import COMPRESSED, RAW
from xplane_bridge.bags.columns import ColumnFile
from xplane_bridge.bags.flight import state_epochs
from xplane_bridge.bags.segments import DEFAULT_MAX_GAP, segments
from xplane_bridge.export.cameras import UNITS as CAMERA_UNITS
from xplane_bridge.export.cameras import CameraRow, one_column_each
from xplane_bridge.export.columns import json_text, name_of
from xplane_bridge.export.flight import full_names, refuse_pictures

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags, Table
    from xplane_bridge.bags.units import Unit

SIM_TIME = "sim_time_unwrapped_s"
#: MATLAB takes no longer names.
_LONGEST_NAME = 63
#: A variable of MATLAB's file format 5 holds less than this.
_MAT_LIMIT = 2**31
_MAT_HEADER = 128  #: [bytes] before the first variable
_MAT_TAG = struct.Struct("=II")  #: of an element: its type, its size
_MAT_COMPRESSED = 15
_PIECE_BYTES = 1 << 20
#: Name of the table of the cameras.
_CAMERAS = "cameras"


class Texts:
    """A column of texts, kept in a file: in memory NumPy gives each the room of the longest.

    Args:
        texts: Each is taken once.
        folder: Where the temporary file lies; Python's choice when omitted.
    """

    def __init__(self, texts: Iterable[str], folder: Optional[Path]) -> None:
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115, closed with the last reference to it
        sizes: array[int] = array("q")
        longest = 1
        for text in texts:
            sizes.append(self._file.write(text.encode("utf-8", "surrogatepass")))
            longest = max(longest, len(text))
        self.dtype = np.dtype(f"U{longest}")
        self.shape = (len(sizes),)
        self._sizes = sizes

    def __iter__(self) -> Iterator[str]:
        """The texts."""
        self._file.seek(0)
        for size in self._sizes:
            yield self._file.read(size).decode("utf-8", "surrogatepass")

    def pieces(self) -> Iterator[np.ndarray]:
        """The texts as arrays of the column's type, so many in each that it is small."""
        texts = iter(self)
        step = max(1, _PIECE_BYTES // self.dtype.itemsize)
        for first in range(0, self.shape[0], step):
            yield np.array(list(islice(texts, min(step, self.shape[0] - first))), dtype=self.dtype)


Source = Union[np.ndarray, Texts]


class Columns(Mapping[str, np.ndarray]):
    """Columns by name, made when they are asked for."""

    def __init__(self) -> None:
        self._sources: dict[str, Callable[[], Source]] = {}

    def add(self, name: str, source: Callable[[], Source]) -> None:
        """Adds a column by what gives it."""
        self._sources[name] = source

    def source(self, name: str) -> Source:
        """Give a column to be written; texts in pieces."""
        return self._sources[name]()

    def __getitem__(self, name: str) -> np.ndarray:
        """Give a column as an array."""
        source = self.source(name)
        return np.concatenate([np.empty(0, source.dtype), *source.pieces()]) if isinstance(source, Texts) else source

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._sources)

    def __len__(self) -> int:
        """Give the number of columns."""
        return len(self._sources)


class TopicArrays(NamedTuple):
    """One topic."""

    name: str  #: a name that MATLAB takes too, e.g. ``mission_engines``
    topic: str
    msgtype: str
    messages: int
    columns: Columns  #: numbers, booleans or texts; the first axis counts messages
    units: dict[str, str]  #: of the columns that have one, as written in the message, e.g. ``rad/s``


class _SimClock(NamedTuple):
    """The simulator's time against the host's, from the flight states."""

    zero: int  #: [ns] stamp of the first state; without states, the first receive time
    stamp: np.ndarray  #: int64 [ns], sorted
    sim_time: np.ndarray  #: [s]
    parts: list[slice]

    def at(self, stamp: np.ndarray) -> np.ndarray:
        """Give the simulator's time [s] at host times [ns]; NaN where no two states of one piece lie around."""
        if not len(self.stamp):
            return np.full(len(stamp), np.nan)
        return interpolated(stamp, self.stamp, self.sim_time, self.parts)


def topic_arrays(bags: Bags, only: Sequence[str] = (), folder: Optional[Path] = None) -> Iterator[TopicArrays]:
    """Read the topics of a flight, one after the other and into temporary files: one column needs to be in memory.

    Args:
        bags: Open bags of one flight.
        only: The topics to read, by full name or by name below the bridge's name space; all when empty.
        folder: Where the temporary files lie; Python's choice when omitted.

    Raises:
        BagError: No such topic, a topic of pictures, or nothing in the bags.
    """
    infos = bags.topics
    space = bags.name_space
    chosen = full_names(bags, only) or sorted(
        name for name, info in infos.items() if info.count and info.msgtype not in (RAW, COMPRESSED)
    )
    if not chosen:
        msg = f"{', '.join(map(str, bags.paths))}: no message that a table can hold; nothing was recorded but pictures"
        raise BagError(msg)
    clocks = _Clocks(bags, chosen)
    taken = ["units", "topics", "about", _CAMERAS]
    refuse_pictures(bags, chosen)
    for topic in chosen:
        name = topic[len(space) :] if topic.startswith(space + "/") else topic
        taken.append(_valid_name(name.strip("/"), taken))
        units, clock = bags.units(topic), clocks.of(topic)
        yield _arrays(taken[-1], bags.read(topic, store=ColumnFile(folder)), units, clock, folder)


class _Written:
    """What is to be said of the topics that were written."""

    def __init__(self) -> None:
        self.names: list[tuple[str, str, str]] = []
        self.units: dict[str, dict[str, str]] = {}
        self.messages = 0
        self.columns = 0

    def add(self, topic: TopicArrays) -> None:
        self.names.append(topic[:3])
        self.units[topic.name] = topic.units
        self.messages += topic.messages
        self.columns += len(topic.columns)

    @property
    def counts(self) -> dict[str, int]:
        """For the manifest."""
        return {"topics": len(self.names), "messages": self.messages, "columns": self.columns}


def write_npz(topics: Iterable[TopicArrays], path: Path, cameras: Iterable[CameraRow] = ()) -> dict[str, int]:
    """Write ``<topic>/<column>`` arrays, then ``topics`` (name, topic, type), ``units`` (key, unit) and ``about``.

    Where there are cameras, also ``cameras/<column>``.

    Returns:
        What the manifest says of it.
    """
    written = _Written()
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:

        def add(name: str, values: Source) -> None:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                if isinstance(values, Texts):
                    about = {"descr": values.dtype.str, "fortran_order": False, "shape": values.shape}
                    np.lib.format.write_array_header_1_0(file, about)
                    for piece in values.pieces():
                        file.write(piece.tobytes())
                else:
                    np.lib.format.write_array(file, values, allow_pickle=False)

        for topic in topics:
            written.add(topic)
            for name in topic.columns:
                add(f"{topic.name}/{name}", topic.columns.source(name))
            del topic  # before the next is read
        rows = list(cameras)  # after the topics: to read them leaves things in memory
        if rows:
            written.units[_CAMERAS] = CAMERA_UNITS
            for name, values in one_column_each(rows).items():
                add(f"{_CAMERAS}/{name}", values)
        units = [
            (f"{topic}/{name}", unit) for topic, of_topic in written.units.items() for name, unit in of_topic.items()
        ]
        add("topics", _texts(written.names))
        add("units", _texts(units))
        add("about", np.array(_about()))
    return written.counts


def write_mat(topics: Iterable[TopicArrays], path: Path, cameras: Iterable[CameraRow] = ()) -> dict[str, int]:
    """Write a struct for each topic, a struct ``units`` of the same shape, ``topics`` and ``about``.

    Where there are cameras, also a struct ``cameras``.

    Returns:
        What the manifest says of it.

    Raises:
        BagError: A topic is too large for the file format.
    """
    from scipy.io import savemat

    written = _Written()
    with path.open("w+b") as file:

        def add(name: str, value: Any) -> None:
            with tempfile.TemporaryFile(dir=path.parent) as plain:  # SciPy would compress in memory
                savemat(plain, {name: value}, long_field_names=True, oned_as="column")
                plain.seek(0)
                header = plain.read(_MAT_HEADER)
                if not file.tell():
                    file.write(header)
                _compress(plain, file)

        for topic in topics:
            written.add(topic)
            size = sum(_mat_bytes(topic.columns.source(name)) for name in topic.columns)
            if size >= _MAT_LIMIT:
                msg = f"{topic.topic}: {size} bytes are too many for a .mat file (limit {_MAT_LIMIT}); use --format npz"
                raise BagError(msg)
            add(topic.name, {name: _MatColumn(topic.columns, name) for name in topic.columns})
            del topic  # before the next is read
        rows = list(cameras)
        if rows:
            written.units[_CAMERAS] = CAMERA_UNITS
            add(_CAMERAS, {name: _cells(values) for name, values in one_column_each(rows).items()})
        add("units", written.units)
        add("topics", _cells(_texts(written.names)))
        add("about", _about())
        # SciPy puts the date there; the same flight is to give the same bytes.
        file.seek(0)
        file.write(f"MATLAB 5.0 MAT-file, {_about()}".ljust(116).encode("ascii"))
    return written.counts


class _MatColumn:
    """A column that SciPy asks for when it writes it."""

    __slots__ = ("_columns", "_name")  # SciPy takes what has a __dict__ for a struct

    def __init__(self, columns: Columns, name: str) -> None:
        self._columns = columns
        self._name = name

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> np.ndarray:
        return _cells(self._columns.source(self._name))


def _compress(plain: BinaryIO, file: BinaryIO) -> None:
    """Adds the rest of an uncompressed MAT-file as one compressed element."""
    tag = file.tell()
    file.write(_MAT_TAG.pack(_MAT_COMPRESSED, 0))
    packer = zlib.compressobj()
    for block in iter(lambda: plain.read(_PIECE_BYTES), b""):
        file.write(packer.compress(block))
    file.write(packer.flush())
    end = file.tell()
    file.seek(tag)
    file.write(_MAT_TAG.pack(_MAT_COMPRESSED, end - tag - _MAT_TAG.size))
    file.seek(end)


def _about() -> str:
    return f"written by xplane_bridge {__version__}"


def _sim_clock(bags: Bags, state: Optional[str]) -> _SimClock:
    if state is None or not bags.topics[state].count:
        zero = min((info.first_time for info in bags.topics.values() if info.count), default=0)
        return _SimClock(zero, np.empty(0, np.int64), np.empty(0), [])
    table = bags.read(state, ["header.stamp", "sim_time_unwrapped", "epoch"]).by_stamp()
    parts = segments(table.stamp, state_epochs(bags, table), DEFAULT_MAX_GAP)
    return _SimClock(int(table.stamp[0]), table.stamp, table["sim_time_unwrapped"], parts)


class _Clocks:
    """The clocks of the bridges in a recording, each read once.

    Args:
        bags: Open bags of one flight.
        topics: Those to be read.
    """

    def __init__(self, bags: Bags, topics: Iterable[str]) -> None:
        self._bags = bags
        self._bridges = bags.bridges_of(topics)
        self._states: dict[Optional[str], str] = {}
        for name, info in sorted(bags.topics.items()):
            if info.msgtype == FLIGHT_STATE:
                self._states.setdefault(name.rpartition("/")[0], name)
        self._read: dict[Optional[str], _SimClock] = {}

    def of(self, topic: str) -> _SimClock:
        """Give the clock of a topic's bridge; of a topic of none, that of the only one, or of several just the zero."""
        space = self._bridges[topic]
        if space not in self._read:
            clock = _sim_clock(self._bags, self._states.get(space, self._bags.topic_of_type(FLIGHT_STATE)))
            known = space is not None or len(self._states) == 1
            self._read[space] = clock if known else clock._replace(stamp=np.empty(0, np.int64))
        return self._read[space]


def _arrays(key: str, table: Table, units: dict[str, Unit], clock: _SimClock, folder: Optional[Path]) -> TopicArrays:
    stamp = table.stamp
    columns = Columns()
    columns.add("stamp_ns", lambda: stamp)
    columns.add("receive_ns", lambda: table.time)
    columns.add("time_s", lambda: (stamp - clock.zero) / 1e9)
    symbols = {"stamp_ns": "ns", "receive_ns": "ns", "time_s": "s"}
    if "sim_time_unwrapped" not in table:
        columns.add(SIM_TIME, lambda: clock.at(stamp))
        symbols[SIM_TIME] = "s"
    for path, values in table.columns.items():
        if path.split(".")[0] == "header":
            continue
        name = _valid_name(name_of(path, units), columns)
        if values.dtype != object:
            columns.add(name, partial(table.__getitem__, path))
        else:
            for ending, flat in _without_objects(values, folder).items():
                columns.add(name + ending, partial(_given, flat))
        if path in units and units[path].symbol:
            symbols[name] = units[path].symbol
    return TopicArrays(key, table.topic, table.msgtype, len(table), columns, symbols)


def _given(source: Source) -> Source:
    return source


def _valid_name(text: str, taken: Iterable[str]) -> str:
    """Make a name of letters, digits and underscores that begins with a letter, unlike those taken."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    name = name if name[:1].isalpha() else f"x{name}"
    base = name = name[: _LONGEST_NAME - len("_count")]
    number = 1
    while name in taken:
        number += 1
        name = f"{base[: _LONGEST_NAME - len('_count') - 4]}_{number}"
    return name


def _without_objects(values: np.ndarray, folder: Optional[Path]) -> dict[str, Source]:
    """Give a column of objects as what needs no pickle, by the ending of the names."""
    filled = [value for value in values if value is not None]
    if all(isinstance(value, str) for value in filled):
        return {"": Texts(("" if value is None else value for value in values), folder)}
    if all(isinstance(value, np.ndarray) for value in filled):
        return _padded(values, np.result_type(*filled))
    if all(isinstance(value, list) and all(isinstance(text, str) for text in value) for value in filled):
        longest = max((len(text) for value in filled for text in value), default=1)
        return _padded(values, np.dtype(f"U{max(longest, 1)}"))
    return {"": Texts(("" if value is None else json_text(value) for value in values), folder)}


def _padded(values: np.ndarray, dtype: np.dtype) -> dict[str, Source]:
    lengths = np.array([0 if value is None else len(value) for value in values], dtype=np.int64)
    width = int(lengths.max()) if len(lengths) else 0
    filler: Any = np.nan if np.issubdtype(dtype, np.floating) else "" if dtype.kind == "U" else 0
    out = np.full((len(values), width), filler, dtype=dtype)
    for k, value in enumerate(values):
        if lengths[k]:
            out[k, : lengths[k]] = value
    return {"": out, "_count": lengths}


def _texts(values: Sequence[Any]) -> np.ndarray:
    return np.array(values, dtype=str) if len(values) else np.empty(0, dtype="U1")


def _mat_bytes(values: Source) -> int:
    texts: Iterable[str] = ()
    if isinstance(values, Texts):
        texts = values
    elif values.dtype.kind == "U":
        texts = values.flat
    else:
        return values.nbytes
    return sum(64 + 2 * len(text) for text in texts)


def _cells(values: Source) -> np.ndarray:
    """Give texts as objects, of which SciPy makes cells; a padded matrix of characters would lose their lengths."""
    if isinstance(values, Texts):
        cells = np.empty((values.shape[0], 1), dtype=object)
        cells[:, 0] = [text.rstrip("\0") for text in values]
        return cells
    if values.dtype.kind != "U":
        return values
    return (values[:, None] if values.ndim == 1 else values).astype(object)
