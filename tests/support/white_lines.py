"""White lines along a runway, measured in pictures of the emulator: how far from where the labels say they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from xplane_bridge.bags.cameras import FIRST, chosen_cameras
from xplane_bridge.bags.pictures import grey_pictures
from xplane_bridge.labels.apt import read_airport
from xplane_bridge.labels.flight import Flight, Options
from xplane_bridge.resources import config_file

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags
    from xplane_bridge.labels.camera import Camera
    from xplane_bridge.labels.things import Labeller

#: The emulator's: middle of the lines beside its runway from the centre line, and their width [m].
LINE_M, WIDTH_M = 21.5, 0.9
LENGTH_M = 1800.0
#: How far lines may be off their labels.
MEDIAN_PX, P95_PX = 0.5, 1.5
#: Of the emulator's twin: how high it stands, less what y_agl says of it parked [m].
STANDING_M = 1.131 - 0.076
#: Looked at so far to each side [px], in steps of a quarter.
_REACH = 6.0
_STEP = 0.25
#: Least contrast of a line [grey levels], least and largest width [px].
_CONTRAST, _THINNEST, _WIDEST = 35.0, 0.7, 7.0
#: Least distance from the picture's edges, its strip included [px].
_MARGIN = 24.0


class Lines(NamedTuple):
    """What was measured."""

    error: np.ndarray  #: [px] across the line, a value for each place looked at
    pictures: int  #: in which there was a line to measure
    unsure: int  #: left out: they may be of the neighbouring frame, as their own flags say

    @property
    def median(self) -> float:
        """How far lines are off their labels [px]."""
        return float(np.median(np.abs(self.error)))

    @property
    def p95(self) -> float:
        """The same of all but the worst twentieth [px]."""
        return float(np.percentile(np.abs(self.error), 95))


def measure(grey: np.ndarray, camera: Camera, labeller: Labeller) -> np.ndarray:
    """Measure the lines of one picture; gives an error [px] for each place where one is clear."""
    along = np.linspace(20.0, LENGTH_M - 20.0, 89)
    errors = []
    for side in (-LINE_M, LINE_M):
        (middle, ahead), (inner, _), (outer, _) = (
            labeller.line_on(camera, 0, side + offset, along) for offset in (0.0, -0.5 * WIDTH_M, 0.5 * WIDTH_M)
        )
        direction = np.gradient(middle, axis=0)
        for k in np.nonzero(ahead)[0]:
            if not (ahead[max(k - 1, 0)] and ahead[min(k + 1, len(along) - 1)] and _inside(middle[k], grey.shape)):
                continue
            normal = np.array((-direction[k][1], direction[k][0]))
            normal = normal / np.linalg.norm(normal)
            width = abs(float((outer[k] - inner[k]) @ normal))
            if _THINNEST <= width <= _WIDEST:
                error = _offset(grey, middle[k], normal, width)
                if error is not None:
                    errors.append(error)
    return np.array(errors)


def measure_flight(bags: Bags, flight: Flight, every: int = 1, late: int = 0, camera: str = FIRST) -> Lines:
    """Measure the lines in each n-th picture of a flight, but for those whose flags say they may be paired wrong.

    Args:
        bags: Open.
        flight: Of them.
        every: n.
        late: With the camera of so many frames later: of another picture, which shows that frame.
        camera: Whose pictures.
    """
    frames = {frame.stamp: frame for frame in flight.frames() if frame.name == camera}
    cameras = {stamp: frame.camera for stamp, frame in frames.items()}
    sure = {stamp: camera for stamp, camera in cameras.items() if not camera.pose.may_be_neighbour}
    unsure = len(cameras) - len(sure)
    if late:
        at = {round(frame.sim_time / frame.camera.pose.period): frame.camera for frame in frames.values()}
        numbers = {stamp: round(frames[stamp].sim_time / frames[stamp].camera.pose.period) + late for stamp in sure}
        sure = {stamp: at[number] for stamp, number in numbers.items() if number in at}
    found = []
    (recorded,) = chosen_cameras(bags, [camera])
    for number, (stamp, grey) in enumerate(grey_pictures(bags, recorded.images)):
        if number % every == 0 and stamp in sure:
            found.append(measure(grey, sure[stamp], flight.labeller))
    errors = np.concatenate(found) if found else np.empty(0)
    return Lines(errors, sum(len(part) > 0 for part in found), unsure)


def _inside(pixel: np.ndarray, shape: tuple[int, ...]) -> bool:
    return bool(_MARGIN <= pixel[0] < shape[1] - _MARGIN and _MARGIN <= pixel[1] < shape[0] - _MARGIN)


def _offset(grey: np.ndarray, middle: np.ndarray, normal: np.ndarray, width: float) -> float | None:
    """Where across the line its brightness lies [px]; None where it does not stand out."""
    reach = _REACH + 0.5 * width
    steps = np.arange(-reach, reach + 0.5 * _STEP, _STEP)
    at = (middle + steps[:, np.newaxis] * normal).astype(np.float32)
    profile = cv2.remap(grey, at[np.newaxis, :, 0], at[np.newaxis, :, 1], cv2.INTER_LINEAR)[0].astype(float)
    peak = int(np.argmax(profile))
    if profile[peak] - np.median(profile) < _CONTRAST:
        return None
    near = np.abs(steps - steps[peak]) <= 0.5 * width + 2.0
    if near[0] or near[-1]:
        return None  # as far away as is looked: it may be another one
    # Asphalt and grass differ: what is above the brighter of the two is the line.
    base = max(np.median(profile[steps < steps[near].min()]), np.median(profile[steps > steps[near].max()]))
    bright = np.clip(profile - base, 0.0, None) * near
    if not bright.any():
        return None
    return float((bright * steps).sum() / bright.sum())


def flight_of(bags: Bags) -> Flight:
    """A flight of the emulator's twin over its aerodrome."""
    airport = read_airport([airport_file()], "XEMU")
    return Flight(bags, airport, {}, Options(flat_world=True, standing_height=STANDING_M))


def airport_file() -> Path:
    """The aerodrome that the emulator draws, as it is shipped."""
    return config_file("aerodromes", "apt.dat")
