"""Reads YAML as people write it by hand: a key that is there twice is an error, not the loss of the first."""

from __future__ import annotations

from typing import Any

import yaml


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


def read_yaml(text: str) -> Any:
    """A YAML document.

    Raises:
        yaml.YAMLError: It does not parse, or a key is there twice.
    """
    return yaml.load(text, _Loader)
