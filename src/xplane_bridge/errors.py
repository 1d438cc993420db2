"""The root of this package's exceptions, and what readers of files share."""

import itertools
import math
from typing import Any, Iterator, Set, Tuple, Union

_YAML = "tag:yaml.org,2002:"
#: Values that YAML has and ROS's parameters have not.
_NO_PARAMETERS = {
    _YAML + "null": "has no value: give it one, or take it out",
    _YAML + "timestamp": "is a date: put it in quotes",
}


class XplaneBridgeError(Exception):
    """Something a user can put right; the text is one line: what was given, what was expected, what to do."""


def is_number(value: Any) -> bool:
    """Whether a value of a file is a finite number that fits a double; true and false are none."""
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def text_problem(error: Union[OSError, UnicodeDecodeError]) -> str:
    """Why a file cannot be read as text."""
    return getattr(error, "strerror", None) or "is not UTF-8 text"


def yaml_problem(error: Exception) -> str:
    """One line about a `yaml.YAMLError`: where, and what."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
    if mark is None or problem is None:
        return f"does not parse as YAML: {' '.join(str(error).split())}"
    return f"does not parse as YAML: line {mark.line + 1}, column {mark.column + 1}: {problem}"


def yaml_entries(node: Any) -> Iterator[Tuple[Any, Any]]:
    """Keys and values of a composed YAML mapping, with those that are merged into it; of other nodes none."""
    for key, value in node.value if getattr(node, "id", "") == "mapping" else []:
        if key.tag == _YAML + "merge":
            for merged in value.value if value.id == "sequence" else [value]:
                yield from yaml_entries(merged)
        else:
            yield key, value


def unsettable(node: Any) -> Iterator[Tuple[str, str]]:
    """What ROS cannot set of a composed YAML file of parameters: its full name (`buttons/gear`), and what to do.

    Also where an argument of the launch file would give the value.
    """
    if _is_endless(node, (), set()):
        yield "an alias", "stands for what it is part of: write it out"
    else:
        yield from _unsettable(node, "")


def _is_endless(node: Any, above: Tuple[Any, ...], done: Set[int]) -> bool:
    if any(node is each for each in above):
        return True
    if id(node) in done or not isinstance(getattr(node, "value", None), list):
        return False
    done.add(id(node))
    parts = itertools.chain.from_iterable(part if isinstance(part, tuple) else (part,) for part in node.value)
    return any(_is_endless(part, (*above, node), done) for part in parts)


def _unsettable(node: Any, name: str) -> Iterator[Tuple[str, str]]:
    for key, value in yaml_entries(node):
        full = f"{name}/{key.value}" if name else key.value
        if key.tag == _YAML + "str":
            yield from _unsettable(value, full)
        else:
            yield full, "is a key that is no text: put it in quotes"
    if getattr(node, "id", "") == "sequence":
        for index, value in enumerate(node.value):
            yield from _unsettable(value, f"{name}[{index}]")
    elif name and node.tag in _NO_PARAMETERS:
        yield name, _NO_PARAMETERS[node.tag]
