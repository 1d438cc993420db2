"""Draws a `Scene`: sky, sun, mountains, textured ground, aerodrome, buildings, head-up display, strip."""

from __future__ import annotations

import math
from typing import Any, Optional

import cv2
import numpy as np

from xplane_bridge.emulator.view.renderer.camera import NEAR_M, Camera, clip
from xplane_bridge.emulator.view.renderer.others import outlines
from xplane_bridge.emulator.view.renderer.scene import Scene
from xplane_bridge.emulator.view.renderer.strip import draw_strip, strip_height
from xplane_bridge.emulator.view.renderer.world import GRAINS, make_world
from xplane_bridge.protocol import UNUSED_SLOT
from xplane_bridge.units import FOOT_M

_ZENITH = np.array((200, 120, 52), np.float32)  # blue, green, red
_PRINT = (255, 255, 255)
_FLOOR = (46, 52, 60)
_FLOOR_M = (0.9, 0.8)  #: half length and half width
_HAZE = np.array((226, 210, 192), np.float32)
_MOUNTAIN = np.array((168, 146, 124), np.float32)
#: Distance at which the haze has taken 63 % of the contrast [m].
_HAZE_M = 22000.0
#: Thinner haze is not drawn [share of a full one].
_LEAST_HAZE = 0.015
#: Coarse grid for what varies slowly over the picture.
_GRID = 16
#: Width of the columns that the ground is drawn in [px].
_TILE = 80
#: A texture level is used up to where its texel is this many pixels' footprints small.
_SHARPNESS = 1.4
_SHIFT = 4  # sub-pixel bits of OpenCV's polygon coordinates
_FAR_PIXELS = 30000.0
_BOX_DEPTH_M = 7000.0
#: Things smaller than this are not drawn [px].
_SMALLEST = 1.5
_BOX_FACES = np.array(((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)))


class Painter:
    """Draws pictures of one size.

    Args:
        width, height: [px]
        anchor: Latitude and longitude [deg] of the aerodrome.
        runway_heading_deg: True heading of its runway.
        hud: Whether a head-up display is drawn.
        strip: Whether the machine-readable strip is drawn.
    """

    def __init__(
        self,
        width: int,
        height: int,
        anchor: tuple[float, float],
        runway_heading_deg: float = 0.0,
        hud: bool = False,
        strip: bool = True,
    ) -> None:
        self._size = (width, height)
        self._anchor = anchor
        self._hud = hud
        self._strip = strip
        self._world = make_world(runway_heading_deg)
        self._picture = np.empty((height, width, 3), np.uint8)
        self._mask = np.zeros((height, width), np.uint8)
        columns, rows = width // _GRID + 2, height // _GRID + 2
        u, v = np.meshgrid(np.linspace(0, width - 1, columns), np.linspace(0, height - 1, rows))
        self._grid = np.stack((u.ravel(), v.ravel(), np.ones(u.size)))
        self._grid_shape = (rows, columns)
        self._frame = np.array(((0, 0), (width - 1, 0), (width - 1, height - 1), (0, height - 1)), float)
        self._skyline = self._skyline_directions()
        self._face_centres = self._world.boxes[:, _BOX_FACES].mean(axis=2)
        outward = self._face_centres - self._world.boxes.mean(axis=1)[:, np.newaxis]
        self._face_normals = outward / np.linalg.norm(outward, axis=2, keepdims=True)
        self._face_light = 0.62 + 0.38 * np.maximum(0.0, self._face_normals @ self._world.sun)

    def paint(self, scene: Scene) -> np.ndarray:
        """The picture (height, width, 3), blue, green, red; overwritten by the next call."""
        camera = Camera(scene, self._size, self._anchor)
        rays = camera.rays @ self._grid
        elevation = (rays[2] / np.linalg.norm(rays, axis=0)).astype(np.float32).reshape(self._grid_shape)
        if elevation.max() > -0.02:
            self._paint_sky(camera, elevation)
        if elevation.min() < 0.0:
            self._paint_ground(camera)
            self._paint_haze(camera, elevation)
            self._paint_markings(camera)
            self._paint_grain(camera)
            self._paint_boxes(camera)
        for corners, colour, distance in outlines(scene, self._anchor, camera):
            self._fill(corners, self._hazed(np.array([colour], float), np.array([distance]))[0])
        if scene.floor_down_m:
            self._paint_floor(scene, camera)
        if self._hud:
            self._paint_hud(scene, camera)
        if scene.rows:
            self._print_rows(scene)
        if self._strip:
            draw_strip(self._picture, scene.frame, scene.sim_time)
        return self._picture

    # --- sky -----------------------------------------------------------------------------------------------------

    def _paint_sky(self, camera: Camera, elevation: np.ndarray) -> None:
        share = np.clip(elevation, 0.0, 1.0)[..., np.newaxis] ** 0.6
        sky = (_HAZE + (_ZENITH - _HAZE) * share).astype(np.uint8)
        cv2.resize(sky, self._size, dst=self._picture, interpolation=cv2.INTER_LINEAR)
        sun = camera.directions_to_camera(self._world.sun[np.newaxis])
        if sun[0, 2] > 0.05:
            x, y = camera.project(sun)[0]
            radius = 0.02 * camera.focal
            for scale, colour in ((2.6, (225, 228, 232)), (1.7, (225, 240, 248)), (1.0, (240, 253, 255))):
                if abs(x) < _FAR_PIXELS and abs(y) < _FAR_PIXELS:
                    self._disc(x, y, radius * scale, colour)
        quads = camera.directions_to_camera(self._skyline) * 100.0
        quads = quads[quads[..., 2].max(axis=1) > 0.1]
        self._fill_quads(camera, quads, np.broadcast_to(_MOUNTAIN, (len(quads), 3)))

    def _disc(self, x: float, y: float, radius: float, colour: tuple[int, int, int]) -> None:
        one = 1 << _SHIFT
        centre = (int(x * one), int(y * one))
        cv2.circle(self._picture, centre, int(radius * one), colour, -1, cv2.LINE_AA, _SHIFT)

    def _skyline_directions(self) -> np.ndarray:
        azimuth, height = self._world.skyline[:, 0], self._world.skyline[:, 1]
        top = np.column_stack((np.sin(azimuth), np.cos(azimuth), np.tan(height)))
        bottom = top * (1.0, 1.0, 0.0) - (0.0, 0.0, 0.01)
        quads = np.stack((bottom[:-1], top[:-1], top[1:], bottom[1:]), axis=1)
        seen: np.ndarray = quads[np.maximum(height[:-1], height[1:]) > 0.0]
        return seen

    # --- ground --------------------------------------------------------------------------------------------------

    def _paint_ground(self, camera: Camera) -> None:
        """Textures in bands of depth: parallel to the horizon, each with the level of detail that fits."""
        up = camera.eye[2]
        falling = -camera.rays[2]  # height over depth of the ground at a pixel, linear in the picture
        at_corners = self._frame @ falling[:2] + falling[2]
        # A texel of `size` suits where depth * sqrt(depth / up) / focal <= size.
        limits = [
            (_SHARPNESS * size * camera.focal * math.sqrt(up)) ** (2.0 / 3.0) for size, _ in self._world.levels[:-1]
        ]
        nearest = 0.0
        for (size, texture), limit in zip(self._world.levels, [*limits, math.inf]):
            depth = max(limit, nearest)
            steepest = math.inf if nearest == 0.0 else up / nearest
            self._paint_band(camera, texture, size, at_corners, falling, up / depth, steepest)
            nearest = depth

    def _band(
        self, at_corners: np.ndarray, falling: np.ndarray, lowest: float, steepest: float
    ) -> Optional[tuple[np.ndarray, tuple[int, int, int, int]]]:
        """Corners and bounding box (x, y, width, height) of the part of the picture between two depths."""
        region = clip(self._frame, at_corners - lowest)
        if len(region) >= 3 and math.isfinite(steepest):
            region = clip(region, steepest - (region @ falling[:2] + falling[2]))
        if len(region) < 3:
            return None
        x0, y0 = np.maximum(np.floor(region.min(axis=0)).astype(int) - 1, 0)
        x1, y1 = np.minimum(np.ceil(region.max(axis=0)).astype(int) + 2, self._size)
        return region, (x0, y0, x1 - x0, y1 - y0)

    def _warp(self, camera: Camera, texture: np.ndarray, size: float, area: tuple[int, int, int, int]) -> np.ndarray:
        """The texture as the area of the picture sees it on the ground."""
        x, y, width, height = area
        up = camera.eye[2]
        span = size * texture.shape[0]
        east, north = camera.eye[0] % span, camera.eye[1] % span
        falling = -camera.rays[2]
        # Row 0 of a texture is its north edge.
        to_texture = np.array(
            (
                (up * camera.rays[0] + east * falling) / size,
                -(up * camera.rays[1] + north * falling) / size,
                falling,
            )
        )
        to_texture = to_texture @ np.array(((1, 0, x), (0, 1, y), (0, 0, 1.0)))
        return cv2.warpPerspective(
            texture,
            to_texture,
            (int(width), int(height)),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_WRAP,
        )

    def _paint_band(
        self,
        camera: Camera,
        texture: np.ndarray,
        size: float,
        at_corners: np.ndarray,
        falling: np.ndarray,
        lowest: float,
        steepest: float,
    ) -> None:
        band = self._band(at_corners, falling, max(lowest, 0.8 / camera.focal), steepest)
        if band is None:
            return
        region, (x, y, width, height) = band
        mask = self._mask[y : y + height, x : x + width]
        mask.fill(0)
        cv2.fillConvexPoly(mask, np.round((region - (x, y)) * (1 << _SHIFT)).astype(np.int32), 255, cv2.LINE_8, _SHIFT)
        # Column by column: the box around a band that lies askew is mostly outside it.
        for left in range(x, x + width, _TILE):
            right = min(left + _TILE, x + width)
            part = clip(region, region[:, 0] - left)
            part = clip(part, right - part[:, 0]) if len(part) >= 3 else part
            if len(part) < 3:
                continue
            top = max(math.floor(part[:, 1].min()) - 1, y)
            bottom = min(math.ceil(part[:, 1].max()) + 2, y + height)
            seen = self._warp(camera, texture, size, (left, top, right - left, bottom - top))
            inside = mask[top - y : bottom - y, left - x : right - x]
            cv2.copyTo(seen, inside, self._picture[top:bottom, left:right])

    def _paint_grain(self, camera: Camera) -> None:
        falling = -camera.rays[2]
        at_corners = self._frame @ falling[:2] + falling[2]
        grain = self._world.detail
        for span, depth in GRAINS:
            lowest = camera.eye[2] / depth
            band = self._band(at_corners, falling, lowest, math.inf)
            if band is None:
                continue
            x, y, width, height = band[1]
            seen = self._warp(camera, grain, span / grain.shape[0], (x, y, width, height))
            # Fades out with depth, and beyond it in the corners of the box.
            u, v = np.meshgrid(np.linspace(x, x + width - 1, 24), np.linspace(y, y + height - 1, 18))
            strength = (u * falling[0] + v * falling[1] + falling[2]) / lowest - 1.0
            weight = cv2.resize(np.clip(strength, 0.0, 1.0).astype(np.float32), (int(width), int(height)))
            if weight.min() < 1.0:
                seen = cv2.blendLinear(seen, np.full_like(seen, 128), weight, 1.0 - weight)
            part = self._picture[y : y + height, x : x + width]
            cv2.multiply(part, seen, dst=part, scale=1.0 / 128.0)

    def _paint_haze(self, camera: Camera, elevation: np.ndarray) -> None:
        distance = camera.eye[2] / np.maximum(-elevation, 1e-6)
        clear = np.where(elevation < 0.0, np.exp(-distance / _HAZE_M), 1.0).astype(np.float32)
        below = elevation < 0.0
        if not below.any() or clear[below].min() > 0.97:
            return
        # Per pixel: a coarse grid would let the haze run over the horizon into the sky. Only where there is any.
        width, height = self._size
        toward = -camera.rays[2].astype(np.float32)
        left = toward[1] * np.arange(height, dtype=np.float32) + toward[2]
        right = left + toward[0] * (width - 1)
        thickness = float(camera.eye[2]) / _HAZE_M  # over what falls away: the share of the haze's length
        rows = np.nonzero((np.minimum(left, right) < thickness / _LEAST_HAZE) & (np.maximum(left, right) > 0.0))[0]
        if rows.size == 0:
            return
        part = slice(rows[0], rows[-1] + 1)
        falling = toward[0] * np.arange(width, dtype=np.float32) + left[part, np.newaxis]
        sky = falling <= 0.0
        least: Any = 1e-7  # OpenCV takes a number too, which its types do not say
        cv2.max(falling, least, dst=falling)
        cv2.divide(-thickness, falling, dst=falling)
        shares = cv2.exp(falling)
        shares[sky] = 1.0
        haze = np.empty_like(self._picture[part])
        haze[:] = _HAZE.astype(np.uint8)
        self._picture[part] = cv2.blendLinear(self._picture[part], haze, shares, 1.0 - shares)

    # --- things --------------------------------------------------------------------------------------------------

    def _fill(self, corners: np.ndarray, colour: np.ndarray | tuple[int, int, int]) -> None:
        low, high = corners.min(axis=0), corners.max(axis=0)
        if high[0] < 0 or high[1] < 0 or low[0] > self._size[0] or low[1] > self._size[1]:
            return
        if min(low) < -_FAR_PIXELS or max(high) > _FAR_PIXELS:
            # Cut off, not moved: a line that runs out below the camera stays straight.
            for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)):
                corners = clip(corners, _FAR_PIXELS - sign * corners[:, axis])
            if len(corners) < 3:
                return
        points = np.round(corners * (1 << _SHIFT)).astype(np.int32)
        cv2.fillConvexPoly(self._picture, points, tuple(float(c) for c in colour), cv2.LINE_AA, _SHIFT)

    def _fill_quads(self, camera: Camera, quads: np.ndarray, colours: np.ndarray, smallest: float = 0.0) -> None:
        """Fills convex quadrangles (n, 4, 3) in camera axes, in their order.

        What can be done for all of them at once is: by far the most time went into single ones, most of them unseen.

        Args:
            camera: That sees them.
            quads: Their corners.
            colours: (n, 3)
            smallest: Smaller ones are not drawn, unless they reach behind the near plane [px].
        """
        depth = quads[..., 2]
        in_front = depth.min(axis=1) >= NEAR_M
        pixels = np.zeros((len(quads), 4, 2))
        pixels[in_front] = camera.project(quads[in_front].reshape(-1, 3)).reshape(-1, 4, 2)
        low, high = pixels.min(axis=1), pixels.max(axis=1)
        seen = in_front & (high >= 0.0).all(axis=1) & (low <= self._size).all(axis=1)
        seen &= (high - low).max(axis=1) >= smallest
        plain = seen & (low >= -_FAR_PIXELS).all(axis=1) & (high <= _FAR_PIXELS).all(axis=1)
        points = np.round(np.where(plain[:, np.newaxis, np.newaxis], pixels, 0.0) * (1 << _SHIFT)).astype(np.int32)
        tuples = colours.tolist()
        for i in np.nonzero(seen | (~in_front & (depth.max(axis=1) >= NEAR_M)))[0]:
            if plain[i]:
                cv2.fillConvexPoly(self._picture, points[i], tuples[i], cv2.LINE_AA, _SHIFT)
                continue
            corners = camera.polygon(quads[i])
            if corners is not None:
                self._fill(corners, tuples[i])

    def _hazed(self, colours: np.ndarray, distances: np.ndarray) -> np.ndarray:
        clear = np.exp(-distances / _HAZE_M)[:, np.newaxis]
        return colours * clear + _HAZE * (1.0 - clear)

    def _paint_markings(self, camera: Camera) -> None:
        in_camera = camera.to_camera(self._world.markings)
        distance = np.linalg.norm(in_camera.mean(axis=1), axis=1)
        self._fill_quads(camera, in_camera, self._hazed(self._world.marking_colours, distance), _SMALLEST)

    def _paint_boxes(self, camera: Camera) -> None:
        in_camera = camera.to_camera(self._world.boxes)
        depth = in_camera[..., 2].mean(axis=1)
        size = np.linalg.norm(in_camera[:, 6] - in_camera[:, 0], axis=1) * camera.focal
        seen = np.nonzero((depth > 0.0) & (depth < _BOX_DEPTH_M) & (size > _SMALLEST * depth))[0]
        colours = self._hazed(self._world.box_colours[seen], depth[seen])
        facing = ((camera.eye - self._face_centres[seen]) * self._face_normals[seen]).sum(axis=2) > 0.0
        order = np.argsort(-depth[seen])
        facing, seen, colours = facing[order], seen[order], colours[order]
        quads = in_camera[seen][:, _BOX_FACES]
        shaded = colours[:, np.newaxis] * self._face_light[seen][..., np.newaxis]
        self._fill_quads(camera, quads[facing], shaded[facing])

    def _paint_floor(self, scene: Scene, camera: Camera) -> None:
        """The cockpit's floor, which hides the ground from who looks down in it."""
        behind, ahead = scene.eye_forward_m - _FLOOR_M[0], scene.eye_forward_m + _FLOOR_M[0]
        corners = [(behind, -1), (ahead, -1), (ahead, 1), (behind, 1)]
        floor = np.array([(along, side * _FLOOR_M[1], scene.floor_down_m) for along, side in corners])
        if scene.eye_down_m < scene.floor_down_m:  # from below, the fuselage is not there
            polygon = camera.polygon(camera.body_to_camera(floor))
            if polygon is not None:
                self._fill(polygon, _FLOOR)

    # --- head-up display -----------------------------------------------------------------------------------------

    def _paint_hud(self, scene: Scene, camera: Camera) -> None:
        green, thick = (90, 255, 120), max(1, self._size[1] // 480)
        width, height = self._size
        scale = height / 960.0
        turn = math.radians(scene.roll_deg)
        along, down = np.array((math.cos(turn), -math.sin(turn))), np.array((math.sin(turn), math.cos(turn)))
        for step in range(-20, 21, 5):
            offset = math.tan(math.radians(max(-60.0, min(60.0, scene.pitch_deg - step)))) * camera.focal
            middle = np.array(camera.centre) + down * offset
            if np.hypot(*(middle - camera.centre)) > 0.35 * height:
                continue
            half = along * (0.16 if step == 0 else 0.07) * width
            ends = [tuple(int(v) for v in middle + sign * half) for sign in (-1, 1)]
            cv2.line(self._picture, ends[0], ends[1], green, thick, cv2.LINE_AA)
            if step:
                at = tuple(int(v) for v in middle + half + (4, 4))
                cv2.putText(
                    self._picture, f"{step:+d}", at, cv2.FONT_HERSHEY_SIMPLEX, 0.7 * scale, green, thick, cv2.LINE_AA
                )
        cv2.circle(self._picture, tuple(int(v) for v in camera.centre), int(8 * scale), green, thick, cv2.LINE_AA)
        texts = (
            (f"{scene.airspeed_kt:4.0f} kt", 0.06, 0.5),
            (f"{scene.altitude_m / FOOT_M:6.0f} ft", 0.78, 0.5),
            (f"{scene.vertical_speed_fpm:+6.0f} fpm", 0.78, 0.55),
            (f"HDG {scene.heading_deg % 360.0:03.0f}", 0.45, 0.07),
        )
        for text, x, y in texts:
            at = (int(x * width), int(y * (height - strip_height(height))))
            cv2.putText(self._picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 1.0 * scale, green, thick, cv2.LINE_AA)

    # --- Data Output -------------------------------------------------------------------------------------------------

    def _print_rows(self, scene: Scene) -> None:
        """Prints rows as X-Plane does with those chosen for the cockpit: numbers at the upper left."""
        width, height = self._size
        line = 0.035 * height
        for k, (number, *values) in enumerate(scene.rows):
            texts = [f"{number:.0f}"] + ["" if value == UNUSED_SLOT else f"{value:.2f}" for value in values]
            for column, text in enumerate(texts):
                at = (int((0.01 + 0.12 * column - (0.07 if column else 0.0)) * width), int((k + 1.2) * line))
                cv2.putText(self._picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, line / 36.0, _PRINT, 1, cv2.LINE_AA)
