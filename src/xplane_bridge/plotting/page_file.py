"""How pages get into their files: whole or not at all, and never over a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Iterable, Union

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.whole_file import replaced


class PageError(XplaneBridgeError):
    """A page, or another file, would be written over the recording it is made of."""


def refuse_recordings(path: Path, recordings: Iterable[Union[str, Path]]) -> None:
    """Looks whether a file may be written there.

    Raises:
        PageError: One of the recordings is there.
    """
    for recording in recordings:
        if path.resolve() == Path(recording).resolve():
            raise PageError(f"{path}: the recording itself is there; expected another file to write to")


def write_page(path: Path, text: str) -> None:
    """Writes a page; what was there before stays until the page is whole.

    Raises:
        OSError: It cannot be written; with its name.
    """
    with replaced(path) as file:
        file.write(text)
