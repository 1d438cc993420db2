"""Flights as data sets for learning: images as files, one row of labels each.

Folder of one flight::

    labels.csv                    one row an image: file, split, stamp, camera, then the columns below
    images/train/000000.jpg       numbered in time order; JPEG bytes as recorded, raw images as PNG (lossless)
                                  (camera_000000.jpg, belly_000100.jpg: where there are several cameras)
    images/train/metadata.parquet the same rows for Hugging Face datasets, with `file_name` relative to this file
    images/validation/...         likewise

With labels (`label_images`) there are also `labels_json`, everything that is labelled in the picture; `labelled`,
whether it could be; `others_known`, whether that holds all other aircraft; and in the Parquet files `objects`: boxes
(left, top, width, height in pixels from the picture's corner), categories and sigmas.

The columns are those of `pictures`.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Optional

import numpy as np
import pandas as pd

from xplane_bridge.export import tables
from xplane_bridge.export.pictures import Options, Pictures, Piece, write_pictures
from xplane_bridge.export.tables import LABELS

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags
    from xplane_bridge.export.image_labels import ImageLabels


#: Types of the columns that may lack values: the same in every flight, whatever it lacks.
_NULLABLE = {**LABELS, "camera_width_px": "Int32", "camera_height_px": "Int32", "labels_json": "string"}


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
    counts: dict[str, Any] = pictures.counts._asdict()
    if labels is not None:
        counts.update(labels.counts(pictures.keys()))
    write_frames(folder / "labels.csv", pictures, labels, texts=True)
    for split in pictures.splits:
        _write_metadata(folder / "images" / split / "metadata.parquet", pictures, split, labels)
    return counts


def _labelled(pieces: Iterable[Piece], labels: Optional[ImageLabels], texts: bool = True) -> Iterator[Piece]:
    """Add to pieces what the labels say of each picture."""
    for piece in pieces:
        if labels is not None:
            piece.columns.update(labels.columns([picture.key for picture in piece.pictures], texts))
        yield piece


def write_frames(path: Path, pictures: Pictures, labels: Optional[ImageLabels], texts: bool = False) -> None:
    """Write the table of the pictures: file, split, stamp, what is known of each, and what its labels say.

    Args:
        path: The file.
        pictures: Those of a flight.
        labels: Of the pictures.
        texts: Whether it has the objects too, as JSON.
    """
    names = [*pictures.names, *(labels.columns([], texts) if labels is not None else ())]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "split", "stamp_ns", *names])
        for piece in _labelled(pictures.pieces(), labels, texts):
            columns = [piece.columns[name] for name in names]
            for picture in piece.pictures:
                values = (_text(column[picture.row]) for column in columns)
                writer.writerow([picture.file, picture.split, picture.stamp, *values])


def _write_metadata(path: Path, pictures: Pictures, split: str, labels: Optional[ImageLabels]) -> None:
    import pyarrow

    number = pyarrow.float64()
    lists = {
        "bbox": pyarrow.list_(number),
        "category": pyarrow.string(),
        "sigma_px": number,
        "coarse": pyarrow.bool_(),
    }
    kind = pyarrow.struct({name: pyarrow.list_(item) for name, item in lists.items()})

    def frame(piece: Piece, rows: slice = slice(None)) -> pd.DataFrame:
        part = piece.pictures[rows]
        data: dict[str, Any] = {"file_name": [Path(picture.file).name for picture in part]}
        data.update(split=split, stamp_ns=piece.stamp[rows])
        for name, values in piece.columns.items():
            chosen = values[rows]
            data[name] = pd.array(chosen, dtype=_NULLABLE[name]) if name in _NULLABLE else chosen
        if labels is not None:
            data["objects"] = [labels.boxes(picture.key) for picture in part]
        return pd.DataFrame(data)

    objects = {name: values for name, values in pictures.objects(split).items() if name not in _NULLABLE}
    first = next(_labelled(pictures.pieces(split), labels))
    schema = tables.schema_of(frame(first, slice(1)), objects)
    if labels is not None:
        schema = schema.set(schema.get_field_index("objects"), pyarrow.field("objects", kind))
    tables.write_frames(path, map(frame, _labelled(pictures.pieces(split), labels)), schema)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, (bool, np.bool_)):
        return "1" if value else "0"
    if isinstance(value, np.floating):
        return "" if np.isnan(value) else np.format_float_positional(value, unique=True, trim="-")
    return str(value)
