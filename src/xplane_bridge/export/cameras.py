"""What each camera of a flight was, in one row: size, matrix K, place in the aircraft, delay of its display."""

from __future__ import annotations

import math
from itertools import chain
from typing import TYPE_CHECKING, Any, Iterable, Iterator, NamedTuple, Sequence

import numpy as np

from xplane_bridge.bags.cameras import cameras
from xplane_bridge.export.flight import full_names

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags

_PLACE = tuple(f"body_to_camera.translation.{axis}" for axis in "xyz")
_TURN = tuple(f"body_to_camera.rotation.{axis}" for axis in "xyzw")

#: Units of what an export has of each camera.
UNITS = {
    "width_px": "px",
    "height_px": "px",
    "camera_matrix": "px",
    "body_to_camera_translation_m": "m",
    "body_to_camera_spread_m": "m",
    "body_to_camera_spread_deg": "deg",
    "display_delay_s": "s",
}


class CameraRow(NamedTuple):
    """A camera in a flight.

    K and pose are each those of one message, the nearest to the median: no mixture of several views. What was not
    recorded is NaN, or 0 of the size.
    """

    name: str
    frames: int  #: messages of FrameState
    width_px: int
    height_px: int
    camera_matrix: list[list[float]]  #: K of CameraInfo
    body_to_camera_translation_m: list[float]  #: as in FrameState; of the measured poses where there are some
    body_to_camera_rotation_xyzw: list[float]
    body_to_camera_spread_m: float  #: the farthest of these poses from this one: 0 of a camera that stands still
    body_to_camera_spread_deg: float
    display_delay_s: float  #: median; of pictures with a delay that was set, where there are some
    display_delay_source: str  #: set, assumed, or both

    def plain(self) -> dict[str, Any]:
        """Give it as JSON knows it; NaN is null."""
        return {name: _plain(value) for name, value in self._asdict().items()}


def camera_rows(bags: Bags, names: Sequence[str] = (), topics: Sequence[str] = ()) -> Iterator[CameraRow]:
    """Read what the cameras were, the bridge's own first, each when it is asked for.

    Args:
        bags: Open bags of one flight.
        names: Of the cameras; all when empty.
        topics: Only cameras whose FrameState is among these; all when empty.
    """
    chosen = full_names(bags, topics)
    for camera in cameras(bags):
        if (names and camera.name not in names) or (chosen and camera.frames not in chosen):
            continue
        width, height, matrix = _intrinsics(bags, camera.info)
        table = bags.read(camera.frames, ["quality", "display_delay", "camera_pose_source", *_PLACE, *_TURN])
        constants = bags.constants(camera.frames)
        measured = table["camera_pose_source"] == constants.get("POSE_MEASURED", -1)
        place, turn = (np.stack([table[path] for path in paths], axis=1) for paths in (_PLACE, _TURN))
        pose = _pose(place, turn, measured)
        assumed = (table["quality"] & int(constants.get("QUALITY_DELAY_ASSUMED", 0))) != 0
        delays = table["display_delay"][assumed if assumed.all() else ~assumed]
        source = "assumed" if assumed.all() else "both" if assumed.any() else "set"
        yield CameraRow(camera.name, len(table), width, height, matrix, *pose, float(np.median(delays)), source)


def _intrinsics(bags: Bags, topic: str) -> tuple[int, int, list[list[float]]]:
    if topic not in bags.topics or not bags.topics[topic].count:
        return 0, 0, [[math.nan] * 3] * 3
    infos = bags.read(topic, ["width", "height", "K"])
    matrices = infos["K"]
    row = _nearest_to_median([infos["width"], infos["height"], *matrices.T])
    return int(infos["width"][row]), int(infos["height"][row]), matrices[row].reshape(3, 3).tolist()


def _pose(place: np.ndarray, turn: np.ndarray, measured: np.ndarray) -> tuple[list[float], list[float], float, float]:
    known = np.isfinite(place).all(axis=1) & np.isfinite(turn).all(axis=1) & (np.linalg.norm(turn, axis=1) > 0.0)
    if (known & measured).any():
        known &= measured
    if not known.any():
        return [math.nan] * 3, [math.nan] * 4, math.nan, math.nan
    place, turn = place[known], turn[known]
    unit = turn / np.linalg.norm(turn, axis=1)[:, None]
    products = (a * b for a in unit.T for b in unit.T)  # the same of a quaternion and its negative
    row = _nearest_to_median(chain(place.T, products))
    farthest_m = float(np.linalg.norm(place - place[row], axis=1).max())
    chords = np.minimum(np.linalg.norm(unit - unit[row], axis=1), np.linalg.norm(unit + unit[row], axis=1))
    return place[row].tolist(), turn[row].tolist(), farthest_m, math.degrees(4.0 * math.asin(chords.max() / 2.0))


def _nearest_to_median(columns: Iterable[np.ndarray]) -> int:
    """Give the row whose distances from the columns' medians sum to the least; one column needs to be in memory."""
    distance: Any = 0.0
    for column in columns:
        distance = distance + np.abs(column - np.median(column))
    return int(np.argmin(distance))


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def one_column_each(rows: Sequence[CameraRow]) -> dict[str, np.ndarray]:
    """Give arrays by the names of `CameraRow`; the first axis counts cameras."""
    return {name: np.array([getattr(row, name) for row in rows]) for name in CameraRow._fields}
