"""The file of labels, beside its bag: JSON lines, the first about how they were made, then one a picture.

A picture's line has the name of its ``camera`` and the stamp of its header, ``stamp_ns``, which are the key, its size,
and ``objects``; pixels as in `xplane_bridge.labels`.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any, BinaryIO, Callable, Dict, Iterable, Iterator, Mapping, NamedTuple, Optional, Tuple

from xplane_bridge.errors import XplaneBridgeError, is_number
from xplane_bridge.whole_file import is_special, replaced

SCHEMA = 2  #: 1 knew one camera
ENDING = ".labels.jsonl"
#: What a picture's line has at least.
_PICTURE = ("camera", "stamp_ns", "width", "height", "objects")


#: Of a picture: its camera's name and its stamp [ns].
Key = Tuple[str, int]


class LabelError(XplaneBridgeError):
    """A file of labels that cannot be used, or a bag that cannot be labelled; the text is one line with the remedy."""


class Frames(Mapping[Key, Dict[str, Any]]):
    """The lines of pictures, each read from the file when it is asked for: those of an hour do not fit into memory.

    Args:
        file: Open; it is closed with this.
        places: Where the line of each begins, by camera and stamp.
    """

    def __init__(self, file: BinaryIO, places: Mapping[str, Mapping[int, int]]) -> None:
        self._file = file
        self._places = places
        self._last: Optional[Tuple[Key, Dict[str, Any]]] = None
        weakref.finalize(self, file.close)

    def __getitem__(self, key: Key) -> Dict[str, Any]:
        """Reads a picture's line."""
        camera, stamp = key
        place = self._places.get(camera, {}).get(stamp)
        if place is None:
            raise KeyError(key)
        if self._last is None or self._last[0] != key:
            self._file.seek(place)
            self._last = key, json.loads(self._file.readline())
        return self._last[1]

    def __contains__(self, key: object) -> bool:
        """Returns whether a picture has labels, without reading them."""
        return isinstance(key, tuple) and key[1] in self._places.get(key[0], {})

    def __iter__(self) -> Iterator[Key]:
        """The keys, by camera, in the order of the file."""
        return ((camera, stamp) for camera, stamps in self._places.items() for stamp in stamps)

    def __len__(self) -> int:
        """Give the number of pictures."""
        return sum(map(len, self._places.values()))


class Labels(NamedTuple):
    """A file of labels."""

    about: dict[str, Any]  #: the first line
    frames: Mapping[Key, dict[str, Any]]  #: the other ones

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras that have labels, in the order of the file."""
        return list(dict.fromkeys(camera for camera, _ in self.frames))


def beside(bag: Path) -> Path:
    """Where the labels of a flight lie: beside its (first) bag, under its name."""
    return bag.with_name(bag.stem + ENDING)


def write(path: Path, about: Callable[[], Mapping[str, Any]], frames: Iterable[Mapping[str, Any]]) -> int:
    """Write a file of labels, under its name only when it is whole; gives the number of pictures.

    Args:
        path: The file.
        about: Gives its first line, once all pictures are written; its error ends it without a file.
        frames: The pictures' lines; not held in memory.

    Raises:
        LabelError: It cannot be written.
    """
    count = 0
    try:
        folder = None if is_special(path) else path.parent  # no files are made beside devices
        with tempfile.TemporaryFile("w+", encoding="utf-8", dir=folder) as lines:
            for frame in frames:
                lines.write(_line(frame))
                count += 1
            lines.seek(0)
            with replaced(path) as file:
                file.write(_line({"labels": SCHEMA, **about()}))
                shutil.copyfileobj(lines, file)
    except OSError as error:
        msg = f"{path}: {error.strerror}; --output takes another file"
        raise LabelError(msg) from None
    return count


def read(path: Path) -> Labels:
    """Read a file of labels.

    Raises:
        LabelError: It is missing, or not one of this version.
    """
    about: Any = None
    number = 0
    places: Dict[str, Dict[int, int]] = {}
    try:
        file = path.open("rb")
    except OSError as error:
        msg = f"{path}: {error.strerror}; label_images writes it"
        raise LabelError(msg) from None
    try:
        at = 0
        for line in file:
            number += 1
            content = json.loads(line)
            if not at:
                about = content
                if not isinstance(about, dict) or about.get("labels") != SCHEMA:
                    break
            else:
                if not _is_picture(content):
                    raise ValueError
                places.setdefault(str(content["camera"]), {})[int(content["stamp_ns"])] = at
            at += len(line)
    except (ValueError, KeyError, TypeError):
        about = None
    if not isinstance(about, dict) or about.get("labels") != SCHEMA:
        file.close()
        where = f"{path}: line {number}: expected {', '.join(_PICTURE)} of a picture" if number > 1 else path
        msg = f"{where}: no labels of this version; label_images writes them anew"
        raise LabelError(msg)
    return Labels(about, Frames(file, places))


def _is_picture(content: Any) -> bool:
    """Returns whether a line is a picture's, with what all that read it look at."""
    if not (isinstance(content, dict) and all(name in content for name in _PICTURE)):
        return False
    numbers, objects = [content[name] for name in ("width", "height")], content["objects"]
    return (
        all(is_number(size) and size > 0 for size in numbers)
        and isinstance(objects, list)
        and all(isinstance(thing, dict) and isinstance(thing.get("kind"), str) for thing in objects)
    )


def digest(path: Path) -> str:
    """The SHA-256 of a file of labels.

    Raises:
        LabelError: It cannot be read.
    """
    try:
        found = hashlib.sha256()
        with path.open("rb") as file:
            for block in iter(lambda: file.read(1 << 20), b""):
                found.update(block)
        return found.hexdigest()
    except OSError as error:
        msg = f"{path}: {error.strerror}; label_images writes it"
        raise LabelError(msg) from None


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False) + "\n"
