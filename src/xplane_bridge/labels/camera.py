"""A picture's camera in the world: from FrameState and CameraInfo, and how places come to pixels."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from xplane_bridge.labels.world import World

#: Nearest depth that is projected [m].
NEAR_M = 0.5
#: Forward, right, down of forward, left, up, and back.
FRD_OF_FLU = np.diag((1.0, -1.0, -1.0))


class Pose(NamedTuple):
    """Where aircraft and camera were when a picture was drawn, and how well that is known."""

    latitude: float  #: [deg] of the aircraft
    longitude: float
    altitude: float  #: [m MSL]
    orientation: np.ndarray  #: quaternion x, y, z, w: forward, right, down of the aircraft into north, east, down there
    lever: np.ndarray  #: [m] the camera's place in base_link: forward, left, up
    rotation: np.ndarray  #: quaternion x, y, z, w: right, down, forward of the camera into base_link
    sigma_angle: float = 0.0  #: [rad] bound of the camera's direction
    sigma_place: float = 0.0  #: [m] of its place
    turn_rate: float = 0.0  #: [rad/s] of the aircraft
    velocity: np.ndarray = np.zeros(3)  #: [m/s] north, east, down
    period: float = 0.0  #: [s] of a frame
    may_be_neighbour: bool = False  #: the picture may be of the frame before or after


class Optics(NamedTuple):
    """CameraInfo."""

    width: int
    height: int
    fx: float  #: [px]
    fy: float
    cx: float
    cy: float
    #: What of it shows the world: `picture_*` of FrameState; no size: all of it.
    shows: Tuple[int, int, int, int] = (0, 0, 0, 0)

    def area(self) -> np.ndarray:
        """Left, top and right, bottom of what shows the world: without the bars of a letterbox."""
        left, top, width, height = self.shows if self.shows[2] and self.shows[3] else (0, 0, self.width, self.height)
        corners: np.ndarray = np.array(((left, top), (left + width, top + height))) - 0.5
        return corners


class Camera:
    """One picture's camera.

    Args:
        world: Where places lie.
        pose: Of aircraft and camera.
        optics: Focal lengths and size.

    Attributes:
        to_optical: Rotation from the world's axes to right, down, forward.
        place: [m] in the world.
        height: [m MSL]
        focal: [px] the mean of both axes
        focals: [px] across and down
        area: `Optics.area`
    """

    def __init__(self, world: World, pose: Pose, optics: Optics) -> None:
        self.pose, self.optics = pose, optics
        level = world.level(pose.latitude, pose.longitude)
        body_to_ned = rotation_of(pose.orientation) @ FRD_OF_FLU
        lever = body_to_ned @ pose.lever
        self.height = pose.altitude - float(lever[2])
        self.place: np.ndarray = world.place(pose.latitude, pose.longitude, pose.altitude) + level.T @ lever
        self.ned_to_optical: np.ndarray = (body_to_ned @ rotation_of(pose.rotation)).T
        self.to_optical: np.ndarray = self.ned_to_optical @ level
        self._velocity = self.ned_to_optical @ pose.velocity
        self.focal = 0.5 * (optics.fx + optics.fy)
        self.focals: np.ndarray = np.array((optics.fx, optics.fy))
        self.area = optics.area()
        outermost = np.abs(self.area - (optics.cx, optics.cy)).max(axis=0) / self.focals
        self._reach = float(np.linalg.norm(outermost))  # tangent of the widest angle in the picture

    def optical(self, places: np.ndarray) -> np.ndarray:
        """Places (n, 3) of the world as right, down, forward of the camera [m]."""
        turned: np.ndarray = (np.atleast_2d(places) - self.place) @ self.to_optical.T
        return turned

    def pixels(self, optical: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3) before the camera; NaN of those behind it."""
        optics = self.optics
        depth = np.where(optical[:, 2] > 0.0, optical[:, 2], np.nan)
        across, down = optical[:, 0] / depth, optical[:, 1] / depth
        return np.stack((optics.fx * across + optics.cx, optics.fy * down + optics.cy), axis=1)

    def inside(self, pixels: np.ndarray) -> np.ndarray:
        """Whether pixels (n, 2) lie in the picture, its outermost pixels included."""
        low, high = self.area
        within: np.ndarray = np.all((pixels >= low) & (pixels <= high), axis=1)
        return within

    def polygon(self, optical: np.ndarray) -> np.ndarray:
        """The part of a polygon (n, 3) that is in the picture, as pixels (m, 2); empty when none is."""
        ahead = clip(optical, optical[:, 2] - NEAR_M)
        if len(ahead) < 3:
            return np.empty((0, 2))
        seen = self.pixels(ahead)
        for sign, axis, limit in self._borders():
            seen = clip(seen, sign * (seen[:, axis] - limit))
            if len(seen) < 3:
                return np.empty((0, 2))
        return seen

    def line(self, optical: np.ndarray) -> list[np.ndarray]:
        """The parts of a line through points (n, 3) that are in the picture, each as pixels (m, 2)."""
        parts: list[np.ndarray] = []
        for begin, end in zip(optical[:-1], optical[1:]):
            segment = _clip_segment(np.stack((begin, end)), 1.0, 2, NEAR_M)
            if segment is not None:
                segment = self.pixels(segment)
                for sign, axis, limit in self._borders():
                    segment = None if segment is None else _clip_segment(segment, sign, axis, limit)
            if segment is None:
                continue
            if parts and np.allclose(parts[-1][-1], segment[0], atol=1e-9):
                parts[-1] = np.vstack((parts[-1], segment[1:]))
            else:
                parts.append(segment)
        return parts

    def sigma(
        self,
        distance: float,
        direction: np.ndarray,
        sigma_height: float,
        sigma_place: float,
        sigma_angle: float = 0.0,
    ) -> float:
        """How well a place is known in the picture [px]: by what each error moves its pixel there, at worst.

        Args:
            distance: [m]; infinite for directions.
            direction: Unit vector to it: right, down, forward of the camera.
            sigma_height: [m] of the place's height.
            sigma_place: [m] of its place on the map.
            sigma_angle: [rad] of its direction.
        """
        pose = self.pose
        ray, moves = self._moves(direction)
        turn = _largest(moves @ _cross(ray))
        terms = [0.3, turn * pose.sigma_angle, turn * sigma_angle]
        if pose.may_be_neighbour:
            terms.append(turn * pose.turn_rate * pose.period)
        if np.isfinite(distance):
            moves = moves / distance
            terms.append(float(np.linalg.norm(moves @ self.ned_to_optical[:, 2])) * sigma_height)
            terms += [_largest(moves @ self.ned_to_optical[:, :2]) * sigma_place, _largest(moves) * pose.sigma_place]
            if pose.may_be_neighbour:
                terms.append(float(np.linalg.norm(moves @ self._velocity)) * pose.period)
        return float(np.sqrt(np.sum(np.square(terms))))

    def _moves(self, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What a point's pixel moves by [px], for the point's own motion: derivatives by right, down, forward at 1 m.

        Outside the picture they grow without limit: beyond its farthest corner those of that angle are taken; behind
        the camera, where there are no pixels, those by the angle alone.

        Returns:
            The direction that is taken, and the matrix (2, 3).
        """
        if direction[2] <= 0.0:
            across: np.ndarray = np.linalg.svd(direction[np.newaxis])[2][1:]  # two directions at right angles to it
            return direction, self.focal * across
        x, y, z = direction.tolist()
        inwards = min(1.0, self._reach * z / max(math.hypot(x, y), 1e-12))
        ray = np.array((inwards * x, inwards * y, z))
        ray /= np.linalg.norm(ray)
        x, y, z = ray.tolist()
        return ray, self.focals[:, np.newaxis] / z * np.array(((1.0, 0.0, -x / z), (0.0, 1.0, -y / z)))

    def _borders(self) -> tuple[tuple[float, int, float], ...]:
        (left, top), (right, bottom) = self.area.tolist()
        return (1.0, 0, left), (-1.0, 0, right), (1.0, 1, top), (-1.0, 1, bottom)


def _largest(moves: np.ndarray) -> float:
    """By how much a matrix (2, n) lengthens the vector that it lengthens most: its greatest singular value."""
    (a, b), (_, c) = (moves @ moves.T).tolist()
    return math.sqrt(0.5 * (a + c) + math.hypot(0.5 * (a - c), b))


def _cross(vector: np.ndarray) -> np.ndarray:
    """The matrix that gives another vector's cross product with this one."""
    x, y, z = vector.tolist()
    return np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)))


def clip(points: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The part of a polygon (n, k) where a linear function, given at its corners, is not negative."""
    kept: list[np.ndarray] = []
    for i in range(len(points)):
        j = (i + 1) % len(points)
        if inside[i] >= 0.0:
            kept.append(points[i])
        if (inside[i] >= 0.0) != (inside[j] >= 0.0):
            kept.append(points[i] + (points[j] - points[i]) * (inside[i] / (inside[i] - inside[j])))
    return np.array(kept).reshape(-1, points.shape[1])


def _clip_segment(segment: np.ndarray, sign: float, axis: int, limit: float) -> Optional[np.ndarray]:
    """The part of a segment (2, k) on one side of a limit of one coordinate."""
    a, b = sign * (segment[:, axis] - limit)
    if a < 0.0 and b < 0.0:
        return None
    if a >= 0.0 and b >= 0.0:
        return segment
    cut = segment[0] + (segment[1] - segment[0]) * (a / (a - b))
    return np.stack((cut, segment[1])) if a < 0.0 else np.stack((segment[0], cut))


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion x, y, z, w of any length but 0."""
    x, y, z, w = (float(part) for part in quaternion / np.linalg.norm(quaternion))
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )
