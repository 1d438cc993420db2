"""Flights as data sets for learning: images as files, one row of labels each.

Folder of one flight::

    labels.csv        one row an image: file, split, stamp, quality, the paired state, then the labels of `labels`
    images/000000.jpg numbered in time order; JPEG bytes as recorded, raw images as PNG (lossless)
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path
from typing import Any, Iterator, NamedTuple

import numpy as np

from xplane_bridge.analysis.quality import BAD_QUALITY
from xplane_bridge.bags import BagError, Bags
from xplane_bridge.bags.pictures import COMPRESSED, RAW, image_topic
from xplane_bridge.export.columns import named
from xplane_bridge.export.flight import FRAME_STATE, labels, topic_of


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
    table, units = bags.read(frame_topic), bags.units(frame_topic)
    constants = bags.constants(frame_topic)
    bad = {name: int(constants[name]) for name in BAD_QUALITY if name in constants}
    stamp = table.stamp
    row_of = {int(s): k for k, s in enumerate(stamp)}
    columns = named(table.columns, units)
    columns = {k: v for k, v in columns.items() if not k.startswith("state_header")}
    columns.update(labels(bags, stamp))
    cut = _split_stamp(stamp, options)

    (folder / "images").mkdir(parents=True)
    left_out: Counter[str] = Counter()
    splits: Counter[str] = Counter()
    images = 0
    with (folder / "labels.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "split", "stamp_ns", *columns])
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
            name = f"images/{sum(splits.values()):06d}{suffix}"
            (folder / name).write_bytes(content)
            splits[split] += 1
            writer.writerow([name, split, image_stamp, *(_text(values[row]) for values in columns.values())])
    total = sum(splits.values())
    return Counts(images, total, splits["train"], splits["validation"], dict(sorted(left_out.items())))


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
