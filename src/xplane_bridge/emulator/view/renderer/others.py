"""Other aircraft: flat parts in body axes, and what of them a camera sees."""

from __future__ import annotations

from typing import Iterator, Tuple

import numpy as np

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.view.renderer.camera import Camera, flat
from xplane_bridge.emulator.view.renderer.scene import Scene

Colour = Tuple[int, int, int]

#: Further away they are smaller than a pixel [m].
_FAR_M = 15000.0
#: Corners forward, right, down of the reference point [m], and colour (blue, green, red). Span 12 m, length 9 m.
_PARTS: Tuple[Tuple[Tuple[Tuple[float, float, float], ...], Colour], ...] = (
    (((4.0, 0.0, -0.7), (4.0, 0.0, 0.5), (-5.0, 0.0, 0.1), (-5.0, 0.0, -0.5)), (215, 215, 220)),  # sides
    (((4.0, -0.6, 0.0), (4.0, 0.6, 0.0), (-5.0, 0.2, -0.2), (-5.0, -0.2, -0.2)), (190, 190, 195)),  # from above
    (((1.0, -6.0, -0.5), (1.0, 6.0, -0.5), (-0.6, 6.0, -0.5), (-0.6, -6.0, -0.5)), (235, 235, 240)),  # wing
    (((-4.1, -1.9, -0.3), (-4.1, 1.9, -0.3), (-5.0, 1.9, -0.3), (-5.0, -1.9, -0.3)), (225, 225, 230)),  # tailplane
    (((-3.9, 0.0, -0.4), (-4.6, 0.0, -2.0), (-5.2, 0.0, -2.0), (-5.1, 0.0, -0.4)), (60, 60, 200)),  # fin
)
_ENU_OF_NED = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))


def outlines(scene: Scene, anchor: tuple[float, float], camera: Camera) -> Iterator[tuple[np.ndarray, Colour, float]]:
    """Pixels, colour and distance [m] of the parts that are in front of the camera, the farthest first."""
    seen = []
    for latitude, longitude, altitude, *angles in scene.others:
        east, north = flat(latitude, longitude, anchor)
        place = np.array((east, north, altitude - scene.terrain_m))
        distance = float(np.linalg.norm(place - camera.eye))
        if distance > _FAR_M:
            continue
        turn = _ENU_OF_NED @ earth.body_to_level(*angles)
        for corners, colour in _PARTS:
            in_camera = camera.to_camera(place + np.array(corners) @ turn.T)
            polygon = camera.polygon(in_camera)
            if polygon is not None:
                seen.append((float(np.linalg.norm(in_camera.mean(axis=0))), polygon, colour))
    seen.sort(key=lambda part: -part[0])
    for away, polygon, colour in seen:
        yield polygon, colour, away
