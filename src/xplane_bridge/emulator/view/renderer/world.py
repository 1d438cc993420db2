"""The world that the renderer draws: ground textures, an aerodrome, buildings and trees, all made from a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Sequence

import cv2
import numpy as np

from xplane_bridge.emulator.view.renderer.camera import box
from xplane_bridge.emulator.view.renderer.ground import Texture

#: Side of the tile that repeats over the whole earth [m].
TILE_M = 16384.0
#: Sides [m] at which the grain is laid over it, and the depth [m] up to which each is seen.
_GRAINS = ((1024.0, 2200.0), (128.0, 260.0))
_TILE_PX = 2048
_DETAIL_PX = 512

_FIELDS = np.array(
    ((70, 120, 96), (62, 140, 120), (80, 150, 160), (58, 105, 75), (90, 165, 185), (66, 128, 105), (75, 112, 125)),
    np.float32,
)  # blue, green, red
_FOREST = (38, 66, 44)
_WATER = (110, 82, 48)
_ROAD = (150, 155, 158)
_TOWN = (128, 138, 150)

RUNWAY_LENGTH_M = 1800.0
RUNWAY_WIDTH_M = 45.0


@dataclass
class World:
    """Positions east, north, up [m] relative to the anchor; colours blue, green, red."""

    levels: list[Texture] = field(default_factory=list)  #: of the ground, finest first
    grains: list[tuple[Texture, float]] = field(default_factory=list)  #: around middle grey; depth [m] up to which seen
    markings: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 3)))  #: on the ground, in the order of drawing
    marking_colours: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    boxes: np.ndarray = field(default_factory=lambda: np.zeros((0, 8, 3)))  #: bottom four corners, top four
    box_colours: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    skyline: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  #: azimuth, elevation [rad]
    sun: np.ndarray = field(default_factory=lambda: np.zeros(3))  #: direction east, north, up


@lru_cache(maxsize=2)
def make_world(heading_deg: float, seed: int = 7) -> World:
    """Builds the world around an aerodrome at the anchor, its runway along `heading_deg`; not to be changed."""
    random = np.random.default_rng(seed)
    world = World()
    tile = _ground_tile(random)
    for step in (1, 4, 16):
        size = _TILE_PX // step
        texture = tile if step == 1 else cv2.resize(tile, (size, size), interpolation=cv2.INTER_AREA)
        world.levels.append(Texture(texture, TILE_M / size))
    grain = _detail_tile(random)
    world.grains = [(Texture(grain, span / _DETAIL_PX), depth) for span, depth in _GRAINS]
    _add_aerodrome(world, heading_deg, random)
    azimuth = np.radians(np.arange(0.0, 361.0, 1.5))
    height = sum(
        (0.5 + 0.5 * np.sin(count * azimuth + random.uniform(0.0, 6.28))) * scale
        for count, scale in ((2, 0.022), (5, 0.016), (13, 0.009), (31, 0.005))
    )
    world.skyline = np.column_stack((azimuth, np.maximum(height - 0.012, 0.0)))
    sun = np.array((0.55, 0.62, 0.5))
    world.sun = sun / np.linalg.norm(sun)
    return world


def _noise(random: np.random.Generator, size: int, cells: int) -> np.ndarray:
    """Smooth noise in [0, 1] that repeats at its edges."""
    coarse = random.random((cells, cells)).astype(np.float32)
    padded = np.pad(coarse, 2, mode="wrap")
    scale = size / cells
    big = cv2.resize(padded, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    start = round(2 * scale)
    return np.clip(big[start : start + size, start : start + size], 0.0, 1.0)


def _ground_tile(random: np.random.Generator) -> np.ndarray:
    """Fields, woods, water, roads and villages seen from above; 8 m a texel."""
    size = _TILE_PX
    x = np.arange(size, dtype=np.float32)
    bend = (_noise(random, size, 16) - 0.5) * 90.0
    across, down = x + bend, x[:, np.newaxis] + 0.7 * bend
    column, row = np.floor(across / 56.0), np.floor(down / 40.0)
    kinds = random.integers(0, len(_FIELDS), (64, 64))
    across -= column * 56.0
    down -= row * 40.0
    column, row = column.astype(np.int32), row.astype(np.int32)
    # Furrows and hedges: what gives a field its grain.
    furrows = 0.94 + 0.08 * np.sin(x * 1.9)
    shade = np.where((row + column) & 1, furrows[:, np.newaxis], furrows)
    hedge = np.where((across < 2.0) | (down < 2.0), np.float32(0.7), np.float32(1.0))
    wood = np.flatnonzero(_noise(random, size, 24) * 0.7 + _noise(random, size, 96) * 0.3 > 0.6)
    trees = 0.75 + 0.6 * random.random(len(wood), np.float32)
    water = _noise(random, size, 9) > 0.86
    field = ((row & 63) << 6) + (column & 63)
    # Each colour by itself: several times faster than three values at each place.
    tile = np.empty((3, size, size), np.float32)
    for plane, fields, forest, wet in zip(tile, _FIELDS[kinds].reshape(-1, 3).T, _FOREST, _WATER):
        np.take(fields, field, out=plane, mode="wrap")
        plane *= shade
        plane *= hedge
        plane.reshape(-1)[wood] = np.float32(forest) * trees
        np.copyto(plane, wet, where=water)
    for _ in range(14):
        here = random.integers(0, size, 2)
        radius = int(random.integers(10, 26))
        for plane, town in zip(tile, _TOWN):
            cv2.circle(plane, tuple(int(v) for v in here), radius, town, -1)
        for _ in range(60):
            corner = here + random.normal(0.0, 14.0, 2)
            lit = float(random.uniform(0.5, 1.3))
            ends = (corner, corner + random.integers(2, 5, 2))
            first, last = (tuple(int(v) for v in end) for end in ends)
            for plane, roof in zip(tile, (120, 120, 190)):
                cv2.rectangle(plane, first, last, float(roof * lit), -1)
    for at in random.integers(0, size, 5):
        wave = (at + 60.0 * np.sin(np.arange(size) * (2.0 * math.pi * int(random.integers(1, 4)) / size))) % size
        line = np.column_stack((np.arange(size), wave)).astype(np.int32)
        line = line if random.random() < 0.5 else line[:, ::-1]
        for plane, road in zip(tile, _ROAD):
            cv2.polylines(plane, [np.ascontiguousarray(line)], False, road, 2, cv2.LINE_AA)
    light = 0.85 + 0.3 * _noise(random, size, 128)
    for plane in tile:
        plane *= light
        np.clip(plane, 0, 255, out=plane)
    blurred: np.ndarray = cv2.GaussianBlur(
        cv2.merge([plane.astype(np.uint8) for plane in tile]), (3, 3), 0.7, borderType=cv2.BORDER_REFLECT
    )
    return blurred


def _detail_tile(random: np.random.Generator) -> np.ndarray:
    """Grain of the ground close by, around middle grey."""
    grain: np.ndarray = np.zeros((_DETAIL_PX, _DETAIL_PX), np.float32)
    for cells, weight in ((8, 0.35), (32, 0.35), (128, 0.3), (256, 0.3)):
        grain = grain + (_noise(random, _DETAIL_PX, cells) - 0.5) * weight
    patches = _noise(random, _DETAIL_PX, 12)[..., np.newaxis] * np.array((-6.0, 4.0, 10.0))
    detail = 128.0 + 90.0 * grain[..., np.newaxis] + patches
    shades: np.ndarray = np.clip(detail, 0, 255).astype(np.uint8)
    return shades


def _rectangle(along: float, across: float, length: float, width: float, heading_deg: float) -> np.ndarray:
    """Rectangle on the ground around a point given along and across the runway [m]."""
    turn = math.radians(heading_deg)
    forward, right = np.array((math.sin(turn), math.cos(turn))), np.array((math.cos(turn), -math.sin(turn)))
    corners = [
        (along + a * length / 2) * forward + (across + c * width / 2) * right
        for a, c in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    ]
    return np.column_stack((np.array(corners), np.zeros(4)))


def _add_aerodrome(world: World, heading_deg: float, random: np.random.Generator) -> None:
    markings: list[np.ndarray] = []
    marking_colours: list[tuple[int, int, int]] = []
    boxes: list[np.ndarray] = []
    box_colours: list[tuple[int, int, int]] = []
    asphalt, white, grass, apron = (78, 76, 74), (235, 235, 235), (70, 140, 105), (120, 118, 116)

    def mark(along: float, across: float, length: float, width: float, colour: tuple[int, int, int]) -> None:
        markings.append(_rectangle(along, across, length, width, heading_deg))
        marking_colours.append(colour)

    def build(
        east: float, north: float, size: Sequence[float], turned_deg: float, colour: tuple[int, int, int]
    ) -> None:
        boxes.append(box(east, north, size, turned_deg))
        box_colours.append(colour)

    half = RUNWAY_LENGTH_M / 2
    mark(0, 60, RUNWAY_LENGTH_M + 400, 420, grass)
    mark(0, 0, RUNWAY_LENGTH_M, RUNWAY_WIDTH_M, asphalt)
    mark(0, 140, RUNWAY_LENGTH_M * 0.9, 18, asphalt)
    mark(0, 215, 320, 110, apron)
    for side in (-1, 1):
        mark(side * half * 0.88, 80, 18, 120, asphalt)
        mark(0, side * (RUNWAY_WIDTH_M / 2 - 1), RUNWAY_LENGTH_M, 0.9, white)
        for bar in range(-4, 4):
            mark(side * (half - 21), (bar + 0.5) * 4.6, 30, 2.2, white)
        for across in (-7, 7):
            mark(side * (half - 325), across, 45, 6, white)
            for distance in (170, 480):
                mark(side * (half - distance), across * 1.4, 22.5, 3, white)
    for along in np.arange(-half + 120, half - 120, 50.0):
        mark(along, 0, 30, 0.9, white)
    turn = math.radians(heading_deg)

    def place(along: float, across: float) -> tuple[float, float]:
        return (
            along * math.sin(turn) + across * math.cos(turn),
            along * math.cos(turn) - across * math.sin(turn),
        )

    for along in (-110, -50, 10, 70):
        build(*place(along, 300), (48, 36, 12), heading_deg, (150, 165, 175))
    build(*place(140, 285), (12, 12, 32), heading_deg, (225, 225, 225))
    for _ in range(60):  # a town beyond the runway's end, and farms about
        along, across = random.normal((2600.0, 700.0), 260.0)
        size = (*random.uniform(9, 26, 2), random.uniform(5, 22))
        build(*place(along, across), size, random.uniform(0, 90), _wall(random))
    for _ in range(70):
        east, north = random.uniform(-5000, 5000, 2)
        along, across = east * math.sin(turn) + north * math.cos(turn), east * math.cos(turn) - north * math.sin(turn)
        if abs(along) < RUNWAY_LENGTH_M * 1.3 and -200 < across < 400:
            continue
        size = (*random.uniform(8, 30, 2), random.uniform(4, 12))
        build(east, north, size, random.uniform(0, 90), _wall(random))
    world.markings, world.marking_colours = np.array(markings), np.array(marking_colours, float)
    world.boxes, world.box_colours = np.array(boxes), np.array(box_colours, float)


def _wall(random: np.random.Generator) -> tuple[int, int, int]:
    return ((140, 160, 190), (120, 130, 200), (190, 200, 205))[int(random.integers(3))]
