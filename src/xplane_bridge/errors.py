"""The root of this package's exceptions, and what readers of files share."""

import math
from typing import Any


class XplaneBridgeError(Exception):
    """Something a user can put right; the text is one line: what was given, what was expected, what to do."""


def is_number(value: Any) -> bool:
    """Whether a value of a file is a finite number that fits a double; true and false are none."""
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def read_yaml(text: str) -> Any:
    """A YAML document in which no mapping has a key twice: YAML's own reader keeps the last one, and says nothing.

    Raises:
        yaml.YAMLError: It does not parse, or a key is there twice.
    """
    import yaml  # here, as rooms of the standard library alone have this one

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        def compose_mapping_node(self, anchor: Any) -> Any:
            node = super().compose_mapping_node(anchor)
            seen = set()
            for key, _ in node.value:
                name = (key.tag, key.value) if isinstance(key, yaml.ScalarNode) else None
                if name in seen:
                    problem = f"{key.value!r} is there twice; expected each key of a mapping once"
                    raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
                seen.update({name} - {None})
            return node

    return yaml.load(text, Loader)


def yaml_problem(error: Exception) -> str:
    """One line about a `yaml.YAMLError`: where, and what."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
    if mark is None or problem is None:
        return f"does not parse as YAML: {' '.join(str(error).split())}"
    return f"does not parse as YAML: line {mark.line + 1}, column {mark.column + 1}: {problem}"
