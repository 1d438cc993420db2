"""The emulator's window: geometry worked out by hand, the strip after JPEG and scaling, the process and its delay."""

from __future__ import annotations

import csv
import math
import os
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from support.deadlines import WAIT_S
from xplane_bridge.emulator.datarefs.tables.views import SUN_HEADING_DEG, SUN_PITCH_DEG
from xplane_bridge.emulator.view.renderer import (
    RendererError,
    RendererOptions,
    RendererProcess,
    Scene,
    StripError,
    read_strip,
)
from xplane_bridge.emulator.view.renderer.__main__ import Picture, SwapChain
from xplane_bridge.emulator.view.renderer.camera import Camera, clip
from xplane_bridge.emulator.view.renderer.painter import Painter
from xplane_bridge.emulator.view.renderer.strip import draw_strip
from xplane_bridge.emulator.view.renderer.world import make_world
from xplane_bridge.harness.processes import wait_until

ANCHOR = (47.0, 8.0)
FOCAL = 554.256  # 320 / tan(30 deg)
LEVEL = Scene(latitude_deg=47.0, longitude_deg=8.0, altitude_m=600.0, terrain_m=500.0)


def pixel(scene: Scene, east: float, north: float, up: float) -> np.ndarray:
    camera = Camera(scene, (640, 480), ANCHOR)
    return camera.project(camera.to_camera(np.array(((east, north, up),))))[0]


@pytest.mark.parametrize(
    ("changes", "u", "v"),
    [
        # Looking north from 100 m above the ground at a point 1000 m ahead, 100 m right, on the ground.
        ({}, 319.5 + FOCAL * 0.1, 239.5 + FOCAL * 0.1),
        # Right wing down: what is below comes to the right, what is right comes up.
        ({"roll_deg": 90.0}, 319.5 + FOCAL * 0.1, 239.5 - FOCAL * 0.1),
        # Nose up by the angle whose tangent is 0.1: a point as far below the nose axis goes down by more.
        ({"heading_deg": math.degrees(math.atan(0.1))}, 319.5, 239.5 + FOCAL * 0.1 / math.hypot(1.0, 0.1)),
    ],
)
def test_points_appear_where_geometry_puts_them(changes: dict, u: float, v: float) -> None:
    assert pixel(replace(LEVEL, **changes), 100.0, 1000.0, 0.0) == pytest.approx((u, v), abs=1e-2)


@pytest.mark.parametrize(("vertical_deg", "roll_deg"), [(0.0, 0.0), (30.0, 0.0), (30.0, 20.0)])
def test_the_ladder_of_the_head_up_display_lies_on_the_horizon(vertical_deg: float, roll_deg: float) -> None:
    scene = replace(LEVEL, pitch_deg=2.0, roll_deg=roll_deg, vertical_field_of_view_deg=vertical_deg)
    plain, drawn = (Painter(640, 480, ANCHOR, strip=False, hud=hud).paint(scene).astype(int) for hud in (False, True))
    changed = np.abs(drawn - plain).max(axis=2) > 40
    camera = Camera(scene, (640, 480), ANCHOR)
    for right in (-0.08, 0.08):  # left and right of the ladder's numbers, within its long line
        at = camera.project(camera.directions_to_camera(np.array(((right, 1.0, 0.0),))))[0]
        u, v = np.round(at).astype(int)
        assert changed[v - 2 : v + 3, u].any()


def test_pitch_moves_the_horizon_down() -> None:
    # The horizon lies on the eye's own height far away: pitch 10 deg up puts it f tan(10 deg) below the middle.
    far = pixel(replace(LEVEL, pitch_deg=10.0), 0.0, 1e6, 100.0)
    assert far[1] == pytest.approx(239.5 + FOCAL * math.tan(math.radians(10.0)), abs=0.1)


def test_head_turns_rear_and_down() -> None:
    rear = replace(LEVEL, head_heading_deg=180.0)
    assert pixel(rear, 100.0, -1000.0, 100.0)[0] == pytest.approx(319.5 - FOCAL * 0.1, abs=1e-2)
    down = replace(LEVEL, head_pitch_deg=-90.0)
    # From 100 m: 20 m ahead is up in the picture, 10 m to the right is right.
    assert pixel(down, 10.0, 20.0, 0.0) == pytest.approx((319.5 + FOCAL * 0.1, 239.5 - FOCAL * 0.2), abs=1e-2)


def test_latitude_and_longitude_move_the_eye_on_xplanes_sphere() -> None:
    moved = replace(LEVEL, latitude_deg=47.001, longitude_deg=8.001)
    eye = Camera(moved, (640, 480), ANCHOR).eye
    degree = math.radians(1e-3) * 6378145.0
    assert eye == pytest.approx((degree * math.cos(math.radians(47.0)), degree, 100.0), abs=1e-3)


def test_clip_keeps_the_inside() -> None:
    square = np.array(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)))
    kept = clip(square, square[:, 0] - 1.0)
    assert sorted(map(tuple, kept.tolist())) == [(1.0, 0.0), (1.0, 2.0), (2.0, 0.0), (2.0, 2.0)]


def test_the_picture_shows_sky_over_ground_and_a_runway() -> None:
    painter = Painter(640, 480, ANCHOR, 0.0, strip=False)
    before_threshold = replace(LEVEL, latitude_deg=47.0 - math.degrees(1500.0 / 6378145.0), altitude_m=580.0)
    picture = painter.paint(before_threshold).astype(int)
    sky, ground = picture[60, :], picture[330, 40:200]
    assert (sky[:, 0] > sky[:, 2] + 20).all()  # blue over red
    assert ground[:, 1].mean() > ground[:, 0].mean() + 15  # green over blue
    # The threshold is 600 m ahead and 80 m below: its row is f * 80 / 600 under the horizon; grey, with white bars.
    row = picture[round(239.5 + FOCAL * 80.0 / 660.0), 310:330]
    assert np.ptp(row, axis=1).max() < 25


def test_horizon_tilts_against_the_roll() -> None:
    painter = Painter(640, 480, ANCHOR, strip=False)
    picture = painter.paint(replace(LEVEL, roll_deg=20.0, altitude_m=1500.0)).astype(int)
    blue = picture[..., 0] - picture[..., 1] > 15

    def horizon(column: int) -> int:
        return int(np.nonzero(blue[:, column])[0].max())

    # Right wing down: the horizon is higher at the right by 400 px * tan(20 deg) = 146.
    assert horizon(120) - horizon(520) == pytest.approx(400 * math.tan(math.radians(20.0)), abs=30)


def test_another_aircraft_appears_where_it_is_and_as_large_as_it_is() -> None:
    # 300 m north at the eye's height, seen from behind: a span of 12 m is f * 12 / 300 = 22 px, 1.5 m of fin 2.8 px.
    north = 47.0 + math.degrees(300.0 / 6378145.0)
    other = (north, 8.0, 600.0, 0.0, 0.0, 0.0)
    empty = Painter(640, 480, ANCHOR, strip=False).paint(LEVEL).astype(int)
    picture = Painter(640, 480, ANCHOR, strip=False).paint(replace(LEVEL, others=(other,)))
    rows, columns = np.nonzero(np.abs(picture - empty).max(axis=2) > 8)
    assert 20 <= np.ptp(columns) <= 25
    assert columns.mean() == pytest.approx(319.5, abs=1.0)
    assert rows.min() >= 235
    assert rows.max() <= 242
    behind = (47.0 - (north - 47.0), 8.0, 600.0, 0.0, 0.0, 0.0)
    assert np.array_equal(Painter(640, 480, ANCHOR, strip=False).paint(replace(LEVEL, others=(behind,))), empty)


def test_painting_twice_gives_the_same_picture() -> None:
    first = Painter(320, 240, ANCHOR).paint(LEVEL)
    assert np.array_equal(first, Painter(320, 240, ANCHOR).paint(LEVEL))


@pytest.mark.parametrize("pitch_deg", [-28.0, -31.0, -34.0, -90.0])
@pytest.mark.parametrize("size", [(16, 16), (640, 480)])
def test_every_pixel_is_painted_whatever_was_in_the_memory(pitch_deg: float, size: tuple[int, int]) -> None:
    painter, scene = Painter(*size, ANCHOR, strip=False), replace(LEVEL, pitch_deg=pitch_deg)
    pictures = [np.full((size[1], size[0], 4), value, np.uint8) for value in (0, 255)]
    for picture in pictures:
        painter.paint_into(scene, picture)
    assert np.array_equal(pictures[0][..., :3], pictures[1][..., :3])


# The haze then ends in an area of at most four pixels, which OpenCV takes for a scalar.
@pytest.mark.parametrize(
    "changes",
    [
        {
            "latitude_deg": 37.437782020539125,
            "longitude_deg": 126.46088827463582,
            "altitude_m": 208.64162236428652,
            "roll_deg": 39.260786279953834,
            "pitch_deg": 11.253818783212559,
            "heading_deg": 329.5727451803782,
            "head_pitch_deg": -90.0,
            "head_roll_deg": 10.0,
        },
        {
            "latitude_deg": 37.475546383438676,
            "longitude_deg": 126.39171685841302,
            "altitude_m": 2946.8454334304593,
            "roll_deg": -72.54906994680245,
            "pitch_deg": 9.567096721364521,
            "heading_deg": 319.66524670706855,
            "head_pitch_deg": -90.0,
            "eye_forward_m": 0.6,
            "eye_down_m": -5.0,
            "floor_down_m": 1.0,
            "field_of_view_deg": 80.0,
        },
    ],
)
def test_haze_is_painted_on_areas_of_a_few_pixels(changes: dict) -> None:
    picture = np.full((240, 320, 4), 0, np.uint8)
    Painter(320, 240, (37.4602, 126.4407), strip=False).paint_into(Scene(**changes), picture)
    assert picture[..., :3].max(axis=2).min() > 0, "painted everywhere"


@pytest.mark.parametrize("quality", [95, 60, 30])
@pytest.mark.parametrize("size", [(640, 480), (320, 240), (1024, 768), (533, 400)])
def test_strip_survives_jpeg_and_scaling(quality: int, size: tuple[int, int]) -> None:
    painter = Painter(640, 480, ANCHOR)
    for frame, sim_time in ((0, 0.0), (4294967295, 1e6), (123456, 1234.5678)):
        picture = painter.paint(replace(LEVEL, frame=frame, sim_time=sim_time))
        scaled = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        _, packed = cv2.imencode(".jpg", scaled, (cv2.IMWRITE_JPEG_QUALITY, quality))
        reading = read_strip(cv2.imdecode(packed, cv2.IMREAD_COLOR))
        assert reading.frame == frame
        assert reading.sim_time == np.float32(sim_time)


def test_strip_survives_large_windows_scaled_down() -> None:
    picture = np.full((1080, 1920, 3), 90, np.uint8)
    draw_strip(picture, 77, 3.25)
    assert read_strip(cv2.resize(picture, (640, 360), interpolation=cv2.INTER_AREA)).frame == 77


def test_a_damaged_strip_is_refused() -> None:
    picture = np.full((480, 640, 3), 90, np.uint8)
    with pytest.raises(StripError, match="640x480"):
        read_strip(picture)
    draw_strip(picture, 77, 3.25)
    picture[-8:, 160:176] ^= 255
    with pytest.raises(StripError):
        read_strip(picture)


def test_scene_record_round_trip_with_other_aircraft() -> None:
    scene = replace(LEVEL, others=((1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (7.0, 8.0, 9.0, 10.0, 11.0, 12.0)))
    assert Scene.unpack(scene.pack()) == scene
    assert len(scene.pack()) <= 4096  # a write to the pipe stays whole


def test_scene_record_round_trip_with_printed_rows() -> None:
    rows = tuple((float(number), *(0.5 * k for k in range(8))) for number in range(9))
    packed = replace(LEVEL, rows=rows, others=((1.0, 2.0, 3.0, 4.0, 5.0, 6.0),)).pack()
    assert len(packed) <= 4096
    assert Scene.unpack(packed).rows == rows[:8], "there is room for eight"


def test_rows_are_printed_at_the_upper_left_and_unused_values_are_left_out() -> None:
    empty = Painter(640, 480, ANCHOR, strip=False).paint(LEVEL).astype(int)
    row = (1.0, 12.34, *([-999.0] * 7))
    picture = Painter(640, 480, ANCHOR, strip=False).paint(replace(LEVEL, rows=(row,)))
    rows, columns = np.nonzero(np.abs(picture - empty).max(axis=2) > 30)
    assert rows.max() < 30
    assert columns.max() < 100


def test_scene_record_round_trip() -> None:
    scene = replace(LEVEL, frame=7, time_ns=123456789012345, head_roll_deg=-3.0, vertical_speed_fpm=250.0)
    assert Scene.unpack(scene.pack()) == scene


@pytest.mark.parametrize("options", [{"width": 100}, {"pipeline_delay": 0.3}, {"pipeline_delay": -0.1}])
def test_options_out_of_range_are_refused(options: dict) -> None:
    with pytest.raises(RendererError, match="expected"):
        RendererOptions(anchor=ANCHOR, **options)


@pytest.fixture
def display():
    """An X server of the test's own."""
    read_end, write_end = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write_end), "-screen", "0", "800x600x24", "-nolisten", "tcp"],
        pass_fds=[write_end],
        stderr=subprocess.DEVNULL,
    )
    os.close(write_end)
    with os.fdopen(read_end) as answer:
        number = answer.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait()


def swaps(renderer: RendererProcess, log: Path) -> list[dict[str, str]]:
    """The window's swap log, each picture held to its delay; it is whole when the process has ended by itself."""
    assert renderer.alive
    renderer._child.stdin.close()
    assert renderer._child.wait(WAIT_S) == 0
    renderer.close()
    with log.open() as file:
        rows = list(csv.DictReader(file))
    offset = time.time_ns() - time.monotonic_ns()
    for row in rows:
        waited = int(row["swap_begin_ns"]) - offset - int(row["frame_monotonic_ns"])
        assert waited > 0.1499e9
        assert int(row["swap_end_ns"]) >= int(row["swap_begin_ns"])
    return rows


def test_process_shows_every_frame_that_is_waited_for_after_the_pipeline_delay(display: str, tmp_path: Path) -> None:
    log = tmp_path / "swaps.csv"
    options = RendererOptions(ANCHOR, pipeline_delay=0.15, swap_log=log, display=display, hud=True, answers_shown=True)
    renderer = RendererProcess(options)
    for frame in range(10):
        given_ns = time.monotonic_ns()
        renderer.show(replace(LEVEL, frame=frame, sim_time=frame * 0.05, time_ns=given_ns))
        wait_until(lambda: renderer.drawn(0.1), WAIT_S, f"frame {frame} on the display")
        assert time.monotonic_ns() - given_ns > 0.1499e9, "answered before it was shown"
    assert [int(row["frame"]) for row in swaps(renderer, log)] == list(range(10))


def test_frames_that_come_while_others_wait_for_their_display_keep_order_and_delay(
    display: str, tmp_path: Path
) -> None:
    log = tmp_path / "swaps.csv"
    renderer = RendererProcess(
        RendererOptions(anchor=ANCHOR, pipeline_delay=0.15, swap_log=log, display=display, hud=True)
    )
    for frame in range(20):
        renderer.show(replace(LEVEL, frame=frame, sim_time=frame * 0.05, time_ns=time.monotonic_ns()))
        time.sleep(0.05)
    frames = [int(row["frame"]) for row in swaps(renderer, log)]
    assert frames == sorted(set(frames))
    assert frames[-1] == 19, "however late it is, nothing comes after it that could be due too"


def test_a_picture_is_left_out_only_where_the_next_one_is_due_too() -> None:
    chain, later = SwapChain(16, 16), time.monotonic_ns() + 10**15
    for frame, due_ns in enumerate((1, 2, 3, later, later + 1)):
        chain.put(Picture(replace(LEVEL, frame=frame), chain.buffer(), due_ns))
    chain.end()
    shown = []
    while not chain.ended:
        shown.append(chain.next(0.0).scene.frame)
    assert shown == [2, 3, 4]


def test_a_window_whose_program_fails_keeps_no_frame_waiting_and_says_why(display: str, capfd) -> None:
    renderer = RendererProcess(RendererOptions(anchor=ANCHOR, display=display))
    renderer.show(replace(LEVEL, roll_deg=math.inf))
    wait_until(lambda: renderer.drawn(0.1), WAIT_S, "end of the frame")
    assert not renderer.alive
    renderer.close()
    assert "math domain error" in capfd.readouterr().err


def test_the_sun_is_drawn_where_its_datarefs_say() -> None:
    east, north, up = make_world(0.0).sun
    assert math.degrees(math.asin(up)) == pytest.approx(SUN_PITCH_DEG, abs=1e-5)
    assert math.degrees(math.atan2(east, north)) == pytest.approx(SUN_HEADING_DEG, abs=1e-5)


def test_process_says_why_it_has_no_window() -> None:
    with pytest.raises(RendererError, match=":9999"):
        RendererProcess(RendererOptions(anchor=ANCHOR, display=":9999"))
