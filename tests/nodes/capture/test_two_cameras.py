"""Two windows of one X-Plane, a capture_node for each: forward and down, joined by the frame they show.

The nodes read the windows, or two `xplane_eye` do and send them.
"""

from __future__ import annotations

import contextlib
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.deadlines import WAIT_S
from support.nodes.late_pictures import ShownFrames, punctual_frames, seldom
from support.nodes.second_camera import NAME, WINDOW, second_camera
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ports import free_tcp_port
from xplane_bridge.resources import config_file, program

#: So few that pictures of half a frame late, by which a pairing could be off, are rare on a busy machine.
FPS = 10
PIPELINE_DELAY_S = 0.15
ENOUGH = 40
PUNCTUAL = 5


@contextlib.contextmanager
def reading_windows(world, port: int, display: str):
    """Two capture_node that read the windows."""
    world.set_param("display_delay", PIPELINE_DELAY_S)
    world.start("capture_node", {"window": {"display": display, "index": 0}})
    with second_camera(world, port, display, display_delay=PIPELINE_DELAY_S) as launch:
        yield launch


@contextlib.contextmanager
def taking_what_is_sent(world, port: int, display: str):
    """Two capture_node with an xplane_eye for each."""
    listen = [f"127.0.0.1:{free_tcp_port()}" for _ in range(2)]
    world.start("capture_node", {"source": "sender", "sender": {"listen": listen[0]}})
    second = yaml.safe_load(config_file("capture.yaml").read_text(encoding="utf-8"))
    second["source"], second["sender"]["listen"] = "sender", listen[1]
    config = world.folder / "second.yaml"
    config.write_text(yaml.safe_dump(second), encoding="utf-8")
    with contextlib.ExitStack() as running:
        launch = running.enter_context(second_camera(world, port, display, capture_config=config))
        for window, receiver in enumerate(listen):
            which = [receiver, "--window", window, "--xplane", f"127.0.0.1:{port}", "--local-port", 0]
            own = ["--undo-file", world.folder / f"undo_{window}.json", "--delay", PIPELINE_DELAY_S]
            command = [str(word) for word in (program("xplane_eye"), *which, *own)]
            running.enter_context(ManagedProcess(f"xplane_eye_{window}", command, world.folder))
        yield launch


@pytest.mark.parametrize("cameras_of", [reading_windows, taking_what_is_sent])
def test_forward_and_down_join_by_the_frame(world, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cameras_of) -> None:
    from sensor_msgs.msg import CameraInfo, Image
    from xplane_bridge.msg import FrameState

    with VirtualDisplay(tmp_path) as display:
        monkeypatch.setenv("DISPLAY", display.display)
        swaps = tmp_path / "swaps.csv"
        views = ["--window", *WINDOW, "--swap-log", swaps]
        emulator = world.emulator(*views, "--fps", FPS, "--pipeline-delay", f"{PIPELINE_DELAY_S}s", "--start", "air")
        world.start("rx_node")
        with cameras_of(world, emulator.port, display.display) as launch:
            cameras = [
                (
                    world.watch(f"{place}camera/image_raw", Image),
                    world.watch(f"{place}camera/camera_info", CameraInfo),
                    world.watch(f"{place}camera/frame_state", FrameState),
                )
                for place in ("", f"{NAME}/")
            ]

            shown = [ShownFrames(camera[0].messages) for camera in cameras]
            logs = swaps, tmp_path / "swaps_2.csv"

            def shared() -> list:
                """The states of each frame that both cameras have without a flag."""
                by_key = [{s.frame_sim_time: s for s in list(c[2].messages) if s.quality == 0} for c in cameras]
                return [[each[key] for each in by_key] for key in sorted(by_key[0].keys() & by_key[1].keys())]

            def compared() -> list:
                """Those of which both windows were punctual and both images came, with what these show."""
                punctual = set.intersection(*(punctual_frames(log, PIPELINE_DELAY_S, FPS) for log in logs))
                strips = [each.by_stamp() for each in shown]
                came = [pair for pair in shared() if all(s.header.stamp in each for s, each in zip(pair, strips))]
                both = [(pair, [each[s.header.stamp] for s, each in zip(pair, strips)]) for pair in came]
                return [(pair, seen) for pair, seen in both if all(strip.frame in punctual for strip in seen)]

            enough = seldom(cameras[0][2], lambda: len(shared()) >= ENOUGH and len(compared()) >= PUNCTUAL, 10)
            wait_until(enough, 4 * WAIT_S, "frames that both cameras have, and windows that were punctual")
            launch.check_running()
        emulator.stop()

    for pair in shared():
        assert pair[0].state == pair[1].state, "the same frame, the same state"
    judged = compared()
    for pair, strips in judged:
        assert [np.float32(strip.sim_time) == pair[1].state.sim_time for strip in strips] == [True, True], (
            [(strip.frame, strip.sim_time) for strip in strips],
            [(state.display_time.to_nsec(), state.grab_time.to_nsec(), state.frame_sim_time) for state in pair],
            [log.read_text() for log in logs],
        )
    assert len(judged) >= PUNCTUAL

    forward, down = pair
    assert (forward.header.frame_id, forward.view) == ("camera_optical", FrameState.VIEW_FORWARD)
    assert (down.header.frame_id, down.view) == ("belly_optical", FrameState.VIEW_DOWN)
    turn = down.body_to_camera.rotation
    # Right is right (-y of base_link), down in the picture is aft (-x), the line of sight is down (-z); by hand.
    wanted = np.array((math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0))
    assert abs(np.dot((turn.x, turn.y, turn.z, turn.w), wanted)) == pytest.approx(
        1.0, abs=1e-6
    )  # q and -q are one turn
    assert down.body_to_camera.translation == forward.body_to_camera.translation
    assert down.field_of_view_deg == pytest.approx(90.0)
    assert cameras[0][1].last.K[0] == pytest.approx(554.256, abs=1e-3)  # 320 / tan(30 deg)
    assert cameras[1][1].last.K[0] == pytest.approx(320.0, abs=1e-3)  # 320 / tan(45 deg)
