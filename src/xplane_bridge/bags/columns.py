"""Columns of a topic while it is read and afterwards: in memory, or in a temporary file and loaded one at a time.

Every column has its full length from its first piece on and is filled piece by piece: nothing is ever copied together.
"""

from __future__ import annotations

import tempfile
from typing import TYPE_CHECKING, Dict, Iterator, List, Mapping, Optional, Tuple, Union

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path


class ColumnFile:
    """A temporary file of numbers; it goes with the last column that lies in it.

    Args:
        folder: Where it lies, best on the disk that is written to: `/tmp` may be memory. Python's choice when omitted.

    Raises:
        OSError: It cannot be made, or the disk is full.
    """

    def __init__(self, folder: Optional[Path] = None) -> None:
        self._folder = folder
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115, closed with the last reference to it
        self._end = 0

    def column(self, rows: int, dtype: np.dtype, shape: Tuple[int, ...] = ()) -> StoredColumn:
        """Gives room for a column of so many rows, each of `shape`."""
        at = self._end
        self._end += rows * int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        return StoredColumn(self, at, rows, dtype, shape)

    def write(self, at: int, values: np.ndarray) -> None:
        """Writes the bytes of an array at a place of the file."""
        try:
            self._file.seek(at)
            self._file.write(values.tobytes())
            self._file.flush()
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self._folder or tempfile.gettempdir())) from None

    def read(self, at: int, out: np.ndarray) -> None:
        """Fills an array with the bytes at a place of the file."""
        if out.nbytes:
            self._file.seek(at)
            self._file.readinto(out.reshape(-1).view(np.uint8).data)


class StoredColumn:
    """A column in a `ColumnFile`."""

    def __init__(self, file: ColumnFile, at: int, rows: int, dtype: np.dtype, shape: Tuple[int, ...]) -> None:
        self.dtype = dtype
        self.shape = (rows, *shape)
        self._file = file
        self._at = at
        self._row_bytes = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize

    def __len__(self) -> int:
        """Give the number of rows."""
        return self.shape[0]

    def __setitem__(self, rows: slice, values: np.ndarray) -> None:
        """Writes rows."""
        first, _, _ = rows.indices(len(self))
        self._file.write(self._at + first * self._row_bytes, np.asarray(values, dtype=self.dtype))

    def __getitem__(self, rows: slice) -> np.ndarray:
        """Loads rows."""
        first, end, _ = rows.indices(len(self))
        out = np.empty((max(end - first, 0), *self.shape[1:]), dtype=self.dtype)
        self._file.read(self._at + first * self._row_bytes, out)
        return out


class _Run:
    """Neighbouring rows of one type and shape; there is room for all rows that may follow.

    Args:
        first: Its first row.
        values: The room.
        lists: Whether each row is an array of its own in the column.
    """

    def __init__(self, first: int, values: Union[np.ndarray, StoredColumn], lists: bool) -> None:
        self.first = first
        self.end = first
        self._values = values
        self._lists = lists

    def takes(self, first: int, values: np.ndarray, lists: bool) -> bool:
        alike = self._values.dtype == values.dtype and self._values.shape[1:] == values.shape[1:]
        return bool(self.end == first and alike and self._lists == lists)

    def add(self, values: np.ndarray) -> None:
        at = self.end - self.first
        self._values[at : at + len(values)] = values
        self.end += len(values)

    def get(self) -> np.ndarray:
        values = self._values[: self.end - self.first]
        if not self._lists:
            return values
        column = np.empty(len(values), dtype=object)
        for k in range(len(values)):
            column[k] = values[k]
        return column


class Filling:
    """The columns of one topic while it is read.

    Args:
        rows: How many there will be.
        store: Where columns of numbers go; into memory when omitted. Texts and lists of messages always do.
    """

    def __init__(self, rows: int, store: Optional[ColumnFile]) -> None:
        self._time = np.empty(rows, dtype=np.int64)
        self._store = store
        self._rows = 0
        self._runs: Dict[str, List[_Run]] = {}

    def __len__(self) -> int:
        """Give the number of rows so far."""
        return self._rows

    @property
    def names(self) -> List[str]:
        """The columns so far."""
        return list(self._runs)

    @property
    def time(self) -> np.ndarray:
        """Receive times so far [ns]."""
        return self._time[: self._rows]

    def add(self, time: np.ndarray, columns: Mapping[str, np.ndarray]) -> None:
        """Adds rows: receive times [ns], and their columns."""
        for name, given in columns.items():
            lists = self._store is not None and _are_lists_alike(given)
            values = np.stack(given.tolist()) if lists else given
            runs = self._runs.setdefault(name, [])
            if not runs or not runs[-1].takes(self._rows, values, lists):
                runs.append(_Run(self._rows, self._room(values), lists))
            runs[-1].add(values)
        self._time[self._rows : self._rows + len(time)] = time
        self._rows += len(time)

    def columns(self, order: Optional[np.ndarray]) -> Mapping[str, np.ndarray]:
        """Give the columns, their rows in this order; what a piece did not have is NaN or None there."""
        if self._store is not None:
            return StoredColumns(self._runs, self._rows, order)
        out: Dict[str, np.ndarray] = {}
        for name in self.names:  # one at a time, and what it was made of let go
            stacked = _stacked(self._runs.pop(name), self._rows)
            out[name] = stacked if order is None else stacked[order]
        return out

    def _room(self, values: np.ndarray) -> Union[np.ndarray, StoredColumn]:
        rows = len(self._time) - self._rows
        if self._store is None or values.dtype.hasobject:
            return np.empty((rows, *values.shape[1:]), dtype=values.dtype)
        return self._store.column(rows, values.dtype, values.shape[1:])


class StoredColumns(Mapping[str, np.ndarray]):
    """Columns that are loaded each time they are asked for."""

    def __init__(self, runs: Mapping[str, List[_Run]], rows: int, order: Optional[np.ndarray]) -> None:
        self._runs = runs
        self._rows = rows
        self._order = order

    def __getitem__(self, name: str) -> np.ndarray:
        """Loads a column."""
        stacked = _stacked(self._runs[name], self._rows)
        return stacked if self._order is None else stacked[self._order]

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._runs)

    def __len__(self) -> int:
        """Give the number of columns."""
        return len(self._runs)

    def __contains__(self, name: object) -> bool:
        """Returns whether there is a column of this name, without loading it."""
        return name in self._runs

    def in_order(self, order: np.ndarray) -> StoredColumns:
        """The same with their rows in another order: numbers of the rows as they are now."""
        return StoredColumns(self._runs, self._rows, order if self._order is None else self._order[order])


def _are_lists_alike(values: np.ndarray) -> bool:
    """Whether the rows are arrays of numbers, of one type and length: as objects they take ten times the room."""
    if not values.dtype.hasobject or not len(values) or not isinstance(values[0], np.ndarray):
        return False
    kind = (values[0].dtype, values[0].shape)
    return all(isinstance(value, np.ndarray) and (value.dtype, value.shape) == kind for value in values)


def _stacked(runs: List[_Run], rows: int) -> np.ndarray:
    """One column of all runs; where there is none it is NaN or None."""
    have = [run.get() for run in runs]
    shapes = {values.shape[1:] for values in have}
    whole = sum(map(len, have)) == rows
    if whole and len(have) == 1:
        return have[0]
    if whole and len(shapes) == 1:
        return np.concatenate(have)
    if len(shapes) == 1 and all(np.issubdtype(v.dtype, np.number) or v.dtype == bool for v in have):
        out = np.full((rows, *next(iter(shapes))), np.nan)
        for run, values in zip(runs, have):
            out[run.first : run.end] = values
        return out
    out = np.full(rows, None, dtype=object)
    for run, values in zip(runs, have):
        for k in range(len(values)):
            out[run.first + k] = values[k]
    return out
