"""Views: which one is shown, where its camera is, what it takes in."""

from __future__ import annotations

from typing import Callable

from xplane_bridge.emulator.datarefs.camera import GLANCE_PITCH, NON_PROPORTIONAL, PANEL, VIEW, Cameras
from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight.frame import Frame

SCENERY = "sim/graphics/scenery/"
#: Where the sun always stands; the window draws it there.
SUN_PITCH_DEG, SUN_HEADING_DEG = 31.101993, 41.576129


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    cameras = sim.cameras
    t.setting(VIEW + "view_type", PANEL)
    t.setting(VIEW + "view_is_external")
    t.setting(GLANCE_PITCH)
    t.setting(VIEW + "field_of_view_deg", 60.0)
    t.setting(VIEW + "vertical_field_of_view_deg", 46.8264)
    t.setting(NON_PROPORTIONAL)
    for name in ("field_of_view_vertical_deg", "field_of_view_horizontal_deg", "field_of_view_roll_deg"):
        t.setting(VIEW + name)
    for name in ("field_of_view_horizontal_ratio", "field_of_view_vertical_ratio"):
        t.setting(VIEW + name)
    t.setting(VIEW + "window_width", sim.window_size[0], read_only=True)
    t.setting(VIEW + "window_height", sim.window_size[1], read_only=True)
    for name in ("x", "y", "z", "psi", "the", "phi"):
        t.setting(VIEW + f"pilots_head_{name}")
    for place, angle in enumerate(("roll", "pitch", "heading")):
        t.value(VIEW + "view_" + angle, _angle(cameras, place))
    for place, axis in enumerate("xyz"):
        t.value(VIEW + "view_" + axis, _coordinate(cameras, place))
    t.array(VIEW + "world_matrix", cameras.world_matrix)
    t.array(VIEW + "projection_matrix_3d", cameras.projection_matrix)
    t.setting("sim/graphics/VR/enabled")
    t.setting(SCENERY + "sun_pitch_degrees", SUN_PITCH_DEG, read_only=True)
    t.setting(SCENERY + "sun_heading_degrees", SUN_HEADING_DEG, read_only=True)


def _angle(cameras: Cameras, place: int) -> Callable[[Frame], float]:
    return lambda f: cameras.reported(f).angles[place]


def _coordinate(cameras: Cameras, place: int) -> Callable[[Frame], float]:
    return lambda f: float(cameras.reported(f).position[place])
