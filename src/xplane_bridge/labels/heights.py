"""Heights of runways: measured in this X-Plane where the aircraft was above them, else from a table, else apt.dat's."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Mapping, NamedTuple, Optional

import numpy as np

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.labels.apt import Airport, Runway
from xplane_bridge.labels.world import RunwayFrame
from xplane_bridge.units import EARTH_RADIUS_M

#: How well each source knows a height [m].
MEASURED_SIGMA_M, TABLE_SIGMA_M, AIRPORT_SIGMA_M = 0.3, 2.0, 15.0
#: [? parked-height] X-Plane's height above the terrain counts from about the wheels, altitudes from the centre of
#: gravity. Where the user does not say how high that stands over them, so much is taken, and doubted [m].
STANDING_M, STANDING_SIGMA_M = 1.0, 1.5
#: Slope of a runway [-] that heights beyond those measured are to be doubted by: 19 m on 3 km were found.
_SLOPE = 0.006
#: Heights are measured in stretches of this length along the runway [m].
_STRETCH_M = 20.0


class HeightError(XplaneBridgeError):
    """A table of heights that cannot be used; the text names file and line."""


class Height(NamedTuple):
    """Height of a point of a runway."""

    metres: float  #: [m MSL]
    sigma: float  #: [m]
    source: str  #: measured, table or apt.dat


class Ground(NamedTuple):
    """Heights of the ground below the aircraft, a row a state; what cannot be used is left out."""

    latitude: np.ndarray  #: [deg]
    longitude: np.ndarray  #: [deg]
    height: np.ndarray  #: [m MSL] altitude less height above the terrain, less how high the aircraft stands
    sigma: float = MEASURED_SIGMA_M  #: [m] of all of them


class Profile:
    """Heights along a runway; distances [m] count from its first end.

    Args:
        along: [m] where heights are known, rising.
        metres: [m MSL] there.
        sigma: [m] there.
        source: What they come from.
        slope: By which each metre beyond them is doubted.
    """

    def __init__(self, along: np.ndarray, metres: np.ndarray, sigma: float, source: str, slope: float) -> None:
        self.along, self._metres = along, metres
        self._sigma, self._source, self._slope = sigma, source, slope

    def at(self, along: float) -> Height:
        """The height at a distance; between known ones linear, beyond them the last one, less and less sure."""
        metres = float(np.interp(along, self.along, self._metres))
        beyond = max(float(self.along[0]) - along, along - float(self.along[-1]), 0.0)
        sigma = min(math.hypot(self._sigma, self._slope * beyond), max(AIRPORT_SIGMA_M, self._sigma))
        return Height(metres, sigma, self._source)

    @property
    def source(self) -> str:
        """What it comes from."""
        return self._source


def profile(airport: Airport, runway: Runway, ground: Optional[Ground], table: Mapping[str, float]) -> Profile:
    """Give a runway's heights from the best source there is.

    Args:
        airport: Has the elevation of last resort.
        runway: Of it.
        ground: Of the recording.
        table: Height [m MSL] by the name of a runway's end.
    """
    frame = RunwayFrame(runway, 0)
    if ground is not None and len(ground.latitude):
        measured = _measured(frame, ground)
        if measured is not None:
            return measured
    given = [
        (along, table[end.number])
        for along, end in ((0.0, frame.near), (frame.length, frame.far))
        if end.number in table
    ]
    if given:
        along, metres = np.array(given).T
        return Profile(along, metres, TABLE_SIGMA_M, "table", _SLOPE)
    return Profile(np.zeros(1), np.array([airport.elevation]), AIRPORT_SIGMA_M, "apt.dat", 0.0)


def _measured(frame: RunwayFrame, ground: Ground) -> Optional[Profile]:
    """The medians of stretches of the runway that the aircraft was above, as it lies; None: it never was."""
    # Degrees first: most of a flight is elsewhere.
    reach = math.degrees((frame.length + frame.width) / EARTH_RADIUS_M)
    wide = reach / max(math.cos(math.radians(frame.near.latitude)), 1e-3)
    turn = (ground.longitude - frame.near.longitude + 180.0) % 360.0 - 180.0
    near = np.nonzero((np.abs(ground.latitude - frame.near.latitude) < reach) & (np.abs(turn) < wide))[0]
    stretches: dict[int, list[tuple[float, float]]] = {}
    for k in near:
        along, right = frame.along_right(float(ground.latitude[k]), float(ground.longitude[k]))
        if 0.0 <= along <= frame.length and abs(right) <= 0.5 * frame.width:
            stretches.setdefault(int(along // _STRETCH_M), []).append((along, float(ground.height[k])))
    if not stretches:
        return None
    medians = np.array([np.median(stretches[key], axis=0) for key in sorted(stretches)])
    return Profile(medians[:, 0], medians[:, 1], ground.sigma, "measured", _SLOPE)


def read_table(path: Path, airport: Airport) -> dict[str, float]:
    """Read a table of heights: a line ``runway end, metres MSL`` each, e.g. ``15L, 12.3``; # begins a comment.

    Raises:
        HeightError: The file is not readable, a line is none, or names an end that the airport does not have.
    """
    ends = {end.number for runway in airport.runways for end in runway.ends}
    heights: dict[str, float] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            for number, row in enumerate(csv.reader(file), 1):
                words = [word.strip() for word in row]
                if not any(words) or words[0].startswith("#"):
                    continue
                try:
                    metres = float(words[1]) if len(words) == 2 else math.nan
                except ValueError:
                    metres = math.nan
                if not math.isfinite(metres):
                    msg = (
                        f"{path}: line {number}: {','.join(row)!r}; expected a runway's end and metres, e.g. 15L, 12.3"
                    )
                    raise HeightError(msg)
                if words[0] not in ends:
                    have = ", ".join(sorted(ends))
                    msg = f"{path}: line {number}: {airport.ident} has no runway {words[0]}; it has: {have}"
                    raise HeightError(msg)
                heights[words[0]] = metres
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: {getattr(error, 'strerror', None) or 'no text file'}"
        raise HeightError(msg) from None
    return heights
