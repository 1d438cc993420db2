"""Which bags are parts of one recording: rosbag begins a new file at a size (`split_size` of record.launch)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Tuple

from xplane_bridge.bags import Bags

#: PREFIX_DATE_NUMBER.bag, where PREFIX or DATE may be missing; each part has a date of its own. Of a recording that was
#: cut off, the last part's name still ends in .active.
_NAME = re.compile(r"(?P<prefix>.*?)_?(?P<date>\d{4}(?:-\d\d){5})?_(?P<number>\d+)\.bag(?:\.active)?")
#: Between the last message of a part and the first one of the next [s]: far below what it takes to begin a recording
#: anew with all nodes, and above what lies between two messages of `link_state` (1/s).
_BETWEEN_S = 2.0


class _Part(NamedTuple):
    path: Path
    number: int


def joined(paths: Sequence[Path]) -> List[List[Path]]:
    """Put the parts of each recording together, in their order; any other bag stays alone.

    Parts are bags of one folder whose names differ in number and date alone, whose numbers follow each other, and of
    which each begins when the one before it ends: so `run_0.bag` and `run_1.bag` that were flown one after the other
    stay two flights.

    Args:
        paths: Bag files.

    Raises:
        BagError: A bag that may be a part cannot be read.
    """
    candidates: Dict[Tuple[Path, str], List[Tuple[str, int, Path]]] = {}
    for path in paths:
        match = _NAME.fullmatch(path.name)
        if match:
            key = (path.resolve().parent, match["prefix"])
            candidates.setdefault(key, []).append((match["date"] or "", int(match["number"]), path))
    spans: Dict[Path, Tuple[int, int]] = {}
    chains: List[List[_Part]] = []
    for found in candidates.values():
        mine: List[List[_Part]] = []
        for _, number, path in sorted(found):
            before = next((c for c in mine if c[-1].number == number - 1 and _follows(c[-1].path, path, spans)), None)
            if before is None:
                mine.append([_Part(path, number)])
            else:
                before.append(_Part(path, number))
        chains += mine
    first = {chain[0].path: [part.path for part in chain] for chain in chains}
    later = {part.path for chain in chains for part in chain[1:]}
    return [first.get(path, [path]) for path in paths if path not in later]


def _follows(path: Path, other: Path, spans: Dict[Path, Tuple[int, int]]) -> bool:
    """Whether the other bag begins when this one ends, by the receive times in the files: each is opened alone."""
    for each in (path, other):
        if each not in spans:
            with Bags(each) as bags:
                spans[each] = bags.written
    (start, end), (begin, _) = spans[path], spans[other]
    return begin > start and abs(begin - end) < _BETWEEN_S * 1e9
