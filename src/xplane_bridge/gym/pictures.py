"""Pictures of an episode by the emulator's renderer: the same bytes in every run, without a window."""

from __future__ import annotations

from typing import Tuple

import cv2
import numpy as np

from xplane_bridge.emulator.flight.flight_model import ModelState
from xplane_bridge.emulator.view.renderer import Scene
from xplane_bridge.emulator.view.renderer.painter import Painter

#: [deg] of the runway of the aerodrome where the flight starts.
_RUNWAY_DEG = 0.0


class Camera:
    """The forward view.

    Args:
        size: Width and height [px].
        anchor: Latitude and longitude [deg] of the aerodrome.
    """

    def __init__(self, size: Tuple[int, int], anchor: Tuple[float, float]) -> None:
        self._painter = Painter(*size, anchor, _RUNWAY_DEG, hud=False, strip=False)

    def picture(self, state: ModelState) -> np.ndarray:
        """A new picture (height, width, 3), red, green, blue."""
        scene = Scene(
            sim_time=state.sim_time_s,
            latitude_deg=state.latitude_deg,
            longitude_deg=state.longitude_deg,
            altitude_m=state.altitude_m,
            terrain_m=state.terrain_elevation_m,
            roll_deg=float(np.degrees(state.roll_rad)),
            pitch_deg=float(np.degrees(state.pitch_rad)),
            heading_deg=float(np.degrees(state.heading_rad)),
        )
        return cv2.cvtColor(self._painter.paint(scene), cv2.COLOR_BGR2RGB)
