"""The code blocks of a document, to be run as they stand there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple


class Block(NamedTuple):
    """A fenced block."""

    section: str  #: heading it stands under, without its marks
    language: str  #: what follows the fence; often nothing
    text: str


def blocks(file: Path) -> list[Block]:
    """All blocks of a document, in order."""
    found, section, language, lines = [], "", None, []
    for line in file.read_text(encoding="utf-8").splitlines():
        fence = re.fullmatch(r"```(\w*)", line)
        if fence and language is None:
            language, lines = fence.group(1), []
        elif fence:
            found.append(Block(section, language, "\n".join(lines)))
            language = None
        elif language is not None:
            lines.append(line)
        elif line.startswith("#"):
            section = line.lstrip("#").strip()
    return found
