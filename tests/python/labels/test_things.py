"""Projection and uncertainty in numbers worked out by hand: sphere, dip, corners by name, displaced thresholds."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from xplane_bridge.labels.apt import Airport, Runway, RunwayEnd
from xplane_bridge.labels.camera import Camera, Optics, Pose
from xplane_bridge.labels.heights import Ground, Profile, profile
from xplane_bridge.labels.things import Labeller, Other, Sun
from xplane_bridge.labels.world import Flat, RunwayFrame, Sphere

R = 6378145.0
F = 554.26
OPTICS = Optics(640, 480, F, F, 319.5, 239.5)
#: Right, down, forward of the camera into forward, left, up: looks ahead.
AHEAD = np.array((-0.5, 0.5, -0.5, 0.5))
#: A runway along the equator to the east: 3000 m, its first end at 0 E; displaced by 400 and 250 m.
LENGTH = 3000.0
EAST = math.degrees(LENGTH / R)
RUNWAY = Runway(60.0, 1, (RunwayEnd("09", 0.0, 0.0, 400.0, 0.0), RunwayEnd("27", 0.0, EAST, 250.0, 0.0)))
AIRPORT = Airport("XTST", "Test", 100.0, (RUNWAY,), "apt.dat", "", 1100)
EXACT = Profile(np.zeros(1), np.array([100.0]), 0.0, "table", 0.0)


def yaw(heading_deg: float, pitch_deg: float = 0.0) -> np.ndarray:
    """Quaternion x, y, z, w of an aircraft without roll."""
    h, p = math.radians(heading_deg) / 2, math.radians(pitch_deg) / 2
    x, y = -math.sin(p) * math.sin(h), math.sin(p) * math.cos(h)
    return np.array((x, y, math.cos(p) * math.sin(h), math.cos(p) * math.cos(h)))


def pose(east: float, height: float, heading: float = 90.0, pitch: float = 0.0, **changes: object) -> Pose:
    """At so many metres east of the runway's first end, on the equator."""
    values = {"lever": np.zeros(3), "rotation": AHEAD, **changes}
    return Pose(0.0, math.degrees(east / R), height, yaw(heading, pitch), **values)  # type: ignore[arg-type]


def labelled(camera: Camera, **others: object) -> dict[str, dict]:
    return labelled_with(EXACT, camera, **others)


def labelled_with(height: Profile, camera: Camera, **others: object) -> dict[str, dict]:
    things = Labeller(AIRPORT, [height], Sphere(), 0.0).label(camera, others.get("sun"), others.get("others", ()))  # type: ignore[arg-type]
    json.dumps(things, allow_nan=False)
    return {thing["kind"]: thing for thing in things}


def test_corners_on_the_sphere_have_their_names_and_places() -> None:
    runway = labelled(Camera(Sphere(), pose(-2000.0, 250.0), OPTICS))["runway"]
    assert (runway["name"], runway["opposite"]) == ("09", "27")
    # Places on the equator by sines and cosines of the arc: x ahead, y down, in the camera's level.
    for name, along, right in (("BL", 0.0, -30.0), ("BR", 0.0, 30.0), ("TL", LENGTH, -30.0), ("TR", LENGTH, 30.0)):
        arc = (2000.0 + along) / R
        side = math.hypot(1.0, right / R)
        ahead = (R + 100.0) * math.sin(arc) / side
        down = R + 250.0 - (R + 100.0) * math.cos(arc) / side
        across = (R + 100.0) * right / R / side
        point = runway["points"][name]
        assert (point["u"], point["v"]) == pytest.approx(
            (319.5 + F * across / ahead, 239.5 + F * down / ahead), abs=2e-3
        )
    # What a flat earth would have said of the far end is half a pixel off: 2 m of 5 km.
    far = 0.5 * (runway["points"]["TL"]["v"] + runway["points"]["TR"]["v"])
    assert far - (239.5 + F * 150.0 / 5000.0) == pytest.approx(F * 5000.0 / (2 * R), rel=0.05)
    assert runway["slant_distance_m"] == pytest.approx(math.hypot(2400.0, 150.0), abs=0.6)
    assert runway["along_track_distance_m"] == pytest.approx(2400.0, abs=0.2)
    assert runway["height_above_threshold_m"] == pytest.approx(150.0, abs=0.01)


def test_displaced_thresholds_are_metres_inside_and_the_near_end_is_where_it_looks_from() -> None:
    runway = labelled(Camera(Sphere(), pose(5000.0, 250.0, 270.0), OPTICS))["runway"]
    assert (runway["name"], runway["opposite"]) == ("27", "09")
    for name, distance in (("BL", 2000.0), ("threshold_near_left", 2250.0), ("threshold_far_left", 4600.0)):
        point = runway["points"][name]
        assert point["v"] == pytest.approx(239.5 + F * (150.0 + distance**2 / 2 / R) / distance, abs=0.02), name
        assert point["u"] == pytest.approx(319.5 - F * 30.0 / distance, abs=0.02), name
    assert runway["points"]["centre_near"]["u"] == pytest.approx(319.5, abs=0.01)
    assert runway["points"]["threshold_near_right"]["u"] > 319.5 > runway["points"]["threshold_near_left"]["u"]


def test_the_camera_stands_where_its_lever_arm_puts_it() -> None:
    plain = labelled(Camera(Sphere(), pose(-2000.0, 250.0), OPTICS))["runway"]["points"]["BL"]
    # 10 m forward, 3 m to the left, 2 m up: the same as an aircraft that flies there.
    moved = Camera(Sphere(), pose(-2010.0, 248.0, lever=np.array((10.0, 3.0, 2.0))), OPTICS)
    point = labelled(moved)["runway"]["points"]["BL"]
    assert moved.height == pytest.approx(250.0)
    assert point["u"] == pytest.approx(plain["u"] + F * 3.0 / 2000.0, abs=1e-3)
    assert point["v"] == pytest.approx(plain["v"], abs=2e-3)


@pytest.mark.parametrize(("height", "dip_px"), [(300.0, 5.4), (1000.0, 9.8), (3000.0, 17.0)])
def test_the_horizon_dips(height: float, dip_px: float) -> None:
    horizon = labelled(Camera(Sphere(), pose(-20000.0, height), OPTICS))["horizon"]
    (level,), (dipped,) = horizon["level"], horizon["dipped"]
    assert [v for _, v in level] == pytest.approx([239.5] * len(level), abs=1e-3)
    assert level[0][0] == pytest.approx(-0.5, abs=1e-3)
    assert level[-1][0] == pytest.approx(639.5, abs=1e-3)
    middle = min(dipped, key=lambda point: abs(point[0] - 319.5))
    assert middle[1] - 239.5 == pytest.approx(dip_px, abs=0.06)
    assert labelled(Camera(Flat(0.0, 0.0), pose(-20000.0, height), OPTICS))["horizon"]


@pytest.mark.parametrize(
    ("distance", "sigma_height", "sigma"), [(3000.0, 15.0, 2.8), (1000.0, 15.0, 8.3), (300.0, 0.3, 0.55)]
)
def test_heights_that_are_not_known_are_said(distance: float, sigma_height: float, sigma: float) -> None:
    camera = Camera(Sphere(), pose(0.0, 250.0), OPTICS)
    found = camera.sigma(distance, np.array((0.0, 0.0, 1.0)), sigma_height, 0.0)
    assert found == pytest.approx(math.hypot(sigma, 0.3), abs=0.05)
    # Looking down on it, its height is along the line of sight.
    assert camera.sigma(distance, np.array((0.0, 1.0, 0.0)), sigma_height, 0.0) == pytest.approx(0.3, abs=1e-6)


def test_a_picture_that_may_be_its_neighbours_is_less_sure() -> None:
    moving = pose(0.0, 250.0, turn_rate=math.radians(10.0), velocity=np.array((30.0, 60.0, 0.0)), period=1 / 60)
    ahead = np.array((0.0, 0.0, 1.0))
    assert Camera(Sphere(), moving, OPTICS).sigma(math.inf, ahead, 0.0, 0.0) == pytest.approx(0.3)
    unsure = Camera(Sphere(), moving._replace(may_be_neighbour=True), OPTICS)
    assert unsure.sigma(math.inf, ahead, 0.0, 0.0) == pytest.approx(math.hypot(0.3, 1.61), abs=0.01)
    # 30 m/s across the line of sight, half a metre a frame, at 100 m.
    assert unsure.sigma(100.0, ahead, 0.0, 0.0) == pytest.approx(math.sqrt(0.3**2 + 1.61**2 + 2.77**2), abs=0.02)


def test_the_pose_and_the_map_count() -> None:
    doubtful = pose(0.0, 250.0, sigma_angle=math.radians(0.1), sigma_place=0.5)
    sigma = Camera(Sphere(), doubtful, OPTICS).sigma(500.0, np.array((0.0, 0.0, 1.0)), 0.0, 1.0)
    assert sigma == pytest.approx(math.sqrt(0.3**2 + 0.967**2 + 0.554**2 + 1.109**2), abs=0.01)


def test_coarse_labels_are_marked_and_stay() -> None:
    unknown = Profile(np.zeros(1), np.array([100.0]), 15.0, "apt.dat", 0.0)
    camera = Camera(Sphere(), pose(-1000.0, 250.0), OPTICS)
    (runway, _) = Labeller(AIRPORT, [unknown], Sphere()).label(camera, None)
    assert runway["coarse"]
    assert runway["points"]["BL"]["sigma_px"] == pytest.approx(8.2, abs=0.3)
    assert runway["points"]["BL"]["coarse"]
    assert not runway["points"]["TL"]["coarse"]
    assert runway["sigma_px"] == max(point["sigma_px"] for point in runway["points"].values())


def test_what_is_behind_or_beside_is_said_and_cut_off() -> None:
    over = labelled(Camera(Sphere(), pose(1000.0, 110.0), OPTICS))["runway"]
    states = {name: point["state"] for name, point in over["points"].items()}
    assert states["BL"] == "behind"
    assert states["threshold_near_left"] == "behind"
    assert states["TL"] == states["TR"] == "visible"
    assert over["points"]["BL"]["u"] is None
    left, top, right, bottom = over["box"]
    assert (left, right, bottom) == pytest.approx((-0.5, 639.5, 479.5), abs=1e-6)
    assert top == pytest.approx(over["points"]["TL"]["v"], abs=0.01)
    assert "runway" not in labelled(Camera(Sphere(), pose(-2000.0, 250.0, 270.0), OPTICS))
    assert "runway" not in labelled(Camera(Sphere(), pose(-2000.0, 250.0, 90.0, 60.0), OPTICS))


#: Of a telescope, to which what is far away is large.
FAR_F = 30000.0
TELESCOPE = Optics(640, 480, FAR_F, FAR_F, 319.5, 239.5)


def test_a_runway_ends_where_it_is_beyond_the_earths_curve() -> None:
    # From 3 m over its ground, the horizon is at 6186 m: 4000 m before it, the farther part of the runway lies behind.
    camera = Camera(Sphere(), pose(-4000.0, 103.0), TELESCOPE)
    runway = labelled(camera)["runway"]
    states = {name: point["state"] for name, point in runway["points"].items()}
    assert states["BL"] == states["BR"] == states["threshold_near_left"] == "visible"
    assert states["TL"] == states["TR"] == states["threshold_far_left"] == states["centre_far"] == "beyond"
    assert runway["points"]["TL"]["v"] is not None
    near, horizon = 3.0 / 4000.0 + 4000.0 / 2 / R, math.sqrt(2 * 3.0 / R)
    assert runway["box"][1::2] == pytest.approx([239.5 + FAR_F * horizon, 239.5 + FAR_F * near], abs=0.02)
    (centre,) = runway["centre_line"]
    assert centre[-1][1] == pytest.approx(239.5 + FAR_F * horizon, abs=0.3)
    beyond = Camera(Sphere(), pose(-7000.0, 103.0), TELESCOPE)
    assert "runway" not in labelled(beyond)
    unsure = Profile(np.zeros(1), np.array([100.0]), 2.0, "table", 0.0)
    assert "runway" in labelled_with(unsure, beyond), "2 m higher it would be seen"
    flat = Camera(Flat(0.0, 0.0), pose(-7000.0, 103.0), TELESCOPE)
    assert "runway" in [thing["kind"] for thing in Labeller(AIRPORT, [EXACT], Flat(0.0, 0.0)).label(flat, None)]


def test_a_runway_that_climbs_is_not_beyond_itself() -> None:
    climbs = Profile(np.array([0.0, LENGTH]), np.array([100.0, 120.0]), 0.0, "table", 0.0)
    for east, heading, height in ((-100.0, 90.0, 101.5), (LENGTH + 100.0, 270.0, 121.5), (-2000.0, 90.0, 95.0)):
        camera = Camera(Sphere(), pose(east, height, heading), TELESCOPE)
        points = labelled_with(climbs, camera)["runway"]["points"]
        assert "beyond" not in {point["state"] for point in points.values()}, east


@pytest.mark.parametrize(
    ("seen", "unseen"),
    [
        # A runway's height is 1.19 and 0.95 px, its width 1.02 and 0.97.
        (pose(-18000.0, 400.0), pose(-20000.0, 400.0)),
        (pose(-32500.0, 3000.0), pose(-34200.0, 3000.0)),
    ],
)
def test_a_runway_of_less_than_a_pixel_is_left_out(seen: Pose, unseen: Pose) -> None:
    assert "runway" in labelled(Camera(Sphere(), seen, OPTICS))
    assert "runway" not in labelled(Camera(Sphere(), unseen, OPTICS))


def test_aircraft_of_less_than_a_pixel_or_beyond_the_curve_are_left_out() -> None:
    camera = Camera(Sphere(), pose(0.0, 250.0, 90.0, -0.6), OPTICS)
    for distance, seen in ((6600.0, True), (6700.0, False)):
        other = Other("1", 0.0, math.degrees(distance / R), 250.0, 0.0)
        assert ("aircraft" in labelled(camera, others=[other])) == seen
    far = Camera(Sphere(), pose(0.0, 250.0, 90.0, -0.6), TELESCOPE)
    # The horizon is at 56.5 km, and at 8.7 km from its top 6 m over the sea.
    for distance, altitude, seen in ((64e3, 0.0, True), (66e3, 0.0, False), (100e3, 0.0, False), (100e3, -10.0, False)):
        other = Other("1", 0.0, math.degrees(distance / R), altitude, 0.0)
        assert ("aircraft" in labelled(far, others=[other])) == seen, (distance, altitude)
    parked = Camera(Sphere(), pose(0.0, -1.0), OPTICS)
    beside = Other("1", 0.0, math.degrees(3000.0 / R), -2.0, 0.0)
    assert "aircraft" in labelled(parked, others=[beside]), "on land below the sea's level"


def test_sun_and_other_aircraft() -> None:
    camera = Camera(Sphere(), pose(-2000.0, 250.0), OPTICS)
    sun = labelled(camera, sun=Sun(10.0, 100.0, (0.0, math.degrees(-2000.0 / R))))["sun"]
    ray = np.array((math.sin(math.radians(10)) * math.cos(math.radians(10)), -math.sin(math.radians(10)), 0.0))
    ahead = math.cos(math.radians(10)) ** 2
    assert sun["centre"] == pytest.approx([319.5 + F * ray[0] / ahead, 239.5 + F * ray[1] / ahead], abs=1e-2)
    assert not sun["coarse"]
    assert labelled(camera, sun=Sun(10.0, 100.0))["sun"]["coarse"], "the scenery's origin is not known"
    assert "sun" not in labelled(camera, sun=Sun(-5.0, 90.0))
    assert "sun" not in labelled(camera, sun=Sun(10.0, 270.0))
    other = Other("G-TEST", 0.0, 0.0, 250.0, 5.0, 20.0)
    aircraft = labelled(camera, others=[other])["aircraft"]
    assert aircraft["name"] == "G-TEST"
    assert aircraft["centre"] == pytest.approx([319.5, 239.5 + F * 2000.0 / (2 * R)], abs=0.01)
    assert aircraft["box"][2] - aircraft["box"][0] == pytest.approx(F * 20.0 / 2000.0, abs=0.01)
    assert aircraft["sigma_px"] == pytest.approx(math.sqrt(0.3**2 + 2 * (F * 5.0 / 2000.0) ** 2), abs=0.01)
    behind = other._replace(longitude=math.degrees(-4000.0 / R))
    assert "aircraft" not in labelled(camera, others=[behind])


def test_nothing_reaches_into_the_bars_of_a_letterbox() -> None:
    """16:9 in 4:3: 60 rows of black above and below."""
    boxed = OPTICS._replace(shows=(0, 60, 640, 360))
    over = labelled(Camera(Sphere(), pose(1000.0, 110.0), boxed))["runway"]
    assert over["box"][3] == pytest.approx(419.5)
    assert max(v for part in over["centre_line"] for _, v in part) == pytest.approx(419.5)
    nose_up = Camera(Sphere(), pose(-2000.0, 250.0, 90.0, 17.5), boxed)  # the runway is in the lower bar
    bare = Camera(Sphere(), nose_up.pose, OPTICS)
    assert labelled(bare)["runway"]["points"]["BL"]["state"] == "visible"
    assert "runway" not in labelled(nose_up)
    assert "horizon" in labelled(nose_up)
    for seen, state in ((bare, "visible"), (nose_up, "cut")):
        above = Other("1", 0.0, 0.0, 250.0 + 2000.0 * math.tan(math.radians(17.5) + math.atan(180.0 / F)), 0.0)
        aircraft = labelled(seen, others=[above])["aircraft"]
        assert aircraft["state"] == state
        assert (aircraft["box"][1] == pytest.approx(59.5)) == (state == "cut")
    horizon = Camera(Sphere(), pose(-2000.0, 250.0, 90.0, 20.0), OPTICS)
    assert "horizon" in labelled(horizon)
    assert "horizon" not in labelled(Camera(Sphere(), horizon.pose, boxed))


def test_a_sun_that_is_partly_in_the_picture_is_labelled() -> None:
    camera = Camera(Sphere(), pose(-2000.0, 250.0), OPTICS)
    origin = (0.0, math.degrees(-2000.0 / R))
    border = math.degrees(math.atan(240.0 / F))  # of the picture's upper side
    for above, state in ((-0.4, "visible"), (-0.1, "cut"), (0.1, "cut"), (0.4, None)):
        sun = labelled(camera, sun=Sun(border + above, 90.0, origin)).get("sun")
        assert (sun and sun["state"]) == state, above
        if sun:
            cosine = math.cos(math.radians(border))
            radius, below = F * math.radians(0.265) / cosine, -F * math.radians(above) / cosine**2
            assert sun["box"][3] - sun["box"][1] == pytest.approx(radius + min(radius, below), rel=0.03)
            assert sun["box"][1] >= -0.5
            assert (sun["centre"][1] > -0.5) == (above < 0.0)


def test_boxes_of_balls_are_by_the_focal_length_of_each_axis() -> None:
    """A window of 16:9 stretched to 4:3: what is round is a third higher than wide."""
    camera = Camera(Sphere(), pose(-2000.0, 250.0), OPTICS._replace(fy=F * 4 / 3))
    seen = labelled(camera, sun=Sun(3.0, 90.0), others=[Other("1", 0.0, 0.0, 250.0, 0.0)])
    for kind, width in (("aircraft", F * 12.0 / 2000.0), ("sun", 2 * F * math.tan(math.radians(0.265)))):
        left, top, right, bottom = seen[kind]["box"]
        assert (right - left, bottom - top) == pytest.approx((width, width * 4 / 3), rel=3e-3), kind
    assert seen["aircraft"]["size_px"] == pytest.approx(F * 12.0 / 2000.0 * 4 / 3, abs=1e-3)


def test_x_planes_own_numbers_hold_on_the_sphere() -> None:
    """KMWH in X-Plane 11: latitude, longitude and local x, z of one place, by another project; WGS 84 is 45 m off."""
    sphere = Sphere()
    difference = sphere.place(47.196890, -119.33260, 362.0) - sphere.place(47.5, -119.0, 0.0)
    north, east, _ = sphere.level(47.5, -119.0) @ difference
    assert (east, -north) == pytest.approx((-25159.27, 33689.81), abs=0.4)


def test_heights_come_from_the_best_source() -> None:
    ends = {"09": 90.0, "27": 110.0}
    assert profile(AIRPORT, RUNWAY, None, {}).at(500.0) == (100.0, 15.0, "apt.dat")
    height = profile(AIRPORT, RUNWAY, None, ends).at(1500.0)
    assert height == (pytest.approx(100.0), 2.0, "table")
    assert profile(AIRPORT, RUNWAY, None, {"27": 110.0}).at(LENGTH)[:2] == (110.0, 2.0)
    assert profile(AIRPORT, RUNWAY, None, {"27": 110.0}).at(LENGTH - 1000.0).sigma == pytest.approx(
        math.hypot(2.0, 6.0)
    )
    # Over the runway from 1000 to 2000 m it rises by 1 %; beside it, and elsewhere, the ground counts for nothing.
    along = np.linspace(1000.0, 2000.0, 200)
    east = np.degrees(np.concatenate((along, [1500.0, 90000.0])) / R)
    north = np.concatenate((np.zeros(200), [math.degrees(40.0 / R), 0.0]))
    ground = Ground(north, east, np.concatenate((80.0 + 0.01 * along, [500.0, 500.0])))
    measured = profile(AIRPORT, RUNWAY, ground, ends)
    assert measured.at(1500.0) == (pytest.approx(95.0, abs=0.05), 0.3, "measured")
    assert measured.at(0.0).metres == pytest.approx(90.0, abs=0.2)
    assert measured.at(0.0).sigma == pytest.approx(math.hypot(0.3, 0.006 * 1000.0), abs=0.1)
    beside = Ground(north[-2:], east[-2:], np.array((500.0, 500.0)))
    assert profile(AIRPORT, RUNWAY, beside, {}).source == "apt.dat"


def test_a_runway_seen_from_its_other_end_is_the_same_runway() -> None:
    there, back = RunwayFrame(RUNWAY, 0), RunwayFrame(RUNWAY, 1)
    assert there.length == pytest.approx(LENGTH)
    assert there.geodetic(700.0, 25.0) == pytest.approx(back.geodetic(LENGTH - 700.0, -25.0), abs=1e-9)
    assert there.along_right(*there.geodetic(700.0, 25.0)) == pytest.approx((700.0, 25.0), abs=1e-3)
    assert back.from_first_end(100.0) == pytest.approx(LENGTH - 100.0)
    assert math.degrees(there.heading) == pytest.approx(90.0)
    assert math.degrees(back.heading) == pytest.approx(-90.0)
