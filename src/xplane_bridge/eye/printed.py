"""Reads the time that X-Plane prints into its picture, in whatever font and place; no input or output here.

The digits are learnt from the pictures themselves. The digit of whole seconds is the same for half a second around the
middle of each second, whichever of the neighbouring frames a picture shows: so pictures of these halves, sorted by the
second that their frame's key says, show where that digit stands and what each of the ten looks like, and do so without
trusting the pairing to better than a quarter of a second. By what was learnt there the digits right and left of it are
read, and these distinguish frames.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Set, Tuple

import numpy as np

#: Looked at: the upper left of larger pictures [px].
SEARCHED = (1080, 1920)
#: Of a second, in which its digit is learnt.
_LEARN = (0.25, 0.75)
#: Each digit is learnt in so many tens of seconds, so that the scenery behind it is another one each time.
_TENS = 3
_PER_SECOND = 4
#: A pixel belongs to the digit if between the digits it varies so much more than behind one of them, and so much.
_MORE = 4.0
_LEAST_VARIANCE = 100.0
#: Pixels so near belong to the same digit [px].
_REACH = 2
_HEIGHTS, _WIDTHS = (5, 80), (3, 60)
_CANDIDATES = 12
#: Correlation of a place with the best of ten digits: of one that shows digits, and of a digit that can be read, which
#: is also by so much better than the next best.
_SHOWS, _READABLE, _BETTER = 0.6, 0.5, 0.02
#: Of several places, the nearest is taken whose correlation is at least this share of the best one's.
_AS_GOOD = 0.9
#: From digit to digit as a share of the digit's width; from seconds to tenths, over the point, of that.
_PITCH, _POINT = (0.9, 2.2), (1.15, 2.2)
_MOST_DECIMALS = 6
#: Printed and true value agree when so much of the last decimal apart.
_SAME = 0.51

Box = Tuple[int, int, int, int]  #: top, left, bottom, right [px], the last two outside


def grey_of(pixels: Any) -> np.ndarray:
    """What is looked at of a picture: the green of its upper left."""
    green: np.ndarray = pixels[: SEARCHED[0], : SEARCHED[1], 1]
    return green


@dataclass(frozen=True)
class Place:
    """Where the digit of whole seconds may stand, and what the ten digits look like there.

    Attributes:
        box: Of the digit.
        digits: Pictures of 0 to 9, (10, height, width).
    """

    box: Box
    digits: np.ndarray

    def cut(self, grey: np.ndarray) -> np.ndarray:
        """What is needed of a picture for `read`: the line around the digit; beyond the picture it is black."""
        top, left, bottom, right = self.box
        width = right - left
        before, after = 3 * width, 9 * width
        part = grey[top:bottom, max(left - before, 0) : right + after]
        line = np.zeros((bottom - top, before + width + after), np.uint8)
        start = max(before - left, 0)
        line[:, start : start + part.shape[1]] = part
        return line


class Finder:
    """Looks for the digit of whole seconds in pictures of one size."""

    def __init__(self) -> None:
        self._sums: Optional[np.ndarray] = None
        self._squares = np.empty(0)
        self._counts = np.zeros(10, int)
        self._seen: List[Set[int]] = [set() for _ in range(10)]
        self._second, self._of_second = -1, 0

    @property
    def missing(self) -> int:
        """Seconds of pictures that are still needed, at least."""
        return sum(max(_TENS - len(tens), 0) for tens in self._seen)

    def add(self, grey: np.ndarray, key: float) -> None:
        """Takes a picture.

        Args:
            grey: Of `grey_of`.
            key: Of the frame that it is paired with [s].
        """
        second = math.floor(key)
        if not _LEARN[0] <= key - second <= _LEARN[1]:
            return
        if self._sums is None:
            self._sums, self._squares = np.zeros((10, *grey.shape), np.float32), np.zeros(grey.shape, np.float32)
        if second != self._second:
            self._second, self._of_second = second, 0
        self._of_second += 1
        if self._of_second > _PER_SECOND:
            return
        level = grey.astype(np.float32)
        self._sums[second % 10] += level
        self._squares += level * level
        self._counts[second % 10] += 1
        self._seen[second % 10].add(second // 10)

    def places(self) -> List[Place]:
        """Where the digit may stand, likeliest first; when nothing is missing any more."""
        assert self._sums is not None
        total = int(self._counts.sum())
        counts = self._counts[:, np.newaxis, np.newaxis]
        overall = self._sums.sum(axis=0) / total
        between = (np.square(self._sums) / counts).sum(axis=0) / total - overall * overall
        within = np.maximum(self._squares / total - overall * overall - between, 0.0)
        rows, columns = np.nonzero((between > _LEAST_VARIANCE) & (between > _MORE * within))
        found = []
        for cluster in _clusters(list(zip(rows.tolist(), columns.tolist()))):
            (top, left), (bottom, right) = np.min(cluster, axis=0), np.max(cluster, axis=0) + 1
            if not (_HEIGHTS[0] <= bottom - top <= _HEIGHTS[1] and _WIDTHS[0] <= right - left <= _WIDTHS[1]):
                continue
            box = (int(top), int(left), int(bottom), int(right))
            digits = self._sums[:, top:bottom, left:right] / counts
            found.append((float(between[top:bottom, left:right].sum()), Place(box, digits)))
        found.sort(key=lambda place: -place[0])
        return [place for _, place in found[:_CANDIDATES]]


@dataclass(frozen=True)
class Reading:
    """What one picture says.

    Attributes:
        value: Seconds of the time, without its hundreds: 0 to 100 [s].
        decimals: That are printed.
    """

    value: float
    decimals: int

    def fits(self, key: float, cut: bool) -> bool:
        """Whether a frame's time is printed so: rounded as printf does, or cut off."""
        step = 10.0**-self.decimals
        slack = (_SAME - 0.5) * step + float(np.spacing(np.float32(key)))
        more = (key - self.value + 50.0) % 100.0 - 50.0
        return -slack <= more < step + slack if cut else abs(more) <= 0.5 * step + slack


def read(place: Place, lines: Sequence[np.ndarray]) -> List[Optional[Reading]]:
    """Reads many pictures.

    Args:
        place: Where the digit of whole seconds stands.
        lines: `Place.cut` of each picture.

    Returns:
        A reading for each; None where a digit cannot be read.
    """
    width = place.box[3] - place.box[1]
    which, alike, better = _best_digits(place.digits, np.stack(lines))
    score = np.median(alike, axis=0)  # how well each column begins a digit
    home = 3 * width
    tens, pitch = _peak(score, home, (-_PITCH[1] * width, -_PITCH[0] * width))
    if tens is None:
        return [None] * len(lines)
    point, _ = _peak(score, home, (_POINT[0] * pitch, _POINT[1] * pitch))
    columns = [tens, home]
    while point is not None and len(columns) < 2 + _MOST_DECIMALS:
        if len(set(which[:, point].tolist())) < 2:
            break  # what stands there does not count
        columns.append(point)
        step = point - home + pitch
        point, _ = _peak(score, home, (step - 1.0, step + 1.0))
    readable = np.all((alike[:, columns] >= _READABLE) & (better[:, columns] >= _BETTER), axis=1)
    weights = 10.0 ** (1 - np.arange(len(columns)))
    return [
        Reading(float(row @ weights), len(columns) - 2) if good else None
        for row, good in zip(which[:, columns], readable.tolist())
    ]


def _best_digits(digits: np.ndarray, lines: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The best of ten digits at each column of each line: which, its correlation, and how much better than the next."""
    width = digits.shape[2]
    wanted = _normal(digits.reshape(10, -1).astype(np.float32))
    count = lines.shape[2] - width + 1
    which = np.zeros((len(lines), count), int)
    best, better = np.zeros((len(lines), count)), np.zeros((len(lines), count))
    for column in range(count):
        part = _normal(lines[:, :, column : column + width].reshape(len(lines), -1).astype(np.float32))
        alike = part @ wanted.T
        order = np.sort(alike, axis=1)
        which[:, column] = np.argmax(alike, axis=1)
        best[:, column], better[:, column] = order[:, -1], order[:, -1] - order[:, -2]
    return which, best, better


def _normal(rows: np.ndarray) -> np.ndarray:
    """Rows of mean 0 and length 1; 0 where all is alike."""
    rows = rows - rows.mean(axis=1, keepdims=True)
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    scaled: np.ndarray = rows / np.maximum(length, 1e-3)
    return scaled


def _peak(score: np.ndarray, home: int, within: Tuple[float, float]) -> Tuple[Optional[int], float]:
    """Where so far from home a digit begins, the nearest if there are several, and its distance [px]."""
    low, high = (home + round(limit) for limit in within)
    columns = range(max(low, 1), min(high, len(score) - 2) + 1)
    peaks = [k for k in columns if score[k] >= max(score[k - 1], score[k + 1], _SHOWS)]
    most = max((score[k] for k in peaks), default=0.0)
    peaks = [k for k in peaks if score[k] >= _AS_GOOD * most]
    column = min(peaks, key=lambda k: abs(k - home), default=None)
    return column, 0.0 if column is None else float(abs(column - home))


def _clusters(pixels: Sequence[Tuple[int, int]]) -> List[List[Tuple[int, int]]]:
    """Pixels that lie together."""
    left = set(pixels)
    found = []
    around = range(-_REACH, _REACH + 1)
    while left:
        queue = [left.pop()]
        cluster = []
        while queue:
            row, column = queue.pop()
            cluster.append((row, column))
            near = {(row + i, column + j) for i in around for j in around} & left
            left -= near
            queue += near
        found.append(cluster)
    return found
