"""Files that programs draw into at their end: looked at when they begin, or what was measured would be lost."""

from __future__ import annotations

import argparse
from pathlib import Path


def figure_file(text: str) -> Path:
    """The type of an option that takes one: its ending is one that matplotlib writes, and its folder is there."""
    from matplotlib.figure import Figure

    path, kinds = Path(text), Figure().canvas.get_supported_filetypes()
    if path.suffix[1:].lower() not in kinds:
        msg = f"{text}: expected a file name that ends in one of {', '.join(sorted(kinds))}"
        raise argparse.ArgumentTypeError(msg)
    if not path.parent.is_dir():
        msg = f"{text}: there is no folder {path.parent}; make it, or give another"
        raise argparse.ArgumentTypeError(msg)
    return path
