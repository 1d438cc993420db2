"""Flights as data sets for learning: images as files, one row of labels each.

Folder of one flight::

    labels.csv                    one row an image: file, split, stamp, then the columns below
    images/train/000000.jpg       numbered in time order; JPEG bytes as recorded, raw images as PNG (lossless)
    images/train/metadata.parquet the same rows for Hugging Face datasets, with `file_name` relative to this file
    images/validation/...         likewise

Columns: every field of FrameState with the state of the frame the image shows; the latched labels (`flight.labels`);
each quality bit, and the bits in words; where the display delay is from; CameraInfo's size and matrix.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path
from typing import Any, Iterator, Mapping, NamedTuple

import numpy as np
import pandas as pd

from xplane_bridge.analysis.quality import BAD_QUALITY
from xplane_bridge.bags import BagError, Bags, Table
from xplane_bridge.bags.pictures import COMPRESSED, RAW, image_topic
from xplane_bridge.export.columns import named
from xplane_bridge.export.flight import FRAME_STATE, labels, quality_bits, topic_of


class Options(NamedTuple):
    """What decides the content of a data set; goes into its manifest."""

    keep_bad: bool = False  #: keep frames of bad quality too
    train_share: float = 0.8  #: of the time of each flight, or of the flights
    split_by: str = "time"  #: time: the first part of each flight trains; flight: whole flights
    seed: int = 0  #: of the choice of flights


class Counts(NamedTuple):
    """How many images of a flight went where."""

    images: int  #: in the bag
    exported: int
    train: int
    validation: int
    left_out: dict[str, int]  #: by reason; an image can have several


def export_images(bags: Bags, folder: Path, options: Options, train_flight: bool) -> Counts:
    """Write the images and labels of one flight.

    Args:
        bags: Open bags of the flight.
        folder: Created; must not hold a data set yet.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.

    Raises:
        BagError: No images or no frame states in the bag, or an image encoding that cannot be written.
    """
    topic = image_topic(bags, (COMPRESSED, RAW))
    frame_topic = topic_of(bags, FRAME_STATE)
    table, constants = bags.read(frame_topic), bags.constants(frame_topic)
    bad = {name: int(constants[name]) for name in BAD_QUALITY if name in constants}
    stamp = table.stamp
    row_of = {int(s): k for k, s in enumerate(stamp)}
    cut = _split_stamp(stamp, options)

    folder.mkdir(parents=True)
    left_out: Counter[str] = Counter()
    kept: list[tuple[str, str, int]] = []  # file, split, row
    images = 0
    for image_stamp, suffix, content in _images(bags, topic):
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
        name = f"images/{split}/{len(kept):06d}{suffix}"
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
        kept.append((name, split, row))
    columns = _columns(bags, frame_topic, table, constants)
    _write_labels(folder, kept, stamp, columns)
    _write_metadata(folder, kept, stamp, columns)
    splits = Counter(split for _, split, _ in kept)
    return Counts(images, len(kept), splits["train"], splits["validation"], dict(sorted(left_out.items())))


def _columns(bags: Bags, topic: str, table: Table, constants: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Give what is known of each frame, by column; shape (frames,)."""
    columns = named(table.columns, bags.units(topic))
    columns = {k: v for k, v in columns.items() if not k.startswith("state_header")}
    columns.update(labels(bags, table.stamp))
    columns.update(_quality(table["quality"], constants))
    columns.update(_camera(bags, f"{topic.rsplit('/', 1)[0]}/camera_info", table.stamp))
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


#: Types of the columns that may lack values: the same in every flight, whatever it lacks.
_NULLABLE = {
    "mode": "UInt8",
    "failsafe": "boolean",
    "failures": "string",
    "excitation": "string",
    "camera_width_px": "Int32",
    "camera_height_px": "Int32",
}


def _write_labels(
    folder: Path, kept: list[tuple[str, str, int]], stamp: np.ndarray, columns: Mapping[str, np.ndarray]
) -> None:
    with (folder / "labels.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "split", "stamp_ns", *columns])
        for name, split, row in kept:
            writer.writerow([name, split, int(stamp[row]), *(_text(values[row]) for values in columns.values())])


def _write_metadata(
    folder: Path, kept: list[tuple[str, str, int]], stamp: np.ndarray, columns: Mapping[str, np.ndarray]
) -> None:
    for split in sorted({split for _, split, _ in kept}):
        rows = np.array([row for _, of, row in kept if of == split])
        data: dict[str, Any] = {"file_name": [Path(name).name for name, of, _ in kept if of == split]}
        data.update(split=split, stamp_ns=stamp[rows])
        for name, values in columns.items():
            chosen = values[rows]
            data[name] = pd.array(chosen, dtype=_NULLABLE[name]) if name in _NULLABLE else chosen
        pd.DataFrame(data).to_parquet(folder / "images" / split / "metadata.parquet", index=False)


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
