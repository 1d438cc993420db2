"""data.yaml, from which YOLO's trainers take where pictures are and what the classes are called."""

from __future__ import annotations

import json
from typing import Any, Mapping, Sequence

from xplane_bridge.export.image_labels import CATEGORIES

DATA_YAML = "data.yaml"
#: Our splits by what the trainers call them.
_CALLED = {"train": "train", "validation": "val"}


def data_yaml(head: str, folders: Mapping[str, Sequence[str]]) -> str:
    """Write the file's text.

    Args:
        head: A comment of one line.
        folders: With pictures, by split, relative to the file; a split without any is not named.
    """
    lines = [f"# {head}"]
    for split, called in _CALLED.items():
        names = [json.dumps(name, ensure_ascii=False) for name in folders.get(split, ())]
        if names:
            lines.append(f"{called}: {names[0] if len(names) == 1 else '[' + ', '.join(names) + ']'}")
    return "\n".join([*lines, "names:", *(f"  {k}: {name}" for k, name in enumerate(CATEGORIES))]) + "\n"


def of_all_flights(version: str, flights: Mapping[str, Mapping[str, Any]]) -> str:
    """Write the same of an export's folder: with whole flights in each split, no flight's own can train.

    Args:
        version: Of this package.
        flights: Name to record in the manifest, of the flights exported as `yolo`.
    """
    folders = {
        split: [f"{name}.yolo/images/{split}" for name, record in sorted(flights.items()) if record["counts"][split]]
        for split in _CALLED
    }
    return data_yaml(f"xplane_bridge {version}; all flights of this folder", folders)
