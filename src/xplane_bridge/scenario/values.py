"""What the values of a scenario must be: each check gives the value, or says its key's path and what was expected."""

from __future__ import annotations

import math
from typing import Any, Collection, Dict, Mapping, Tuple

from xplane_bridge.errors import is_number
from xplane_bridge.scenario import resets, world
from xplane_bridge.scenario.schema import ScenarioError

#: Of all keys with ranges those that count something.
_WHOLE = (*resets.WHOLE, *world.WHOLE, "number")


def expect_mapping(item: Any, path: str, known: Any) -> Dict[str, Any]:
    """A mapping without other keys than those of `known`."""
    if not isinstance(item, Mapping):
        raise ScenarioError(f"{path}: {short(item)}; expected a mapping")
    for key in item:
        if key not in known:
            raise ScenarioError(f"{path}.{key}: unknown key; expected one of {', '.join(known)}")
    return dict(item)


def expect_numbers(
    item: Any, path: str, ranges: Mapping[str, Tuple[float, float]], some: bool = False
) -> Dict[str, float]:
    """A mapping of keys of `ranges` to numbers within them; `some`: not an empty one."""
    given = expect_mapping(item, path, ranges)
    if some and not given:
        raise ScenarioError(f"{path}: is empty; expected some of {', '.join(ranges)}")
    out = {}
    for key, value in given.items():
        check = expect_whole if key in _WHOLE else expect_number
        out[key] = check(value, f"{path}.{key}", *ranges[key])
    return out


def expect_one_of(value: Any, path: str, known: Collection[str]) -> str:
    """One of the texts of `known`."""
    # A list or a mapping cannot be looked up.
    if not isinstance(value, str) or value not in known:
        raise ScenarioError(f"{path}: {short(value)}; expected one of {', '.join(known)}")
    return value


def expect_number(value: Any, path: str, low: float, high: float) -> float:
    """A number of these bounds."""
    if not (is_number(value) and low <= value <= high):
        bounds = "a number" if math.isinf(low) and math.isinf(high) else f"a number from {low:g} to {high:g}"
        raise ScenarioError(f"{path}: {short(value)}; expected {bounds}")
    return float(value)


def expect_whole(value: Any, path: str, low: float, high: float) -> float:
    """A number of these bounds without a fraction."""
    if not (is_number(value) and low <= value <= high and value == int(value)):
        raise ScenarioError(f"{path}: {short(value)}; expected a whole number from {low:.0f} to {high:.0f}")
    return float(value)


def expect_text(mapping: Mapping[str, Any], key: str, default: str, path: str = "") -> str:
    """The text below a key of a mapping that has been checked."""
    value = mapping.get(key, default)
    if not isinstance(value, str):
        raise ScenarioError(f"{path + '.' if path else ''}{key}: {value!r}; expected a text")
    return value


def short(value: Any) -> str:
    """A value in the words of an error."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
