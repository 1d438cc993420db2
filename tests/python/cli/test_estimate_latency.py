"""estimate_latency on bags whose pictures were drawn with a known delay."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Callable, NamedTuple, Optional

import cv2
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.cli.estimate_latency import main
from xplane_bridge.emulator.view.renderer import Scene
from xplane_bridge.emulator.view.renderer.painter import Painter

DURATION_S = 12.0
_HALF = math.radians(-15.0)


class Window(NamedTuple):
    """A camera whose pictures are recorded."""

    delay: float  #: [s]
    topics: str = "/xplane/camera"
    pitch_deg: float = 0.0
    view: int = 1
    rotation: Optional[tuple[float, float, float, float]] = None  #: of body_to_camera, where it is measured
    every: int = 2  #: frames of 60 a second
    quality: int = 0


#: For tests that do not look at the delay of pictures: few, as drawing and comparing them takes nearly all of the time.
FEW = Window(0.05, every=5)


def belly(delay: float) -> Window:
    """Forward and 30 degrees down, which is none of the views with a name; a product of two quaternions, by hand."""
    sine, cosine = math.sin(_HALF), math.cos(_HALF)
    rotation = (0.5 * (sine - cosine), 0.5 * (cosine - sine), -0.5 * (cosine + sine), 0.5 * (cosine + sine))
    return Window(delay, "/xplane/belly/camera", -30.0, 0, rotation)


def roll_and_rate(t: float, scale: float) -> tuple[float, float]:
    """Roll angle [rad] and rate [rad/s] of a multisine."""
    parts = ((0.3, 10.0, 0.1), (0.7, 2.4, 1.3), (1.1, 0.6, 2.9))
    roll = sum(math.radians(a) * math.sin(2 * math.pi * f * t + p) for f, a, p in parts)
    rate = sum(math.radians(a) * 2 * math.pi * f * math.cos(2 * math.pi * f * t + p) for f, a, p in parts)
    return scale * roll, scale * rate


def add_picture(
    bag: FlightBag, painter: Painter, window: Window, k: int, scale: float, flown: Callable[[float], float]
) -> None:
    """Write the picture that appears with frame `k` of 60 a second, and its FrameState."""
    t = k / 60
    shown = flown(t - window.delay)
    scene = Scene(
        frame=k,
        latitude_deg=47.0 + 60.0 * shown / 111000.0,
        longitude_deg=8.0,
        altitude_m=600.0,
        pitch_deg=-5.0,
        roll_deg=math.degrees(roll_and_rate(shown, scale)[0]),
        head_pitch_deg=window.pitch_deg,
    )
    _, jpeg = cv2.imencode(".jpg", painter.paint(scene))
    header = bag.header(stamp_ns(t), "camera_forward_optical")
    image = {"header": header, "format": "bgr8; jpeg compressed bgr8", "data": jpeg.ravel()}
    bag.add(f"{window.topics}/image_raw/compressed", "sensor_msgs/CompressedImage", stamp_ns(t), image)
    frame = {"header": header, "view": window.view, "quality": window.quality}
    if window.rotation is not None:
        frame.update(camera_pose_source=2, body_to_camera={"rotation": dict(zip("xyzw", window.rotation))})
    bag.add(f"{window.topics}/frame_state", "xplane_bridge/FrameState", stamp_ns(t), frame)


def write_bag(
    path: Path,
    *windows: Window,
    scale: float = 1.0,
    refresh: bool = False,
    surfaces_too: bool = False,
    held: bool = False,
    aileron: float = 15.0,
    pause: float = 0.0,  # [s] in its middle
) -> None:
    def flown(t: float) -> float:
        return t if t < DURATION_S / 2 else max(DURATION_S / 2, t - pause)

    painter = Painter(320, 240, (47.02, 8.0))
    with FlightBag(path) as bag:
        for k in range(round((DURATION_S + pause) * 60)):
            t = k / 60
            state = {**bag.state(t, k), "paused": DURATION_S / 2 <= t < DURATION_S / 2 + pause}
            state["angular_velocity"] = {"x": roll_and_rate(flown(t), scale)[1], "y": 0.0, "z": 0.0}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
            if k % 3 == 0 or refresh:
                new = k // 3 * 3 / 60  # when this value was sent for the first time
                command = {"header": bag.header(stamp_ns(t), ""), "source": 2, "fields": 1, "roll": math.sin(2.1 * new)}
                bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", stamp_ns(t), command)
            if surfaces_too:
                echo = {"header": bag.header(stamp_ns(t), ""), "surface_names": ["rudder1"]}
                bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", stamp_ns(t + 0.003), echo)
            if k % 3 == 0 or held:  # the aileron follows the stick by 45 ms; held: each value of it
                shown = math.floor((t - 0.045) * 20.0 + 1e-6) / 20.0 if held else t - 0.045
                moved = aileron * math.sin(2.1 * shown)
                surface = {"header": bag.header(stamp_ns(t), ""), "delta_aileron": moved}
                bag.add("/xplane/mission/surfaces", "xplane_bridge/SurfaceStates", stamp_ns(t), surface)
            for window in windows:
                if k % window.every == 0 and t > 0.5:
                    add_picture(bag, painter, window, k, scale, flown)


def test_delay_and_response_are_found_and_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, plot, numbers = tmp_path / "flight.bag", tmp_path / "delay.png", tmp_path / "delay.json"
    write_bag(bag, Window(0.085))
    assert main([str(bag), "--plot", str(plot), "--json", str(numbers)]) == 0
    text = capsys.readouterr().out
    assert "display delay" in text
    assert "roll command" in text
    results = json.loads(numbers.read_text())
    assert results["display_delay"]["delay"] == pytest.approx(0.085, abs=0.005)
    assert results["display_delay"]["low"] < results["display_delay"]["delay"] < results["display_delay"]["high"]
    assert results["roll command"]["delay"] == pytest.approx(0.045, abs=0.002)
    assert results["roll command"]["gain"] == pytest.approx(15.0, abs=0.1)
    assert plot.stat().st_size > 5000


def test_a_pause_leaves_the_delay_of_the_rest(tmp_path: Path) -> None:
    bag, numbers = tmp_path / "paused.bag", tmp_path / "delay.json"
    write_bag(bag, Window(0.085, every=4), pause=15.0)
    assert main([str(bag), "--json", str(numbers)]) == 0
    assert json.loads(numbers.read_text())["display_delay"]["delay"] == pytest.approx(0.085, abs=0.005)


def test_what_is_not_determined_is_no_number(tmp_path: Path) -> None:
    bag, plot, numbers = tmp_path / "still.bag", tmp_path / "delay.png", tmp_path / "delay.json"
    write_bag(bag, FEW, aileron=0.0)
    assert main([str(bag), "--plot", str(plot), "--json", str(numbers)]) == 0
    text = numbers.read_text()
    assert "Infinity" not in text
    assert "NaN" not in text
    assert list(json.loads(text)["roll command"]) == ["not_determined"]
    height, width = cv2.imread(str(plot)).shape[:2]
    assert width / height == pytest.approx(7.0 / 2.4, rel=0.02)  # one panel


def test_sending_a_command_again_does_not_make_the_response_faster(tmp_path: Path) -> None:
    bag, numbers = tmp_path / "flight.bag", tmp_path / "delay.json"
    write_bag(bag, FEW, refresh=True)
    assert main([str(bag), "--json", str(numbers)]) == 0
    assert json.loads(numbers.read_text())["roll command"]["delay"] == pytest.approx(0.045, abs=0.002)


def test_surfaces_sent_one_by_one_are_no_commands_of_axes(tmp_path: Path) -> None:
    bag, numbers = tmp_path / "flight.bag", tmp_path / "delay.json"
    write_bag(bag, FEW, surfaces_too=True)
    assert main([str(bag), "--json", str(numbers)]) == 0
    assert json.loads(numbers.read_text())["roll command"]["delay"] == pytest.approx(0.045, abs=0.002)


def test_a_controller_slower_than_the_frames_has_a_delay(tmp_path: Path) -> None:
    """It holds its commands for three frames: on average they are half of that older than when they came."""
    bag, numbers = tmp_path / "flight.bag", tmp_path / "delay.json"
    write_bag(bag, FEW, refresh=True, held=True)
    assert main([str(bag), "--json", str(numbers)]) == 0
    # The first frame that shows a value comes 5 ms after that.
    assert json.loads(numbers.read_text())["roll command"]["delay"] == pytest.approx(0.045 + 0.025, abs=0.006)


def test_of_several_cameras_one_is_measured_about_its_own_line_of_sight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, numbers = tmp_path / "two.bag", tmp_path / "delay.json"
    write_bag(bag, Window(0.085), belly(0.04))
    for arguments, delay in (([], 0.085), (["--camera", "belly"], 0.04)):
        assert main([str(bag), "--json", str(numbers), *arguments]) == 0
        found = json.loads(numbers.read_text())["display_delay"]
        assert found["delay"] == pytest.approx(delay, abs=0.005)
        # Against the rate about the aircraft's own axis, that of the second were 0.87: cos(30 deg).
        assert found["gain"] == pytest.approx(1.0, abs=0.05)
    assert main([str(bag), "--camera", "tail"]) == 1
    assert "no camera tail; expected some of: camera, belly" in capsys.readouterr().err


def test_too_little_motion_is_one_line_and_exit_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / "calm.bag"
    write_bag(bag, FEW, scale=0.01)
    assert main([str(bag)]) == 1
    error = capsys.readouterr().err.strip()
    assert "\n" not in error
    assert "too small" in error or "do not move together" in error


def test_pictures_that_come_too_slowly_are_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / "slow.bag"
    write_bag(bag, Window(0.05, every=12))
    assert main([str(bag)]) == 1
    assert (
        "the pictures come too slowly, every 0.20 s (median): two that are compared must be less than 0.2 s apart; "
        "expected 10 pictures/s or more: record with a higher image rate" in capsys.readouterr().err
    )


def test_a_quality_that_leaves_all_pictures_out_is_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "unknown.bag"
    write_bag(bag, belly(0.05)._replace(quality=8))  # whose view has no name: that is not the reason
    assert main([str(bag)]) == 1
    error = capsys.readouterr().err
    assert "of 344 pictures these are of no use: 344: QUALITY_DISPLAY_UNKNOWN (when it appeared was not seen" in error


def test_bag_without_pictures_is_one_line_and_exit_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / "blind.bag"
    write_bag(bag)
    assert main([str(bag)]) == 1
    assert "no camera images" in capsys.readouterr().err


def test_a_figure_that_cannot_be_written_is_refused_before_anything_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(tmp_path / "flight.bag"), "--plot", str(tmp_path / "none" / "delay.png")])
    assert ended.value.code == 2
    assert f"there is no folder {tmp_path / 'none'}; make it" in capsys.readouterr().err


@pytest.mark.parametrize(("option", "name"), [("--json", "flight.bag"), ("--plot", "flight.png")])
def test_the_recording_is_not_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, name: str
) -> None:
    bag = tmp_path / name
    write_bag(bag)
    before = bag.read_bytes()
    assert main([str(bag), option, str(bag)]) == 1
    assert f"{bag}: the recording itself is there; expected another file to write to" in capsys.readouterr().err
    assert bag.read_bytes() == before
