"""The figures of a flight: the paper's multiplots and what else a flight test engineer looks at first."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Callable, Optional, Sequence

import numpy as np

from xplane_bridge.analysis.commands import commanded, of_controls
from xplane_bridge.analysis.episodes import Episode, from_sets, from_values, who_flew, within
from xplane_bridge.plotting.spec import Panel, PathFigure, Series, TimeFigure

if TYPE_CHECKING:
    from xplane_bridge.bags import Table
    from xplane_bridge.bags.flight import Flight

#: Fields of SurfaceStates with a deflection of each panel. What does not move is not drawn.
_SURFACES = (
    "aileron1", "aileron2", "spoiler1", "spoiler2", "flap1", "flap2", "speedbrake1", "speedbrake2", "yaw_brake",
    "wing_elevator1", "wing_elevator2", "elevator", "rudder",
)  # fmt: skip


class MissingError(Exception):
    """A figure cannot be made; the text says which topic or values the bag lacks."""


def all_figures() -> list[tuple[str, str, Callable[[Flight], TimeFigure | PathFigure]]]:
    """Give key, title and maker of every figure, in the order of the report. A maker raises `MissingError`."""
    return [
        ("attitude", "Attitude", _attitude),
        ("airspeed", "Speeds", _airspeed),
        ("altitude", "Altitude", _altitude),
        ("airflow", "Angle of attack, sideslip and path angles", _airflow),
        ("rates", "Body rates", _rates),
        ("loads", "Load factors", _loads),
        ("controls", "Controls: commanded and achieved", _controls),
        ("surfaces", "Control surfaces: left and right", _surfaces),
        ("engines", "Engines", _engines),
        ("track", "Ground track", lambda flight: _path(flight, in_space=False)),
        ("path", "Flight path", lambda flight: _path(flight, in_space=True)),
    ]


def episodes(flight: Flight) -> list[tuple[str, Episode]]:
    """Give the stretches of the flight to shade: who flew, failures, excitations, disturbances of the air."""
    return [(kind, cut) for kind, e in _episodes(flight) for cut in within([e], flight.start, flight.end)]


def _episodes(flight: Flight) -> list[tuple[str, Episode]]:
    out: list[tuple[str, Episode]] = []
    if "mode" in flight.tables:
        table = flight.tables["mode"]
        flown = who_flew(table.stamp, table["mode"], table["failsafe"], flight.end)
        out += [(stretch.label, stretch) for stretch in flown]
    if "failures" in flight.tables:
        table = flight.tables["failures"]
        rows = zip(table["names"], table["kinds"], table["active"])
        sets = [[f"{n} {k}" for n, k, on in zip(*row) if on] for row in rows]
        out += [("failure", e) for e in from_sets(table.stamp, sets, flight.end)]
    if "excitation" in flight.tables:
        table = flight.tables["excitation"]
        rows = zip(table["active"], table["kind"], table["target"])
        names = [f"{kind} {target}" if on else "" for on, kind, target in rows]
        out += [("excitation", e) for e in from_values(table.stamp, names, flight.end)]
    if "disturbance" in flight.tables:
        table = flight.tables["disturbance"]
        names = [str(kind) if on else "" for on, kind in zip(table["active"], table["kind"])]
        out += [("disturbance", e) for e in from_values(table.stamp, names, flight.end)]
    return out


def _table(flight: Flight, role: str, topic: str) -> Table:
    if role not in flight.tables:
        msg = f"the bag has no {topic}"
        raise MissingError(msg)
    return flight.tables[role]


def _state(flight: Flight) -> Table:
    return _table(flight, "state", "flight_state")


def _panel(label: str, table: Table, lines: Sequence[tuple[str, str]], factor: float = 1.0) -> Panel:
    """Make a panel of (legend, column) lines; a column without one finite value is left out."""
    series = []
    for name, column in lines:
        if column in table and np.isfinite(table[column]).any():
            series.append(Series(name, table.stamp, table[column] * factor))
    return Panel(label, series)


def _figure(key: str, title: str, flight: Flight, panels: list[Panel]) -> TimeFigure:
    filled = [panel for panel in panels if panel.series]
    if not filled:
        msg = "the messages hold no valid value of these quantities"
        raise MissingError(msg)
    for panel in filled:
        panel.series = [_cut(series, flight) for series in panel.series]
    return TimeFigure(key, title, filled, episodes(flight))


def _cut(series: Series, flight: Flight) -> Series:
    """Break a line where the flight states have a gap or a reset."""
    if len(flight.parts) < 2:
        return series
    stamp = flight.tables["state"].stamp
    behind = np.array([part.start for part in flight.parts[1:]])
    edges = stamp[behind - 1] + (stamp[behind] - stamp[behind - 1]) // 2
    rows = np.searchsorted(series.time, edges)
    time, values = np.insert(series.time, rows, edges), np.insert(series.values.astype(np.float64), rows, np.nan)
    return replace(series, time=time, values=values)


def _broken(values: np.ndarray, jump: float = 180.0) -> np.ndarray:
    """Put NaN where an angle wraps, so that no line runs across the panel."""
    out = values.astype(np.float64).copy()
    out[1:][np.abs(np.diff(values)) > jump] = np.nan
    return out


def _attitude(flight: Flight) -> TimeFigure:
    t = _state(flight)
    lines = [
        ("true heading", "heading_true_deg"),
        ("magnetic heading", "heading_magnetic_deg"),
        ("track", "track_deg"),
    ]
    roll = Panel("roll [deg]", [Series("roll", t.stamp, _broken(t["roll_deg"]))])
    panels = [roll, _panel("pitch [deg]", t, [("pitch", "pitch_deg")]), _headings(_panel("heading [deg]", t, lines))]
    return _figure("attitude", "Attitude", flight, panels)


def _headings(panel: Panel) -> Panel:
    """Let the axis begin where lines break least often: from 0 on, a flight to the north is shreds at both edges."""
    turned = {}
    for first in (0, -180, -90):
        values = [np.mod(s.values.astype(np.float64) - first, 360.0) + first for s in panel.series]
        turned[first] = [_broken(each) for each in values]
    lost = {first: sum(int(np.isnan(each).sum()) for each in lines) for first, lines in turned.items()}
    first = min(lost, key=lambda each: lost[each])
    label = panel.label if first == 0 else f"heading {first}..{first + 360} [deg]"
    return Panel(label, [replace(s, values=values) for s, values in zip(panel.series, turned[first])])


def _airspeed(flight: Flight) -> TimeFigure:
    t = _state(flight)
    lines = [
        ("true airspeed", "true_airspeed"),
        ("indicated airspeed", "indicated_airspeed"),
        ("calibrated airspeed", "calibrated_airspeed"),
        ("equivalent airspeed", "equivalent_airspeed"),
        ("ground speed", "ground_speed"),
    ]
    panels = [_panel("speed [m/s]", t, lines), _panel("wind [m/s]", t, [("wind speed", "wind_speed")])]
    return _figure("airspeed", "Speeds", flight, panels)


def _altitude(flight: Flight) -> TimeFigure:
    t = _state(flight)
    lines = [
        ("MSL", "altitude_msl"),
        ("AGL", "altitude_agl"),
        ("indicated", "altitude_indicated"),
        ("pressure", "altitude_pressure"),
    ]
    panels = [
        _panel("altitude [m]", t, lines),
        _panel("vertical speed [m/s]", t, [("vertical speed", "vertical_speed")]),
    ]
    return _figure("altitude", "Altitude", flight, panels)


def _airflow(flight: Flight) -> TimeFigure:
    t = _state(flight)
    sideslip = [("computed, wind from the right +", "beta_deg"), ("X-Plane's, sign disputed", "xplane_beta_deg")]
    panels = [
        _panel("angle of attack [deg]", t, [("computed", "alpha_deg"), ("X-Plane's", "xplane_alpha_deg")]),
        _panel("sideslip [deg]", t, sideslip),
        _panel("path angle [deg]", t, [("flight-path angle", "flight_path_angle_deg"), ("vpath", "xplane_vpath_deg")]),
    ]
    return _figure("airflow", "Angle of attack, sideslip and path angles", flight, panels)


def _rates(flight: Flight) -> TimeFigure:
    t = _state(flight)
    lines = [("p roll", "angular_velocity.x"), ("q pitch", "angular_velocity.y"), ("r yaw", "angular_velocity.z")]
    return _figure("rates", "Body rates", flight, [_panel("rate [deg/s]", t, lines, float(np.degrees(1.0)))])


def _loads(flight: Flight) -> TimeFigure:
    t = _state(flight)
    lines = [("normal", "load_factor_normal"), ("axial", "load_factor_axial"), ("side", "load_factor_side")]
    return _figure("loads", "Load factors", flight, [_panel("load factor [g]", t, lines)])


def _controls(flight: Flight) -> TimeFigure:
    t = _table(flight, "controls", "mission/controls")
    panels = []
    for axis in ("roll", "pitch", "yaw"):
        lines = [("at the surfaces", f"total_{axis}"), ("stick", f"stick_{axis}"), ("trim", f"trim_{axis}")]
        panel = _panel(f"{axis} [-]", t, lines)
        panel.series += _commanded(flight, axis)
        panels.append(panel)
    throttle = Panel("throttle [-]", _engine_series(flight, "throttle_actual", "engine {} actual"))
    throttle.series += _commanded(flight, "throttles", 0)
    others = [
        ("flaps", "flap_ratio"),
        ("speed brake", "speedbrake_ratio"),
        ("gear handle", "gear_handle"),
        ("thrust vector", "thrust_vector_ratio"),
    ]
    panels += [throttle, _panel("ratio [-]", t, others)]
    return _figure("controls", "Controls: commanded and achieved", flight, panels)


def _commanded(flight: Flight, column: str, index: Optional[int] = None) -> list[Series]:
    if "applied" not in flight.tables:
        return []
    t = flight.tables["applied"]
    values = (t[column] if index is None else t[column][:, index]).astype(np.float64)
    sent, own = commanded(t.columns, column), of_controls(t.columns)
    if not sent.any():
        return []
    return [Series("commanded", t.stamp[own], np.where(sent, values, np.nan)[own], dashed=True, stepped=True)]


def _surfaces(flight: Flight) -> TimeFigure:
    t = _table(flight, "surfaces", "mission/surfaces")
    panels = []
    for group in _SURFACES:
        if group not in t:
            continue
        series = []
        for k in range(t[group].shape[1]):
            values = t[group][:, k]
            if np.isfinite(values).any() and np.nanmax(np.abs(values)) > 1e-6:
                series.append(Series(_place(group, k), t.stamp, values))
        panels.append(Panel(f"{group} [deg]", series))
    return _figure("surfaces", "Control surfaces: left and right", flight, panels)


def _place(group: str, index: int) -> str:
    if group == "rudder":
        return f"rudder {index // 2 + 1}, fin {index % 2 + 1}"
    side = "left" if index % 2 == 0 else "right"
    return f"{side}, {index // 2 + 1}" if group == "elevator" else f"wing {index // 2 + 1} {side}"


def _engine_series(flight: Flight, column: str, name: str, factor: float = 1.0) -> list[Series]:
    if "engines" not in flight.tables:
        return []
    t = flight.tables["engines"]
    count = int(t["count"].max()) if len(t) else 0
    out = []
    for k in range(t[column].shape[1]):
        values = t[column][:, k]
        finite = values[np.isfinite(values)]
        # One way, X-Plane's rows come without the number of engines, and with 0 for those that the aircraft lacks.
        exists = k < count if count else finite.any()
        if exists and finite.size:
            out.append(Series(name.format(k + 1), t.stamp, values * factor))
    return out


def _engines(flight: Flight) -> TimeFigure:
    _table(flight, "engines", "mission/engines")
    panels = [
        Panel(
            "throttle [-]",
            _engine_series(flight, "throttle_command", "lever {}")
            + _engine_series(flight, "throttle_actual", "engine {}"),
        ),
        Panel("engine speed [rpm]", _engine_series(flight, "engine_speed", "engine {}")),
        Panel("thrust [N]", _engine_series(flight, "thrust", "engine {}")),
        Panel("power [kW]", _engine_series(flight, "power", "engine {}", 1e-3)),
        Panel("fuel flow [g/s]", _engine_series(flight, "fuel_flow", "engine {}", 1e3)),
    ]
    return _figure("engines", "Engines", flight, panels)


def _path(flight: Flight, in_space: bool) -> PathFigure:
    t = _state(flight)
    north, east, up = t["position_north"], t["position_east"], t["altitude_msl"]
    good = np.isfinite(north) & np.isfinite(east) & np.isfinite(up)
    if not good.any():
        msg = "no valid position"
        raise MissingError(msg)
    moved = np.flatnonzero(np.diff(t["position_epoch"].astype(np.int64))) + 1
    broken = [*(part.start for part in flight.parts[1:]), *moved]
    columns = [values.astype(np.float64).copy() for values in (east, north, up)]
    x, y, z = columns
    for values in columns:
        values[~good] = np.nan
        values[broken] = np.nan  # no line across a gap, a reset or a new origin
    colour, label = (t["true_airspeed"], "true airspeed [m/s]") if in_space else (up, "altitude MSL [m]")
    key, title = ("path", "Flight path") if in_space else ("track", "Ground track")
    return PathFigure(key, title, x, y, z, colour.astype(np.float64), label, in_space)
