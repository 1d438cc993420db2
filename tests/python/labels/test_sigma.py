"""How sure a place in the picture is, against the projection of what was moved or turned by so much."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.labels.camera import Camera, Optics, Pose
from xplane_bridge.labels.world import Flat

#: So small that the projection is linear.
METRES, ANGLE = 0.01, 1e-5
DISTANCE = 300.0
PERIOD = 1.0 / 60.0
VELOCITY = np.array((40.0, 12.0, 3.0))
#: Of the camera, looking ahead, into forward, left, up.
AHEAD = np.array((-0.5, 0.5, -0.5, 0.5))
PLACES = {
    "middle": (319.5, 239.5),
    "side": (639.5, 239.5),
    "top": (319.5, -0.5),
    "lower corner": (639.5, 479.5),
    "upper corner": (-0.5, -0.5),
}


def camera(field_of_view: float, pitch: float = 0.0, stretch: float = 1.0, **changes: object) -> Camera:
    focal, half = 320.0 / math.tan(math.radians(0.5 * field_of_view)), math.radians(0.5 * pitch)
    orientation = np.array((0.0, math.sin(half), 0.0, math.cos(half)))
    pose = Pose(0.0, 0.0, 300.0, orientation, np.zeros(3), AHEAD, period=PERIOD)._replace(**changes)
    return Camera(Flat(0.0, 0.0), pose, Optics(640, 480, focal, stretch * focal, 319.5, 239.5))


def ray(seen: Camera, place: str) -> np.ndarray:
    (u, v), optics = PLACES[place], seen.optics
    through = np.array(((u - optics.cx) / optics.fx, (v - optics.cy) / optics.fy, 1.0))
    return through / np.linalg.norm(through)


def sphere() -> np.ndarray:
    """Directions (n, 3) all around."""
    turns, heights = np.meshgrid(np.linspace(0.0, 2 * math.pi, 181), np.linspace(-1.0, 1.0, 91))
    flat = np.sqrt(1.0 - heights**2)
    return np.stack((flat * np.cos(turns), flat * np.sin(turns), heights), axis=-1).reshape(-1, 3)


def moved(seen: Camera, point: np.ndarray, by: np.ndarray) -> float:
    """Pixels by which the worst of some displacements (n, 3) moves a point."""
    shifts = seen.pixels(point + np.atleast_2d(by)) - seen.pixels(point[np.newaxis])
    return float(np.max(np.linalg.norm(shifts, axis=1)))


def alone(sigma: float) -> float:
    """A term without the 0.3 px of every sigma."""
    return math.sqrt(sigma**2 - 0.3**2)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("field_of_view", "pitch", "stretch"), [(60, 0, 1), (60, -25, 1), (90, 0, 1), (90, -25, 1.3)])
def test_each_term_is_what_its_error_moves_the_point_by(
    place: str, field_of_view: float, pitch: float, stretch: float
) -> None:
    def of(**changes: object) -> Camera:
        return camera(field_of_view, pitch, stretch, **changes)

    seen = of()
    towards = ray(seen, place)
    point, (north, east, down) = DISTANCE * towards, seen.ned_to_optical.T
    large = 1e3  # times, so that 0.3 px are little
    bearings = np.linspace(0.0, 2 * math.pi, 181)
    level = np.outer(np.cos(bearings), north) + np.outer(np.sin(bearings), east)
    turned = large * moved(seen, point, ANGLE * np.cross(sphere(), point))
    neighbour = {"may_be_neighbour": True}
    drifted = moved(seen, point, 1e-3 * PERIOD * seen.ned_to_optical @ VELOCITY)
    found = {
        "height": seen.sigma(DISTANCE, towards, large * METRES, 0.0),
        "map": seen.sigma(DISTANCE, towards, 0.0, large * METRES),
        "lever": of(sigma_place=large * METRES).sigma(DISTANCE, towards, 0.0, 0.0),
        "angle": of(sigma_angle=large * ANGLE).sigma(DISTANCE, towards, 0.0, 0.0),
        "angle of what is far": of(sigma_angle=large * ANGLE).sigma(math.inf, towards, 0.0, 0.0),
        "bearing": seen.sigma(math.inf, towards, 0.0, 0.0, large * ANGLE),
        "turn": of(turn_rate=large * ANGLE / PERIOD, **neighbour).sigma(math.inf, towards, 0.0, 0.0),
        "motion": of(velocity=large * VELOCITY, **neighbour).sigma(DISTANCE, towards, 0.0, 0.0),
    }
    assert {name: alone(sigma) for name, sigma in found.items()} == pytest.approx(
        {
            "height": large * moved(seen, point, METRES * down),
            "map": large * moved(seen, point, METRES * level),
            "lever": large * moved(seen, point, METRES * sphere()),
            "angle": turned,
            "angle of what is far": turned,
            "bearing": turned,
            "turn": turned,
            "motion": 1e3 * large * drifted,
        },
        rel=2e-3,
    )


def test_off_the_axis_it_is_less_sure() -> None:
    """By hand, level at 300 m with 90 degrees across: below and to the right, at depth 599 m."""
    seen = camera(90.0)
    towards = np.array((310.5, 160.5, 320.0))
    depth = 300.0 / (towards[1] / towards[2])
    distance = depth * float(np.linalg.norm(towards)) / towards[2]
    towards /= np.linalg.norm(towards)
    # 15 m of 300 m are a twentieth of the depth at which that pixel meets the ground: down alone moves v.
    assert alone(seen.sigma(distance, towards, 15.0, 0.0)) == pytest.approx(320.0 * 15.0 / depth)
    sure = alone(camera(90.0, sigma_angle=math.radians(0.2)).sigma(distance, towards, 0.0, 0.0))
    assert sure == pytest.approx(320.0 * math.radians(0.2) * (1.0 + (310.5**2 + 160.5**2) / 320.0**2))


def test_outside_the_picture_it_is_as_at_its_border_and_behind_by_the_angle() -> None:
    seen = camera(90.0, sigma_angle=math.radians(0.2))
    corner = seen.sigma(math.inf, ray(seen, "lower corner"), 0.0, 0.0)
    for right in (10.0, 1e9):
        assert seen.sigma(math.inf, np.array((right, 0.75 * right, 1.0)), 0.0, 0.0) == pytest.approx(corner, rel=1e-3)
    behind = seen.sigma(math.inf, np.array((0.6, 0.0, -0.8)), 0.0, 0.0)
    assert alone(behind) == pytest.approx(320.0 * math.radians(0.2), rel=1e-3)
