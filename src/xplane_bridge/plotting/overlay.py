"""Pictures of a flight with their labels drawn into them, for the report."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any, Iterator, Mapping, Sequence

import cv2
import numpy as np

from xplane_bridge.bags.cameras import cameras, has_jpegs
from xplane_bridge.plotting.page import missing

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags
    from xplane_bridge.bags.cameras import Camera
    from xplane_bridge.labels.table import Labels

#: Pictures of a camera on the page, evenly spread over those with a runway.
PICTURES = 10
#: Width that pictures are drawn at, so that thin lines stand out [px].
_WIDTH = 960
_RUNWAY, _THRESHOLD, _CENTRE = (60, 220, 60), (40, 60, 255), (255, 220, 40)  # blue, green, red
_LEVEL, _DIPPED, _SUN, _AIRCRAFT = (200, 120, 255), (255, 80, 200), (0, 215, 255), (255, 160, 60)
_LEGEND = (
    "Green: outline of the pavement, with its corners; red: thresholds; light blue: centre line; pink: horizon, level "
    "and as the earth's curve dips it; yellow: sun; blue: other aircraft. Rings are three sigma wide. Projected, not "
    "seen: what stands before them is not known."
)
_SHIFT = 4  # sub-pixel bits of OpenCV's coordinates


def section(bags: Bags, labels: Labels, start: int) -> str:
    """Make the section: ten pictures of each camera with what is labelled in them.

    Args:
        bags: Open; pictures are streamed from them.
        labels: Of these pictures.
        start: [ns] zero of the times shown.
    """
    seen = cameras(bags)
    compressed = [camera for camera in seen if has_jpegs(bags, camera)]
    if not compressed:
        return missing("the bag has no compressed camera images")
    if not labels.frames:
        return missing("no picture has labels")
    parts = []
    for camera in compressed:
        figures = "".join(_figures(bags, camera, labels, start))
        if figures:
            head = f"<h3>Camera {html.escape(camera.name)}</h3>" if len(seen) > 1 else ""
            parts.append(f'{head}<div class="overlay">{figures}</div>')
    if not parts:
        return missing("the labels are of other pictures")
    return f"<p>{html.escape(_about(labels))}</p>{''.join(parts)}"


def _figures(bags: Bags, camera: Camera, labels: Labels, start: int) -> Iterator[str]:
    """Ten pictures of a camera with what is labelled in them."""
    chosen = _chosen(labels, camera)
    for _, message in bags.messages(camera.images) if chosen else ():
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if stamp not in chosen:
            continue
        picture = cv2.imdecode(np.frombuffer(message.data.tobytes(), dtype=np.uint8), cv2.IMREAD_COLOR)
        if picture is None:
            continue
        frame = labels.frames[camera.name, stamp]
        jpeg = cv2.imencode(".jpg", draw(picture, frame), [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
        yield (
            f'<figure><img alt="picture with labels" src="data:image/jpeg;base64,{_text(jpeg)}">'
            f"<figcaption>{(stamp - start) / 1e9:.1f} s &middot; {_caption(frame)}</figcaption></figure>"
        )


def draw(picture: np.ndarray, frame: Mapping[str, Any]) -> np.ndarray:
    """Draw the labels of a picture into a copy of it, at least `_WIDTH` wide; blue, green, red."""
    height, width = picture.shape[:2]
    # The labels' pixels are those of the size they were made for; a corner of a picture lies at -0.5.
    scale = max(1.0, _WIDTH / width)
    big = cv2.resize(picture, (round(width * scale), round(height * scale)), interpolation=cv2.INTER_CUBIC)
    pen = _Pen(big, (big.shape[1] / frame["width"], big.shape[0] / frame["height"]))
    for thing in frame["objects"]:
        if thing["kind"] == "horizon":
            for part in thing["level"]:
                pen.line(part, _LEVEL)
            for part in thing["dipped"]:
                pen.line(part, _DIPPED)
        elif thing["kind"] == "runway":
            _runway(pen, thing)
        else:
            left, top, right, bottom = thing["box"]
            colour = _SUN if thing["kind"] == "sun" else _AIRCRAFT
            pen.line([(left, top), (right, top), (right, bottom), (left, bottom)], colour, closed=True)
            pen.ring(thing["centre"], thing["sigma_px"], colour)
    return big


def _runway(pen: _Pen, thing: Mapping[str, Any]) -> None:
    points = thing["points"]
    pen.line(thing["polygon"], _RUNWAY, closed=True)
    for part in thing["centre_line"]:
        pen.line(part, _CENTRE)
    for end in ("near", "far"):
        sides = [points[f"threshold_{end}_{side}"] for side in ("left", "right")]
        if all(point["state"] != "behind" for point in sides):
            pen.line([(point["u"], point["v"]) for point in sides], _THRESHOLD)
    for name in ("TL", "TR", "BL", "BR"):
        point = points[name]
        if point["state"] == "visible":
            pen.ring((point["u"], point["v"]), point["sigma_px"], _RUNWAY)
            pen.text(name, (point["u"], point["v"]), _RUNWAY)


class _Pen:
    """Draws in pixels of the labels into a picture of another size."""

    def __init__(self, picture: np.ndarray, scale: tuple[float, float]) -> None:
        self._picture, self._scale = picture, np.array(scale)

    def line(self, pixels: Sequence[Sequence[float]], colour: tuple[int, int, int], closed: bool = False) -> None:
        """A line of one pixel through points."""
        if len(pixels) > 1:
            at = self._at(pixels)
            cv2.polylines(self._picture, [at], closed, colour, 1, cv2.LINE_AA, _SHIFT)

    def ring(self, pixel: Sequence[float], sigma: float, colour: tuple[int, int, int]) -> None:
        """A ring of three sigma, never smaller than can be seen."""
        radius = max(3.0 * sigma * float(self._scale[0]), 3.0)
        x, y = self._at([pixel])[0].tolist()
        cv2.circle(self._picture, (x, y), round(radius * (1 << _SHIFT)), colour, 1, cv2.LINE_AA, _SHIFT)

    def text(self, words: str, pixel: Sequence[float], colour: tuple[int, int, int]) -> None:
        """Words beside a point."""
        x, y = (self._at([pixel])[0] / (1 << _SHIFT)).round().astype(int).tolist()
        cv2.putText(self._picture, words, (x + 6, y - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)

    def _at(self, pixels: Sequence[Sequence[float]]) -> np.ndarray:
        scaled = (np.array(pixels, dtype=float) + 0.5) * self._scale - 0.5
        # Far outside, OpenCV's whole numbers would overflow.
        turned: np.ndarray = np.round(np.clip(scaled, -20000.0, 20000.0) * (1 << _SHIFT)).astype(np.int32)
        return turned


def _chosen(labels: Labels, camera: Camera) -> set[int]:
    """Stamps of the pictures to show: those with a runway, where there are any."""
    every, with_runway = [], []
    for (name, stamp), frame in labels.frames.items():
        if name == camera.name:
            every.append(stamp)
            if any(thing["kind"] == "runway" for thing in frame["objects"]):
                with_runway.append(stamp)
    stamps = sorted(with_runway or every)
    places = np.linspace(0, max(len(stamps) - 1, 0), min(PICTURES, len(stamps))).astype(int)
    return {stamps[k] for k in places}


def _about(labels: Labels) -> str:
    about = labels.about
    heights = ", ".join(about["heights"])
    return f"{about['airport']} of {about['apt']['file']}; heights of runways: {heights}. {_LEGEND}"


def _caption(frame: Mapping[str, Any]) -> str:
    parts = []
    for thing in frame["objects"]:
        words = thing["kind"] if thing["kind"] != "runway" else f"runway {thing['name']}"
        if thing["kind"] == "runway":
            words += f" at {thing['slant_distance_m']:.0f} m"
        coarse = " (coarse)" if thing["coarse"] else ""
        parts.append(html.escape(f"{words}: {thing['sigma_px']:.1f} px{coarse}"))
    return " &middot; ".join(parts)


def _text(data: np.ndarray) -> str:
    return base64.b64encode(data.tobytes()).decode("ascii")
