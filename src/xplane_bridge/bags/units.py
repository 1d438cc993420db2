"""Units and angle ranges of message fields, read from the comments of the definition that the bag carries.

A field line reads ``float64 roll_deg  # [deg] -180..180, right wing down +; source``. Definitions without such comments
(standard messages) simply have no units.
"""

from __future__ import annotations

import re
from typing import NamedTuple, Optional

from xplane_bridge.bags.later_fields import LATER_FIELDS

_FIELD = re.compile(r"^\s*([\w/]+)(?:\[\d*\])?\s+(\w+)\s*(?:#\s*(.*))?$")
_UNIT = re.compile(r"^\[([^\]]+)\]\s*(.*)$")
_SEPARATOR = re.compile(r"^=+$", re.MULTILINE)


class Unit(NamedTuple):
    """What a field's comment says of its numbers."""

    symbol: str  #: as written, e.g. ``m/s``; empty for pure numbers and flags
    wrap: float  #: period of an angle that wraps (360), else 0
    low: float  #: lower end of the wrapped range: 0 or -180

    @property
    def suffix(self) -> str:
        """The symbol as a part of a column name: ``m/s`` gives ``mps``, ``rad/s^2`` gives ``radps2``."""
        return re.sub(r"[^A-Za-z0-9]", "", self.symbol.replace("/", "p").replace("%", "percent"))


NO_UNIT = Unit("", 0.0, 0.0)
_SECONDS = Unit("s", 0.0, 0.0)


def parse_units(definition: str, msgtype: str) -> dict[str, Unit]:
    """Give the unit of every column of a message type.

    Args:
        definition: Full text as stored in the bag, with the definitions it depends on.
        msgtype: ROS 1 name of the top type, e.g. ``xplane_bridge/FlightState``.

    Returns:
        Column path (``angular_velocity.x``) to unit. A unit given for a nested field holds for all below it.
    """
    types: dict[str, list[tuple[str, str, str]]] = {}
    for k, section in enumerate(_SEPARATOR.split(definition)):
        lines = section.strip("\n").split("\n")
        name = msgtype
        if k:
            name, lines = lines[0].replace("MSG:", "").strip(), lines[1:]
        types[name] = [(m[1], m[2], m[3] or "") for m in map(_FIELD.match, lines) if m]
    units: dict[str, Unit] = {}
    _walk(types, msgtype, "", NO_UNIT, units)
    return units


def later_units(msgtype: str) -> dict[str, Unit]:
    """Give the units of fields that a message of the package has got since its first version."""
    return {name: _unit(f"[{unit}]") or NO_UNIT for name, (_, _, unit) in LATER_FIELDS.get(msgtype, {}).items()}


def _walk(
    types: dict[str, list[tuple[str, str, str]]], msgtype: str, prefix: str, inherited: Unit, units: dict[str, Unit]
) -> None:
    for typename, field, comment in types.get(msgtype, []):
        unit = _unit(comment) or inherited
        if typename == "duration":
            unit = _SECONDS  # as it is read, whatever the comment says
        nested = _resolve(types, typename, msgtype)
        if nested:
            _walk(types, nested, f"{prefix}{field}.", unit, units)
        else:
            units[prefix + field] = unit


def _resolve(types: dict[str, list[tuple[str, str, str]]], typename: str, inside: str) -> str:
    package = inside.split("/")[0]
    for candidate in (typename, f"{package}/{typename}", f"std_msgs/{typename}"):
        if candidate in types and "/" in candidate:
            return candidate
    return ""


def _unit(comment: str) -> Optional[Unit]:
    match = _UNIT.match(comment)
    if not match:
        return None
    symbol, rest = match.groups()
    symbol = symbol.split(",")[0].strip()
    if symbol == "-" or symbol == "bits" or ".." in symbol or re.fullmatch(r"[-0-9.]+", symbol):
        symbol = ""
    if rest.startswith("0..360"):
        return Unit(symbol, 360.0, 0.0)
    if rest.startswith("-180..180"):
        return Unit(symbol, 360.0, -180.0)
    return Unit(symbol, 0.0, 0.0)
