"""The formats of an export: what each is called, which options it has, and who writes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, NamedTuple, Optional

from xplane_bridge.export.dataset import export_images
from xplane_bridge.export.pictures import Options

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags
    from xplane_bridge.export.image_labels import ImageLabels


class Job(NamedTuple):
    """One flight to export. Plain values: it travels to other processes and machines."""

    name: str  #: folder or file stem in the export
    bags: tuple[str, ...]
    output: str
    format: str  #: a key of `FORMATS`
    rate: Optional[float]
    topics: tuple[str, ...]
    dataset: Options
    train_flight: bool
    labels: str = ""  #: file of the pictures' labels
    labels_sha256: str = ""

    @property
    def parameters(self) -> dict[str, Any]:
        """What the user asked for that decides the content of this format."""
        options = FORMATS[self.format].options
        out: dict[str, Any] = {}
        if "rate" in options:
            out["rate"] = self.rate
        if "topics" in options:
            out["topics"] = list(self.topics)
        if "dataset" in options:
            out.update(self.dataset._asdict(), cameras=list(self.dataset.cameras))
            if self.dataset.split_by == "flight":
                out["train_flight"] = self.train_flight
            else:
                del out["seed"]  # nothing is drawn
        if self.labels_sha256:
            out["labels_sha256"] = self.labels_sha256
        return out


class Format(NamedTuple):
    """One way to write a flight."""

    ending: str  #: of the flight's file or folder
    options: tuple[str, ...]  #: of a `Job`, which decide the content: rate, topics, dataset, labels
    write: Callable[[Bags, Path, Job], dict[str, Any]]  #: gives counts for the manifest
    frames: bool = False  #: whether it has the pictures, or what is known of each
    annotated: bool = False  #: whether labels of pictures are what it is for


def _csv(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import tables

    table = tables.flight_table(bags, job.rate, job.topics, path.parent)
    tables.write_csv(table, path)
    return table.counts


def _parquet(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import tables

    table = tables.flight_table(bags, job.rate, job.topics, path.parent)
    tables.write_parquet(table, path)
    return table.counts


def _tum(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import trajectories

    stamp, position, orientation = trajectories.trajectory(bags, job.rate)
    trajectories.write_tum(path, stamp, position, orientation)
    return {"poses": len(stamp)}


def _euroc(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import trajectories

    stamp, position, orientation = trajectories.trajectory(bags, job.rate)
    trajectories.write_euroc(path, stamp, position, orientation)
    return {"poses": len(stamp)}


def _imagefolder(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    return export_images(bags, path, job.dataset, job.train_flight, _labels(bags, job))


def _labels(bags: Bags, job: Job) -> Optional[ImageLabels]:
    from xplane_bridge.export.image_labels import ImageLabels

    return ImageLabels(bags, Path(job.labels)) if job.labels else None


def _coco(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import annotated

    return annotated.export_annotated(bags, path, job.dataset, job.train_flight, _labels(bags, job), annotated.coco)


def _yolo(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import annotated

    labels = _labels(bags, job)
    # To a trainer, a picture without a file of labels shows nothing.
    return annotated.export_annotated(
        bags, path, job.dataset, job.train_flight, labels, annotated.yolo, only_labelled=True
    )


def _lard(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import annotated

    return annotated.export_annotated(bags, path, job.dataset, job.train_flight, _labels(bags, job), annotated.lard)


def _npz(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import arrays
    from xplane_bridge.export.cameras import camera_rows

    rows = camera_rows(bags, topics=job.topics)
    return arrays.write_npz(arrays.topic_arrays(bags, job.topics, path.parent), path, rows)


def _mat(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import arrays
    from xplane_bridge.export.cameras import camera_rows

    rows = camera_rows(bags, topics=job.topics)
    return arrays.write_mat(arrays.topic_arrays(bags, job.topics, path.parent), path, rows)


def _mcap(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import recordings

    return recordings.write_mcap(bags, path, job.topics)._asdict()


def _ros2(bags: Bags, path: Path, job: Job) -> dict[str, Any]:
    from xplane_bridge.export import recordings

    return recordings.write_ros2(bags, path, job.topics)._asdict()


#: Name to format, in the order in which they are listed to users.
FORMATS = {
    "csv": Format(".csv", ("rate", "topics"), _csv),
    "parquet": Format(".parquet", ("rate", "topics"), _parquet),
    "npz": Format(".npz", ("topics",), _npz, frames=True),
    "mat": Format(".mat", ("topics",), _mat, frames=True),
    "tum": Format(".tum", ("rate",), _tum),
    "euroc": Format(".euroc.csv", ("rate",), _euroc),
    "imagefolder": Format("", ("dataset", "labels"), _imagefolder, frames=True),
    "coco": Format(".coco", ("dataset", "labels"), _coco, frames=True, annotated=True),
    "yolo": Format(".yolo", ("dataset", "labels"), _yolo, frames=True, annotated=True),
    "lard": Format(".lard", ("dataset", "labels"), _lard, frames=True, annotated=True),
    "mcap": Format(".mcap", ("topics",), _mcap, frames=True),
    "ros2": Format(".ros2", ("topics",), _ros2, frames=True),
}
#: Earlier names of formats.
ALIASES = {"images": "imagefolder"}
