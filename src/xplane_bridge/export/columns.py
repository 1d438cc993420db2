"""Message columns as the columns of an export: units in the names, one column a number, optionally on one time base."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any, Iterator, Mapping

import numpy as np

from xplane_bridge.analysis.resampling import held, interpolated, rotated
from xplane_bridge.bags.decoding import MessageList

if TYPE_CHECKING:
    from xplane_bridge.bags.units import Unit


def named(columns: Mapping[str, np.ndarray], units: Mapping[str, Unit], prefix: str = "") -> dict[str, np.ndarray]:
    """Flatten columns and put the unit into each name.

    Args:
        columns: From a `Table`; shape (n,) or (n, k).
        units: From `Bags.units`.
        prefix: Put before every name, with an underscore.

    Returns:
        ``altitude_msl_m``, ``velocity_ned_x_mps``, ``roll_deg``, ``throttle_command_0``, ... in message order, without
        the header; arrays are spread over numbered columns, or ``clock_zulu_h``, ``clock_zulu_min``, ... where each
        element has its own unit; lists of varying length stay objects, lists of messages are JSON.
    """
    out: dict[str, np.ndarray] = {}
    for path, values in columns.items():
        if path.split(".")[0] == "header":
            continue
        base, ending = _parts(path, units, prefix)
        if values.ndim == 1:
            out[base + ending] = as_json(values, MessageList)
        else:
            flat = values.reshape(len(values), -1)
            each = units[path].each if path in units else ()
            endings = each or [f"{k}{ending}" for k in range(flat.shape[1])]
            for k, last in enumerate(endings):
                out[f"{base}_{last}"] = flat[:, k]
    return out


def as_json(values: np.ndarray, *kinds: type) -> np.ndarray:
    """Give a column where what is of some kinds of lists is JSON."""
    if not values.dtype.hasobject or not any(isinstance(value, kinds) for value in values):
        return values
    texts = np.empty(len(values), dtype=object)  # values beside them keep their types
    texts[:] = [json_text(value) if isinstance(value, kinds) else value for value in values]
    return texts


def json_text(value: Any) -> str:
    """Give a list, or messages, as JSON; numbers that are not finite are null."""
    return json.dumps(_plain(value))


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        # Constants have a default, what was sent has none.
        fields = [field.name for field in dataclasses.fields(value) if field.default is dataclasses.MISSING]
        return {name: _plain(getattr(value, name)) for name in fields}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple, MessageList)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def name_of(path: str, units: Mapping[str, Unit]) -> str:
    """Name a column, with its unit: ``angular_velocity.x`` is ``angular_velocity_x_radps``."""
    return "".join(_parts(path, units, ""))


def _parts(path: str, units: Mapping[str, Unit], prefix: str) -> tuple[str, str]:
    """Give a column's name without its unit, and the ending that says the unit."""
    base = f"{prefix}_{path}" if prefix else path
    base = base.replace(".", "_").replace("[", "_").replace("]", "")
    suffix = units[path].suffix if path in units else ""
    return base, f"_{suffix}" if suffix and not base.endswith(f"_{suffix}") else ""


def on_base(
    base: np.ndarray,
    time: np.ndarray,
    columns: Mapping[str, np.ndarray],
    units: Mapping[str, Unit],
    parts: list[slice],
) -> Iterator[tuple[str, np.ndarray]]:
    """Bring columns onto a time base: numbers linearly, angles and quaternions the short way round, others held.

    Args:
        base: int64 [ns], shape (m,).
        time: int64 [ns], shape (n,), of the columns.
        columns: From a `Table`.
        units: From `Bags.units`; say which angles wrap.
        parts: Segments of `time` (`segments`).

    Yields:
        The same names, m rows each, one after the other. NaN where there is nothing to interpolate.
    """
    done: set[str] = set()
    for path in columns:
        if path in done:
            continue
        values = columns[path]
        quaternion = [f"{path[:-2]}.{axis}" for axis in "xyzw"]
        if path.endswith(".x") and all(q in columns for q in quaternion):
            turned = rotated(base, time, np.stack([columns[q] for q in quaternion], axis=1), parts)
            for k, name in enumerate(quaternion):
                yield name, turned[:, k]
            done.update(quaternion)
        elif np.issubdtype(values.dtype, np.floating):
            unit = units.get(path)
            wrap, low = (unit.wrap, unit.low) if unit else (0.0, 0.0)
            yield path, interpolated(base, time, values, parts, wrap, low)
        else:
            yield path, held(base, time, values)
