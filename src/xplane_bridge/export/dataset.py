"""Flights as data sets for learning: images as files, one row of labels each.

Folder of one flight::

    labels.csv                    one row an image: file, split, stamp, camera, then the columns below
    images/train/000000.jpg       numbered in time order; JPEG bytes as recorded, raw images as PNG (lossless)
                                  (camera_000000.jpg, belly_000100.jpg: where there are several cameras)
    images/train/metadata.parquet the same rows for Hugging Face datasets, with `file_name` relative to this file
    images/validation/...         likewise

With labels (`label_images`) there are also `labels_json`, everything that is labelled in the picture, and in the
Parquet files `objects`: boxes (left, top, width, height in pixels from the picture's corner), categories and sigmas.

Columns: every field of FrameState with the state of the frame the image shows; the latched labels (`flight.labels`);
each quality bit, and the bits in words; where the display delay is from; CameraInfo's size and matrix.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterator, Mapping, NamedTuple, Optional, Sequence

import numpy as np
import pandas as pd

from xplane_bridge.analysis.quality import BAD_QUALITY
from xplane_bridge.bags import BagError, Bags, Table
from xplane_bridge.bags.cameras import COMPRESSED, RAW, Camera, cameras, chosen_cameras
from xplane_bridge.bags.pictures import image_topic
from xplane_bridge.export import tables
from xplane_bridge.export.columns import named
from xplane_bridge.export.flight import labels as flight_labels
from xplane_bridge.export.flight import quality_bits

if TYPE_CHECKING:
    from xplane_bridge.export.image_labels import ImageLabels
    from xplane_bridge.labels.table import Key


class Options(NamedTuple):
    """What decides the content of a data set; goes into its manifest."""

    keep_bad: bool = False  #: keep frames of bad quality too
    train_share: float = 0.8  #: of the time of each flight, or of the flights
    split_by: str = "time"  #: time: the first part of each flight trains; flight: whole flights
    seed: int = 0  #: of the choice of flights
    cameras: tuple[str, ...] = ()  #: names of those to export; all when empty


class Counts(NamedTuple):
    """How many images of a flight went where."""

    images: int  #: in the bag
    exported: int
    train: int
    validation: int
    left_out: dict[str, int]  #: by reason; an image can have several


class Picture(NamedTuple):
    """A picture that was written."""

    file: str  #: relative to the flight's folder
    split: str
    row: int  #: of what is known of the frames
    stamp: int  #: [ns]
    size: tuple[int, int]  #: width, height [px]
    camera: str  #: its name

    @property
    def key(self) -> Key:
        """By which its labels are found."""
        return self.camera, self.stamp


class Pictures(NamedTuple):
    """The pictures of a flight, written, and what is known of each frame."""

    kept: list[Picture]
    stamp: np.ndarray  #: int64 [ns] of the frames
    columns: dict[str, np.ndarray]  #: by name, one value per frame
    counts: Counts


def export_images(
    bags: Bags, folder: Path, options: Options, train_flight: bool, labels: Optional[ImageLabels] = None
) -> dict[str, Any]:
    """Write the image folder of one flight; gives counts for the manifest.

    Args:
        bags: Open bags of the flight.
        folder: Created; must not hold a data set yet.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.
        labels: Of its pictures.

    Raises:
        BagError: No images or no frame states in the bag, or an image encoding that cannot be written.
        ExportError: The labels are of other pictures.
    """
    pictures = write_pictures(bags, folder, options, train_flight)
    columns = dict(pictures.columns)
    counts = pictures.counts._asdict()
    if labels is not None:
        counts.update(labels.counts([picture.key for picture in pictures.kept]))
        keys = zip(columns["camera"], pictures.stamp.tolist())
        columns["labels_json"] = np.array([labels.text(key) for key in keys], dtype=object)
    write_frames(folder / "labels.csv", pictures, columns)
    for split in sorted({picture.split for picture in pictures.kept}):
        part = [picture for picture in pictures.kept if picture.split == split]
        _write_metadata(folder / "images" / split / "metadata.parquet", part, pictures.stamp, columns, labels)
    return counts


def write_pictures(bags: Bags, folder: Path, options: Options, train_flight: bool) -> Pictures:
    """Write the images of one flight below ``images/SPLIT``.

    Args:
        bags: Open bags of the flight.
        folder: Created; must not hold a data set yet.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.

    Raises:
        BagError: No such camera, no images or no frame states in the bag, or an image encoding that cannot be written.
    """
    image_topic(bags, (COMPRESSED, RAW))  # says what to record where there is none at all
    chosen = chosen_cameras(bags, options.cameras)
    for camera in chosen:
        if not camera.images:
            topic = f"{camera.info.rsplit('/', 1)[0]}/image_raw/compressed"
            names = ", ".join(map(str, bags.paths))
            others = ", or leave this camera out with --camera" if len(chosen) > 1 else ""
            msg = f"{names}: no images of camera {camera.name}; record {topic} (launch/record.launch does){others}"
            raise BagError(msg)
    # One instant for all cameras, also for those that are not exported: no frame is in both splits.
    stamps = np.concatenate([bags.read(camera.frames, ["header.stamp"]).stamp for camera in cameras(bags)])
    cut = _split_stamp(stamps, options)
    folder.mkdir(parents=True)
    parts = []
    for camera in chosen:
        prefix = f"{camera.name}_" if len(chosen) > 1 else ""
        parts.append(_write_camera(bags, camera, folder, options, train_flight, cut, prefix))
    return _joined(parts)


def _joined(parts: list[Pictures]) -> Pictures:
    """Put the pictures of several cameras behind each other."""
    kept: list[Picture] = []
    left_out: Counter[str] = Counter()
    first = 0
    for part in parts:
        kept += [picture._replace(row=first + picture.row) for picture in part.kept]
        left_out.update(part.counts.left_out)
        first += len(part.stamp)
    columns = parts[0].columns
    if len(parts) > 1:
        columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in columns}
    counts = Counts(
        sum(part.counts.images for part in parts),
        sum(part.counts.exported for part in parts),
        sum(part.counts.train for part in parts),
        sum(part.counts.validation for part in parts),
        dict(sorted(left_out.items())),
    )
    return Pictures(kept, np.concatenate([part.stamp for part in parts]), columns, counts)


def _write_camera(
    bags: Bags, camera: Camera, folder: Path, options: Options, train_flight: bool, cut: int, prefix: str
) -> Pictures:
    """Write the images of one camera.

    Args:
        bags: Open bags of the flight.
        camera: Whose.
        folder: Of the flight; exists.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.
        cut: [ns] with ``split_by="time"``: images before it train.
        prefix: Of the files' names.
    """
    table, constants = bags.read(camera.frames), bags.constants(camera.frames)
    bad = {name: int(constants[name]) for name in BAD_QUALITY if name in constants}
    stamp = table.stamp
    row_of = {int(s): k for k, s in enumerate(stamp)}
    left_out: Counter[str] = Counter()
    kept: list[Picture] = []
    images = 0
    for image_stamp, suffix, content in _images(bags, camera.images):
        images += 1
        row = row_of.get(image_stamp)
        if row is None:
            left_out["no frame_state of the same stamp"] += 1
            continue
        reasons = [name for name, bit in bad.items() if int(table["quality"][row]) & bit]
        if reasons and not options.keep_bad:
            left_out.update(reasons)
            continue
        trains = train_flight if options.split_by == "flight" else image_stamp < cut
        split = "train" if trains else "validation"
        name = f"images/{split}/{prefix}{len(kept):06d}{suffix}"
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
        kept.append(Picture(name, split, row, image_stamp, (0, 0), camera.name))
    columns = _columns(bags, camera, table, constants)
    kept = [picture._replace(size=_size(folder / picture.file, columns, picture.row)) for picture in kept]
    splits = Counter(picture.split for picture in kept)
    counts = Counts(images, len(kept), splits["train"], splits["validation"], dict(sorted(left_out.items())))
    return Pictures(kept, stamp, columns, counts)


def _size(path: Path, columns: Mapping[str, np.ndarray], row: int) -> tuple[int, int]:
    """Give a picture's width and height: CameraInfo's, else those of the file."""
    width, height = (columns[f"camera_{name}_px"][row] for name in ("width", "height"))
    if width is not None and height is not None:
        return int(width), int(height)
    import cv2

    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return (0, 0) if picture is None else (int(picture.shape[1]), int(picture.shape[0]))


def _columns(bags: Bags, camera: Camera, table: Table, constants: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Give what is known of each frame, by column; shape (frames,)."""
    columns = {"camera": np.full(len(table), camera.name, dtype=object)}
    named_columns = named(table.columns, bags.units(camera.frames))
    columns.update({k: v for k, v in named_columns.items() if not k.startswith("state_header")})
    columns.update(flight_labels(bags, table.stamp))
    columns.update(_quality(table["quality"], constants))
    columns.update(_camera(bags, camera.info, table.stamp))
    return columns


def _quality(quality: np.ndarray, constants: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Give each bit as a column, all of them in words, and what the display delay was."""
    bits = quality_bits(constants)
    columns = {f"quality_{word.replace(' ', '_')}": (quality & bit) != 0 for word, bit in bits.items()}
    words = [", ".join(word for word, bit in bits.items() if int(value) & bit) for value in quality]
    columns["quality_words"] = np.array(words, dtype=object)
    if "quality_delay_assumed" in columns:
        assumed = columns["quality_delay_assumed"]
        columns["display_delay_source"] = np.where(assumed, "assumed", "set").astype(object)
    return columns


def _camera(bags: Bags, topic: str, stamp: np.ndarray) -> dict[str, np.ndarray]:
    """Give CameraInfo's size and matrix K (row by row) of each frame; None and NaN where none has the frame's stamp."""
    size = {name: np.full(len(stamp), None, dtype=object) for name in ("width", "height")}
    matrix = np.full((len(stamp), 9), np.nan)
    if topic in bags.topics and bags.topics[topic].count:
        infos = bags.read(topic, ["header.stamp", "width", "height", "K"])
        row_of = {int(s): k for k, s in enumerate(infos.stamp)}
        for k, row in enumerate(row_of.get(int(s)) for s in stamp):
            if row is not None:
                matrix[k] = infos["K"][row]
                for name, values in size.items():
                    values[k] = int(infos[name][row])
    out = {f"camera_{name}_px": values for name, values in size.items()}
    out.update({f"camera_matrix_{k}": matrix[:, k] for k in range(9)})
    return out


#: Rows of metadata that are written at a time.
_PIECE_ROWS = 8192
#: Types of the columns that may lack values: the same in every flight, whatever it lacks.
_NULLABLE = {
    "mode": "UInt8",
    "failsafe": "boolean",
    "failures": "string",
    "excitation": "string",
    "camera_width_px": "Int32",
    "camera_height_px": "Int32",
    "labels_json": "string",
}


def write_frames(path: Path, pictures: Pictures, columns: Mapping[str, np.ndarray]) -> None:
    """Write the table of the pictures: file, split, stamp, then the columns."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "split", "stamp_ns", *columns])
        for picture in pictures.kept:
            values = (_text(column[picture.row]) for column in columns.values())
            writer.writerow([picture.file, picture.split, int(pictures.stamp[picture.row]), *values])


def _write_metadata(
    path: Path,
    kept: list[Picture],
    stamp: np.ndarray,
    columns: Mapping[str, np.ndarray],
    labels: Optional[ImageLabels],
) -> None:
    import pyarrow

    number = pyarrow.float64()
    lists = {
        "bbox": pyarrow.list_(number),
        "category": pyarrow.string(),
        "sigma_px": number,
        "coarse": pyarrow.bool_(),
    }
    kind = pyarrow.struct({name: pyarrow.list_(item) for name, item in lists.items()})

    def frame(part: Sequence[Picture]) -> pd.DataFrame:
        rows = np.array([picture.row for picture in part], dtype=int)
        data: dict[str, Any] = {"file_name": [Path(picture.file).name for picture in part]}
        data.update(split=kept[0].split, stamp_ns=stamp[rows])
        for name, values in columns.items():
            chosen = values[rows]
            data[name] = pd.array(chosen, dtype=_NULLABLE[name]) if name in _NULLABLE else chosen
        if labels is not None:
            data["objects"] = [labels.boxes(picture.key) for picture in part]
        return pd.DataFrame(data)

    rows = np.array([picture.row for picture in kept])
    objects = {name: v[rows] for name, v in columns.items() if v.dtype.hasobject and name not in _NULLABLE}
    schema = tables.schema_of(frame(kept[:1]), objects)
    if labels is not None:
        schema = schema.set(schema.get_field_index("objects"), pyarrow.field("objects", kind))
    pieces = (frame(kept[first : first + _PIECE_ROWS]) for first in range(0, len(kept), _PIECE_ROWS))
    tables.write_frames(path, pieces, schema)


def _split_stamp(stamp: np.ndarray, options: Options) -> int:
    if not len(stamp):
        return 0
    first, last = int(stamp.min()), int(stamp.max())
    return first + round((last - first) * options.train_share) + (1 if options.train_share >= 1 else 0)


def _images(bags: Bags, topic: str) -> Iterator[tuple[int, str, bytes]]:
    """Yield stamp [ns], file ending and file content of every image, in time order."""
    compressed = bags.topics[topic].msgtype == COMPRESSED
    for _, message in bags.messages(topic):
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if compressed:
            ending = ".png" if "png" in message.format.lower() else ".jpg"
            yield stamp, ending, message.data.tobytes()
        else:
            yield stamp, ".png", encode_png(message)


def encode_png(message: Any) -> bytes:
    """Give a raw ``sensor_msgs/Image`` as PNG.

    Raises:
        BagError: An encoding other than bgr8, rgb8, bgra8, rgba8, mono8.
    """
    import cv2

    channels = {"bgr8": 3, "rgb8": 3, "bgra8": 4, "rgba8": 4, "mono8": 1}.get(message.encoding)
    if channels is None:
        msg = f"image encoding {message.encoding!r} cannot be exported; expected bgr8, rgb8, bgra8, rgba8 or mono8"
        raise BagError(msg)
    rows = message.data.reshape(message.height, message.step)[:, : message.width * channels]
    pixels = rows.reshape(message.height, message.width, channels)
    if message.encoding in ("rgb8", "rgba8"):
        pixels = pixels[:, :, [2, 1, 0, 3][:channels]]
    return bytes(cv2.imencode(".png", pixels)[1])


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, (bool, np.bool_)):
        return "1" if value else "0"
    if isinstance(value, np.floating):
        return "" if np.isnan(value) else np.format_float_positional(value, unique=True, trim="-")
    return str(value)
