"""Flights as tables: CSV and Parquet, one row per flight state or one row an instant of a uniform time base."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Optional, Sequence, Union

import numpy as np
import pandas as pd

from xplane_bridge.analysis.resampling import held, time_base
from xplane_bridge.bags import FLIGHT_STATE
from xplane_bridge.bags.columns import ColumnFile, StoredColumn
from xplane_bridge.bags.segments import DEFAULT_MAX_GAP, segments
from xplane_bridge.export.columns import as_json, named, on_base
from xplane_bridge.export.flight import breaks, full_names, labels, refuse_pictures, topic_of

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags

#: Rows that are written at a time.
_PIECE_ROWS = 8192
#: Types of the labels of a flight; they may lack values.
LABELS = {"mode": "UInt8", "failsafe": "boolean", "failures": "string", "excitation": "string"}


class FlightTable:
    """A table whose numbers lie in a temporary file and which is taken some thousand rows at a time.

    Args:
        rows: How many it has.
        store: Where the numbers lie; texts and lists are in memory.
    """

    def __init__(self, rows: int, store: ColumnFile) -> None:
        self.rows = rows
        self.store = store
        self._columns: dict[str, Union[np.ndarray, StoredColumn]] = {}
        self.nullable: dict[str, str] = {}  #: pandas' types of columns that may lack values: the same in every flight

    @property
    def counts(self) -> dict[str, int]:
        """For the manifest."""
        return {"rows": self.rows, "columns": len(self._columns)}

    @property
    def names(self) -> list[str]:
        """Of its columns."""
        return list(self._columns)

    def add(self, columns: Mapping[str, np.ndarray]) -> None:
        """Adds columns; one of the name of an earlier one takes its place."""
        for name, values in columns.items():
            if values.dtype.hasobject:
                self._columns[name] = values
            else:
                kept = self.store.column(self.rows, values.dtype, values.shape[1:])
                kept[:] = values
                self._columns[name] = kept

    def objects(self) -> dict[str, np.ndarray]:
        """The columns of texts and lists."""
        return {name: values for name, values in self._columns.items() if isinstance(values, np.ndarray)}

    def piece(self, rows: slice) -> dict[str, np.ndarray]:
        """Give some rows, by column."""
        return {name: values[rows] for name, values in self._columns.items()}

    def frame(self, rows: Union[slice, Sequence[int]]) -> pd.DataFrame:
        """Give some rows: neighbours, or a few by their numbers."""
        if isinstance(rows, slice):
            return pd.DataFrame(self.piece(rows))
        return pd.concat([self.frame(slice(k, k + 1)) for k in rows], ignore_index=True)

    def frames(self) -> Iterator[pd.DataFrame]:
        """Give all rows in pieces; a table without any is one piece without any."""
        for first in range(0, max(self.rows, 1), _PIECE_ROWS):
            yield self.frame(slice(first, first + _PIECE_ROWS))


def flight_table(
    bags: Bags, rate: Optional[float] = None, topics: Sequence[str] = (), folder: Optional[Path] = None
) -> FlightTable:
    """Make the table of a flight.

    Args:
        bags: Open bags of one flight.
        rate: [1/s] of a uniform time base; None: one row per flight state, nothing interpolated.
        topics: Further topics whose newest values at each row are added, prefixed by their name below the name space.
        folder: Where its temporary file lies; Python's choice when omitted.

    Returns:
        ``stamp_ns`` (int64), ``time_s`` since the first row, every field of FlightState with its unit in the name, the
        labels ``mode``, ``failsafe``, ``failures``, ``excitation``, then the further topics.

    Raises:
        BagError: No flight state in the bag, or no such further topic, or one of pictures.
    """
    further = full_names(bags, topics)
    refuse_pictures(bags, further)
    store = ColumnFile(folder)
    topic = topic_of(bags, FLIGHT_STATE)
    units = bags.units(topic)
    state = bags.read(topic, store=store).by_stamp()
    base, columns = state.stamp, iter(state.columns.items())
    # Also where nothing is interpolated: a warning says where the clock was set back.
    parts = segments(state.stamp, breaks(bags, state), DEFAULT_MAX_GAP)
    if rate is not None:
        base = time_base(state.stamp, parts, rate)
        columns = on_base(base, state.stamp, state.columns, units, parts)
    table = FlightTable(len(base), store)
    table.add({"stamp_ns": base, "time_s": (base - base[0]) / 1e9 if len(base) else np.empty(0)})
    for path, values in columns:
        table.add(named({path: values}, units))
    table.add(labels(bags, base))
    table.nullable.update(LABELS)
    for other in further:
        _add_newest(table, bags, other, base)
    return table


def _add_newest(table: FlightTable, bags: Bags, full: str, base: np.ndarray) -> None:
    space = bags.name_space
    units = bags.units(full)
    other = bags.read(full, store=table.store).by_stamp()
    prefix = full[len(space) :].strip("/") if full.startswith(space + "/") else full.strip("/")
    for path, values in other.columns.items():
        for name, column in named({path: values}, units, prefix.replace("/", "_")).items():
            table.add({name: held(base, other.stamp, column)})
            kind = _nullable(column)
            if kind:
                table.nullable[name] = kind


def _nullable(column: np.ndarray) -> str:
    """The type of a column in which values may be missing; empty where it has values for that, or holds lists."""
    if column.dtype == bool:
        return "boolean"
    if np.issubdtype(column.dtype, np.integer):
        return str(column.dtype).replace("int", "Int").replace("uI", "UI")
    return "string" if len(column) and all(isinstance(value, str) for value in column) else ""


def write_csv(table: FlightTable, path: Path) -> None:
    """Write a table as CSV; numbers read back to the very same values, lists are JSON."""
    with path.open("w", encoding="utf-8", newline="") as file:
        for k, frame in enumerate(table.frames()):
            for name in table.objects():
                frame[name] = as_json(frame[name].to_numpy(), list, np.ndarray)
            frame.to_csv(file, index=False, header=k == 0, lineterminator="\n")


def write_parquet(table: FlightTable, path: Path) -> None:
    """Write a table as Parquet with its types."""
    objects = {name: values for name, values in table.objects().items() if name not in table.nullable}
    # Rows that show what each column of objects holds.
    filled = (np.flatnonzero([value is not None for value in values])[:1].tolist() for values in objects.values())
    rows = sorted({row for of_column in filled for row in of_column}) or [0]
    frames = (frame.astype(table.nullable) for frame in table.frames())
    write_frames(path, frames, schema_of(table.frame(rows[: table.rows]).astype(table.nullable), objects))


def schema_of(sample: pd.DataFrame, objects: Mapping[str, np.ndarray]) -> Any:
    """Give Arrow's schema of a table.

    Args:
        sample: Some of its rows.
        objects: Whole columns, those whose type follows from all of their values.
    """
    import pyarrow as pa

    schema = pa.Schema.from_pandas(sample, preserve_index=False)
    for name, values in objects.items():
        whole = pa.Schema.from_pandas(pd.DataFrame({name: values}), preserve_index=False).field(name)
        if whole.type == pa.list_(pa.null()):  # all empty, and of texts: those of numbers are arrays with a type
            whole = whole.with_type(pa.list_(pa.string()))
        schema = schema.set(schema.get_field_index(name), whole)
    return schema


def write_frames(path: Path, frames: Iterable[pd.DataFrame], schema: Any) -> None:
    """Write pieces of a table as one Parquet file."""
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    with ParquetWriter(path, schema) as writer:
        for frame in frames:
            writer.write_table(pa.Table.from_pandas(frame, schema=schema, preserve_index=False))
