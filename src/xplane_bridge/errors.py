"""The root of this package's exceptions, and what readers of files share."""

import math
from typing import Any, Union


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
