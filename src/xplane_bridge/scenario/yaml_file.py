"""Reads YAML as people write it by hand: a key that is there twice is an error, not the loss of the first."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Type

import yaml

from xplane_bridge.errors import XplaneBridgeError, yaml_problem


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    def compose_mapping_node(self, anchor: Any) -> Any:
        node = super().compose_mapping_node(anchor)
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue
            if (key.tag, key.value) in seen:
                problem = f"{key.value!r} is there twice; expected each key of a mapping once"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add((key.tag, key.value))
        return node


def read_yaml_file(path: Path, refusal: Type[XplaneBridgeError]) -> Any:
    """The YAML document of a file.

    Raises:
        refusal: The file cannot be read, is no YAML, or has a key twice.
    """
    try:
        return yaml.load(Path(path).read_text(encoding="utf-8"), _Loader)
    except OSError as error:
        raise refusal(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise refusal(f"{path}: is not UTF-8 text") from None
    except yaml.YAMLError as error:
        raise refusal(f"{path}: {yaml_problem(error)}") from None
