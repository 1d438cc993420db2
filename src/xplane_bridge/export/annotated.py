"""Pictures with labels as other programs read them: COCO, YOLO, and the columns of LARD.

Folder of one flight: ``images/SPLIT/...`` as in an image folder, ``frames.csv`` with what is known of each picture, and

* COCO: ``annotations/SPLIT.json``;
* YOLO: ``labels/SPLIT/*.txt``, ``data.yaml``, and ``sigmas.csv`` for what those cannot say; only the pictures that
  could be labelled;
* LARD: ``SPLIT.csv``.

Without labels there are the pictures, and annotations of nothing.
"""

from __future__ import annotations

import contextlib
import csv
import json
import math
import shutil
import tempfile
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterator, Optional, Sequence, TextIO

import numpy as np

from xplane_bridge import __version__
from xplane_bridge.export.dataset import write_frames
from xplane_bridge.export.image_labels import CATEGORIES, KEYPOINTS, ImageLabels, Thing, keypoints
from xplane_bridge.export.pictures import NO_LABELS, Options, Picture, Pictures, write_pictures
from xplane_bridge.export.yolo_yaml import DATA_YAML, data_yaml
from xplane_bridge.labels.camera import FRD_OF_FLU, rotation_of
from xplane_bridge.units import FOOT_M, moved

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags

#: Lines between keypoints, counted from 1: the outline, both thresholds, the centre line.
_SKELETON = [[1, 2], [2, 3], [3, 4], [4, 1], [5, 6], [7, 8], [9, 10]]
_SPLITS = ("train", "validation")
#: Columns of LARD (deel-ai/LARD, version 2), then ours.
_LARD = (
    *("uuid", "image", "height", "width", "type", "original_dataset", "scenario", "airport", "runway"),
    *("time_to_landing", "weather", "night", "time", "lat_cam", "lon_cam", "alt_cam", "yaw", "pitch", "roll"),
    *("slant_distance", "along_track_distance", "height_above_runway", "lateral_path_angle", "vertical_path_angle"),
    *("watermark_height", "runway_in_cone"),
    *("x_TR", "y_TR", "x_TL", "y_TL", "x_BL", "y_BL", "x_BR", "y_BR"),
    *("sigma_TR_px", "sigma_TL_px", "sigma_BL_px", "sigma_BR_px", "height_source", "stamp_ns", "camera"),
)
_MILE_M = 1852.0

_Write = Callable[[Path, Pictures, "Optional[ImageLabels]"], None]


def export_annotated(
    bags: Bags,
    folder: Path,
    options: Options,
    train_flight: bool,
    labels: Optional[ImageLabels],
    write: _Write,
    only_labelled: bool = False,
) -> dict[str, Any]:
    """Write pictures, what is known of them, and their annotations; gives counts for the manifest.

    Args:
        bags: Open bags of the flight.
        folder: Created; must not hold a data set yet.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.
        labels: Of its pictures.
        write: Writes the annotations.
        only_labelled: Leave out pictures that have no labels: where a picture without is one of nothing.

    Raises:
        BagError: No images or no frame states in the bag, or an image encoding that cannot be written.
        ExportError: The labels are of other pictures.
    """
    pictures = write_pictures(bags, folder, options, train_flight, labels if only_labelled else None)
    left_out = pictures.counts.left_out.get(NO_LABELS, 0)
    counts = labels.counts(pictures.keys(), left_out) if labels else {"labelled": 0}
    write_frames(folder / "frames.csv", pictures, labels)
    write(folder, pictures, labels)
    return {**pictures.counts._asdict(), **counts}


def coco(folder: Path, pictures: Pictures, labels: Optional[ImageLabels]) -> None:
    """Write COCO's JSON, one file a split."""
    categories: list[dict[str, Any]] = [{"id": k, "name": name} for k, name in enumerate(CATEGORIES, 1)]
    categories[0].update(keypoints=list(KEYPOINTS), skeleton=_SKELETON)
    about = {"description": f"xplane_bridge {__version__}", "version": __version__, "labels": _about(labels)}
    head = {"info": about, "licenses": [], "categories": categories}
    (folder / "annotations").mkdir()
    number = 0
    for split in _SPLITS:
        path = folder / "annotations" / f"{split}.json"
        # Annotations come behind all images: an hour of them is not held in memory.
        spool = tempfile.TemporaryFile("w+", encoding="utf-8", dir=folder)  # noqa: SIM115, closed below
        with spool as notes, path.open("w", encoding="utf-8") as file:
            file.write(json.dumps(head, allow_nan=False)[:-1] + ', "images": [')
            images, annotations = _JsonList(file), _JsonList(notes)
            for picture in pictures.of(split):
                image_id = picture.number + 1
                images.add({"id": image_id, **_image(picture, pictures, labels)})
                for thing in labels.things(picture.key) if labels else ():
                    number += 1
                    annotations.add({"id": number, "image_id": image_id, **_annotation(thing)})
            file.write('], "annotations": [')
            notes.seek(0)
            shutil.copyfileobj(notes, file)
            file.write("]}\n")


class _JsonList:
    """The elements of a list, written as they come."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._begun = False

    def add(self, item: Any) -> None:
        """Writes an element."""
        self._file.write((", " if self._begun else "") + json.dumps(item, allow_nan=False))
        self._begun = True


def _image(picture: Picture, pictures: Pictures, labels: Optional[ImageLabels]) -> dict[str, Any]:
    def value(name: str) -> Any:
        return _plain(picture.known(name))

    def vector(prefix: str, axes: Sequence[object]) -> list[Any]:
        return [value(f"{prefix}_{axis}") for axis in axes]

    width, height = pictures.size(picture)
    return {
        "file_name": Path(picture.file).name,
        "width": width,
        "height": height,
        "camera": picture.camera,
        "stamp_ns": picture.stamp,
        "camera_matrix": vector("camera_matrix", range(9)),
        "picture": [value(f"picture_{name}_px") for name in ("x", "y", "width", "height")],
        "body_to_camera": {
            "translation_m": vector("body_to_camera_translation", "xyz"),
            "rotation_xyzw": vector("body_to_camera_rotation", "xyzw"),
            "uncertainty_m": value("camera_pose_uncertainty_m"),
            "uncertainty_deg": value("camera_pose_uncertainty_deg"),
        },
        "display_delay_s": value("display_delay_s"),
        "display_delay_source": value("display_delay_source"),
        "quality": value("quality_words"),
        "labelled": bool(labels and picture.key in labels),
        "others_known": bool(labels and labels.others_known(picture.key)),
        "horizon": labels.horizon(picture.key) if labels else None,
    }


def _annotation(thing: Thing) -> dict[str, Any]:
    out: dict[str, Any] = {
        "category_id": CATEGORIES.index(thing.category) + 1,
        "bbox": _rounded(thing.box),
        "segmentation": [_rounded([part for corner in thing.outline for part in corner])],
        "area": round(_area(thing.outline), 3),
        "iscrowd": 0,
        "sigma_px": thing.label["sigma_px"],
        "coarse": thing.label["coarse"],
    }
    if thing.category == "runway":
        flat, sigmas = keypoints(thing)
        seen = sum(flag > 0 for flag in flat[2::3])
        out.update(keypoints=_rounded(flat), num_keypoints=seen, keypoint_sigmas_px=sigmas)
    for name in ("name", "opposite", "height", "centre"):
        if name in thing.label:
            out[name] = thing.label[name]
    return out


def yolo(folder: Path, pictures: Pictures, labels: Optional[ImageLabels]) -> None:
    """Write YOLO's text: a line an object, its class and its outline as shares of the picture; boxes follow from it."""
    with _csv(folder / "sigmas.csv", ("file", "line", "class", "sigma_px", "coarse"), ",") as write:
        for picture in pictures:
            if labels is None:
                continue
            path = folder / "labels" / picture.split / f"{Path(picture.file).stem}.txt"
            path.parent.mkdir(parents=True, exist_ok=True)
            size, lines = pictures.size(picture), []
            for number, thing in enumerate(labels.things(picture.key)):
                shares = [min(max(part / side, 0.0), 1.0) for at in thing.outline for part, side in zip(at, size)]
                lines.append(" ".join([str(CATEGORIES.index(thing.category)), *(f"{share:.6f}" for share in shares)]))
                label = thing.label
                write([picture.file, number, thing.category, label["sigma_px"], int(label["coarse"])])
            _write_text(path, "".join(line + "\n" for line in lines))
    head = f"xplane_bridge {__version__}; labels: {json.dumps(_about(labels))}"
    folders = {split: [f"images/{split}"] for split in pictures.splits}
    _write_text(folder / DATA_YAML, data_yaml(head, folders))


def lard(folder: Path, pictures: Pictures, labels: Optional[ImageLabels]) -> None:
    """Write LARD's table, one file a split: a row a runway, distances in nautical miles, the height in feet."""
    for split in _SPLITS:
        with _csv(folder / f"{split}.csv", _LARD, ";") as write:
            if labels is None:
                continue
            for picture in pictures.of(split):
                for thing in labels.things(picture.key):
                    if "points" in thing.label:
                        write(_lard_row(picture, thing, pictures.size(picture), labels))


def _lard_row(picture: Picture, thing: Thing, size: tuple[int, int], labels: ImageLabels) -> list[Any]:
    label = thing.label
    heading, pitch, roll = _attitude(picture)
    latitude, longitude, altitude = _place(picture)
    values: dict[str, Any] = {
        "uuid": uuid.uuid5(uuid.NAMESPACE_OID, f"{labels.about['recording']} {picture.camera} {picture.stamp}"),
        "image": picture.file,
        "width": size[0],
        "height": size[1],
        "type": "xplane_bridge",
        "original_dataset": "xplane_bridge",
        "airport": labels.about["airport"],
        "runway": label["name"],
        "lat_cam": latitude,
        "lon_cam": longitude,
        "alt_cam": altitude,
        "runway_in_cone": "UNKNOWN",
        "slant_distance": label["slant_distance_m"] / _MILE_M,
        "along_track_distance": label["along_track_distance_m"] / _MILE_M,
        "height_above_runway": label["height_above_threshold_m"] / FOOT_M,
        "lateral_path_angle": label["lateral_path_angle_deg"],
        "vertical_path_angle": label["vertical_path_angle_deg"],
        "yaw": heading,
        "pitch": 90.0 + pitch,  # theirs: 90 is level
        "roll": roll,
        "height_source": label["height"]["source"],
        "camera": picture.camera,
        "stamp_ns": picture.stamp,
    }
    for corner in ("TR", "TL", "BL", "BR"):
        point = label["points"][corner]
        for axis, name in (("x", "u"), ("y", "v")):
            values[f"{axis}_{corner}"] = "" if point[name] is None else round(point[name] + 0.5, 3)
        values[f"sigma_{corner}_px"] = point["sigma_px"]
    return [values.get(name, "") for name in _LARD]


def _place(picture: Picture) -> tuple[float, float, float]:
    """Latitude, longitude [deg] and altitude [m MSL] of the camera."""
    names = ("latitude_deg", "longitude_deg", "altitude_msl_m")
    latitude, longitude, altitude = (float(picture.known(f"state_{name}")) for name in names)
    lever = [float(picture.known(f"body_to_camera_translation_{axis}")) for axis in "xyz"]
    north, east, down = (_rotation(picture, "state_orientation") @ FRD_OF_FLU @ lever).tolist()
    return (*moved(latitude, longitude, north, east), altitude - down)


def _rotation(picture: Picture, prefix: str) -> np.ndarray:
    return rotation_of(np.array([float(picture.known(f"{prefix}_{axis}")) for axis in "xyzw"]))


def _attitude(picture: Picture) -> tuple[float, float, float]:
    """Heading, pitch, roll [deg] of the camera against the local level."""
    body = _rotation(picture, "state_orientation") @ FRD_OF_FLU
    optical = body @ _rotation(picture, "body_to_camera_rotation")
    right, down, forward = optical[:, 0], optical[:, 1], optical[:, 2]
    heading = math.degrees(math.atan2(forward[1], forward[0])) % 360.0
    pitch = math.degrees(math.asin(float(np.clip(-forward[2], -1.0, 1.0))))
    return heading, pitch, math.degrees(math.atan2(float(right[2]), float(down[2])))


def _about(labels: Optional[ImageLabels]) -> Any:
    return "none" if labels is None else {key: value for key, value in labels.about.items() if key != "labels"}


def _area(outline: Sequence[tuple[float, float]]) -> float:
    around = [*outline[1:], outline[0]]
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, around))) / 2.0


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(float(value), 3) for value in values]


def _plain(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def _csv(path: Path, head: Sequence[str], separator: str) -> Iterator[Callable[[Sequence[Any]], object]]:
    """Begin a table; gives what writes a row."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, delimiter=separator, lineterminator="\n")
        writer.writerow(head)
        yield writer.writerow
