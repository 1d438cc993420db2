"""The file of labels, beside its bag: JSON lines, the first about how they were made, then one a picture.

A picture's line has the name of its ``camera`` and the stamp of its header, ``stamp_ns``, which are the key, its size,
and ``objects``; pixels as in `xplane_bridge.labels`.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, Iterable, Mapping, NamedTuple, Tuple

from xplane_bridge.errors import XplaneBridgeError

SCHEMA = 2  #: 1 knew one camera
ENDING = ".labels.jsonl"


#: Of a picture: its camera's name and its stamp [ns].
Key = Tuple[str, int]


class LabelError(XplaneBridgeError):
    """A file of labels that cannot be used, or a bag that cannot be labelled; the text is one line with the remedy."""


class Labels(NamedTuple):
    """A file of labels."""

    about: dict[str, Any]  #: the first line
    frames: dict[Key, dict[str, Any]]  #: the other ones

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras that have labels, in the order of the file."""
        return list(dict.fromkeys(camera for camera, _ in self.frames))


def beside(bag: Path) -> Path:
    """Where the labels of a flight lie: beside its (first) bag, under its name."""
    return bag.with_name(bag.stem + ENDING)


def write(path: Path, about: Mapping[str, Any], frames: Iterable[Mapping[str, Any]]) -> int:
    """Write a file of labels, under its name only when it is whole; gives the number of pictures.

    Raises:
        LabelError: It cannot be written.
    """
    part = path.with_name(path.name + ".part")
    count = 0
    try:
        with part.open("w", encoding="utf-8") as file:
            file.write(_line({"labels": SCHEMA, **about}))
            for frame in frames:
                file.write(_line(frame))
                count += 1
        part.replace(path)
    except OSError as error:
        msg = f"{path}: {error.strerror}; --output takes another file"
        raise LabelError(msg) from None
    finally:
        if part.exists():
            part.unlink()
    return count


def read(path: Path) -> Labels:
    """Read a file of labels.

    Raises:
        LabelError: It is missing, or not one of this version.
    """
    try:
        with path.open(encoding="utf-8") as file:
            lines = [json.loads(line) for line in file]
    except OSError as error:
        msg = f"{path}: {error.strerror}; label_images writes it"
        raise LabelError(msg) from None
    except ValueError:
        lines = []
    if not lines or not isinstance(lines[0], dict) or lines[0].get("labels") != SCHEMA:
        msg = f"{path}: no labels of this version; label_images writes them anew"
        raise LabelError(msg)
    return Labels(lines[0], {(str(line["camera"]), int(line["stamp_ns"])): line for line in lines[1:]})


def digest(path: Path) -> str:
    """The SHA-256 of a file of labels.

    Raises:
        LabelError: It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        msg = f"{path}: {error.strerror}; label_images writes it"
        raise LabelError(msg) from None


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False) + "\n"
