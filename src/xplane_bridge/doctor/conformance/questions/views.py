"""What the picture follows."""

from __future__ import annotations

import contextlib
import math
import time
from typing import Iterator

from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import names, pictures
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.link import FAST_HZ
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged

#: So many frames are compared with the window, for at most [s]; so many of them must show a picture of their own.
_WATCH_FRAMES, _WATCH_S = 80, 20.0
_CHANGED = 0.8
_DOWN_DEG, _OFFSET_DEG = -60.0, -40.0
#: So much must psi and true_psi differ, in degrees.
_TELLABLE_DEG = 0.02


@contextlib.contextmanager
def _view(flight: Flight, command: str) -> Iterator[None]:
    """Another view meanwhile; the one before comes back."""
    before = round(flight.xplane.read(names.VIEW_TYPE)[names.VIEW_TYPE])
    flight.xplane.send(protocol.CommandRequest(command))
    time.sleep(0.3)
    try:
        yield
    finally:
        flight.xplane.send(protocol.CommandRequest(names.VIEWS.get(before, names.PANEL_VIEW)))


def _camera_pitch(flight: Flight) -> float:
    """Of the camera against the aircraft's nose [deg]."""
    now = flight.xplane.read(names.VIEW_PITCH, names.THETA)
    return now[names.VIEW_PITCH] - now[names.THETA]


def _glance(flight: Flight) -> Answer:
    with _view(flight, names.LOOK_DOWN):
        soon = _camera_pitch(flight)
        time.sleep(1.0)
        later = _camera_pitch(flight)
    text = (
        f"after one press of straight_down the camera is {soon:.0f} deg from the nose, a second later {later:.0f} deg"
    )
    return judged(later < _DOWN_DEG, text, soon_deg=soon, later_deg=later)


def _offset(flight: Flight) -> Answer:
    with _view(flight, names.PLAIN_VIEW):
        before = flight.xplane.read(*names.CAMERA_BACK)
        with flight.xplane.changed({names.VISUAL_OFFSET: _OFFSET_DEG}):
            time.sleep(0.4)
            after = flight.xplane.read(*names.CAMERA_BACK)
    cosine = sum(before[name] * after[name] for name in names.CAMERA_BACK)
    if not abs(cosine) <= 1.001 or not any(before.values()):
        raise NotTestableError("world_matrix does not give where the camera looks: watch the picture instead")
    turned = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
    text = f"a visual offset of {_OFFSET_DEG:.0f} deg turned the camera of world_matrix by {turned:.0f} deg"
    return judged(turned > 0.5 * abs(_OFFSET_DEG), text, turned_deg=turned)


def _angles(flight: Flight) -> Answer:
    with _view(flight, names.PLAIN_VIEW):
        now = flight.xplane.read(names.VIEW_HEADING, names.PSI, names.TRUE_HEADING)
    against = {
        "psi": _half_turn(now[names.VIEW_HEADING] - now[names.PSI]),
        "true_psi": _half_turn(now[names.VIEW_HEADING] - now[names.TRUE_HEADING]),
    }
    apart = abs(against["psi"] - against["true_psi"])
    if apart < _TELLABLE_DEG:
        raise NotTestableError(f"psi and true_psi differ by {apart:.3f} deg here: fly farther from the whole degree")
    text = f"straight ahead, view_heading is {against['psi']:.3f} deg from psi, {against['true_psi']:.3f} from true_psi"
    fits = abs(against["psi"]) < abs(against["true_psi"])
    return judged(fits, text, from_psi_deg=against["psi"], from_true_psi_deg=against["true_psi"])


def _half_turn(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0


def _window(flight: Flight) -> Answer:
    with flight.xplane.receiver() as receiver:
        receiver.subscribe([names.RUNNING_TIME], FAST_HZ)
        last = b""

        def new_frames() -> int:
            nonlocal last
            found = list(dict.fromkeys(receiver.waiting()))  # one of a frame: the time in it differs
            count = len(found) - (last in found)
            last = found[-1] if found else last
            return count

        seen = pictures.watch(new_frames, _WATCH_FRAMES, _WATCH_S)
    if seen.frames < _WATCH_FRAMES:
        text = f"{seen.grabs} pictures in {seen.duration_s:.1f} s could not distinguish {_WATCH_FRAMES} frames"
        raise NotTestableError(f"{text}: end other programs, or lower X-Plane's frame rate")
    text = f"{seen.changes} changes of the window's picture in {seen.distinct} of {seen.frames} frames"
    kept = {"changes": seen.changes, "distinct": seen.distinct, "frames": seen.frames, "grabs": seen.grabs}
    return judged(seen.changes > _CHANGED * seen.distinct, text, **kept)


QUESTIONS = (
    Question("window-changes", "the window's picture changes with each frame", _window),
    Question("glance-holds", "one press of a glance holds it", _glance),
    Question("offset-turns", "a visual offset turns the camera", _offset),
    Question("view-angles", "view_heading is against the scenery's axes, as psi is", _angles),
)
