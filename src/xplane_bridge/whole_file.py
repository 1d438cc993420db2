"""A text file that takes the place of another one when it is whole."""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Iterator, TextIO


@contextmanager
def replaced(path: Path) -> Iterator[TextIO]:
    """Gives the new file, beside the other one; where it does not become whole, the other stays alone.

    Bytes of file names that are no UTF-8 are written as codes.

    Raises:
        OSError: It cannot be written; with the name of the other.
    """
    part = path.with_name(path.name + ".part")
    try:
        with part.open("w", encoding="utf-8", errors="backslashreplace") as file:
            yield file
        os.replace(part, path)
    except BaseException as error:
        with suppress(OSError):
            part.unlink()
        if not isinstance(error, OSError):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None
