"""What is labelled in a picture: runways, horizon, sun, other aircraft; each as plain values for a line of JSON."""

from __future__ import annotations

import math
from typing import Any, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from xplane_bridge.labels.apt import Airport, Runway
from xplane_bridge.labels.camera import NEAR_M, Camera, clip
from xplane_bridge.labels.heights import Height, Profile
from xplane_bridge.labels.world import SIDE_PARTS, RunwayFrame, World
from xplane_bridge.units import EARTH_RADIUS_M

#: A label less sure than this is `coarse` [px].
COARSE_PX = 3.0
#: What is not as wide and as high in the picture is left out: it cannot be seen [px].
LEAST_PX = 1.0
#: How well a file's latitudes and longitudes say what X-Plane draws [m].
MAP_SIGMA_M = 0.5
#: What other aircraft are taken to measure across by default [m].
SPAN_M = 12.0
#: Half of the sun's disc [rad].
_SUN_RADIUS = math.radians(0.53 / 2)
#: How well the sun's direction is known [rad]: with the scenery's origin, and without it, whose axes it is against.
_SUN_SIGMA, _SUN_SIGMA_NO_ORIGIN = math.radians(0.01), math.radians(0.4)
#: Azimuths that the horizon is drawn through, to each side of the line of sight.
_HORIZON_POINTS, _HORIZON_REACH = 64, math.radians(85.0)


class Other(NamedTuple):
    """Another aircraft at the time of a picture."""

    name: str
    latitude: float  #: [deg]
    longitude: float  #: [deg]
    altitude: float  #: [m MSL]
    sigma: float  #: [m] of its place, in every direction
    span: float = SPAN_M  #: [m] a ball of this diameter is its box


class Sun(NamedTuple):
    """Where the sun stands, in the axes of the scenery's origin."""

    elevation: float  #: [deg] above the level there
    heading: float  #: [deg] true
    origin: Optional[tuple[float, float]] = None  #: latitude, longitude [deg]; None: not known


class Labeller:
    """Labels pictures of one airport.

    Args:
        airport: Its runways.
        profiles: The height of each, in the same order.
        world: Where places lie.
        map_sigma: How well its runways lie on the map [m].
    """

    def __init__(
        self, airport: Airport, profiles: Sequence[Profile], world: World, map_sigma: float = MAP_SIGMA_M
    ) -> None:
        self._world, self._map_sigma = world, map_sigma
        frames = [(RunwayFrame(runway, 0), RunwayFrame(runway, 1)) for runway in airport.runways]
        self._runways = list(zip(airport.runways, frames, profiles))
        self._lowest = min(
            along.at(part * frame.length).metres
            for _, (frame, _), along in self._runways
            for part in np.linspace(0.0, 1.0, SIDE_PARTS + 1)
        )  #: [m MSL] of the ground there

    def label(self, camera: Camera, sun: Optional[Sun], others: Sequence[Other] = ()) -> list[dict[str, Any]]:
        """Label one picture; what lies outside it altogether is left out."""
        objects = [self._runway(camera, *runway) for runway in self._runways]
        objects.append(self._horizon(camera))
        if sun is not None:
            objects.append(self._sun(camera, sun))
        objects += [self._other(camera, other) for other in others]
        return [thing for thing in objects if thing is not None]

    # --- runways -------------------------------------------------------------------------------------------------

    def _runway(
        self, camera: Camera, runway: Runway, frames: tuple[RunwayFrame, RunwayFrame], profile: Profile
    ) -> Optional[dict[str, Any]]:
        frame = frames[_looked_along(camera, frames[0])]
        half, length = 0.5 * frame.width, frame.length
        parts = np.linspace(0.0, length, SIDE_PARTS + 1)
        outline = [(along, -half) for along in parts] + [(along, half) for along in parts[::-1]]
        optical, beyond = self._optical(camera, frame, profile, outline)
        polygon = camera.polygon(clip(optical, -beyond))
        box = _box(polygon)
        if box is None:
            return None
        near, far = frame.near.displaced, length - frame.far.displaced
        points = {
            "TR": (length, half),
            "TL": (length, -half),
            "BL": (0.0, -half),
            "BR": (0.0, half),
            "threshold_near_left": (near, -half),
            "threshold_near_right": (near, half),
            "threshold_far_left": (far, -half),
            "threshold_far_right": (far, half),
            "centre_near": (near, 0.0),
            "centre_far": (far, 0.0),
        }
        named = {name: self._point(camera, frame, profile, *at) for name, at in points.items()}
        optical, beyond = self._optical(camera, frame, profile, [(x, 0.0) for x in np.linspace(near, far, 9)])
        centre = camera.line(optical[beyond <= 0.0])
        heights = [profile.at(frame.from_first_end(along)) for along in (0.0, length)]
        return {
            "kind": "runway",
            "name": frame.near.number,
            "opposite": frame.far.number,
            "points": named,
            "polygon": _rounded(polygon),
            "centre_line": [_rounded(part) for part in centre],
            "box": box,
            **_sure([point["sigma_px"] for point in named.values() if point["state"] == "visible"] or [_worst(named)]),
            "height": {
                "source": profile.source,
                "near_m": round(heights[0].metres, 2),
                "far_m": round(heights[1].metres, 2),
                "sigma_m": round(max(height.sigma for height in heights), 2),
            },
            "surface": runway.surface,
            **self._approach(camera, frame, profile.at(frame.from_first_end(near))),
        }

    def line_on(
        self, camera: Camera, runway: int, right: float, parts: Sequence[float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (n, 2) of a line along a runway, and whether each is in front of the camera.

        Args:
            camera: Of the picture.
            runway: Number of the runway in the airport.
            right: [m] of its centre line, seen from its first end.
            parts: [m] along, from its first end.
        """
        _, frames, profile = self._runways[runway]
        optical, _ = self._optical(camera, frames[0], profile, [(along, right) for along in parts])
        return camera.pixels(optical), optical[:, 2] > 1.0

    def _place(self, frame: RunwayFrame, profile: Profile, along: float, right: float) -> tuple[np.ndarray, Height]:
        height = profile.at(frame.from_first_end(along))
        latitude, longitude = frame.geodetic(along, right)
        return self._world.place(latitude, longitude, height.metres), height

    def _optical(
        self, camera: Camera, frame: RunwayFrame, profile: Profile, points: Sequence[tuple[float, float]]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Right, down, forward of the camera (n, 3) of points of a runway; how far beyond the earth's curve [m]."""
        places, heights = zip(*(self._place(frame, profile, *point) for point in points))
        optical = camera.optical(np.array(places))
        # It lies on the ground, so that is as high as its lowest part; a height that is not sure hides nothing.
        farthest = [self._farthest_seen(self._lowest, camera.height, h.metres + h.sigma) for h in heights]
        return optical, np.linalg.norm(optical, axis=1) - farthest

    def _point(
        self, camera: Camera, frame: RunwayFrame, profile: Profile, along: float, right: float
    ) -> dict[str, Any]:
        (optical,), (beyond,) = self._optical(camera, frame, profile, [(along, right)])
        sigma_height = profile.at(frame.from_first_end(along)).sigma
        return _point(camera, optical, sigma_height, self._map_sigma, hidden=beyond > 0.0)

    def _approach(self, camera: Camera, frame: RunwayFrame, threshold: Height) -> dict[str, Any]:
        """Where the camera is, seen from the threshold it looks at."""
        position = frame.along_right(*self._below(camera))
        along = frame.near.displaced - position[0]
        above = camera.height - threshold.metres
        return {
            "slant_distance_m": round(math.sqrt(along * along + position[1] ** 2 + above * above), 1),
            "along_track_distance_m": round(along, 1),
            "height_above_threshold_m": round(above, 2),
            "lateral_path_angle_deg": round(math.degrees(math.atan2(position[1], along)), 4),
            "vertical_path_angle_deg": round(
                math.degrees(math.atan2(above, math.hypot(along + 305.0, position[1]))), 4
            ),
        }

    def _below(self, camera: Camera) -> tuple[float, float]:
        """Latitude and longitude [deg] of the camera: a lever arm from the aircraft, so flat."""
        pose = camera.pose
        level = self._world.level(pose.latitude, pose.longitude)
        north, east, _ = level @ (camera.place - self._world.place(pose.latitude, pose.longitude, pose.altitude))
        degrees = math.degrees(1.0 / EARTH_RADIUS_M)
        cosine = max(math.cos(math.radians(pose.latitude)), 1e-6)
        return pose.latitude + degrees * float(north), pose.longitude + degrees * float(east) / cosine

    # --- what is far away ----------------------------------------------------------------------------------------

    def _horizon(self, camera: Camera) -> Optional[dict[str, Any]]:
        dip = self._world.dip(camera.height)
        lines = {name: _horizon_line(camera, angle) for name, angle in (("level", 0.0), ("dipped", dip))}
        if not any(lines.values()):
            return None
        sigma = camera.sigma(math.inf, np.array((0.0, 0.0, 1.0)), 0.0, 0.0)
        return {
            "kind": "horizon",
            **{name: [_rounded(part) for part in parts] for name, parts in lines.items()},
            "dip_deg": round(math.degrees(dip), 5),
            "seen": "geometric",  # terrain and haze stand before it
            **_sure([sigma]),
        }

    def _sun(self, camera: Camera, sun: Sun) -> Optional[dict[str, Any]]:
        if sun.elevation < -math.degrees(_SUN_RADIUS + self._world.dip(camera.height)):
            return None
        elevation, heading = math.radians(sun.elevation), math.radians(sun.heading)
        flat = math.cos(elevation)
        ned = np.array((flat * math.cos(heading), flat * math.sin(heading), -math.sin(elevation)))
        pose = camera.pose
        level = self._world.level(*(sun.origin or (pose.latitude, pose.longitude)))
        optical = camera.to_optical @ level.T @ ned
        if optical[2] <= 0.0:
            return None
        centre = camera.pixels(optical[np.newaxis])[0]
        seen = _seen_ball(camera, centre, camera.focals * math.tan(_SUN_RADIUS) / float(optical[2]))
        if seen is None:
            return None
        sigma = camera.sigma(math.inf, optical, 0.0, 0.0, _SUN_SIGMA if sun.origin else _SUN_SIGMA_NO_ORIGIN)
        return {"kind": "sun", "centre": _rounded(centre[np.newaxis])[0], **seen, **_sure([sigma])}

    def _other(self, camera: Camera, other: Other) -> Optional[dict[str, Any]]:
        place = self._world.place(other.latitude, other.longitude, other.altitude)
        optical = camera.optical(place)[0]
        distance = float(np.linalg.norm(optical))
        farthest = self._farthest_seen(min(0.0, self._lowest), camera.height, other.altitude + 0.5 * other.span)
        if optical[2] <= NEAR_M or distance > farthest:
            return None
        centre = camera.pixels(optical[np.newaxis])[0]
        radii = camera.focals * 0.5 * other.span / float(optical[2])
        seen = _seen_ball(camera, centre, radii)
        if seen is None:
            return None
        return {
            "kind": "aircraft",
            "name": other.name,
            "centre": _rounded(centre[np.newaxis])[0],
            "distance_m": round(distance, 1),
            **seen,
            "size_px": round(2.0 * float(radii.max()), 3),
            "seen": "geometric",  # terrain, clouds and the own cockpit stand before it
            **_sure([camera.sigma(distance, optical / distance, other.sigma, other.sigma)]),
        }

    def _farthest_seen(self, ground: float, *heights: float) -> float:
        """How far apart two at these heights [m MSL] still see each other over the curve of the ground [m MSL] [m]."""
        lowest = min(ground, *heights)
        return sum(self._world.horizon(height - lowest) for height in heights)


def _looked_along(camera: Camera, frame: RunwayFrame) -> int:
    """Which end of a runway is the near one: 0 when the camera looks along `frame`, which begins at the first."""
    forward = camera.ned_to_optical[2, :2]
    if math.hypot(*forward) < 0.2:  # it looks up or down: what is up in the picture is ahead
        forward = -camera.ned_to_optical[1, :2]
    return 0 if float(forward @ (math.cos(frame.heading), math.sin(frame.heading))) >= 0.0 else 1


def _point(
    camera: Camera, optical: np.ndarray, sigma_height: float, sigma_place: float, hidden: bool
) -> dict[str, Any]:
    distance = float(np.linalg.norm(optical))
    sigma = camera.sigma(distance, optical / distance, sigma_height, sigma_place)
    pixel = camera.pixels(optical[np.newaxis])
    state = "behind" if optical[2] <= 0.0 else "outside" if not camera.inside(pixel)[0] else "visible"
    state = "beyond" if hidden and state == "visible" else state
    u, v = (None, None) if state == "behind" else (round(float(part), 3) for part in pixel[0])
    return {"u": u, "v": v, "state": state, "distance_m": round(distance, 1), **_sure([sigma])}


def _horizon_line(camera: Camera, dip: float) -> list[np.ndarray]:
    forward = camera.ned_to_optical[2]
    if math.hypot(*forward[:2]) < 0.2:
        forward = -camera.ned_to_optical[1]
    middle = math.atan2(forward[1], forward[0])
    azimuth = middle + np.linspace(-_HORIZON_REACH, _HORIZON_REACH, 2 * _HORIZON_POINTS + 1)
    flat, down = math.cos(dip), math.sin(dip)
    ned = np.stack((flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(len(azimuth), down)), axis=1)
    return camera.line((ned @ camera.ned_to_optical.T) * 1e6)


def _worst(points: Mapping[str, Mapping[str, Any]]) -> float:
    return max(float(point["sigma_px"]) for point in points.values())


def _sure(sigmas: Sequence[float]) -> dict[str, Any]:
    """How sure the worst of some points is."""
    sigma = max(sigmas)
    return {"sigma_px": round(sigma, 3), "coarse": sigma > COARSE_PX}


def _box(pixels: np.ndarray) -> Optional[list[float]]:
    """Left, top, right, bottom; None where that is too small to be seen."""
    if not len(pixels) or (np.ptp(pixels, axis=0) < LEAST_PX).any():
        return None
    return [round(float(part), 3) for part in (*pixels.min(axis=0), *pixels.max(axis=0))]


def _seen_ball(camera: Camera, centre: np.ndarray, radii: np.ndarray) -> Optional[dict[str, Any]]:
    """The box of a ball's part that is in the picture, and whether that is all of it; None where none can be seen."""
    whole = np.stack((centre - radii, centre + radii))
    part = np.clip(whole, *camera.area)
    box = _box(part)
    return None if box is None else {"box": box, "state": "visible" if (part == whole).all() else "cut"}


def _rounded(pixels: np.ndarray) -> list[list[float]]:
    return [[round(float(u), 3), round(float(v), 3)] for u, v in pixels]
