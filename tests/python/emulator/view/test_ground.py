"""The ground that the renderer draws: which place a pixel sees, and what a repeating texture shows there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xplane_bridge.emulator.view.renderer.camera import Camera
from xplane_bridge.emulator.view.renderer.ground import GroundView, Texture
from xplane_bridge.emulator.view.renderer.scene import Scene

ANCHOR = (47.0, 8.0)
LEVEL = Scene(latitude_deg=47.0, longitude_deg=8.0, altitude_m=600.0, terrain_m=500.0)
SIZE = (160, 120)
ORIGIN = np.zeros(3)


def numbered() -> np.ndarray:
    """4x4 texels with their row in blue, column in green [tens]."""
    rows, columns = np.mgrid[0:4, 0:4] * 10
    return np.dstack((rows, columns, np.zeros((4, 4)))).astype(np.uint8)


def texel(texture: Texture, east: float, north: float, origin: np.ndarray = ORIGIN) -> list[int]:
    place = (np.array([[value]], np.float32) for value in (east, north))
    return [int(v) for v in texture.at(*place, origin)[0, 0, :2]]


@pytest.mark.parametrize("repeats", [0, 1, -3])
def test_a_texture_repeats_in_both_directions_from_its_north_edge(repeats: int) -> None:
    texture = Texture(numbered(), 2.0)
    there = repeats * 8.0
    assert texel(texture, there, 0.0) == [0, 0]
    assert texel(texture, 6.0, there - 2.0) == [10, 30]
    assert texel(texture, there + 2.0, there - 6.0) == [30, 10]


def test_between_two_texels_it_is_between_them_also_across_the_edge() -> None:
    texture = Texture(numbered(), 2.0)
    assert texel(texture, 3.0, 0.0) == [0, 15]
    assert texel(texture, 7.0, 0.0) == [0, 15]  # between columns 3 and 0
    assert texel(texture, 0.0, 1.0) == [15, 0]


def test_places_count_from_the_origin_in_texels_of_their_own_size() -> None:
    texture = Texture(numbered(), 2.0)
    assert texel(texture, 0.0, 0.0, np.array((2.0, -4.0, 9.0))) == [20, 10]
    larger = Texture(numbered(), 8.0)
    assert texel(larger, 8.0, -16.0) == [20, 10]
    assert larger.span_m == 32.0


def test_a_texture_that_cannot_repeat_by_bits_is_refused() -> None:
    with pytest.raises(ValueError, match="3 texels: expected a power of two"):
        Texture(np.zeros((3, 3, 3), np.uint8), 1.0)


ATTITUDES = [(0.0, 0.0), (20.0, 0.0), (-75.0, 10.0), (90.0, -5.0), (180.0, 3.0), (5.0, -89.0), (0.0, -20.0)]


@pytest.mark.parametrize(("roll", "pitch"), ATTITUDES)
def test_boxes_hold_every_pixel_between_two_depths_once(roll: float, pitch: float) -> None:
    view = GroundView(Camera(replace(LEVEL, roll_deg=roll, pitch_deg=pitch), SIZE, ANCHOR), SIZE, 1e-3)
    for lowest, steepest in ((0.0, np.inf), (0.05, 0.2), (0.2, np.inf), (5.0, 6.0)):
        held = np.zeros(view.falling.shape, int)
        for area in view.boxes(lowest, steepest):
            held[area] += 1
        assert held.max(initial=0) <= 1
        assert held[(view.falling >= lowest) & (view.falling <= steepest)].all()


@pytest.mark.parametrize(("roll", "pitch"), ATTITUDES)
def test_a_pixel_sees_the_place_that_the_camera_projects_onto_it(roll: float, pitch: float) -> None:
    scene = replace(LEVEL, roll_deg=roll, pitch_deg=pitch, heading_deg=30.0)
    camera = Camera(scene, SIZE, ANCHOR)
    view = GroundView(camera, SIZE, 1e-3)
    for area in view.boxes(0.02, np.inf):
        rows, columns = view.picture(area)
        places = np.stack([array[area] + camera.eye[k] for k, array in enumerate(view.places)], axis=-1).reshape(-1, 2)
        pixels = camera.project(camera.to_camera(np.column_stack((places, np.zeros(len(places))))))
        v, u = np.mgrid[rows, columns]
        seen = view.falling[area].ravel() >= 0.02
        assert np.abs(pixels[seen, 0] - u.ravel()[seen]).max() < 0.02
        assert np.abs(pixels[seen, 1] - v.ravel()[seen]).max() < 0.02


def test_who_looks_up_sees_no_ground() -> None:
    view = GroundView(Camera(replace(LEVEL, pitch_deg=60.0), SIZE, ANCHOR), SIZE, 1e-3)
    assert view.falling.size == 0
    assert list(view.boxes(0.0, np.inf)) == []
