"""Pictures of a flight as files, and what is known of each: kept in a temporary file and taken some thousand at a time.

Columns: every field of FrameState with the state of the frame the image shows; the latched labels (`flight.labels`)
at that frame;
each quality bit, and the bits in words; where the display delay is from; CameraInfo's size and matrix.
"""

from __future__ import annotations

from array import array
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Container, Iterator, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from xplane_bridge.analysis.quality import BAD_QUALITY
from xplane_bridge.bags import BagError, Bags, Table
from xplane_bridge.bags.cameras import COMPRESSED, RAW, Camera, cameras, chosen_cameras
from xplane_bridge.bags.columns import ColumnFile
from xplane_bridge.bags.pictures import image_topic
from xplane_bridge.export.columns import named
from xplane_bridge.export.flight import labels as flight_labels
from xplane_bridge.export.flight import quality_bits
from xplane_bridge.export.tables import FlightTable

if TYPE_CHECKING:
    from xplane_bridge.labels.table import Key

#: Pictures that are taken at a time.
_PIECE_ROWS = 4096
_ENDINGS = (".jpg", ".png")
#: What the instant of a frame follows from.
_FLOWN = ("header.stamp", "state.header.stamp", "display_delay")
_SPLITS = ("train", "validation")
#: The reason of pictures that are left out because they could not be labelled.
NO_LABELS = "no labels"


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

    number: int  #: among all of the flight, from 0
    file: str  #: relative to the flight's folder
    split: str
    stamp: int  #: [ns]
    camera: str  #: its name
    columns: Mapping[str, np.ndarray]  #: what is known of it and of its neighbours
    row: int  #: its own, of these

    @property
    def key(self) -> Key:
        """By which its labels are found."""
        return self.camera, self.stamp

    def known(self, name: str) -> Any:
        """Give what is known of its frame by the name of the column; None where there is none."""
        return self.columns[name][self.row] if name in self.columns else None


class Piece(NamedTuple):
    """Some pictures of one camera, and what is known of each, by column."""

    pictures: list[Picture]
    stamp: np.ndarray  #: int64 [ns]
    columns: dict[str, np.ndarray]


class _Kept:
    """The pictures of one camera that were written.

    Args:
        camera: Whose.
        prefix: Of the files' names.
        labelled: Keys of the labels that each must be one of; None: labels do not matter.
    """

    def __init__(self, camera: Camera, prefix: str, labelled: Optional[Container[Key]]) -> None:
        self.camera = camera
        self.prefix = prefix
        self._labelled = labelled
        self.images = 0  #: in the bag
        self.left_out: Counter[str] = Counter()
        self.stamp, self.row = array("q"), array("q")
        self.trains, self.ending = array("b"), array("b")

    def __len__(self) -> int:
        """Give the number of pictures."""
        return len(self.stamp)

    def takes(self, stamp: int) -> bool:
        """Whether a picture is one to write, by its labels."""
        return self._labelled is None or (self.camera.name, stamp) in self._labelled

    def add(self, stamp: int, row: int, trains: bool, ending: str) -> str:
        """Adds a picture; gives its file's name."""
        self.stamp.append(stamp)
        self.row.append(row)
        self.trains.append(trains)
        self.ending.append(_ENDINGS.index(ending))
        return self.file(len(self) - 1)

    def of(self, split: str) -> np.ndarray:
        """Whether each picture is of this split."""
        chosen: np.ndarray = np.array(self.trains, bool) == (split == _SPLITS[0])
        return chosen

    def split(self, number: int) -> str:
        """Give the split of a picture."""
        return _SPLITS[0] if self.trains[number] else _SPLITS[1]

    def file(self, number: int) -> str:
        """Give a picture's file, relative to the flight's folder."""
        return f"images/{self.split(number)}/{self.prefix}{number:06d}{_ENDINGS[self.ending[number]]}"


class Pictures:
    """The pictures of a flight, written, and what is known of each frame.

    Args:
        folder: Of the flight.
        parts: The pictures of each camera, with the table of its frames.
    """

    def __init__(self, folder: Path, parts: Sequence[tuple[_Kept, FlightTable]]) -> None:
        self._folder = folder
        self._parts = parts

    @property
    def counts(self) -> Counts:
        """How many there are."""
        kept = [part for part, _ in self._parts]
        left_out = sum((part.left_out for part in kept), Counter())
        exported, train = sum(map(len, kept)), sum(sum(part.trains) for part in kept)
        images = sum(part.images for part in kept)
        return Counts(images, exported, train, exported - train, dict(sorted(left_out.items())))

    @property
    def names(self) -> list[str]:
        """The columns of what is known of each."""
        return self._parts[0][1].names

    @property
    def splits(self) -> list[str]:
        """Those that have a picture."""
        counts = self.counts
        return [split for split in _SPLITS if getattr(counts, split)]

    def keys(self) -> Iterator[Key]:
        """Give the keys of all labels."""
        for part, _ in self._parts:
            for stamp in part.stamp:
                yield part.camera.name, stamp

    def __iter__(self) -> Iterator[Picture]:
        """Give all, by camera and time."""
        return self.of(None)

    def of(self, split: Optional[str]) -> Iterator[Picture]:
        """Give those of a split, by camera and time; all when None."""
        for piece in self.pieces(split):
            yield from piece.pictures

    def pieces(self, split: Optional[str] = None) -> Iterator[Piece]:
        """Give the same some thousand at a time."""
        first = 0
        for part, table in self._parts:
            stamps, rows = np.array(part.stamp, np.int64), np.array(part.row, np.int64)
            chosen = np.arange(len(part)) if split is None else np.flatnonzero(part.of(split))
            for at in range(0, len(chosen), _PIECE_ROWS):
                numbers = chosen[at : at + _PIECE_ROWS]
                own = rows[numbers]
                low = int(own.min())
                columns = {name: values[own - low] for name, values in table.piece(slice(low, own.max() + 1)).items()}
                pictures = [
                    Picture(first + k, part.file(k), part.split(k), part.stamp[k], part.camera.name, columns, row)
                    for row, k in enumerate(numbers.tolist())
                ]
                yield Piece(pictures, stamps[numbers], columns)
            first += len(part)

    def objects(self, split: str) -> dict[str, np.ndarray]:
        """Give the whole columns of texts of a split: their types follow from all of their values."""
        found: dict[str, list[np.ndarray]] = {}
        for part, table in self._parts:
            own = np.array(part.row, np.int64)[part.of(split)]
            for name, values in table.objects().items():
                found.setdefault(name, []).append(values[own])
        return {name: np.concatenate(values) for name, values in found.items()}

    def size(self, picture: Picture) -> tuple[int, int]:
        """Give a picture's width and height [px]: CameraInfo's, else those of the file."""
        width, height = (float(picture.known(f"camera_{name}_px")) for name in ("width", "height"))
        if width == width and height == height:
            return int(width), int(height)
        import cv2

        image = cv2.imread(str(self._folder / picture.file), cv2.IMREAD_UNCHANGED)
        return (0, 0) if image is None else (int(image.shape[1]), int(image.shape[0]))


def write_pictures(
    bags: Bags, folder: Path, options: Options, train_flight: bool, labelled: Optional[Container[Key]] = None
) -> Pictures:
    """Write the images of one flight below ``images/SPLIT``.

    Args:
        bags: Open bags of the flight.
        folder: Created; must not hold a data set yet.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.
        labelled: Keys of the labels that a picture must be one of; any picture is written when omitted.

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
    flown = np.concatenate([_flown(bags.read(camera.frames, _FLOWN)) for camera in cameras(bags)])
    cut = _split_instant(flown, options)
    del flown
    folder.mkdir(parents=True)
    parts = []
    for camera in chosen:
        kept = _Kept(camera, f"{camera.name}_" if len(chosen) > 1 else "", labelled)
        parts.append((kept, _write_camera(bags, kept, folder, options, train_flight, cut)))
    return Pictures(folder, parts)


def _split_instant(flown: np.ndarray, options: Options) -> int:
    if not len(flown):
        return 0
    first, last = int(flown.min()), int(flown.max())
    return first + round((last - first) * options.train_share) + (1 if options.train_share >= 1 else 0)


def _write_camera(bags: Bags, kept: _Kept, folder: Path, options: Options, train_flight: bool, cut: int) -> FlightTable:
    """Write the images of one camera; gives the table of its frames.

    Args:
        bags: Open bags of the flight.
        kept: Filled with the images.
        folder: Of the flight; exists.
        options: What to keep and how to split.
        train_flight: With ``split_by="flight"``: whether this flight trains.
        cut: [ns] with ``split_by="time"``: images of frames before it train.
    """
    camera = kept.camera
    store = ColumnFile(folder.parent)
    table, constants = bags.read(camera.frames, store=store), bags.constants(camera.frames)
    bad = {name: int(constants[name]) for name in BAD_QUALITY if name in constants}
    # Not by when they are shown: each camera has a delay of its own.
    quality, rows, flown = table["quality"], _Rows(table.stamp), _flown(table)
    for stamp, ending, content in _images(bags, camera.images):
        kept.images += 1
        row = rows.of(stamp)
        if row is None:
            kept.left_out["no frame_state of the same stamp"] += 1
            continue
        reasons = [name for name, bit in bad.items() if int(quality[row]) & bit]
        if reasons and not options.keep_bad:
            kept.left_out.update(reasons)
            continue
        if not kept.takes(stamp):
            kept.left_out[NO_LABELS] += 1
            continue
        trains = train_flight if options.split_by == "flight" else int(flown[row]) < cut
        path = folder / kept.add(stamp, row, trains, ending)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return _known(bags, camera, table, constants, store)


class _Rows:
    """Rows of a table by their stamp [ns]; the last of those alike."""

    def __init__(self, stamp: np.ndarray) -> None:
        self._order = np.argsort(stamp, kind="stable")
        self._sorted = stamp[self._order]

    def of(self, stamp: int) -> Optional[int]:
        """Give the row of a stamp; None where there is none."""
        row = int(self.of_each(np.array([stamp]))[0])
        return row if row >= 0 else None

    def of_each(self, stamps: np.ndarray) -> np.ndarray:
        """Give the row of each stamp; -1 where there is none."""
        if not len(self._sorted):
            return np.full(len(stamps), -1)
        at = np.maximum(np.searchsorted(self._sorted, stamps, side="right") - 1, 0)
        rows: np.ndarray = np.where(self._sorted[at] == stamps, self._order[at], -1)
        return rows


def _known(bags: Bags, camera: Camera, table: Table, constants: Mapping[str, Any], store: ColumnFile) -> FlightTable:
    """Give what is known of each frame, by column; shape (frames,)."""
    known = FlightTable(len(table), store)
    known.add({"camera": np.full(len(table), camera.name, dtype=object)})
    units = bags.units(camera.frames)
    for path in table.columns:
        if not path.startswith(("header.", "state.header.")):
            known.add(named({path: table[path]}, units))
    known.add(flight_labels(bags, _flown(table)))
    known.add(_quality(table["quality"], constants))
    for column, values in _camera(bags, camera.info, table.stamp, store):
        known.add({column: values})
    return known


def _flown(table: Table) -> np.ndarray:
    """Give the instant [ns] of each frame that is shown: that of its state; without one, its display less the delay."""
    delay = np.nan_to_num(table["display_delay"].astype(np.float64))
    state = table["state.header.stamp"]
    instants: np.ndarray = np.where(state > 0, state, table.stamp - np.rint(1e9 * delay).astype(np.int64))
    return instants


def _quality(quality: np.ndarray, constants: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Give each bit as a column, all of them in words, and what the display delay was."""
    bits = quality_bits(constants)
    columns = {f"quality_{word.replace(' ', '_')}": (quality & bit) != 0 for word, bit in bits.items()}
    values, which = np.unique(quality, return_inverse=True)
    words = [", ".join(word for word, bit in bits.items() if int(value) & bit) for value in values]
    columns["quality_words"] = np.array(words, dtype=object)[which]
    if "quality_delay_assumed" in columns:
        assumed = columns["quality_delay_assumed"].astype(int)
        columns["display_delay_source"] = np.array(["set", "assumed"], dtype=object)[assumed]
    return columns


def _camera(bags: Bags, topic: str, stamp: np.ndarray, store: ColumnFile) -> Iterator[tuple[str, np.ndarray]]:
    """Yield CameraInfo's size and matrix K (row by row), by column; NaN where none has a frame's stamp."""
    size = {name: f"camera_{name}_px" for name in ("width", "height")}
    matrix = {k: f"camera_matrix_{k}" for k in range(9)}
    if topic not in bags.topics or not bags.topics[topic].count:
        for column in (*size.values(), *matrix.values()):
            yield column, np.full(len(stamp), np.nan)
        return
    infos = bags.read(topic, ["header.stamp", "width", "height", "K"], store)
    rows = _Rows(infos.stamp).of_each(stamp)
    for name, column in size.items():
        yield column, np.where(rows >= 0, infos[name][rows], np.nan)
    for k, column in matrix.items():
        yield column, np.where(rows >= 0, infos["K"][rows, k], np.nan)


def _images(bags: Bags, topic: str) -> Iterator[tuple[int, str, bytes]]:
    """Yield stamp [ns], file ending and file content of every image, in time order."""
    compressed = bags.topics[topic].msgtype == COMPRESSED
    for _, message in bags.messages(topic):
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if compressed:
            yield stamp, _ENDINGS["png" in message.format.lower()], message.data.tobytes()
        else:
            yield stamp, _ENDINGS[1], encode_png(message)


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
