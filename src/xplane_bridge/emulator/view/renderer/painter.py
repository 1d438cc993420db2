"""Draws a `Scene`: sky, sun, mountains, textured ground, aerodrome, buildings, head-up display, strip."""

from __future__ import annotations

import math

import cv2
import numpy as np

from xplane_bridge.emulator.view.renderer.camera import NEAR_M, Camera, clip
from xplane_bridge.emulator.view.renderer.ground import GroundView
from xplane_bridge.emulator.view.renderer.others import outlines
from xplane_bridge.emulator.view.renderer.scene import Scene
from xplane_bridge.emulator.view.renderer.strip import draw_strip, strip_height
from xplane_bridge.emulator.view.renderer.world import make_world
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
_LEAST_FALLING = 1e-7
#: The ground ends so far below the horizon [px].
_LEAST_PIXEL = 0.8
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
        self._picture = np.empty((0, 0, 4), np.uint8)  # the one that is being drawn
        self._all_haze = np.empty((height, width, 4), np.uint8)
        self._all_haze[:] = (*_HAZE.astype(np.uint8), 255)
        columns, rows = width // _GRID + 2, height // _GRID + 2
        u, v = np.meshgrid(np.linspace(0, width - 1, columns), np.linspace(0, height - 1, rows))
        self._grid = np.stack((u.ravel(), v.ravel(), np.ones(u.size)))
        self._grid_shape = (rows, columns)
        self._skyline = self._skyline_directions()
        self._face_centres = self._world.boxes[:, _BOX_FACES].mean(axis=2)
        outward = self._face_centres - self._world.boxes.mean(axis=1)[:, np.newaxis]
        self._face_normals = outward / np.linalg.norm(outward, axis=2, keepdims=True)
        self._face_light = 0.62 + 0.38 * np.maximum(0.0, self._face_normals @ self._world.sun)

    def paint(self, scene: Scene) -> np.ndarray:
        """The picture (height, width, 3): blue, green, red."""
        width, height = self._size
        picture = np.empty((height, width, 4), np.uint8)
        self.paint_into(scene, picture)
        return cv2.cvtColor(picture, cv2.COLOR_BGRA2BGR)

    def paint_into(self, scene: Scene, picture: np.ndarray) -> None:
        """Draws into a picture (height, width, 4): blue, green, red, and one without a meaning."""
        self._picture = picture
        camera = Camera(scene, self._size, self._anchor)
        rays = camera.rays @ self._grid
        elevation = (rays[2] / np.linalg.norm(rays, axis=0)).astype(np.float32).reshape(self._grid_shape)
        nearest = _LEAST_PIXEL / camera.focal  # to the horizon that ground is drawn
        if elevation.max() > -max(0.02, nearest):
            self._paint_sky(camera, elevation)
        if elevation.min() < 0.0:
            ground = GroundView(camera, self._size, nearest)
            self._paint_ground(camera, ground)
            self._paint_haze(camera, ground)
            self._paint_markings(camera)
            self._paint_grain(camera, ground)
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

    # --- sky -----------------------------------------------------------------------------------------------------

    def _paint_sky(self, camera: Camera, elevation: np.ndarray) -> None:
        share = np.clip(elevation, 0.0, 1.0)[..., np.newaxis] ** 0.6
        sky = (_HAZE + (_ZENITH - _HAZE) * share).astype(np.uint8)
        sky = cv2.cvtColor(sky, cv2.COLOR_BGR2BGRA)
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

    def _paint_ground(self, camera: Camera, ground: GroundView) -> None:
        """Textures in bands of depth, each with the level of detail that fits."""
        up = camera.eye[2]
        # A texel of `size` suits where depth * sqrt(depth / up) / focal <= size.
        limits = [
            (_SHARPNESS * level.texel_m * camera.focal * math.sqrt(up)) ** (2.0 / 3.0)
            for level in self._world.levels[:-1]
        ]
        steepest = math.inf
        for level, limit in zip(self._world.levels, [*limits, math.inf]):
            lowest = min(max(up / limit, ground.least), steepest)
            for area in ground.boxes(lowest, steepest):
                inside = cv2.inRange(ground.falling[area], lowest, steepest)
                cv2.copyTo(ground.sample(level, area), inside, self._picture[ground.picture(area)])
            steepest = lowest

    def _paint_grain(self, camera: Camera, ground: GroundView) -> None:
        for grain, depth in self._world.grains:
            lowest = camera.eye[2] / depth
            for area in ground.boxes(lowest, math.inf):
                seen = ground.sample(grain, area)
                # Fades out with depth, and beyond it in the corners of the box.
                falling = ground.falling[area]
                fading = np.nonzero(np.minimum(falling[:, 0], falling[:, -1]) < 2.0 * lowest)[0]
                if fading.size:
                    rows = slice(fading[0], fading[-1] + 1)
                    weight = np.clip(falling[rows] * np.float32(1.0 / lowest) - np.float32(1.0), 0.0, 1.0)
                    seen[rows] = cv2.blendLinear(seen[rows], np.full_like(seen[rows], 128), weight, 1.0 - weight)
                part = self._picture[ground.picture(area)]
                cv2.multiply(part, seen, dst=part, scale=1.0 / 128.0)

    def _paint_haze(self, camera: Camera, ground: GroundView) -> None:
        thickness = float(camera.eye[2]) / _HAZE_M  # over what falls away: the share of the haze's length
        for area in ground.boxes(0.0, thickness / _LEAST_HAZE):
            falling = ground.falling[area]
            # Over the mountains, too, where they end below the horizon.
            # Not by OpenCV: an area of one to four pixels is a scalar to it.
            clear = cv2.exp(np.float32(-thickness) / np.maximum(falling, np.float32(_LEAST_FALLING)))
            clear += _LEAST_HAZE  # so that it begins without a step
            np.minimum(clear, 1.0, out=clear)
            np.copyto(clear, 1.0, where=falling <= 0.0)  # also the sky
            part = self._picture[ground.picture(area)]
            haze = self._all_haze[: part.shape[0], : part.shape[1]]
            cv2.blendLinear(part, haze, clear, 1.0 - clear, dst=part)

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
            offset = math.tan(math.radians(max(-60.0, min(60.0, scene.pitch_deg - step))))
            middle = np.array(camera.centre) + down * offset * camera.focals
            if np.hypot(*(middle - camera.centre)) > 0.35 * height:
                continue
            half = along * (0.16 if step == 0 else 0.07) * width * camera.focals / camera.focal
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
