"""Units and angle ranges of message fields, read from the comments of the definition that the bag carries.

A field line reads ``float64 roll_deg  # [deg] -180..180, right wing down +; source``. Definitions without such comments
(standard messages) simply have no units.
"""

from __future__ import annotations

import re
from typing import Dict, List, NamedTuple, Optional

from xplane_bridge.bags.later_fields import LATER_FIELDS

_FIELD = re.compile(r"^\s*([\w/]+)(?:\[(\d*)\])?\s+(\w+)\s*(?:#\s*(.*))?$")
_UNIT = re.compile(r"^\[([^\]]+)\]\s*(.*)$")
_FURTHER = re.compile(r"; \[([^\]]+)\]")
_SEPARATOR = re.compile(r"^=+$", re.MULTILINE)


class _Field(NamedTuple):
    typename: str
    size: int  #: of a fixed array, else 0
    name: str
    comment: str


_Types = Dict[str, List[_Field]]


class Unit(NamedTuple):
    """What a field's comment says of its numbers."""

    symbol: str  #: as written, e.g. ``m/s``; ``h, min, s`` of an array's elements; empty for pure numbers and flags
    wrap: float  #: period of an angle that wraps (360), else 0
    low: float  #: lower end of the wrapped range: 0 or -180

    @property
    def suffix(self) -> str:
        """The symbol as a part of a column name: ``m/s`` gives ``mps``, ``rad/s^2`` gives ``radps2``."""
        return "" if self.each else _suffix(self.symbol)

    @property
    def each(self) -> tuple[str, ...]:
        """The suffix of each element, where they have units of their own; else empty."""
        symbols = self.symbol.split(", ")
        return tuple(map(_suffix, symbols)) if len(symbols) > 1 else ()


def _suffix(symbol: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "", symbol.replace("/", "p").replace("%", "percent"))


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
    types: _Types = {}
    for k, section in enumerate(_SEPARATOR.split(definition)):
        lines = section.strip("\n").split("\n")
        name = msgtype
        if k:
            name, lines = lines[0].replace("MSG:", "").strip(), lines[1:]
        types[name] = [_Field(m[1], int(m[2] or 0), m[3], m[4] or "") for m in map(_FIELD.match, lines) if m]
    units: dict[str, Unit] = {}
    _walk(types, msgtype, "", NO_UNIT, units)
    return units


def later_units(msgtype: str) -> dict[str, Unit]:
    """Give the units of fields that a message of the package has got since its first version."""
    return {
        name: _unit(f"[{unit}]", size) or NO_UNIT for name, (_, size, unit) in LATER_FIELDS.get(msgtype, {}).items()
    }


def _walk(types: _Types, msgtype: str, prefix: str, inherited: Unit, units: dict[str, Unit]) -> None:
    for typename, size, field, comment in types.get(msgtype, []):
        unit = _unit(comment, size) or inherited
        if typename == "duration":
            unit = _SECONDS  # as it is read, whatever the comment says
        nested = _resolve(types, typename, msgtype)
        if nested:
            _walk(types, nested, f"{prefix}{field}.", unit, units)
        else:
            units[prefix + field] = unit


def _resolve(types: _Types, typename: str, inside: str) -> str:
    package = inside.split("/")[0]
    for candidate in (typename, f"{package}/{typename}", f"std_msgs/{typename}"):
        if candidate in types and "/" in candidate:
            return candidate
    return ""


def _unit(comment: str, size: int) -> Optional[Unit]:
    """What a comment says of a field, of an array of fixed size where that is not 0; None without a unit."""
    match = _UNIT.match(comment)
    if not match:
        return None
    text, rest = match.groups()
    if any(other != text for other in _FURTHER.findall(rest)):
        return NO_UNIT  # what the numbers are depends on another field
    symbols = [_symbol(part.strip()) for part in text.split(",")]
    symbol = ", ".join(symbols) if len(symbols) == size and all(symbols) else symbols[0]
    if rest.startswith("0..360"):
        return Unit(symbol, 360.0, 0.0)
    if rest.startswith("-180..180"):
        return Unit(symbol, 360.0, -180.0)
    return Unit(symbol, 0.0, 0.0)


def _symbol(text: str) -> str:
    """A unit as written, empty for what is none."""
    none = text in ("-", "bits") or ".." in text or re.fullmatch(r"[-0-9.]+", text)
    return "" if none else text
