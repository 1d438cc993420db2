"""How pages get into their files: whole or not at all, and never over a recording."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Iterable, Union

from xplane_bridge.errors import XplaneBridgeError


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

    Bytes of file names that are no UTF-8 are in it as codes.

    Raises:
        OSError: It cannot be written; with its name.
    """
    data = text.encode("utf-8", "backslashreplace")
    try:
        if path.exists() and not path.is_file():  # a folder, which is an error, or a device
            path.write_bytes(data)
            return
        final = path.resolve()
        part = final.with_name(final.name + ".part")
        try:
            part.write_bytes(data)
            os.replace(part, final)
        except OSError:
            with contextlib.suppress(OSError):
                part.unlink()
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
