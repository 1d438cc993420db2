"""Which datarefs and commands X-Plane has, by version: the lists that Laminar ships with it, reduced to facts.

`datarefs.txt` and `commands.txt` beside this file have a line for each folder (`sim/time/`) and below it one for each
name: the leaf, then a column for each list. A cell is `-` (not in that list), `=` (as in the last column to the left
that has it), or what the list says: for a dataref `type;access;unit`, type with its array size, access `r` or `w`
(writable), `?` where nothing is known but the name; for a command `x`.

The columns are of Laminar's `DataRefs.txt` and `Commands.txt` as found in public repositories (X-Plane/XPlane2Blender @
c93d0021: 11.40, 69f1466c: 12.00, 03aa4c2a: 12.08; XPlane11Saitek/plugin: 11.55; VlaydDetect/aviacia: 12.10). Types of
11.55, whose list has only names, are those of 11.40; commands of 12.08, of which there is no list, those that 12.00 and
12.10 share. Column 12.10 is the newest list, of March 2026.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, FrozenSet, List, Mapping, Optional, Tuple

#: The lists there are, oldest first.
VERSIONS = ("11.40", "11.55", "12.00", "12.08", "12.10")
#: The newest list of a major version.
NEWEST = {"11": "11.55", "12": "12.10"}

_FOLDER = Path(__file__).parent
_TYPE = re.compile(r"(int|float|double|byte)((?:\[\d*\])*)")


@dataclass(frozen=True)
class Dataref:
    """What a list says of a dataref.

    Attributes:
        kind: `int`, `float`, `double` or `byte`; "" where the list gives only the name.
        shape: Sizes of an array, outermost first; 0 where the list does not give one; () is a scalar.
        writable: None where the list does not say.
        unit: As written in the list; "" where it gives none.
    """

    kind: str = ""
    shape: Tuple[int, ...] = ()
    writable: Optional[bool] = None
    unit: str = ""

    @property
    def is_array(self) -> bool:
        """Whether elements have indices."""
        return bool(self.shape)

    @property
    def size(self) -> int:
        """Number of elements; 0 where the list does not give it."""
        count = 1
        for length in self.shape:
            count *= length
        return count


def version_of(internal_version: int) -> str:
    """The list that holds for X-Plane's own version number (`sim/version/xplane_internal_version`, e.g. 120815).

    That is the newest list that is not newer; the oldest list for what is older still.
    """
    known = [version for version in VERSIONS if first_version(version) <= internal_version]
    return known[-1] if known else VERSIONS[0]


def first_version(version: str) -> int:
    """The first internal version that a list holds for: 12.08 is 120800, 12 is 120000."""
    major, _, minor = version.partition(".")
    return int(major) * 10000 + int(minor or 0) * 100


@functools.lru_cache(maxsize=None)
def datarefs(version: str) -> Mapping[str, Dataref]:
    """All datarefs of a version of VERSIONS."""
    column = _column(version)
    found: Dict[str, Dataref] = {}
    for name, cells in _rows("datarefs.txt"):
        cell = _resolved(cells, column)
        if cell is not None:
            try:
                found[name] = _parsed(cell)
            except ValueError as error:
                raise ValueError(f"datarefs.txt, {name}: {error}") from None
    return found


@functools.lru_cache(maxsize=None)
def commands(version: str) -> FrozenSet[str]:
    """All commands of a version of VERSIONS."""
    column = _column(version)
    return frozenset(name for name, cells in _rows("commands.txt") if _resolved(cells, column) is not None)


def versions_with(name: str) -> List[str]:
    """The versions that have a dataref or a command of this name."""
    return [version for version in VERSIONS if name in datarefs(version) or name in commands(version)]


def _column(version: str) -> int:
    if version not in VERSIONS:
        raise ValueError(f"version {version}: expected one of {', '.join(VERSIONS)}")
    return VERSIONS.index(version)


@functools.lru_cache(maxsize=None)
def _rows(file: str) -> List[Tuple[str, List[str]]]:
    folder, rows = "", []
    for line in (_FOLDER / file).read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        leaf, *cells = line.split("\t")
        if not cells:
            folder = leaf
            continue
        if len(cells) != len(VERSIONS):
            raise ValueError(f"{file}, {folder}{leaf}: {len(cells)} cells, expected {len(VERSIONS)}")
        rows.append((folder + leaf, cells))
    return rows


def _resolved(cells: List[str], column: int) -> Optional[str]:
    """What a column says; None where the name is not in it."""
    if cells[column] == "-":
        return None
    if cells[column] != "=":
        return cells[column]
    return next((cell for cell in reversed(cells[: column + 1]) if cell not in ("-", "=")), "?")


@functools.lru_cache(maxsize=None)  # thousands of datarefs have some hundred different ones
def _parsed(cell: str) -> Dataref:
    if cell == "?":
        return Dataref()
    kind, access, unit = ([*cell.split(";", 2), "", ""])[:3]
    match = _TYPE.fullmatch(kind)
    if match is None or access not in ("", "r", "w"):
        raise ValueError(f"'{cell}', expected type;access;unit, e.g. float[8];w;ratio")
    shape = tuple(int(length or 0) for length in re.findall(r"\[(\d*)\]", match.group(2)))
    return Dataref(match.group(1), shape, None if access == "" else access == "w", unit)
