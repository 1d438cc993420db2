"""The camera of each view: where it stands in the aircraft, as X-Plane draws it and as its datarefs report it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import FrozenSet, Optional, Protocol, Tuple

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import InitialState, ModelInfo
from xplane_bridge.emulator.flight.frame import Clocks, Frame

VIEW = "sim/graphics/view/"
NON_PROPORTIONAL = "sim/graphics/settings/non_proportional_vertical_FOV"
#: Numbers of `view_type`. They are in no list of Laminar's; X-Plane plugins use these.
PANEL, BACK, TOWER, RUNWAY, CHASE, CIRCLE = 1000, 1010, 1014, 1015, 1017, 1018
STILL_SPOT, LINEAR_SPOT, HUD, NOTHING, STRAIGHT_DOWN, COCKPIT_3D = 1020, 1021, 1023, 1024, 1025, 1026
FREE, RIDE_ALONG = 1028, 1031
#: The emulator's own: pitch of a glance upwards, which has no view of its own.
GLANCE_PITCH = "_emulator/glance_pitch"

#: Columns: right, up, back of the camera's eye axes, in forward, right, down.
_EYE_IN_FRD = np.array(((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))
#: North, east, down into X east, Y up, Z south.
_OPENGL_OF_NED = np.array(((0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)))
#: Cameras outside, in metres: behind and above, around, and beside where flights start.
_CHASE_BACK, _CHASE_UP, _CHASE_PITCH_DEG = 30.0, 6.0, -8.0
_CIRCLE_AWAY, _CIRCLE_UP, _CIRCLE_FROM_DEG = 60.0, 15.0, 225.0
_TOWER_EAST_DEG, _TOWER_UP = 0.0015, 20.0
_FREE_HEADING_DEG, _FREE_PITCH_DEG = 300.0, -5.0
_RIDE = (-2.0, 3.0, -1.0)  #: forward, right, down
#: The cockpit's floor lies so far below where the aircraft's file puts the pilot's eye [m].
_FLOOR_BELOW_EYE = 1.1
_NARROWEST_DEG, _WIDEST_DEG = 5.0, 150.0
_NEAR, _FAR = 0.1, 100000.0  # of the projection [m]


@dataclass(frozen=True)
class DrawnCamera:
    """One frame's camera; axes forward, right, down of aircraft and camera."""

    lever: np.ndarray  #: from the aircraft's reference point, in its axes [m]
    turn: np.ndarray  #: rotation from the camera's axes into the aircraft's, as drawn
    reported: np.ndarray  #: likewise, as `view_*` report it
    floor_down: float = 0.0  #: where the cockpit's floor lies, down from the reference point [m]; 0: there is none

    @property
    def angles(self) -> Tuple[float, float, float]:
        """Roll, pitch, heading of the drawn camera in the aircraft [deg]."""
        return earth.euler_degrees(self.turn)


@dataclass(frozen=True)
class ReportedView:
    """What `view_*` say of a frame: roll, pitch, heading [deg] and X, Y, Z [m]."""

    angles: Tuple[float, float, float]
    position: np.ndarray


class Viewed(Protocol):
    """What a camera depends on."""

    store: DatarefStore
    clocks: Clocks
    initial: InitialState  #: where flights start
    window_size: Tuple[int, int]  #: width and height [px]
    otherwise: FrozenSet[str]  #: of `otherwise.IDS`


class Cameras:
    """Gives the camera of a frame; the same one as long as nothing has changed."""

    def __init__(self, sim: Viewed) -> None:
        self._sim = sim
        self._key: Optional[Tuple[float, ...]] = None
        self._frame_number = -1
        self._drawn: Optional[DrawnCamera] = None
        self._reported: Optional[ReportedView] = None
        self._reported_before: Optional[ReportedView] = None

    def take_seat(self, info: ModelInfo) -> None:
        """Puts the pilot's head where this aircraft has the eye."""
        for axis, value in zip("xyz", (0.0, -info.eye_down_m, -info.eye_forward_m)):
            self._sim.store.set(VIEW + f"pilots_head_{axis}", value)

    def drawn(self, frame: Frame) -> DrawnCamera:
        """The camera that the frame is drawn with."""
        self._update(frame)
        assert self._drawn is not None
        return self._drawn

    def reported(self, frame: Frame) -> ReportedView:
        """What `view_*` say with that frame; see [? view-angles] for how X-Plane may do otherwise."""
        self._update(frame)
        reported = self._reported_before if "view-angles" in self._sim.otherwise else self._reported
        assert reported is not None
        return reported

    def field_of_view(self) -> Tuple[float, float, float, float]:
        """Horizontal angle, vertical angle (0: pixels are square) [deg], shift right and up [widths, heights]."""
        get = self._sim.store.get
        horizontal = min(max(get(VIEW + "field_of_view_deg"), _NARROWEST_DEG), _WIDEST_DEG)
        vertical = 0.0
        if get(NON_PROPORTIONAL):
            vertical = min(max(get(VIEW + "vertical_field_of_view_deg"), _NARROWEST_DEG), _WIDEST_DEG)
        shifts = get(VIEW + "field_of_view_horizontal_ratio"), get(VIEW + "field_of_view_vertical_ratio")
        return horizontal, vertical, shifts[0], shifts[1]

    def world_matrix(self, frame: Frame) -> np.ndarray:
        """`world_matrix`: OpenGL axes into the camera's right, up, back; column by column."""
        camera = self.drawn(frame)
        body = earth.body_to_level(frame.phi, frame.theta, frame.psi)
        turn = _EYE_IN_FRD.T @ (body @ camera.turn).T @ _OPENGL_OF_NED.T
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        matrix[:3, 3] = -turn @ self._position(frame, camera)
        return matrix.T.ravel()

    def projection_matrix(self, _frame: Frame) -> np.ndarray:
        """`projection_matrix_3d`: eye axes into clip coordinates; column by column."""
        horizontal, vertical, right, up = self.field_of_view()
        width, height = self._sim.window_size
        across = 1.0 / math.tan(math.radians(0.5 * horizontal))
        upwards = 1.0 / math.tan(math.radians(0.5 * vertical)) if vertical else across * width / height
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = across, upwards
        matrix[0, 2], matrix[1, 2] = 2.0 * right, 2.0 * up
        matrix[2, 2], matrix[2, 3] = -(_FAR + _NEAR) / (_FAR - _NEAR), -2.0 * _FAR * _NEAR / (_FAR - _NEAR)
        matrix[3, 2] = -1.0
        return matrix.T.ravel()

    # --- one frame ---

    def _update(self, frame: Frame) -> None:
        get, number = self._sim.store.get, self._sim.clocks.frame
        settings = tuple(get(VIEW + leaf) for leaf in _SETTINGS)
        key = (*settings, get(GLANCE_PITCH), *frame.position, frame.phi, frame.theta, frame.psi)
        if key == self._key and number == self._frame_number:
            return
        camera = self._camera(frame)
        reported = self._report(frame, camera)
        if number != self._frame_number or self._reported_before is None:
            self._reported_before = self._reported or reported
        self._key, self._frame_number, self._drawn, self._reported = key, number, camera, reported

    def _report(self, frame: Frame, camera: DrawnCamera) -> ReportedView:
        if "view-angles" in self._sim.otherwise:  # against the local level
            body = earth.body_to_level(frame.true_phi, frame.true_theta, frame.true_psi)
        else:
            body = earth.body_to_level(frame.phi, frame.theta, frame.psi)
        return ReportedView(earth.euler_degrees(body @ camera.reported), self._position(frame, camera))

    def _position(self, frame: Frame, camera: DrawnCamera) -> np.ndarray:
        body = earth.body_to_level(frame.phi, frame.theta, frame.psi)
        place: np.ndarray = np.array(frame.position) + _OPENGL_OF_NED @ body @ camera.lever
        return place

    def _camera(self, frame: Frame) -> DrawnCamera:
        get = self._sim.store.get
        view = round(get(VIEW + "view_type"))
        eye = np.array((frame.info.eye_forward_m, 0.0, frame.info.eye_down_m))
        floor = 0.0
        turn = earth.body_to_level(0.0, get(GLANCE_PITCH), 0.0)
        lever = eye
        if view == COCKPIT_3D:  # the only view that follows the pilot's head
            turn = earth.body_to_level(*(get(VIEW + f"pilots_head_{angle}") for angle in ("phi", "the", "psi")))
            right, up, aft = (get(VIEW + f"pilots_head_{axis}") for axis in "xyz")
            lever = np.array((-aft, right, -up))
            floor = frame.info.eye_down_m + _FLOOR_BELOW_EYE
        elif view == BACK:
            turn = earth.body_to_level(0.0, 0.0, 180.0)
        elif view == STRAIGHT_DOWN:
            turn = earth.body_to_level(0.0, -90.0, 0.0)
        elif view == RIDE_ALONG:
            lever = np.array(_RIDE)
        elif get(VIEW + "view_is_external"):
            lever, turn = self._outside(frame, view)
        drawn = turn
        if "offset-turns" not in self._sim.otherwise:
            names = ("field_of_view_roll_deg", "field_of_view_vertical_deg", "field_of_view_horizontal_deg")
            drawn = turn @ earth.body_to_level(*(get(VIEW + name) for name in names))
        return DrawnCamera(lever, drawn, turn, floor)

    def _outside(self, frame: Frame, view: int) -> Tuple[np.ndarray, np.ndarray]:
        """Place and turn in the aircraft of cameras that do not bank with it."""
        body = earth.body_to_level(frame.phi, frame.theta, frame.psi)
        if view == CHASE:
            turn = earth.body_to_level(0.0, _CHASE_PITCH_DEG, frame.psi)
            heading = math.radians(frame.psi)
            place = np.array((-_CHASE_BACK * math.cos(heading), -_CHASE_BACK * math.sin(heading), -_CHASE_UP))
        elif view == CIRCLE:
            bearing = math.radians(_CIRCLE_FROM_DEG)
            place = np.array((_CIRCLE_AWAY * math.cos(bearing), _CIRCLE_AWAY * math.sin(bearing), -_CIRCLE_UP))
            turn = _looking(-place)
        else:
            start = self._sim.initial
            tower = np.array(
                frame.local.to_local(
                    start.latitude_deg, start.longitude_deg + _TOWER_EAST_DEG, frame.m.terrain_elevation_m + _TOWER_UP
                )
            )
            place = _OPENGL_OF_NED.T @ (tower - np.array(frame.position))
            fixed = view in (STILL_SPOT, LINEAR_SPOT, FREE)
            turn = earth.body_to_level(0.0, _FREE_PITCH_DEG, _FREE_HEADING_DEG) if fixed else _looking(-place)
        return body.T @ place, body.T @ turn


_SETTINGS = (
    "view_type",
    "view_is_external",
    "pilots_head_phi",
    "pilots_head_the",
    "pilots_head_psi",
    "pilots_head_x",
    "pilots_head_y",
    "pilots_head_z",
    "field_of_view_roll_deg",
    "field_of_view_vertical_deg",
    "field_of_view_horizontal_deg",
)


def _looking(toward: np.ndarray) -> np.ndarray:
    """Rotation of a level camera that looks along a direction north, east, down."""
    heading = math.degrees(math.atan2(toward[1], toward[0]))
    pitch = math.degrees(math.atan2(-toward[2], math.hypot(toward[0], toward[1])))
    return earth.body_to_level(0.0, pitch, heading)
