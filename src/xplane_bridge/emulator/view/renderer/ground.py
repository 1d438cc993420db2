"""Which place on the ground each pixel sees, and what a repeating texture shows there."""

from __future__ import annotations

import math
from typing import Iterator, Optional, Tuple

import cv2
import numpy as np

from xplane_bridge.emulator.view.renderer.camera import Camera

#: Rows and columns of a picture.
Area = Tuple[slice, slice]
#: A box for each of these rises of the horizon [px], up to so many.
_RISE_PX, _MOST_BOXES = 40.0, 8


class Texture:
    """A square texture that repeats over the ground, its row 0 at the north edge.

    Args:
        picture: (n, n, 3), n a power of two.
        texel_m: Side of a texel.

    Raises:
        ValueError: n is no power of two.
    """

    def __init__(self, picture: np.ndarray, texel_m: float) -> None:
        self._count = picture.shape[0]
        if self._count & (self._count - 1):
            raise ValueError(f"a texture of {self._count} texels: expected a power of two")
        self.texel_m = texel_m
        self.span_m = texel_m * self._count
        # Four channels are looked up faster than three; the edge once more for what lies across it.
        self._texels = cv2.copyMakeBorder(cv2.cvtColor(picture, cv2.COLOR_BGR2BGRA), 0, 1, 0, 1, cv2.BORDER_WRAP)

    def at(self, east_m: np.ndarray, north_m: np.ndarray, origin: np.ndarray) -> np.ndarray:
        """What lies at places relative to an origin.

        OpenCV's own repeating is three times slower: it leaves its fast path at each texel outside the texture.

        Args:
            east_m: (h, w)
            north_m: (h, w)
            origin: East and north [m].

        Returns:
            (h, w, 4): blue, green, red, and one without a meaning.
        """
        per_m = 1.0 / self.texel_m
        column = east_m * per_m
        column += float(origin[0] % self.span_m) * per_m
        row = north_m * -per_m
        row -= float(origin[1] % self.span_m) * per_m
        whole, fraction = cv2.convertMaps(column, row, cv2.CV_16SC2)
        whole &= self._count - 1
        seen: np.ndarray = cv2.remap(self._texels, whole, fraction, cv2.INTER_LINEAR)
        return seen


class GroundView:
    """The ground as a camera sees it; the earth is flat.

    Args:
        camera: That sees it.
        size: Width and height of the picture [px].
        least: A pixel whose ray falls less than this over its depth sees no ground any more.
    """

    def __init__(self, camera: Camera, size: Tuple[int, int], least: float) -> None:
        self.least = least  #: what a pixel that sees ground has at least in `falling`
        self._eye = camera.eye
        width, height = size
        u, v = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        to_east, to_north, down = camera.rays[0], camera.rays[1], -camera.rays[2]
        at_left = (down[1] * v + down[2]).astype(np.float32)
        seen = np.nonzero(at_left + max(float(down[0]) * (width - 1), 0.0) > 0.0)[0]
        below = slice(int(seen[0]), int(seen[-1]) + 1) if seen.size else slice(height, height)
        self._top = below.start  # first row that looks below the horizon, of those in the arrays
        v = v[below, np.newaxis]
        #: Height over depth of what a pixel sees, (rows, width).
        self.falling = np.float32(down[0]) * u + at_left[below, np.newaxis]
        depth = np.float32(self._eye[2]) / np.maximum(self.falling, np.float32(least))
        rise = abs(down[0] / down[1]) * width if down[1] else math.inf  # of the horizon, from edge to edge [px]
        boxes = int(min(max(rise / _RISE_PX, 1.0), _MOST_BOXES))
        self._columns = [width * i // boxes for i in range(boxes + 1)]
        #: East and north of the eye [m].
        self.places = tuple(
            (np.float32(ray[0]) * u + (ray[1] * v + ray[2]).astype(np.float32)) * depth for ray in (to_east, to_north)
        )

    def boxes(self, lowest: float, steepest: float) -> Iterator[Area]:
        """Boxes of the arrays around all pixels between two depths, as height over depth.

        Side by side where the horizon lies askew: one box around all of it would be mostly outside it.
        """
        if self.falling.size == 0:
            return
        first, last = self.falling[0], self.falling[-1]
        for left, right in zip(self._columns[:-1], self._columns[1:]):
            # It varies linearly: what the edges have, all between them has.
            rows = _span(self.falling[:, left], self.falling[:, right - 1], lowest, steepest)
            columns = _span(first[left:right], last[left:right], lowest, steepest)
            if rows and columns:
                yield rows, slice(columns.start + left, columns.stop + left)

    def picture(self, area: Area) -> Area:
        """The same box in the picture."""
        return slice(area[0].start + self._top, area[0].stop + self._top), area[1]

    def sample(self, texture: Texture, area: Area) -> np.ndarray:
        """What a box of the arrays sees of a texture, (h, w, 4)."""
        east, north = self.places
        return texture.at(east[area], north[area], self._eye)


def _span(first: np.ndarray, last: np.ndarray, lowest: float, highest: float) -> Optional[slice]:
    """From the first to the last place where a range between two edges meets another range."""
    met = np.nonzero((np.maximum(first, last) >= lowest) & (np.minimum(first, last) <= highest))[0]
    return slice(int(met[0]), int(met[-1]) + 1) if met.size else None
