"""The manoeuvres of a recorded flight: states and inputs of the same frames, from an excitation's start to its tail.

Inputs are where the surfaces stood (mission/surfaces), never what was commanded. They are joined to the states by
simulator time, which both carry from the same frame; stamps and places in the bag say less.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Sequence

import numpy as np

from xplane_bridge.bags import Table
from xplane_bridge.bags.flight import Flight
from xplane_bridge.bags.segments import segments
from xplane_bridge.constants import FlightMode, FlightStateValid, FuelStateValid, SurfaceStatesValid
from xplane_bridge.identification.model import AXES, Axis, IdentificationError, Signal, signal_names
from xplane_bridge.identification.output_error import Samples

#: How long the motion is followed after an excitation's end [s].
TAIL_S = 2.0
#: Shortest window and fewest frames of one.
_SHORTEST_S, _FEWEST = 1.0, 40
#: Between an excitation's report and its nearest frame at most, by stamp: X-Plane's time begins anew with X-Plane [s].
_NEIGHBOURHOOD_S = 5.0
#: Longest time between two samples of the surfaces that is bridged [s].
_LONGEST_GAP_S = 0.15
#: Two simulator times closer than this are of one frame [s].
_SAME_FRAME_S = 1e-4
_NO_END = "no end in the bag"
#: Share of its movement that an input may still make after the excitation's end.
_STILL = 0.05
_NEEDED = {
    "attitude": FlightStateValid.ATTITUDE,
    "angular rates": FlightStateValid.RATES,
    "air velocity": FlightStateValid.AIR_VELOCITY,
    "specific force": FlightStateValid.LOAD,
}
_SURFACES = {
    "elevator": ("delta_elevator", SurfaceStatesValid.ELEVATOR),
    "aileron": ("delta_aileron", SurfaceStatesValid.AILERON1),
    "rudder": ("delta_rudder", SurfaceStatesValid.RUDDER),
}


@dataclass
class Excitation:
    """One injection, as excitation/state reports it."""

    number: int
    kind: str
    targets: tuple[str, ...]
    stamp: int  #: [ns] of its beginning
    start: float  #: raw simulator time [s]
    end: float
    result: str
    run: int = 0  #: which one of its number, from 1 on; 0: the only one

    @property
    def name(self) -> str:
        """Its number; of several that have it `1.1`, `1.2`, ..."""
        return f"{self.number}.{self.run}" if self.run else str(self.number)

    @property
    def axes(self) -> set[str]:
        """The axes that it moves."""
        return {axis for axis in map(axis_of, self.targets) if axis}

    @property
    def label(self) -> str:
        """For the reader."""
        return f"excitation {self.name} ({self.kind} on {', '.join(self.targets)})"


@dataclass
class Window:
    """States and inputs of an excitation, frame by frame; radians, m/s, m/s^2."""

    excitation: Excitation
    stamp: np.ndarray  #: int64 [ns]
    time: np.ndarray  #: [s] from the window's first frame
    columns: dict[str, np.ndarray]
    conditions: dict[str, tuple[float, str]]  #: means over the window, with their units
    bridged: float  #: longest time over which inputs had to be interpolated; 0: each frame has its own [s]
    warnings: list[str] = field(default_factory=list)

    def samples(self, axis: Axis, inputs: tuple[Signal, ...], shift: int = 0) -> Samples:
        """What a fit takes; `shift` > 0: inputs of that many frames earlier."""
        states = np.column_stack([self.columns[name] for name in signal_names(axis.states)])
        moved = np.column_stack([self.columns[name] for name in signal_names(inputs)])
        n = len(self.time)
        return Samples(self.time[1 : n - 1], states[1 : n - 1], moved[1 - shift : n - 1 - shift])


def axis_of(target: str) -> str:
    """The axis that an excitation's target moves, of stick or single surface; empty where it is none of the two."""
    if target == "pitch" or target.startswith("elevator"):
        return "longitudinal"
    return "lateral" if target in ("roll", "yaw") or target.startswith(("aileron", "rudder")) else ""


def find_windows(flight: Flight, tail: float = TAIL_S) -> tuple[list[Window], list[str]]:
    """Find the manoeuvres of a flight; also why others were left out.

    Raises:
        IdentificationError: A topic is missing, or there is no manoeuvre that can be used.
    """
    for role, topic in (
        ("state", "flight_state"),
        ("surfaces", "mission/surfaces"),
        ("excitation", "excitation/state"),
    ):
        if role not in flight.tables:
            msg = f"{flight.name} has no {topic}; record all topics (launch/record.launch) while inject_excitation runs"
            raise IdentificationError(msg)
    found = read_excitations(flight.tables["excitation"])
    if not found:
        msg = f"{flight.name}: no excitation ran; windows are taken from excitation/state (service inject_excitation)"
        raise IdentificationError(msg)
    windows, left_out = [], []
    for k, excitation in enumerate(found):
        try:
            end = _end(flight.tables["state"], excitation, found[k + 1 :], tail)
            windows.append(_window(flight, excitation, end))
        except IdentificationError as error:
            left_out.append(str(error))
    if not windows:
        msg = f"{flight.name}: no manoeuvre can be used: {'; '.join(left_out)}"
        raise IdentificationError(msg)
    return windows, left_out


def with_known_inputs(windows: list[Window], axis: Axis) -> tuple[list[Window], list[str]]:
    """Choose the windows that move an axis and know its inputs in every frame; also why others were left out."""
    chosen, left_out = [], []
    for window in windows:
        if axis.name not in window.excitation.axes:
            continue
        unknown = [name for name in signal_names(axis.inputs) if not np.isfinite(window.columns[name]).all()]
        if unknown:
            left_out.append(
                f"{window.excitation.label} for the {axis.name} axis: {', '.join(unknown)} not known all the time "
                "(bits in `valid` of surfaces)"
            )
        else:
            chosen.append(window)
    return chosen, left_out


def read_excitations(table: Table) -> list[Excitation]:
    """The injections in the order they ran."""
    out: list[Excitation] = []
    for k in range(len(table)):
        number = int(table["id"][k])
        if table["active"][k]:
            start, duration = float(table["start_sim_time"][k]), float(table["duration"][k])
            # Numbers begin anew with tx_node, and times with X-Plane.
            same = out and out[-1].number == number and abs(out[-1].start - start) <= _SAME_FRAME_S
            if not same or out[-1].result != _NO_END:
                targets = tuple(str(table["target"][k]).replace(" ", "").split(","))
                kind, stamp = str(table["kind"][k]), int(table.stamp[k])
                out.append(Excitation(number, kind, targets, stamp, start, start + duration, _NO_END))
        elif out and out[-1].number == number:
            out[-1].result = str(table["result"][k])
            if np.isfinite(table["end_sim_time"][k]):
                out[-1].end = float(table["end_sim_time"][k])
    numbers = [each.number for each in out]
    for k, each in enumerate(out):
        if numbers.count(each.number) > 1:
            each.run = numbers[: k + 1].count(each.number)
    return out


def _end(state: Table, excitation: Excitation, following: Sequence[Excitation], tail: float) -> float:
    """Where the window ends [s of simulated time]: `tail` behind the excitation, or where the next one begins."""
    end = excitation.end + tail
    rows = _rows(state, excitation, end)
    if not len(rows):
        return end
    # Of another flight, which may have the same simulated times, none.
    last = state.stamp[rows[-1]]
    return min([end, *(o.start for o in following if o.start > excitation.start and o.stamp <= last)])


def _window(flight: Flight, excitation: Excitation, end: float) -> Window:
    if not excitation.axes:
        msg = f"{excitation.label}: moves neither elevator nor aileron nor rudder"
        raise IdentificationError(msg)
    state = flight.tables["state"]
    rows = _rows(state, excitation, end)
    _check_frames(state, rows, excitation)
    stamp, time = state.stamp[rows], state["sim_time_unwrapped"][rows]
    columns = _states(state, rows)
    inputs, bridged = _inputs(flight.tables["surfaces"], state, rows, excitation)
    columns.update(inputs)
    window = Window(excitation, stamp, time - time[0], columns, _conditions(flight, rows, columns), bridged)
    window.warnings += _flown_by(flight, window)
    return window


def _rows(state: Table, excitation: Excitation, end: float) -> np.ndarray:
    """The frames from an excitation's start to `end`, by simulated time: real time may be several times as long."""
    within = (state["sim_time"] > excitation.start - _SAME_FRAME_S) & (state["sim_time"] <= end + _SAME_FRAME_S)
    rows = np.flatnonzero(within)
    if not len(rows):
        return rows
    # Of several flights with the same simulated times, that of its stamp.
    off = np.abs(state.stamp[rows] - excitation.stamp)
    nearest = int(np.argmin(off))
    if off[nearest] > _NEIGHBOURHOOD_S * 1e9:
        return rows[:0]
    other = np.flatnonzero(~within)
    first, last = np.searchsorted(other, rows[nearest]) + np.array([-1, 0])
    begin = other[first] + 1 if first >= 0 else 0
    stop = other[last] if last < len(other) else len(within)
    return np.arange(begin, stop)


def _check_frames(state: Table, rows: np.ndarray, excitation: Excitation) -> None:
    """Refuse what cannot be one stretch of free flight."""
    if excitation.result.startswith("aborted"):
        msg = f"{excitation.label} was {excitation.result}"
        raise IdentificationError(msg)
    if len(rows) < _FEWEST or np.ptp(state["sim_time_unwrapped"][rows]) < _SHORTEST_S:
        msg = f"{excitation.label}: {len(rows)} flight states, expected at least {_FEWEST} over {_SHORTEST_S:.0f} s"
        raise IdentificationError(msg)
    if len(segments(state.stamp[rows], state["epoch"][rows])) > 1:
        msg = f"{excitation.label}: the flight states have a gap or a reset in it"
        raise IdentificationError(msg)
    steps = np.diff(state["sim_time_unwrapped"][rows])
    if np.any(steps < 0.0):
        msg = f"{excitation.label}: the host's clock was set back in it"
        raise IdentificationError(msg)
    if np.any(steps == 0.0) or state["paused"][rows].any():
        msg = f"{excitation.label}: simulator time stood still in it"
        raise IdentificationError(msg)
    for name, bit in _NEEDED.items():
        if np.any(state["valid"][rows] & bit == 0):
            msg = f"{excitation.label}: {name} was not known all the time (bits in `valid` of flight_state)"
            raise IdentificationError(msg)
    if state["on_ground"][rows].any():
        msg = f"{excitation.label}: the aircraft was on the ground"
        raise IdentificationError(msg)


def _states(state: Table, rows: np.ndarray) -> dict[str, np.ndarray]:
    u, v, w = (state[f"air_velocity_body.{axis}"][rows].astype(float) for axis in "xyz")
    speed = np.sqrt(u * u + v * v + w * w)
    columns = {"true_airspeed": speed, "alpha": np.arctan2(w, u), "beta": np.arcsin(v / np.maximum(speed, 1e-3))}
    for name, axis in (("roll_rate", "x"), ("pitch_rate", "y"), ("yaw_rate", "z")):
        columns[name] = state[f"angular_velocity.{axis}"][rows].astype(float)
    for name in ("roll", "pitch"):
        columns[name] = np.unwrap(np.radians(state[f"{name}_deg"][rows].astype(float)))
    for axis in "xyz":
        columns[f"specific_force_{axis}"] = state[f"specific_force.{axis}"][rows].astype(float)
    return columns


def _inputs(
    surfaces: Table, state: Table, rows: np.ndarray, excitation: Excitation
) -> tuple[dict[str, np.ndarray], float]:
    """Deflections at the frames, and the longest time over which they had to be interpolated [s]."""
    low, high = state.stamp[rows[0]], state.stamp[rows[-1]]
    around = max(1e9, float(high - low) / float(np.ptp(state["sim_time_unwrapped"][rows])))  # a second of either time
    near = np.flatnonzero((surfaces.stamp > low - around) & (surfaces.stamp < high + around))
    order = near[np.argsort(surfaces["sim_time"][near], kind="stable")]
    known = surfaces["sim_time"][order].astype(float)
    wanted = state["sim_time"][rows].astype(float)
    inside = (known > wanted[0] - _LONGEST_GAP_S) & (known < wanted[-1] + _LONGEST_GAP_S)
    gaps = np.diff(np.concatenate([[wanted[0]], np.clip(known[inside], wanted[0], wanted[-1]), [wanted[-1]]]))
    if not inside.any() or gaps.max() > _LONGEST_GAP_S:
        msg = (
            f"{excitation.label}: mission/surfaces is silent for {gaps.max():.2f} s in it, expected a sample every "
            "frame; let rx_node ask for them every frame (rates: surfaces: 999) and record again"
        )
        raise IdentificationError(msg)
    after = np.clip(np.searchsorted(known, wanted - _SAME_FRAME_S), 0, len(known) - 1)
    interpolated = bool(np.any(np.abs(known[after] - wanted) > _SAME_FRAME_S))
    columns = {}
    for name, (column, bit) in _SURFACES.items():
        values = np.radians(surfaces[column][order].astype(float))
        values[surfaces["valid"][order] & bit == 0] = np.nan
        columns[name] = np.interp(wanted, known, values) if interpolated else values[after]
    return columns, float(gaps.max()) if interpolated else 0.0


def _conditions(flight: Flight, rows: np.ndarray, columns: dict[str, np.ndarray]) -> dict[str, tuple[float, str]]:
    state = flight.tables["state"]
    out = {"true_airspeed": (float(columns["true_airspeed"].mean()), "m/s")}
    out["altitude"] = (float(state["altitude_msl"][rows].mean()), "m")
    for name in ("alpha", "beta", "pitch", "roll", "elevator", "aileron", "rudder"):
        out[name] = (float(np.degrees(columns[name].mean())), "deg")
    for name, column, unit in (
        ("flight_path", "flight_path_angle_deg", "deg"),
        ("dynamic_pressure", "dynamic_pressure", "Pa"),
        ("air_density", "air_density", "kg/m^3"),
    ):
        out[name] = (float(state[column][rows].astype(float).mean()), unit)
    wind = np.column_stack([state[f"wind_ned.{axis}"][rows].astype(float) for axis in "xyz"])
    out["gust"] = (float(np.sqrt(np.sum(wind.var(axis=0)))), "m/s")
    out["mass"] = (_mass(flight, rows), "kg")
    return out


def _mass(flight: Flight, rows: np.ndarray) -> float:
    if "fuel" not in flight.tables:
        return float("nan")
    fuel = flight.tables["fuel"]
    known = np.flatnonzero((fuel["valid"] & FuelStateValid.WEIGHTS) != 0)
    if not len(known):
        return float("nan")
    stamp = flight.tables["state"].stamp[rows[0]]
    return float(fuel["total_mass"][known[np.argmin(np.abs(fuel.stamp[known] - stamp))]])


def _flown_by(flight: Flight, window: Window) -> list[str]:
    """Warn of closed loops: AUTO in the window, or surfaces that go on moving after the excitation's end."""
    label = window.excitation.label
    if "mode" in flight.tables:
        mode = flight.tables["mode"]
        last = np.searchsorted(mode.stamp, window.stamp[-1], side="right")
        first = max(int(np.searchsorted(mode.stamp, window.stamp[0], side="right")) - 1, 0)
        if np.any(mode["mode"][first:last] == FlightMode.AUTO):
            return [
                f"{label}: a controller flew (AUTO), so inputs follow the motion and the model is biased by the loop; "
                "fly it in MANUAL with the stick held still"
            ]
    after = window.time > window.excitation.end - window.excitation.start + 0.5
    for axis in sorted(window.excitation.axes):
        for name in signal_names(AXES[axis].inputs):
            moved, rest = np.ptp(window.columns[name]), window.columns[name][after]
            if len(rest) > 10 and np.ptp(rest) > _STILL * moved and moved > 1e-4:
                return [
                    f"{label}: the {name} goes on moving after the excitation's end, so a pilot or a controller flew "
                    "with it and the model may be biased by the loop; hold the stick still until the motion is over"
                ]
    return []
