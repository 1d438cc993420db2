"""The camera's measured pose against the camera that the emulator draws, frame by frame."""

from __future__ import annotations

import csv
import math
import socket
from pathlib import Path

import numpy as np
import pytest

from support.deadlines import WAIT_S
from xplane_bridge import protocol
from xplane_bridge.emulator.flight import earth
from xplane_bridge.harness import wait_until

PIPELINE_DELAY_S = 0.1
FPS = 20
#: Of the measured pose, in every view.
ANGLE_DEG, PLACE_M = 0.1, 0.01
VIEWS = (
    "forward_with_2d_panel",
    "forward_with_nothing",
    "3d_cockpit_cmnd_look",
    "back",
    "straight_down",
    "ridealong",
    "chase",
    "circle",
    "tower",
    "free_camera",
)
ROLLING = """
name: rolling
repeat_every: 6
events:
  - {at: 0, stick: {roll: 1, pitch: 0}}
  - {at: 1.5, stick: {roll: -1}}
  - {at: 4.5, stick: {roll: 1}}
"""
#: Optical axes right, down, forward of a camera that looks ahead, in forward, right, down.
_OPTICAL = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
_FLU = np.diag((1.0, -1.0, -1.0))


def send(port: int, message) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(message.encode(), ("127.0.0.1", port))


def drawn(row: dict) -> tuple[np.ndarray, np.ndarray]:
    """Place in base_link and rotation of optical vectors into it, of a row of the swap log."""
    place = _FLU @ [float(row[f"eye_{axis}_m"]) for axis in ("forward", "right", "down")]
    turn = earth.body_to_level(*(float(row[f"head_{axis}_deg"]) for axis in ("roll", "pitch", "heading")))
    return place, _FLU @ turn @ _OPTICAL


def measured(state) -> tuple[np.ndarray, np.ndarray]:
    t, q = state.body_to_camera.translation, state.body_to_camera.rotation
    return np.array((t.x, t.y, t.z)), earth.rotation_from_quaternion(q.w, q.x, q.y, q.z)


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    # The sine of half the angle keeps its digits where the cosine has lost them.
    return math.degrees(2.0 * math.asin(min(np.linalg.norm(a - b) / (2.0 * math.sqrt(2.0)), 1.0)))


def test_pose_is_that_of_the_drawn_camera_in_every_view(
    world, display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tf2_msgs.msg import TFMessage
    from xplane_bridge.msg import FrameState

    monkeypatch.setenv("DISPLAY", display)
    swaps = tmp_path / "swaps.csv"
    (tmp_path / "rolling.yaml").write_text(ROLLING, encoding="utf-8")
    options = ["--window", "320x240", "--fps", FPS, "--pipeline-delay", f"{PIPELINE_DELAY_S}s", "--swap-log", swaps]
    emulator = world.emulator(*options, "--pilot", tmp_path / "rolling.yaml", "--start", "air")
    world.set_param("display_delay", PIPELINE_DELAY_S)
    world.start("rx_node", {"publish_tf": True})
    world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    states = world.watch("camera/frame_state", FrameState)
    transforms = world.watch("/tf", TFMessage)
    unsure = FrameState.QUALITY_POSE_UNSURE | FrameState.QUALITY_STATE_MISSING
    states.wait_for(lambda state: not state.quality & unsure, timeout=WAIT_S, what="a sure pose")

    seen: dict[str, range] = {}
    for view in (*VIEWS, "turned"):
        if view == "turned":  # by the visual offset
            send(emulator.port, protocol.CommandRequest("sim/view/forward_with_nothing"))
            for leaf, value in (("vertical", -40.0), ("horizontal", 120.0), ("roll", 10.0)):
                send(emulator.port, protocol.DrefWrite(f"sim/graphics/view/field_of_view_{leaf}_deg", value))
        else:
            send(emulator.port, protocol.CommandRequest(f"sim/view/{view}"))
        begin = len(states.messages)
        wait_until(lambda begin=begin: len(states.messages) > begin + 3 * FPS, WAIT_S, f"pictures of {view}")
        seen[view] = range(begin + FPS // 2, len(states.messages))  # the view's first pictures are on their way still
    emulator.stop()

    with swaps.open() as file:
        rows = {np.float32(float(row["sim_time"])): row for row in csv.DictReader(file)}
    fastest = 0.0
    for view, numbers in seen.items():
        compared = 0
        for state in (states.messages[number] for number in numbers):
            # By the frame that the state names: on a busy machine pictures are late, and then of another frame.
            row = rows.get(np.float32(state.frame_sim_time))
            if row is None:
                continue
            assert state.header.frame_id == "camera_optical"
            assert state.camera_pose_source == FrameState.POSE_MEASURED, view
            if state.quality & FrameState.QUALITY_POSE_UNSURE:
                continue
            compared += 1
            fastest = max(fastest, abs(math.degrees(state.state.angular_velocity.x)))
            (place, turn), (true_place, true_turn) = measured(state), drawn(row)
            assert angle_deg(turn, true_turn) < ANGLE_DEG, f"{view}, frame {row['frame']}"
            assert np.linalg.norm(place - true_place) < PLACE_M, f"{view}, frame {row['frame']}: {place} {true_place}"
            assert state.camera_pose_uncertainty < PLACE_M
        assert compared >= 10, f"{view}: only {compared} of {len(numbers)} pictures"
    assert fastest > 60.0, "the aircraft was to roll"

    # The aircraft of a picture is at its frame's stamp, the camera in it at its own: docs/nodes/capture_node.md.
    aircraft = {t.header.stamp for m in transforms.messages for t in m.transforms if t.child_frame_id == "base_link"}
    of_frame = [states.messages[number] for numbers in seen.values() for number in numbers]
    doubtful = FrameState.QUALITY_INTERPOLATED | FrameState.QUALITY_BORDERLINE | FrameState.QUALITY_CLOCK_UNSURE
    of_frame = [state for state in of_frame if not state.quality & (unsure | doubtful)]
    assert len(of_frame) > 100
    for state in of_frame:
        assert state.state.header.stamp in aircraft
        assert (state.header.stamp - state.state.header.stamp).to_sec() > 0.5 * PIPELINE_DELAY_S
    poses = {state.header.stamp: state.body_to_camera for state in states.messages}
    sent = [t for message in transforms.messages for t in message.transforms if t.child_frame_id == "camera_optical"]
    assert len(sent) > 100
    for transform in sent:
        assert transform.header.frame_id == "base_link"
        assert transform.transform == poses[transform.header.stamp]
