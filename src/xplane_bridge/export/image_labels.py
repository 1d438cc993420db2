"""Labels of pictures as exports need them: the file of `label_images`, its objects as boxes and outlines.

Exports count pixels from the picture's corner, as most libraries do: half a pixel more than the labels' own, whose
whole numbers are centres of pixels.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterable, Iterator, NamedTuple, Optional, Sequence

import numpy as np

from xplane_bridge.export.flight import ExportError
from xplane_bridge.labels.recording import labels_of

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags
    from xplane_bridge.labels.table import Key

#: Classes of objects, in the order of their numbers.
CATEGORIES = ("runway", "sun", "aircraft")
#: Points of a runway, in the order of an export's keypoints.
KEYPOINTS = (
    *("TL", "TR", "BR", "BL"),
    *("threshold_near_left", "threshold_near_right", "threshold_far_left", "threshold_far_right"),
    *("centre_near", "centre_far"),
)
_HALF = 0.5


class Thing(NamedTuple):
    """An object with a box; pixels from the picture's corner."""

    category: str
    box: tuple[float, float, float, float]  #: left, top, width, height
    outline: list[tuple[float, float]]
    label: dict[str, Any]  #: as `label_images` wrote it


class ImageLabels:
    """The labels of one flight.

    Args:
        bags: Open bags of the flight.
        path: A file of `label_images`.

    Raises:
        LabelError: It cannot be used, or is of another recording.
    """

    def __init__(self, bags: Bags, path: Path) -> None:
        self._path = path
        self.about, self._frames = labels_of(bags, path)

    def counts(self, keys: Iterable[Key], others: int = 0) -> dict[str, Any]:
        """Count for the manifest what is labelled of these pictures.

        Args:
            keys: Of the pictures.
            others: How many were left out because they have no labels.

        Raises:
            ExportError: Nothing is: they are labels of other pictures.
        """
        kinds: Counter[str] = Counter()
        seen = labelled = 0
        for key in keys:
            frame = self._frames.get(key)
            seen += 1
            if frame is not None:
                labelled += 1
                kinds.update(thing["kind"] for thing in frame["objects"])
        if seen + others and not labelled:
            msg = f"{self._path} labels none of these pictures: it is of {', '.join(self.about['bags'])}"
            raise ExportError(msg)
        return {"labelled": labelled, "objects": dict(sorted(kinds.items()))}

    def __contains__(self, key: object) -> bool:
        """Whether a picture could be labelled."""
        return key in self._frames

    def others_known(self, key: Key) -> bool:
        """Whether the labels of a picture hold all other aircraft that there were."""
        frame = self.frame(key)
        return bool(frame and frame.get("others_known"))

    def columns(self, keys: Sequence[Key], texts: bool) -> dict[str, np.ndarray]:
        """Give what the labels say of each picture, by column.

        Args:
            keys: Of the pictures.
            texts: Whether the objects are wanted too, as JSON.
        """
        columns = {"labels_json": np.array([self.text(key) for key in keys], dtype=object)} if texts else {}
        columns["labelled"] = np.array([key in self for key in keys], dtype=bool)
        columns["others_known"] = np.array([self.others_known(key) for key in keys], dtype=bool)
        return columns

    def frame(self, key: Key) -> Optional[dict[str, Any]]:
        """Give everything about a picture; None where it has no labels."""
        return self._frames.get(key)

    def text(self, key: Key) -> Optional[str]:
        """Give the objects of a picture as JSON."""
        frame = self._frames.get(key)
        return None if frame is None else json.dumps(frame["objects"], separators=(",", ":"))

    def things(self, key: Key) -> Iterator[Thing]:
        """Give the objects of a picture that have a box."""
        frame = self._frames.get(key)
        for label in frame["objects"] if frame else ():
            if label["kind"] not in CATEGORIES:
                continue
            left, top, right, bottom = (part + _HALF for part in label["box"])
            corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
            outline = [(u + _HALF, v + _HALF) for u, v in label["polygon"]] if "polygon" in label else corners
            yield Thing(label["kind"], (left, top, right - left, bottom - top), outline, label)

    def horizon(self, key: Key) -> Optional[dict[str, Any]]:
        """Give the horizon of a picture, its lines in pixels from the corner."""
        frame = self._frames.get(key)
        for label in frame["objects"] if frame else ():
            if label["kind"] == "horizon":
                lines = {name: [_moved(part) for part in label[name]] for name in ("level", "dipped")}
                return {**lines, "dip_deg": label["dip_deg"], "sigma_px": label["sigma_px"]}
        return None

    def boxes(self, key: Key) -> dict[str, list[Any]]:
        """Give boxes, categories and sigmas of a picture as lists side by side."""
        things = list(self.things(key))
        return {
            "bbox": [list(thing.box) for thing in things],
            "category": [thing.category for thing in things],
            "sigma_px": [thing.label["sigma_px"] for thing in things],
            "coarse": [thing.label["coarse"] for thing in things],
        }


def keypoints(thing: Thing) -> tuple[list[float], list[Optional[float]]]:
    """Give a runway's points as COCO has them (u, v, 2; zeros where not in the picture), and their sigmas [px]."""
    flat: list[float] = []
    sigmas: list[Optional[float]] = []
    for name in KEYPOINTS:
        point = thing.label["points"][name]
        seen = point["state"] == "visible"
        flat += [point["u"] + _HALF, point["v"] + _HALF, 2] if seen else [0, 0, 0]
        sigmas.append(point["sigma_px"] if seen else None)
    return flat, sigmas


def _moved(pixels: Sequence[Sequence[float]]) -> list[list[float]]:
    return [[u + _HALF, v + _HALF] for u, v in pixels]
