"""Derivatives as coefficients: from A and B, and the aircraft's mass, inertia and sizes.

A and B hold effective derivatives: the lag of the downwash is in them (``Cm_q`` here is ``Cm_q + Cm_alphadot``), as it
is in what any estimate from a flight can give.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, List, Optional, Tuple

import numpy as np
import yaml

from xplane_bridge.errors import text_problem, yaml_problem
from xplane_bridge.identification.model import AxisModel, Estimate, IdentificationError
from xplane_bridge.resources import share_dir

#: Coefficient, the column of A or B that it is made of, and the weights of that column's rows.
_Row = Tuple[str, str, List[float]]


@dataclass(frozen=True)
class Geometry:
    """Sizes of an aircraft, SI units; inertia about the centre of gravity in body axes."""

    wing_area: float  #: [m^2]
    chord: float  #: [m] mean aerodynamic
    span: float  #: [m]
    mass: float  #: [kg] where the flight does not determine it
    ixx: float  #: [kg m^2]
    iyy: float
    izz: float
    ixz: float = 0.0


def read_geometry(path: Path) -> Geometry:
    """Read the sizes from a file as in config/geometry.

    Raises:
        IdentificationError: It does not exist, does not parse, or a number is missing or impossible.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: {text_problem(error)}; give a file as in config/geometry"
        raise IdentificationError(msg) from None
    except yaml.YAMLError as error:
        msg = f"{path}: {yaml_problem(error)}"
        raise IdentificationError(msg) from None
    known = [field.name for field in fields(Geometry)]
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        msg = f"{path}: expected a map with the keys {', '.join(known)}"
        raise IdentificationError(msg)
    return Geometry(**{name: _size(path, content, name) for name in _checked_keys(path, content, known)})


def geometry_of(aircraft: str) -> Optional[Geometry]:
    """Read config/geometry/<aircraft>.yaml; None where there is no such file."""
    path = share_dir() / "config" / "geometry" / f"{aircraft}.yaml"
    return read_geometry(path) if path.is_file() else None


def geometry_names() -> List[str]:
    """The aircraft that config/geometry has."""
    return sorted(path.stem for path in (share_dir() / "config" / "geometry").glob("*.yaml"))


def _checked_keys(path: Path, content: dict[str, Any], known: list[str]) -> list[str]:
    unknown = sorted(set(content) - set(known))
    if unknown:
        msg = f"{path}: unknown key {', '.join(unknown)}; expected: {', '.join(known)}"
        raise IdentificationError(msg)
    missing = [name for name in known if name not in content and name != "ixz"]
    if missing:
        msg = f"{path}: {', '.join(missing)} is missing; expected: {', '.join(known)}"
        raise IdentificationError(msg)
    return list(content)


def _size(path: Path, content: dict[str, Any], name: str) -> float:
    value = content[name]
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if not good or (value <= 0.0 and name != "ixz"):
        msg = f"{path}: {name} is {value!r}, expected a {'' if name == 'ixz' else 'positive '}number (SI unit)"
        raise IdentificationError(msg)
    return float(value)


#: Of the geometry's, by which the mass in flight may be another before its moments of inertia are said to be.
_MASS_SHARE = 0.02


def mass_warning(geometry: Geometry, mass: Optional[float]) -> list[str]:
    """A line where the aircraft was loaded otherwise than the geometry's moments of inertia are for."""
    if mass is None or abs(mass - geometry.mass) <= _MASS_SHARE * geometry.mass:
        return []
    return [
        f"the aircraft had {mass:.0f} kg, the geometry {geometry.mass:.0f} kg: coefficients of moments are worked out "
        "by the geometry's moments of inertia, which are another loading's"
    ]


def derivatives(
    model: AxisModel, geometry: Geometry, speed: float, pressure: float, mass: Optional[float] = None
) -> dict[str, Estimate]:
    """Give the derivatives of an axis, per rad and, of rates, per unit of rate times c/2V or b/2V.

    Args:
        model: With A and B, and their intervals where they are known.
        geometry: Sizes of the aircraft.
        speed: True airspeed at the trim point [m/s].
        pressure: Dynamic pressure there [Pa].
        mass: In the flight [kg]; None: the geometry's.
    """
    mass = geometry.mass if mass is None else mass
    names = [signal.name for signal in model.axis.states]
    values = {name: model.a[:, k] for k, name in enumerate(names)}
    values.update({signal.name: model.b[:, k] for k, signal in enumerate(model.inputs)})
    widths = {key: np.full(len(names), math.nan) for key in values}
    if model.a_interval is not None and model.b_interval is not None:
        widths.update({name: model.a_interval[:, k] for k, name in enumerate(names)})
        widths.update({signal.name: model.b_interval[:, k] for k, signal in enumerate(model.inputs)})
    rows = _longitudinal if model.axis.name == "longitudinal" else _lateral
    out = {}
    for name, column, weights in rows(geometry, speed, pressure * geometry.wing_area, mass, names):
        if column in values:
            width = math.sqrt(float(np.sum([(w * u) ** 2 for w, u in zip(weights, widths[column]) if w != 0.0])))
            out[name] = Estimate(float(np.dot(weights, values[column])), _unit(column), width)
    return out


def _unit(column: str) -> str:
    return "" if column.endswith("_rate") else "1/rad"


def _longitudinal(g: Geometry, speed: float, qs: float, mass: float, names: list[str]) -> list[_Row]:
    """Rows of A and B to coefficients; lift is that of the angle of attack's own equation, drag's share in it."""
    lift = [-mass * speed / qs if name == "alpha" else 0.0 for name in names]
    moment = [g.iyy / (qs * g.chord) if name == "pitch_rate" else 0.0 for name in names]
    per_rate = [value * 2.0 * speed / g.chord for value in moment]
    return [
        ("CL_alpha", "alpha", lift),
        ("CL_de", "elevator", lift),
        ("Cm_alpha", "alpha", moment),
        ("Cm_q", "pitch_rate", per_rate),
        ("Cm_de", "elevator", moment),
    ]


def _lateral(g: Geometry, speed: float, qs: float, mass: float, names: list[str]) -> list[_Row]:
    """The product of inertia couples the accelerations: L = Ixx p' - Ixz r', N = Izz r' - Ixz p'."""
    qsb = qs * g.span
    roll = {"roll_rate": g.ixx / qsb, "yaw_rate": -g.ixz / qsb}
    yaw = {"roll_rate": -g.ixz / qsb, "yaw_rate": g.izz / qsb}
    side = {"beta": mass * speed / qs}
    out = []
    for column, suffix, factor in (
        ("beta", "beta", 1.0),
        ("roll_rate", "p", 2.0 * speed / g.span),
        ("yaw_rate", "r", 2.0 * speed / g.span),
        ("aileron", "da", 1.0),
        ("rudder", "dr", 1.0),
    ):
        for coefficient, weights in (("CY", side), ("Cl", roll), ("Cn", yaw)):
            if coefficient == "CY" and suffix in ("p", "r"):
                continue  # kinematics (alpha, and 1) outweigh the side force of rates
            out.append((f"{coefficient}_{suffix}", column, [factor * weights.get(name, 0.0) for name in names]))
    return out
