"""capture_node with rx_node, the emulator's window and a screen of the tests' own."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import (
    ShownFrames,
    decoded,
    display_delays,
    joined,
    pixels,
    punctual_frames,
    schedule_late,
)
from xplane_bridge import protocol
from xplane_bridge.emulator.view.renderer import read_strip
from xplane_bridge.harness import HarnessError, ManagedProcess, wait_until
from xplane_bridge.resources import program

FOCAL_60_DEG = 554.256  # 320 / tan(30 deg)
pytestmark = pytest.mark.usefixtures("screen")

HEAD_PSI = "sim/graphics/view/pilots_head_psi"
HEAD_THE = "sim/graphics/view/pilots_head_the"
FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"
#: Longer than any drawing here takes, so that pictures appear when they are due.
PIPELINE_DELAY_S = 0.15
FPS = 20
STILL = "Still life"


def window(world, *options: str):
    """Starts the emulator with its window."""
    return world.emulator("--window", "--fps", FPS, "--pipeline-delay", f"{PIPELINE_DELAY_S}s", *options)


def capture(world, display: str, **params: object):
    return world.start("capture_node", {"window": {"display": display, "search_period": 0.05}, **params})


def flickering(world, geometry: str) -> ManagedProcess:
    """A window of almost black pictures that change, so that a late subscriber sees some; WIDTHxHEIGHT in pixels."""
    code = f"""
import itertools, tkinter
root = tkinter.Tk()
root.title({STILL!r})
root.geometry({geometry!r})
colours = itertools.cycle(("#000000", "#010101"))
def draw():
    root.configure(bg=next(colours))
    root.after(100, draw)
draw()
root.mainloop()
"""
    return ManagedProcess("black", [sys.executable, "-c", code], world.folder)


def topics() -> dict:
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image
    from xplane_bridge.msg import FrameState

    return {
        "image": ("camera/image_raw", Image),
        "jpeg": ("camera/image_raw/compressed", CompressedImage),
        "info": ("camera/camera_info", CameraInfo),
        "state": ("camera/frame_state", FrameState),
    }


def watch(world, *names: str) -> list:
    known = topics()
    return [world.watch(*known[name]) for name in names]


def test_every_picture_has_its_info_and_the_state_of_its_frame(world, display, tmp_path: Path) -> None:
    from xplane_bridge.msg import FrameState

    swaps = tmp_path / "swaps.csv"
    emulator = window(world, "--swap-log", swaps)
    world.set_param("display_delay", PIPELINE_DELAY_S)
    world.start("rx_node")
    # A busy machine's states come late, but they come.
    capture(world, display, max_wait=3.0)
    images, infos, states = watch(world, "image", "info", "state")
    began = states.wait_for(lambda state: state.quality == 0, what="a perfectly paired picture").header.stamp
    shown = ShownFrames(images.messages)

    def judged() -> list:
        return shown.judged(states.messages, swaps, PIPELINE_DELAY_S, FPS)

    def enough() -> bool:
        return sum(image.header.stamp >= began for image in joined(images, infos)) >= 100

    wait_until(enough, 2 * WAIT_S, "pictures with info")
    wait_until(lambda: len(judged()) >= 10, 2 * WAIT_S, "punctual pictures, of which a busy machine has few")
    taken = [image for image in list(images.messages) if image.header.stamp >= began]
    last = taken[-1].header.stamp
    wait_until(lambda: states.last.header.stamp >= last, WAIT_S, "the state of the last picture")
    emulator.stop()

    by_stamp = {state.header.stamp: state for state in states.messages}
    assert len(by_stamp) == len(states.messages)
    info_by_stamp = {info.header.stamp: info for info in infos.messages}
    frames = [shown.by_stamp()[image.header.stamp] for image in taken]
    assert all(b.frame > a.frame for a, b in zip(frames, frames[1:])), "a picture came twice"

    shifts = set()
    for image in taken:
        assert (image.width, image.height, image.encoding, image.step) == (640, 480, "bgr8", 1920)
        assert image.header.frame_id == "camera_optical"
        state = by_stamp[image.header.stamp]
        assert state.header.frame_id == image.header.frame_id
        assert state.view == FrameState.VIEW_FORWARD
        assert state.field_of_view_deg == pytest.approx(60.0, abs=1e-3)
        assert state.display_delay == pytest.approx(PIPELINE_DELAY_S)
        assert not state.quality & FrameState.QUALITY_STATE_MISSING
        assert not state.quality & FrameState.QUALITY_INTERPOLATED
        assert state.grab_time >= state.display_time
        info = info_by_stamp.get(image.header.stamp)
        if info is not None:
            assert info.header.frame_id == image.header.frame_id
            assert pytest.approx((FOCAL_60_DEG, 0, 319.5, 0, FOCAL_60_DEG, 239.5, 0, 0, 1), abs=5e-4) == info.K
            shifts.add((info.header.seq - image.header.seq, state.header.seq - image.header.seq))
    # Numbers count also what a queue of two has lost on a busy machine.
    assert len(shifts) == 1, "a picture without info or without state was published"
    pairs = judged()
    assert len(pairs) >= 10
    for state, frame in pairs:
        assert state.state.sim_time == np.float32(frame.sim_time), f"frame {frame.frame}"
        assert state.sim_time_error == pytest.approx(0.0, abs=1e-6)


def test_a_node_that_is_scheduled_late_pairs_no_picture_wrongly(world, display, tmp_path: Path) -> None:
    """Stopped for most of a frame, as on a busy computer: the X server's own stamps say when a picture appeared."""
    swaps = tmp_path / "swaps.csv"
    emulator = window(world, "--swap-log", swaps)
    world.set_param("display_delay", PIPELINE_DELAY_S)
    world.start("rx_node")
    node = capture(world, display)
    images, states = watch(world, "image", "state")
    states.wait_for(lambda state: state.quality == 0, what="a perfectly paired picture")
    first = len(states.messages)
    shown = ShownFrames(images.messages)

    def judged() -> list:
        return shown.judged(states.messages[first:], swaps, PIPELINE_DELAY_S, FPS)

    def enough() -> bool:
        return sum(state.quality == 0 for state in states.messages[first:]) >= 80 and len(judged()) >= 10

    schedule_late(node, 1.0 / FPS, enough)
    emulator.stop()
    pairs = judged()
    assert len(pairs) >= 10
    for state, frame in pairs:
        assert state.state.sim_time == np.float32(frame.sim_time), f"frame {frame.frame}"


def test_views_and_field_of_view_are_read_back(world, display) -> None:
    from xplane_bridge.msg import FrameState

    wire = world.wire(window(world).port)
    capture(world, display)
    infos, states = watch(world, "info", "state")
    states.wait_for(lambda state: state.view == FrameState.VIEW_FORWARD)
    wire.send(protocol.DrefWrite(HEAD_PSI, 180.0))  # nothing, but in the 3-D cockpit
    with pytest.raises(HarnessError):
        states.wait_for_next(lambda state: state.view != FrameState.VIEW_FORWARD, timeout=1.0)
    wire.send(protocol.CommandRequest("sim/view/3d_cockpit_cmnd_look"))
    wire.send(protocol.DrefWrite(HEAD_PSI, 180.0))
    state = states.wait_for_next(lambda state: state.view == FrameState.VIEW_REAR)
    assert state.header.frame_id == "camera_optical"
    wire.send(protocol.DrefWrite(HEAD_PSI, 0.0))
    wire.send(protocol.DrefWrite(HEAD_THE, -90.0))
    states.wait_for_next(lambda state: state.view == FrameState.VIEW_DOWN)
    wire.send(protocol.DrefWrite(HEAD_THE, -30.0))
    state = states.wait_for_next(lambda state: state.view == FrameState.VIEW_UNKNOWN)
    assert not state.quality & FrameState.QUALITY_VIEW_UNKNOWN, "it is none of the three, but it is known"
    assert state.camera_pose_source == FrameState.POSE_MEASURED
    wire.send(protocol.DrefWrite(FIELD_OF_VIEW, 90.0))
    unsure = FrameState.QUALITY_FOV_ASSUMED  # which frame of the change the first pictures show
    state = states.wait_for_next(lambda s: abs(s.field_of_view_deg - 90.0) < 1e-3 and not s.quality & unsure)
    since = state.header.stamp
    wait_until(lambda: any(info.header.stamp >= since for info in joined(infos, states)), WAIT_S, "the info of one")
    info = next(info for info in joined(infos, states) if info.header.stamp >= since)
    assert info.K[0] == pytest.approx(320.0, abs=1e-3)  # 320 / tan(45 deg)


def test_a_picture_has_the_field_of_view_of_the_frame_that_it_shows(world, display, tmp_path: Path) -> None:
    from xplane_bridge.msg import FrameState

    swaps = tmp_path / "swaps.csv"
    world.set_param("display_delay", PIPELINE_DELAY_S)
    emulator = window(world, "--swap-log", swaps)
    world.start("rx_node")
    capture(world, display)
    images, infos, states = watch(world, "image", "info", "state")
    # Before it, X-Plane's view may not be known.
    began = states.wait_for(lambda state: state.quality == 0, timeout=60.0).header.stamp

    frames = ShownFrames(images.messages)

    def punctual_since(stamp) -> int:
        pictures = [image.header.stamp for image in joined(images, infos, states) if image.header.stamp >= stamp]
        shown, due = frames.by_stamp(), punctual_frames(swaps, PIPELINE_DELAY_S, FPS)
        return sum(shown[picture].frame in due for picture in pictures)

    wait_until(lambda: punctual_since(began) >= 3, WAIT_S, "pictures of one field of view")
    world.wire(emulator.port).send(protocol.DrefWrite(FIELD_OF_VIEW, 90.0))
    change = states.wait_for_next(lambda state: abs(state.field_of_view_deg - 90.0) < 1e-3 and state.quality == 0)
    wait_until(lambda: punctual_since(change.header.stamp) >= FPS // 2, WAIT_S, "pictures of the other")
    pictures = [image for image in joined(images, infos, states) if image.header.stamp >= began]
    emulator.stop()
    focal = {info.header.stamp: info.K[0] for info in list(infos.messages)}
    quality = {state.header.stamp: state.quality for state in list(states.messages)}
    shown, punctual = frames.by_stamp(), punctual_frames(swaps, PIPELINE_DELAY_S, FPS)
    small = [pixels(image)[::8, ::8, 1].astype(float) for image in pictures]
    zoomed = 1 + int(np.argmax([np.abs(b - a).mean() for a, b in zip(small, small[1:])]))
    unsure, judged = 0, set()
    for k, stamp in enumerate(image.header.stamp for image in pictures):
        if shown[stamp].frame not in punctual:
            continue  # late, it says nothing about the frame that it is taken for
        if quality[stamp] & FrameState.QUALITY_FOV_ASSUMED:
            unsure += 1
            continue
        judged.add(k < zoomed)
        assert focal[stamp] == pytest.approx(FOCAL_60_DEG if k < zoomed else 320.0, abs=0.01), k - zoomed
    assert judged == {True, False}
    assert zoomed >= 2
    assert unsure <= 4, "only beside the change it is not known which frame a picture shows"


def test_nominal_frames_where_wanted(world, display) -> None:
    wire = world.wire(window(world).port)
    capture(world, display, nominal_frames=True)
    (states,) = watch(world, "state")
    state = states.wait_for(lambda state: state.camera_pose_source == state.POSE_MEASURED)
    assert state.header.frame_id == "camera_forward_optical"
    wire.send(protocol.CommandRequest("sim/view/back"))
    states.wait_for_next(lambda state: state.header.frame_id == "camera_rear_optical")


def test_camera_info_follows_the_frustum(world, display) -> None:
    wire = world.wire(window(world).port)
    capture(world, display)
    (infos,) = watch(world, "info")
    infos.wait_for()
    wire.send(protocol.DrefWrite(FIELD_OF_VIEW, 90.0))
    wire.send(protocol.DrefWrite("sim/graphics/view/vertical_field_of_view_deg", 60.0))
    wire.send(protocol.DrefWrite("sim/graphics/settings/non_proportional_vertical_FOV", 1.0))
    wire.send(protocol.DrefWrite("sim/graphics/view/field_of_view_horizontal_ratio", 0.25))
    # fx = 320 / tan 45 deg, fy = 240 / tan 30 deg; the middle lies a quarter of the width right of the line of sight
    wanted = (320.0, 159.5, 415.692, 239.5)
    infos.wait_for_next(lambda info: (info.K[0], info.K[2], info.K[4], info.K[5]) == pytest.approx(wanted, abs=1e-2))


def test_three_static_frames(world, display) -> None:
    from tf2_msgs.msg import TFMessage

    capture(world, display)
    static = world.watch("/tf_static", TFMessage)
    expected = {  # rotation from the optical frame to base_link, by hand: (x, y, z, w)
        "camera_forward_optical": (0.5, -0.5, 0.5, -0.5),
        "camera_rear_optical": (0.5, 0.5, -0.5, -0.5),
        "camera_down_optical": (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0),
    }

    def has_all(message: TFMessage) -> bool:
        return {transform.child_frame_id for transform in message.transforms} >= set(expected)

    for transform in static.wait_for(has_all).transforms:
        assert transform.header.frame_id == "base_link"
        q = transform.transform.rotation
        got, wanted = np.array((q.x, q.y, q.z, q.w)), np.array(expected[transform.child_frame_id])
        assert min(np.abs(got - wanted).max(), np.abs(got + wanted).max()) < 1e-9, transform.child_frame_id


def test_one_advertiser_of_compressed_and_it_decodes(world, display) -> None:
    import rosgraph

    window(world)
    capture(world, display)
    (jpegs,) = watch(world, "jpeg")
    message = jpegs.wait_for(lambda jpeg: decoded(jpeg).any())  # the window is black before its first frame
    assert "jpeg" in message.format
    assert decoded(message).shape == (480, 640, 3)
    read_strip(decoded(message))
    publishers = dict(rosgraph.Master("/tests").getSystemState()[0])
    assert publishers[f"{world.namespace}/camera/image_raw/compressed"] == [f"{world.namespace}/capture_node"]


def test_lost_window_is_said_and_found_again(world, display) -> None:
    emulator = window(world)
    node = capture(world, display)
    images, states = watch(world, "image", "state")
    images.wait_for()
    emulator.kill()
    status = world.wait_for_diagnostics("capture", lambda status: status.level == 2, timeout=WAIT_S)
    assert "X-System" in status.message
    emulator.restart()
    images.wait_for_next(timeout=WAIT_S)
    states.wait_for_next(timeout=WAIT_S)
    node.check_running()


def test_a_black_picture_is_reported(world, display) -> None:
    from xplane_bridge.msg import FrameState

    world.point_to(9)  # nothing answers there
    capture(world, display, window={"display": display, "search_period": 0.05, "title": STILL})
    images, states = watch(world, "image", "state")
    with flickering(world, "200x200"):
        images.wait_for(timeout=WAIT_S)
        assert states.wait_for(timeout=WAIT_S).quality & FrameState.QUALITY_BLACK
        reported = world.wait_for_diagnostics("capture", lambda s: s.level == 1, timeout=WAIT_S)
        assert reported.message == "the picture is black"


def test_works_alone_on_any_window(world, display) -> None:
    from xplane_bridge.msg import FrameState

    emulator = window(world)
    world.point_to(9)  # nothing answers there
    capture(world, display, field_of_view_deg=90.0, max_wait=0.05)
    images, states = watch(world, "image", "state")
    images.wait_for()
    state = states.wait_for()
    wanted = (
        FrameState.QUALITY_STATE_MISSING
        | FrameState.QUALITY_VIEW_UNKNOWN
        | FrameState.QUALITY_FOV_ASSUMED
        | FrameState.QUALITY_DELAY_ASSUMED
    )
    assert state.quality & wanted == wanted
    assert state.state.valid == 0
    assert math.isnan(state.state.latitude)
    assert math.isnan(state.sim_time_error)
    assert state.header.frame_id == "camera_forward_optical"
    assert state.camera_pose_source == FrameState.POSE_NOMINAL
    assert state.body_to_camera.rotation.x == pytest.approx(0.5)
    assert math.isnan(state.camera_pose_uncertainty)
    assert state.field_of_view_deg == pytest.approx(90.0)
    assert emulator.running


def test_field_of_view_is_set_and_given_back(world, display) -> None:
    wire = world.wire(window(world).port)
    wire.send(protocol.DrefWrite(FIELD_OF_VIEW, 72.0))
    node = capture(world, display, field_of_view_deg=40.0, set_field_of_view=True)
    (states,) = watch(world, "state")
    states.wait_for(lambda state: abs(state.field_of_view_deg - 40.0) < 1e-3, timeout=WAIT_S)
    node.stop()
    capture(world, display, field_of_view_deg=40.0, set_field_of_view=False)
    states.wait_for_next(lambda state: abs(state.field_of_view_deg - 72.0) < 1e-3, timeout=WAIT_S)


def test_states_below_the_frame_rate_are_interpolated(world, display) -> None:
    from xplane_bridge.msg import FrameState

    window(world)
    world.set_param("display_delay", PIPELINE_DELAY_S)
    world.start("rx_node", {"max_publish_rate": 5.0})
    capture(world, display)
    (states,) = watch(world, "state")
    state = states.wait_for(lambda state: state.quality & FrameState.QUALITY_INTERPOLATED, timeout=WAIT_S)
    assert state.state.sim_time == pytest.approx(state.frame_sim_time, abs=2e-3)
    assert state.sim_time_error == 0.0


@pytest.mark.parametrize(
    ("params", "text"),
    [
        ({"window": {"point": [1920]}}, "[x, y] in pixels of the screen"),
        ({"window": {"point": [1920, 0], "index": 1}}, "name a window already"),
        ({"max_rate": -1.0}, "max_rate"),
        ({"fit": "zoom"}, "crop"),
        ({"window": {"title": "a", "class": "b"}}, "at most one"),
        ({"window": {"region": [1, 2, 3]}}, "region"),
        ({"source": "video"}, "address"),
        ({"widht": 320}, "width"),
    ],
)
def test_wrong_parameters_are_refused_in_words(world, params: dict, text: str) -> None:
    node = world.start("capture_node", params)
    assert node.wait(WAIT_S) == 1
    assert text in node.output()


ROLLS = """
name: rolls
repeat_every: 20
events:
  - {at: 0, hold: {roll: 0, altitude: 1000, speed: 75}}
  - at: 0
    excitation: {kind: multisine, target: roll, amplitude: 0.25, duration: 19, frequency: 0.3, frequency_end: 1.5}
"""


def test_estimate_latency_live_finds_the_delay_of_the_display(world, display, tmp_path: Path) -> None:
    (tmp_path / "rolls.yaml").write_text(ROLLS, encoding="utf-8")
    swaps = tmp_path / "swaps.csv"
    window(world, "--pilot", tmp_path / "rolls.yaml", "--start", "air", "--swap-log", swaps)
    world.start("rx_node")
    command = [program("estimate_latency"), "--live", "15", "--namespace", world.namespace]
    with ManagedProcess("live", [*command, "--json", tmp_path / "live.json"], tmp_path, env=world.env) as live:
        live.wait_for_line(f"waiting: no node publishes {world.namespace}/camera/image_raw/compressed", 60)
        first = max(display_delays(swaps), default=0)
        capture(world, display)
        assert live.wait(120) == 0, live.output()
    shown = np.median([delay for frame, delay in display_delays(swaps).items() if frame > first])  # late where busy
    delay = json.loads((tmp_path / "live.json").read_text(encoding="utf-8"))["display_delay"]["delay"]
    assert delay == pytest.approx(shown, abs=0.02)


def test_part_of_a_window_is_not_taken_for_the_whole(world, display) -> None:
    """X-Plane's window has 640 x 480 px; what is captured has another shape."""
    from xplane_bridge.msg import FrameState

    world.emulator("--fps", FPS)
    shown = {"window": {"display": display, "search_period": 0.05, "title": STILL}, "fit": "letterbox"}
    with flickering(world, "320x400"):
        node = capture(world, display, **shown)
        (states,) = watch(world, "state")
        node.wait_for_line("pictures of 320 x 400 px do not have the shape of X-Plane's window", WAIT_S)
        states.skip_to_now()
        state = states.then_wait_for(lambda state: state.quality & FrameState.QUALITY_FOV_ASSUMED, timeout=WAIT_S)
    # 320 x 400 in 640 x 480: 384 columns.
    assert (state.picture_x, state.picture_y, state.picture_width, state.picture_height) == (128, 0, 384, 480)


def test_scaled_output(world, display) -> None:
    from xplane_bridge.msg import FrameState

    window(world)
    capture(world, display, width=320, height=160, fit="crop", max_rate=10.0)
    images, infos, states = watch(world, "image", "info", "state")
    image, info, state = images.wait_for(), infos.wait_for(), states.wait_for()
    assert (state.picture_x, state.picture_y, state.picture_width, state.picture_height) == (0, 0, 320, 160)
    states.wait_for(lambda state: not state.quality & FrameState.QUALITY_FOV_ASSUMED, timeout=WAIT_S)
    assert pixels(image).shape == (160, 320, 3)
    # 640x480 cropped to 640x320, halved: f = 554.256 / 2.
    assert info.K[0] == pytest.approx(FOCAL_60_DEG / 2, abs=5e-4)
    assert info.K[5] == pytest.approx(79.5)
    with pytest.raises(HarnessError):
        images.wait_for_count(60, timeout=3.0)  # at most 30 in that time
