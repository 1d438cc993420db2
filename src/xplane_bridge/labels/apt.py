"""Runways of an airport from X-Plane's apt.dat, versions 1000 to 1200.

X-Plane takes an airport from the first file, in the order of ``scenery_packs.ini``, that has it, and in a file the
first one of that name; so do we. Nothing of other airports is looked at. Elevations are in feet there, the other
lengths in metres, the displaced threshold too.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Iterable, Iterator, NamedTuple, Optional, Sequence, Tuple

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.units import EARTH_RADIUS_M, FOOT_M

#: Versions of the file format whose rows are known.
OLDEST, NEWEST = 1000, 1299
_AIRPORT_ROWS = {"1", "16", "17"}
_RUNWAY, _METADATA, _END = "100", "1302", "99"
#: Fields of a runway's row: 8 of the runway, 9 of each end.
_RUNWAY_FIELDS, _END_FIELDS = 8, 9


class AptError(XplaneBridgeError):
    """An apt.dat that cannot be used; the text names file and line, what was found, and what is expected."""


class RunwayEnd(NamedTuple):
    """One end of a runway's pavement, without its blast pad."""

    number: str  #: as painted, e.g. ``09L``
    latitude: float  #: [deg] of the middle of the pavement's end
    longitude: float  #: [deg]
    displaced: float  #: [m] from there to the threshold, inwards
    blast_pad: float  #: [m] of pavement outside


class Runway(NamedTuple):
    """A land runway."""

    width: float  #: [m]
    surface: int  #: X-Plane's code: 1 asphalt, 2 concrete, ..., 15 transparent
    ends: Tuple[RunwayEnd, RunwayEnd]


class Airport(NamedTuple):
    """What is needed of an airport."""

    ident: str
    name: str
    elevation: float  #: [m MSL]; runways follow the terrain, this is one number for all
    runways: Tuple[Runway, ...]
    file: str
    sha256: str  #: of the airport's own rows
    version: int  #: of the file's format


def read_airport(files: Sequence[str | Path], ident: str) -> Airport:
    """Read an airport from the first file that has it.

    Args:
        files: In the order of ``scenery_packs.ini``.
        ident: Its identifier, or the ICAO code of its metadata.

    Raises:
        AptError: No file has it, or the file or the airport in it is broken.
    """
    seen = 0
    for file in files:
        airport, airports = _search(Path(file), ident.strip().upper())
        seen += airports
        if airport is not None:
            return airport
    names = ", ".join(map(str, files))
    msg = (
        f"{names}: no airport {ident} among {seen}; X-Plane has its own apt.dat files in Global Airports (or, in "
        "version 11, Resources/default scenery/default apt dat) and below Custom Scenery/*/Earth nav data"
    )
    raise AptError(msg)


class _Block(NamedTuple):
    """The rows of one airport."""

    rows: list[tuple[int, str]]  #: number in the file, text
    ended: bool  #: whether anything came after it


def _search(path: Path, ident: str) -> tuple[Optional[Airport], int]:
    """Find an airport in a file; gives how many there are up to it, too."""
    count = 0
    by_code: Optional[_Block] = None
    try:
        with path.open(encoding="utf-8-sig", errors="replace", newline=None) as file:
            lines = enumerate(file, 1)
            version = _version(path, lines)
            for block in _blocks(lines):
                count += 1
                first = block.rows[0][1].split(None, 5)
                if len(first) > 4 and first[4].upper() == ident:
                    return _airport(path, version, block), count
                if by_code is None and _code(block) == ident:
                    by_code = block  # not read yet: it may be no airport, and the identifier still come
    except OSError as error:
        msg = f"{path}: {error.strerror}"
        raise AptError(msg) from None
    return None if by_code is None else _airport(path, version, by_code), count


def _version(path: Path, lines: Iterable[tuple[int, str]]) -> int:
    """Read the two lines at the top."""
    head = [line.strip() for _, (_, line) in zip(range(2), lines)]
    if len(head) < 2 or head[0] not in ("I", "A"):
        given = head[0][:40] if head else "an empty file"
        msg = f"{path}: line 1: {given!r}; expected I or A: this is no apt.dat"
        raise AptError(msg)
    word = (head[1].split() or [""])[0]
    if not word.isdecimal() or not OLDEST <= int(word) <= NEWEST:
        msg = f"{path}: line 2: version {word!r}; versions {OLDEST} to 1200 are known"
        raise AptError(msg)
    return int(word)


def _blocks(lines: Iterable[tuple[int, str]]) -> Iterator[_Block]:
    rows: list[tuple[int, str]] = []
    for number, line in lines:
        code = line.split(None, 1)[:1]
        if code and (code[0] in _AIRPORT_ROWS or code[0] == _END):
            if rows:
                yield _Block(rows, True)
            rows = []
            if code[0] == _END:
                return
        if rows or (code and code[0] in _AIRPORT_ROWS):
            rows.append((number, line.rstrip("\r\n")))
    if rows:
        yield _Block(rows, False)


def _code(block: _Block) -> str:
    for _, line in block.rows:
        words = line.split(None, 2)
        if len(words) > 2 and words[0] == _METADATA and words[1] == "icao_code":
            return words[2].strip().upper()
    return ""


def _airport(path: Path, version: int, block: _Block) -> Airport:
    number, line = block.rows[0]
    words = line.split(None, 5)
    elevation = _number(path, number, "elevation [ft]", words[1] if len(words) > 1 else "", -2000.0, 30000.0)
    if len(words) < 5:
        msg = f"{path}: line {number}: {line!r}; expected: 1 elevation 0 0 identifier name"
        raise AptError(msg)
    if not block.ended:
        msg = f"{path}: the file is cut off within {words[4]} (no row 99 at its end); copy it again"
        raise AptError(msg)
    runways = tuple(_runway(path, n, row) for n, row in block.rows if row.split(None, 1)[:1] == [_RUNWAY])
    if not runways:
        msg = f"{path}: line {number}: {words[4]} has no land runway (row 100), so there is nothing to label"
        raise AptError(msg)
    digest = hashlib.sha256("\n".join(row for _, row in block.rows).encode("utf-8")).hexdigest()
    name = words[5].strip() if len(words) > 5 else ""
    return Airport(words[4], name, elevation * FOOT_M, runways, str(path), digest, version)


def _runway(path: Path, number: int, row: str) -> Runway:
    words = row.split()
    wanted = _RUNWAY_FIELDS + 2 * _END_FIELDS
    if len(words) < wanted:
        msg = f"{path}: line {number}: a runway of {len(words)} fields; expected {wanted}"
        raise AptError(msg)
    width = _number(path, number, "width [m]", words[1], 1.0, 1000.0)
    surface = int(_number(path, number, "surface", words[2], 0.0, 1000.0))
    ends = tuple(
        _end(path, number, words[at : at + _END_FIELDS]) for at in (_RUNWAY_FIELDS, _RUNWAY_FIELDS + _END_FIELDS)
    )
    runway = Runway(width, surface, (ends[0], ends[1]))
    length = _length(runway)
    names = f"{ends[0].number}/{ends[1].number}"
    if not 10.0 < length < 20000.0:
        msg = f"{path}: line {number}: runway {names} is {length:.0f} m long; expected 10 to 20000"
        raise AptError(msg)
    if ends[0].displaced + ends[1].displaced >= length:
        msg = f"{path}: line {number}: the displaced thresholds of {names} leave nothing of its {length:.0f} m"
        raise AptError(msg)
    return runway


def _end(path: Path, number: int, words: Sequence[str]) -> RunwayEnd:
    return RunwayEnd(
        words[0],
        _number(path, number, "latitude [deg]", words[1], -90.0, 90.0),
        _number(path, number, "longitude [deg]", words[2], -180.0, 180.0),
        _number(path, number, "displaced threshold [m]", words[3], 0.0, 10000.0),
        _number(path, number, "blast pad [m]", words[4], 0.0, 10000.0),
    )


def _length(runway: Runway) -> float:
    """Length [m], good enough to find nonsense."""
    a, b = runway.ends
    north = math.radians(b.latitude - a.latitude)
    east = math.radians((b.longitude - a.longitude + 180.0) % 360.0 - 180.0) * math.cos(math.radians(a.latitude))
    return EARTH_RADIUS_M * math.hypot(north, east)


def _number(path: Path, line: int, what: str, text: str, low: float, high: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        msg = f"{path}: line {line}: {what} {text!r}; expected a number from {low:g} to {high:g}"
        raise AptError(msg)
    return value
