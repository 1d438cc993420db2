"""Pinhole camera of the cockpit view over a flat patch of ground."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.view.renderer.scene import Scene
from xplane_bridge.units import EARTH_RADIUS_M

#: Nearest depth that is drawn [m].
NEAR_M = 0.3
#: Lowest eye over the ground [m]: the plane has no thickness.
_LOWEST_EYE_M = 0.5

#: Camera axes (right, down, forward) in body axes (forward, right, down).
_CAMERA_IN_BODY = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
#: East, north, up of north, east, down.
_ENU_OF_NED = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))


class Camera:
    """Where the pilot looks from, and how the world comes to pixels.

    Args:
        scene: The frame.
        size: Width and height of the picture [px].
        anchor: Latitude and longitude [deg] of the world's origin; the earth is drawn flat around it.

    Attributes:
        eye: East, north, up [m] over the ground, relative to the anchor.
        to_world: Rotation from camera axes (right, down, forward) to east, north, up.
        focal: [px] across
        focals: [px] across and down
    """

    def __init__(self, scene: Scene, size: tuple[int, int], anchor: tuple[float, float]) -> None:
        width, height = size
        self.size = size
        self.focal = 0.5 * width / math.tan(math.radians(0.5 * scene.field_of_view_deg))
        upwards = scene.vertical_field_of_view_deg
        down = 0.5 * height / math.tan(math.radians(0.5 * upwards)) if upwards else self.focal
        self.focals = np.array((self.focal, down))
        self.centre = ((width - 1) / 2.0 - scene.shift_right * width, (height - 1) / 2.0 + scene.shift_up * height)
        east, north = flat(scene.latitude_deg, scene.longitude_deg, anchor)
        body = earth.body_to_level(scene.roll_deg, scene.pitch_deg, scene.heading_deg)
        self._lever = np.array((scene.eye_forward_m, scene.eye_right_m, scene.eye_down_m))
        lever = _ENU_OF_NED @ body @ self._lever
        height_m = max(scene.altitude_m - scene.terrain_m + lever[2], _LOWEST_EYE_M)
        self.eye = np.array((east + lever[0], north + lever[1], height_m))
        head = earth.body_to_level(scene.head_roll_deg, scene.head_pitch_deg, scene.head_heading_deg)
        self._in_body = head @ _CAMERA_IN_BODY
        self.to_world = _ENU_OF_NED @ body @ self._in_body
        self.rays = self.to_world @ np.array(
            (
                (1.0 / self.focals[0], 0.0, -self.centre[0] / self.focals[0]),
                (0.0, 1.0 / self.focals[1], -self.centre[1] / self.focals[1]),
                (0.0, 0.0, 1.0),
            )
        )  #: from homogeneous pixels to directions east, north, up of unit depth

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) east, north, up [m] in camera axes."""
        turned: np.ndarray = (points - self.eye) @ self.to_world
        return turned

    def body_to_camera(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) forward, right, down of the aircraft's reference point [m] in camera axes."""
        turned: np.ndarray = (points - self._lever) @ self._in_body
        return turned

    def directions_to_camera(self, directions: np.ndarray) -> np.ndarray:
        """Directions (..., 3), of things infinitely far away."""
        turned: np.ndarray = directions @ self.to_world
        return turned

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points in camera axes, in front of the near plane."""
        pixels: np.ndarray = points[:, :2] * (self.focals / points[:, 2:3]) + self.centre
        return pixels

    def polygon(self, in_camera: np.ndarray) -> Optional[np.ndarray]:
        """Pixels of a convex polygon in camera axes, cut at the near plane; None when nothing is in front of it."""
        depth = in_camera[:, 2]
        if depth.min() >= NEAR_M:
            return self.project(in_camera)
        if depth.max() < NEAR_M:
            return None
        return self.project(clip(in_camera, depth - NEAR_M))


def flat(latitude_deg: float, longitude_deg: float, anchor: tuple[float, float]) -> tuple[float, float]:
    """East and north [m] of the anchor, on the flat earth that is drawn around it."""
    north = math.radians(latitude_deg - anchor[0]) * EARTH_RADIUS_M
    east = math.radians(earth.wrap_half_turn(longitude_deg - anchor[1])) * EARTH_RADIUS_M
    return east * math.cos(math.radians(anchor[0])), north


def clip(points: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The part of a convex polygon where a linear function is not negative.

    Args:
        points: (n, k) corners in order.
        inside: (n,) the function at the corners.
    """
    kept: list[np.ndarray] = []
    for i in range(len(points)):
        j = (i + 1) % len(points)
        if inside[i] >= 0.0:
            kept.append(points[i])
        if (inside[i] >= 0.0) != (inside[j] >= 0.0):
            kept.append(points[i] + (points[j] - points[i]) * (inside[i] / (inside[i] - inside[j])))
    return np.array(kept).reshape(-1, points.shape[1])


def box(east: float, north: float, size: Sequence[float], heading_deg: float) -> np.ndarray:
    """Eight corners (bottom four, top four) of a box standing on the ground: size along, across, up [m]."""
    along, across, up = size
    turn = math.radians(heading_deg)
    forward, right = np.array((math.sin(turn), math.cos(turn))), np.array((math.cos(turn), -math.sin(turn)))
    corners = [0.5 * (a * along * forward + c * across * right) for a, c in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    ground = np.array(corners) + np.array((east, north))
    return np.vstack((np.column_stack((ground, np.zeros(4))), np.column_stack((ground, np.full(4, up)))))
