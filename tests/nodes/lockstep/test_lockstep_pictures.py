"""Pictures in lock-step: each is of its own frame, and a frame waits for its picture."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.nodes.late_pictures import pixels
from support.nodes.second_camera import NAME, WINDOW, second_camera
from support.nodes.tx_fixtures import tx_params
from xplane_bridge.cli.flight_report import write_report
from xplane_bridge.emulator.view.renderer import read_strip
from xplane_bridge.harness import wait_until
from xplane_bridge.resources import config_file

pytestmark = pytest.mark.usefixtures("screen")

FPS = 60
EVERY = 2
FRAMES = 60
WATCHDOG_S = 15.0  # longer than nodes take to start on a busy machine


def start(world, *options, participants=("capture_node",), **lockstep):
    """Emulator, rx_node and tx_node, which hold the flight."""
    emulator = world.emulator("--stepped", "lockstep", "--start", "air", "--fps", FPS, *options)
    section = {"enabled": True, "participants": list(participants), "hold": True, **lockstep}
    world.set_param("lockstep", section)
    return emulator, world.start("rx_node"), world.start("tx_node", tx_params())


def capture(world, display: str, **params: object):
    return world.start("capture_node", {"window": {"display": display, "search_period": 0.05}, **params})


def step(world, frames):
    from xplane_bridge.srv import LockstepStep

    return world.call("lockstep/step", LockstepStep, frames=frames)


def have(log, count):
    """Waits until so many messages have come, of those that came already."""
    wait_until(lambda: len(log.messages) >= count, 30, f"{count} messages on {log.topic}")
    assert len(log.messages) == count


def test_every_picture_is_of_its_own_frame_and_says_nothing_of_wall_time(world, display):
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image
    from xplane_bridge.msg import FlightState, FrameState

    start(world, "--window", "--picture-every", EVERY)
    capture(world, display)
    types = {"image_raw": Image, "image_raw/compressed": CompressedImage, "camera_info": CameraInfo}
    pictures = {name: world.watch(f"camera/{name}", kind) for name, kind in types.items()}
    pairs, states = world.watch("camera/frame_state", FrameState), world.watch("flight_state", FlightState)
    logs = [*pictures.values(), pairs, states]
    wait_until(lambda: all(log.connected for log in logs), 30, "all topics")
    assert step(world, FRAMES).flown == FRAMES
    for log in [*pictures.values(), pairs]:
        have(log, FRAMES // EVERY)
    have(states, FRAMES)

    due = states.messages[::EVERY]  # the first frame, and every second one after it
    stamps = [state.header.stamp for state in due]
    for name, log in pictures.items():
        assert [message.header.stamp for message in log.messages] == stamps, name
        assert [message.header.seq for message in log.messages] == list(range(len(due))), name
    for image, pair, state in zip(pictures["image_raw"].messages, pairs.messages, due):
        shown = read_strip(pixels(image))
        assert shown.frame == state.frame_count
        assert np.float32(shown.sim_time) == np.float32(state.sim_time) == np.float32(pair.frame_sim_time)
        assert pair.state == state
        assert pair.header.stamp == pair.display_time == pair.grab_time == state.header.stamp
        assert (pair.display_delay, pair.clock_uncertainty, pair.sim_time_error, pair.state_age) == (0, 0, 0, 0)
        assert (pair.dropped, pair.frozen, pair.unpaired) == (0, 0, 0)
        assert pair.quality in (0, FrameState.QUALITY_POSE_UNSURE), "until it is seen how angles are to be read"
        assert pair.camera_pose_source == FrameState.POSE_MEASURED
    assert [pair.image_count for pair in pairs.messages] == list(range(1, len(due) + 1))


def kept_in_a_bag(path: Path, logs) -> Path:
    """What came on topics, as a recording."""
    import rosbag

    with rosbag.Bag(str(path), "w") as bag:
        for log in logs:
            for message in log.messages:
                bag.write(log.topic, message, message.header.stamp)
    return path


def test_two_cameras_answer_with_pictures_of_the_same_frames(world, display, tmp_path):
    from sensor_msgs.msg import CompressedImage
    from xplane_bridge.msg import FlightState, FrameState

    names = [f"{world.namespace}/capture_node", f"{world.namespace}/{NAME}/capture_node"]
    emulator, _, _ = start(world, "--window", "320x240", *WINDOW, participants=names)
    capture(world, display, window={"display": display, "index": 0})
    common = yaml.safe_load(config_file("common.yaml").read_text(encoding="utf-8"))
    common["lockstep"].update(enabled=True, participants=names)
    (tmp_path / "common.yaml").write_text(yaml.safe_dump(common), encoding="utf-8")
    with second_camera(world, emulator.port, display, common_config=tmp_path / "common.yaml"):
        places = [f"{camera}camera" for camera in ("", f"{NAME}/")]
        logs = [world.watch(f"{place}/frame_state", FrameState) for place in places]
        logs += [world.watch(f"{place}/image_raw/compressed", CompressedImage) for place in places]
        logs.append(world.watch("flight_state", FlightState))
        wait_until(lambda: all(log.connected for log in logs), 60, "both cameras")
        assert step(world, 20).flown == 20
        for log in logs:
            have(log, 20)
        ahead, down = (log.messages for log in logs[:2])
    assert [pair.state for pair in ahead] == [pair.state for pair in down]
    assert [pair.header.stamp for pair in ahead] == [pair.header.stamp for pair in down]
    assert ahead[-1].view == FrameState.VIEW_FORWARD
    assert down[-1].view == FrameState.VIEW_DOWN
    page = write_report([kept_in_a_bag(tmp_path / "two.bag", logs)], tmp_path / "report.html").read_text("utf-8")
    assert "100.0 % of the frames with a picture have one of every camera: 20 of 20" in page
    strips = page.split('<section id="images">')[1].split("</section>")[0].split("<h3>Camera ")[1:]
    assert [(strip.split("<")[0], strip.count("<img")) for strip in strips] == [("camera", 12), (NAME, 12)]


def test_a_picture_that_looks_like_the_one_before_comes_too(world, display):
    from sensor_msgs.msg import Image

    start(world, "--window", "--no-strip", "--model", "kinematic", "--start", "ground", "--speed", 0)
    capture(world, display)
    images = world.watch("camera/image_raw", Image)
    wait_until(lambda: images.connected, 30, "connection")
    assert step(world, 20).flown == 20
    have(images, 20)
    assert len({bytes(image.data) for image in images.messages}) < 20
    assert len({image.header.stamp for image in images.messages}) == 20


def test_the_first_frame_waits_for_a_camera_that_starts_late(world, display):
    from std_msgs.msg import Header
    from xplane_bridge.msg import FrameState

    start(world, "--window", hold=False)
    done = world.watch("lockstep/done", Header)
    wait_until(lambda: done.messages, 60, "rx_node's answer to frame 0")
    pairs = world.watch("camera/frame_state", FrameState)
    capture(world, display)
    wait_until(lambda: len(pairs.messages) >= 5, 60, "pictures of five frames")
    # The first heard may be a later one; a frame that was not waited for would have no number.
    assert all(pair.image_count == pair.state.frame_count for pair in pairs.messages[:5])


def test_a_simulator_without_a_renderer_is_named_by_the_watchdog(world, display):
    _, _, tx_node = start(world, watchdog=WATCHDOG_S, hold=False)
    capture(world, display)
    wait_until(lambda: not tx_node.running, 60, "end of tx_node")
    assert tx_node.returncode == 2
    named = "frame 1 was not answered by capture_node, which waits for the emulator's renderer (option --window)"
    assert named in tx_node.describe("")


def test_a_window_that_is_not_found_is_named_by_the_watchdog(world, display):
    _, _, tx_node = start(world, "--window", watchdog=WATCHDOG_S, hold=False)
    capture(world, display, window={"display": display, "title": "No such window"})
    wait_until(lambda: not tx_node.running, 60, "end of tx_node")
    log = tx_node.describe("")
    assert "frame 1 was not answered by capture_node, which waits for a picture: no visible window" in log
    assert "No such window" in log


def test_a_missing_capture_node_is_named_by_the_watchdog(world):
    _, _, tx_node = start(world, "--window", watchdog=WATCHDOG_S, hold=False)
    wait_until(lambda: not tx_node.running, 60, "end of tx_node")
    assert "frame 0 was not answered by capture_node" in tx_node.describe("")


def test_a_renderer_that_dies_ends_the_emulator_in_words(world, display):
    emulator, _, _ = start(world, "--window")
    capture(world, display)
    assert step(world, 5).flown == 5
    children = Path(f"/proc/{emulator.pid}/task/{emulator.pid}/children").read_text(encoding="utf-8").split()
    assert len(children) == 1
    os.kill(int(children[0]), signal.SIGKILL)
    step_in_vain(world)
    wait_until(lambda: not emulator.running, 60, "end of the emulator")
    assert "the window was closed: in lock-step no frame goes on without its picture" in emulator.describe("")


def step_in_vain(world):
    """Asks for a frame; does not wait for it."""
    from std_srvs.srv import Trigger

    assert world.call("lockstep/run", Trigger).success


@pytest.mark.parametrize(
    ("participants", "params", "message"),
    [
        (["controller"], {}, "lockstep/participants does not name"),
        (["capture_node"], {"source": "video", "video": {"address": "film.mp4"}}, "x11 with lockstep/enabled"),
        (["capture_node"], {"set_field_of_view": True}, "false with lockstep/enabled"),
    ],
)
def test_what_pictures_in_lockstep_cannot_work_with_is_refused(world, display, participants, params, message):
    world.point_to(49000)
    world.set_param("lockstep", {"enabled": True, "participants": participants})
    node = capture(world, display, **params)
    wait_until(lambda: not node.running, 30, "end of capture_node")
    assert node.returncode == 1
    assert message in node.describe("")
