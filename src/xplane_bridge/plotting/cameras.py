"""What a report shows of each camera: a strip of pictures with their state, and how well they were paired."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any, Iterator, Mapping, Optional, Sequence

import cv2
import numpy as np

from xplane_bridge.analysis.quality import BAD_QUALITY, QUALITY_WORDS, Joined, bit_shares, joined, pairing
from xplane_bridge.bags.cameras import COMPRESSED, has_jpegs
from xplane_bridge.bags.pictures import pictures_near
from xplane_bridge.plotting.page import missing, number, rows_table

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags
    from xplane_bridge.bags.flight import CameraFrames, Flight

#: Images on a strip, evenly spread over the flight.
STRIP_IMAGES = 12
_THUMBNAIL_WIDTH = 320


def strips(bags: Bags, flight: Flight) -> str:
    """Make a strip of pictures for each camera; of several, all strips show the same frames where there are enough.

    Args:
        bags: Open; the pictures are read from them.
        flight: Read from `bags`.
    """
    if not any(info.count and info.msgtype == COMPRESSED for info in flight.topics.values()):
        return missing("the bag has no compressed camera images")
    seen = flight.cameras
    if not seen:
        return missing("the bag has no camera/frame_state")
    if len(seen) == 1:
        return _strip(bags, flight, seen[0], _spread(np.arange(len(seen[0].table))))
    join = _join(seen)
    together = join.of_all >= STRIP_IMAGES
    rows = join.rows if together else [np.arange(len(camera.table)) for camera in seen]
    parts = [f"<p>{_share(join)}{' The strips show the same frames.' if together else ''}</p>"]
    for camera, chosen in zip(seen, rows):
        parts.append(
            f"<h3>Camera {html.escape(camera.camera.name)}</h3>{_strip(bags, flight, camera, _spread(chosen))}"
        )
    return "".join(parts)


def quality(flight: Flight) -> str:
    """Say how well the pictures of each camera were paired with states, and how those of several join."""
    seen = flight.cameras
    if len(seen) < 2:
        return "".join(f"<h3>Images</h3>{_pairing(camera)}" for camera in seen)
    parts = [f"<h3>Images of camera {html.escape(camera.camera.name)}</h3>{_pairing(camera)}" for camera in seen]
    join = _join(seen)
    rows = [
        (html.escape(camera.camera.name), str(frames), f"{_percent(join.of_all, frames)} %")
        for camera, frames in zip(seen, join.frames)
    ]
    parts.append(
        f"<h3>Frames of several cameras</h3><p>{_share(join)} A picture without a state, or of a paused simulator, "
        "is of no frame that is known.</p>"
        + rows_table(("camera", "frames with its picture", "of these, with one of every camera"), rows, (1, 2))
    )
    return "".join(parts)


def _join(seen: Sequence[CameraFrames]) -> Joined:
    return joined([camera.table.columns for camera in seen], seen[0].constants)


def _share(join: Joined) -> str:
    return (
        f"{_percent(join.of_all, join.of_any)} % of the frames with a picture have one of every camera: "
        f"{join.of_all} of {join.of_any}, {join.perfect} of them without a remark on any."
    )


def _percent(part: int, whole: int) -> str:
    return f"{part / whole * 100:.1f}" if whole else "&ndash;"


def _spread(rows: np.ndarray) -> np.ndarray:
    """So many rows as a strip has images, evenly spread."""
    chosen: np.ndarray = rows[np.unique(np.linspace(0, len(rows) - 1, min(STRIP_IMAGES, len(rows))).astype(int))]
    return chosen


def _strip(bags: Bags, flight: Flight, camera: CameraFrames, rows: np.ndarray) -> str:
    if not has_jpegs(bags, camera.camera):
        return missing("no compressed images of this camera were recorded")
    figures = "".join(_figures(bags, flight, camera, rows))
    return f'<div class="strip">{figures}</div>' if figures else missing("no image could be decoded")


def _figures(bags: Bags, flight: Flight, camera: CameraFrames, rows: np.ndarray) -> Iterator[str]:
    stamps = camera.table.stamp
    for stamp, picture in pictures_near(bags, camera.camera, camera.table, rows.tolist()):
        row = int(np.searchsorted(stamps, stamp))
        known = row if row < len(stamps) and stamps[row] == stamp else None
        caption = _caption(camera, known, f"{(stamp - flight.start) / 1e9:.1f}")
        yield (
            f'<figure><img alt="cockpit view" src="data:image/jpeg;base64,{_thumbnail(picture)}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )


def _thumbnail(picture: np.ndarray) -> str:
    height = max(1, round(picture.shape[0] * _THUMBNAIL_WIDTH / picture.shape[1]))
    small = cv2.resize(picture, (_THUMBNAIL_WIDTH, height), interpolation=cv2.INTER_AREA)
    return base64.b64encode(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()).decode("ascii")


def _caption(camera: CameraFrames, row: Optional[int], at: str) -> str:
    if row is None:
        return f"{at} s &middot; no state"
    frames = camera.table
    names = ("roll_deg", "pitch_deg", "heading_true_deg", "altitude_msl", "indicated_airspeed")
    value = {name: frames[f"state.{name}"][row] for name in names}
    error = float(frames["sim_time_error"][row])
    return (
        f"{at} s &middot; roll {value['roll_deg']:.1f}&deg; &middot; pitch {value['pitch_deg']:.1f}&deg; &middot; "
        f"true heading {value['heading_true_deg']:.1f}&deg;<br>{value['altitude_msl']:.0f} m MSL &middot; "
        f"IAS {value['indicated_airspeed']:.1f} m/s"
        + (f" &middot; time error {error * 1e3:.1f} ms" if np.isfinite(error) else "")
        + _remarks(int(frames["quality"][row]), camera.constants)
    )


def _remarks(bits: int, constants: Mapping[str, Any]) -> str:
    """Name the quality bits that are set; those that make an image unfit in red."""
    names = [name for name, bit in constants.items() if name.startswith("QUALITY_") and bits & int(bit)]
    return "".join(
        f' &middot; <span class="{"bad" if name in BAD_QUALITY else "note"}">'
        f"{name[len('QUALITY_') :].lower().replace('_', ' ')}</span>"
        for name in names
    )


def _pairing(camera: CameraFrames) -> str:
    t, constants = camera.table, camera.constants
    p = pairing(t.columns, constants)
    shares = bit_shares(t["quality"], constants, "QUALITY_")
    rows = [
        (html.escape(name.lower().replace("_", " ")), QUALITY_WORDS.get(name, ""), f"{share * 100:.1f} %")
        for name, share in shares.items()
        if share
    ]
    text = (
        f"<p>{p.images} images, {p.with_state * 100:.1f} % with a state, {p.perfect * 100:.1f} % "
        f"without any remark; time error {number(p.error_p50 * 1e3, 3)} ms (median), "
        f"{number(p.error_p95 * 1e3, 3)} ms (95 %), {number(p.error_max * 1e3, 3)} ms (worst); "
        f"{p.dropped} pictures not published, {p.frozen} frozen, {p.unpaired} without a state, "
        "counted from the first image recorded.</p>"
    )
    return text + (rows_table(("remark", "that is", "images"), rows, (2,)) if rows else "")
