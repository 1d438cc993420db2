"""A flight in a few numbers."""

from __future__ import annotations

from typing import Mapping, NamedTuple

import numpy as np


class Quantity(NamedTuple):
    """A number with its unit."""

    name: str
    value: float
    unit: str


def distance(time: np.ndarray, ground_speed: np.ndarray, parts: list[slice]) -> float:
    """Integrate the ground speed [m/s] over `time` [s] inside the segments: metres flown over ground."""
    total = 0.0
    for part in parts:
        t, v = time[part], ground_speed[part].astype(np.float64)
        good = np.isfinite(v)
        t, v = t[good], v[good]
        total += float(np.sum((v[1:] + v[:-1]) / 2 * np.diff(t)))
    return total


def summary(time: np.ndarray, columns: Mapping[str, np.ndarray], parts: list[slice]) -> list[Quantity]:
    """Summarise the columns of FlightState.

    Args:
        time: int64 [ns], shape (n,).
        columns: Of FlightState; what is missing is left out, but simulator time must be there.
        parts: Segments of `time`.

    Returns:
        Duration, distance, and the extremes that a pilot asks for.
    """
    out = [Quantity("duration", float((time[-1] - time[0]) / 1e9) if len(time) else 0.0, "s")]
    if "ground_speed" in columns:
        flown = distance(columns["sim_time_unwrapped"], columns["ground_speed"], parts)
        out.append(Quantity("distance over ground", flown, "m"))
    extremes = (
        ("altitude_msl", "altitude MSL", "m", ("min", "max")),
        ("indicated_airspeed", "indicated airspeed", "m/s", ("min", "max")),
        ("true_airspeed", "true airspeed", "m/s", ("max",)),
        ("vertical_speed", "vertical speed", "m/s", ("min", "max")),
        ("load_factor_normal", "load factor", "g", ("min", "max")),
        ("roll_deg", "roll", "deg", ("min", "max")),
        ("pitch_deg", "pitch", "deg", ("min", "max")),
        ("alpha_deg", "angle of attack", "deg", ("max",)),
    )
    for column, name, unit, kinds in extremes:
        values = columns.get(column)
        if values is None or not np.isfinite(values).any():
            continue
        for kind in kinds:
            pick = np.nanmin if kind == "min" else np.nanmax
            word = "lowest" if kind == "min" else "highest"
            out.append(Quantity(f"{word} {name}", float(pick(values)), unit))
    return out
