"""Flights as tables: CSV and Parquet, one row per flight state or one row an instant of a uniform time base."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Sequence

import numpy as np
import pandas as pd

from xplane_bridge.analysis.resampling import held, time_base
from xplane_bridge.bags.segments import DEFAULT_MAX_GAP, segments
from xplane_bridge.export.columns import named, on_base
from xplane_bridge.export.flight import STATE, labels, topic_of

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags


def flight_table(bags: Bags, rate: Optional[float] = None, topics: Sequence[str] = ()) -> pd.DataFrame:
    """Make the table of a flight.

    Args:
        bags: Open bags of one flight.
        rate: [1/s] of a uniform time base; None: one row per flight state, nothing interpolated.
        topics: Further topics whose newest values at each row are added, prefixed by their name below the name space.

    Returns:
        ``stamp_ns`` (int64), ``time_s`` since the first row, every field of FlightState with its unit in the name, the
        labels ``mode``, ``failsafe``, ``failures``, ``excitation``, then the further topics.

    Raises:
        BagError: No flight state in the bag, or no such further topic.
    """
    topic = topic_of(bags, STATE)
    table, units = bags.read(topic), bags.units(topic)
    order = np.argsort(table.stamp, kind="stable")
    stamp = table.stamp[order]
    columns = {name: values[order] for name, values in table.columns.items()}
    base = stamp
    if rate is not None:
        parts = segments(stamp, columns["epoch"], DEFAULT_MAX_GAP)
        base = time_base(stamp, parts, rate)
        columns = on_base(base, stamp, columns, units, parts)
    data: dict[str, Any] = {"stamp_ns": base, "time_s": (base - base[0]) / 1e9 if len(base) else np.empty(0)}
    data.update(named(columns, units))
    data.update(labels(bags, base))
    for other in topics:
        data.update(_newest(bags, other, base, topic.rsplit("/", 1)[0]))
    return pd.DataFrame(data)


def _newest(bags: Bags, topic: str, base: np.ndarray, space: str) -> dict[str, np.ndarray]:
    full = topic if topic.startswith("/") else f"{space}/{topic}"
    table, units = bags.read(full), bags.units(full)
    order = np.argsort(table.stamp, kind="stable")
    columns = {name: held(base, table.stamp[order], values[order]) for name, values in table.columns.items()}
    prefix = full[len(space) :].strip("/") if full.startswith(space + "/") else full.strip("/")
    return named(columns, units, prefix.replace("/", "_"))


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV; numbers read back to the very same values."""
    frame.to_csv(path, index=False, lineterminator="\n")


def write_parquet(frame: pd.DataFrame, path: Path) -> None:
    """Write a table as Parquet with its types."""
    frame.to_parquet(path, index=False)
