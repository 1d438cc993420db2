"""Which files of a folder are bags, and in which order the parts of a recording were written."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Union

from xplane_bridge.bags.chunks import BagFile, DamagedError
from xplane_bridge.bags.once import warn_once

#: Follows the name of a bag while it is recorded, and stays where the recorder was killed.
_ACTIVE = ".active"
#: Ends the name of each part of a split recording.
_PART = re.compile(r"_[0-9]+$")


def bags_in(folder: Path, pattern: str = "*.bag") -> list[Path]:
    """The bags of a folder, by name, also ``NAME.bag.active`` of a recording that was cut off.

    Not what ``rosbag reindex`` keeps of each: ``NAME.orig.bag`` is the same flight. What was cut off before it held one
    whole chunk is left out, and a warning says so.

    Args:
        folder: Where to look.
        pattern: ``**/*.bag`` also looks in the folders in it.
    """
    active = list(folder.glob(pattern + _ACTIVE))  # first: what rosbag renames meanwhile is found among the others
    found = set(folder.glob(pattern))
    kept = {path.with_suffix(".orig.bag") for path in found}
    cut_off = {path for path in active if path.with_suffix("") not in found}
    return sorted(found - kept | set(filter(_has_chunk, cut_off)))


def recording_of(path: Path) -> tuple[Path, str]:
    """What the parts NAME_0, NAME_1, ... of a recording have in common: folder and name."""
    whole = path.with_suffix("") if path.suffix == _ACTIVE else path
    return whole.parent, _PART.sub("", whole.stem)


def ending(path: Path) -> str:
    """What can have happened to a recording without an index."""
    return "was cut off, or is still being recorded" if path.suffix == _ACTIVE else "was cut off"


def part_order(path: Path) -> list[Union[str, int]]:
    """By which the parts of a recording are ordered: NAME_2 before NAME_10."""
    return [int(text) if k % 2 else text for k, text in enumerate(re.split("([0-9]+)", path.name))]


def _has_chunk(path: Path) -> bool:
    try:
        BagFile(path, probe=True).close()
    except DamagedError as error:
        why = "the recording was cut off before its first whole chunk, or has just begun"
        warn_once(f"{path}: left out ({error}); {why}")
        return False
    except OSError:
        pass  # as of any other bag, the reason is said when it is opened
    return True
