"""A text file that takes the place of another one when it is whole."""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Iterator, TextIO


def is_special(path: Path) -> bool:
    """Returns whether there is something that no file may take the place of: a device, a pipe or a folder."""
    return path.exists() and not path.is_file()


@contextmanager
def replaced(path: Path) -> Iterator[TextIO]:
    """Gives the new file, beside the other one; where it does not become whole, the other stays alone.

    A symbolic link stays, and what it names is replaced. A device or a pipe is written to as it is. Bytes of file names
    that are no UTF-8 are written as codes.

    Raises:
        OSError: It cannot be written; with the name of the other.
    """
    try:
        if is_special(path):
            with _opened(path) as file:
                yield file
            return
        whole = path.resolve()
        part = whole.with_name(whole.name + ".part")
        try:
            with _opened(part) as file:
                yield file
            os.replace(part, whole)
        except BaseException:
            with suppress(OSError):
                part.unlink()
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def _opened(path: Path) -> TextIO:
    return path.open("w", encoding="utf-8", errors="backslashreplace")
