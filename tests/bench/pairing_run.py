#!/usr/bin/env python3
"""One flight of the truth bench: writes down what each picture shows and what it was paired with.

A program of its own because one process is one ROS node; `bench_pairing.py` starts it and reads what it writes:
`pictures.npz` (arrays of `COLUMNS`, a picture each), the emulator's `truth.csv` and `swaps.csv`.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from pathlib import Path

import numpy as np

from xplane_bridge.emulator.view.renderer import StripError, read_strip
from xplane_bridge.harness import EmulatorProcess, ManagedProcess, RosMaster, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ros import free_port
from xplane_bridge.resources import config_file, node_program, program

COLUMNS = (
    "shown_frame",  # by the strip; -1: not readable
    "shown_sim_time",  # [s] by the strip
    "state_sim_time",  # [s] of the state; nan: none
    "quality",  # FrameState.QUALITY_* bits
    "display_ns",  # [ns] host time
    "grab_ns",  # [ns] host time
)
_NAMESPACE = "/bench"
_WARM_UP_S = 30.0


class Recorder:
    """Keeps the lower edge of each image (decoding it would load the machine that is measured), and its state."""

    def __init__(self) -> None:
        self.edges: dict[int, tuple[int, np.ndarray]] = {}  #: by stamp [ns]: first row, rows
        self.states: dict[int, tuple] = {}
        self.perfect = False  #: whether a picture was paired without any flag

    def on_image(self, image) -> None:
        first = image.height - image.height // 20
        rows = np.frombuffer(image.data[first * image.step :], np.uint8).reshape(-1, image.width, 3)
        self.edges[image.header.stamp.to_nsec()] = (first, rows)

    def on_state(self, state) -> None:
        self.perfect = self.perfect or not state.quality
        self.states[state.header.stamp.to_nsec()] = (
            np.nan if state.quality & state.QUALITY_STATE_MISSING else state.state.sim_time,
            state.quality,
            state.display_time.to_nsec(),
            state.grab_time.to_nsec(),
        )

    def row(self, stamp: int) -> tuple:
        """Values of `COLUMNS`."""
        try:
            first, rows = self.edges[stamp]
            strip = read_strip(np.pad(rows, ((first, 0), (0, 0), (0, 0))))
            return (strip.frame, strip.sim_time, *self.states[stamp])
        except StripError:
            return (-1, np.nan, *self.states[stamp])


def eye(folder: Path, xplane_port: int, receiver_port: int) -> ManagedProcess:
    """`xplane_eye` on the same screen; it measures the delay itself."""
    where = [f"127.0.0.1:{receiver_port}", "--xplane", f"127.0.0.1:{xplane_port}", "--local-port", "0"]
    command = [program("xplane_eye"), *where, "--undo-file", folder / "undo.json"]
    return ManagedProcess("xplane_eye", command, folder, env=dict(os.environ))


def fly(folder: Path, fps: float, seconds: float, delay: float, sender: bool) -> None:
    """Flies and writes the files; the pictures come from the window, or from `xplane_eye`."""
    with VirtualDisplay(folder) as display, RosMaster(folder) as master:
        os.environ["DISPLAY"] = display.display
        master.use_here()
        import rospy
        from sensor_msgs.msg import Image
        from xplane_bridge.msg import FrameState

        rospy.init_node("pairing_run", disable_signals=True, disable_rosout=True)
        env = {**master.env, "DISPLAY": display.display}
        options = ["--window", "--fps", f"{fps:g}", "--pipeline-delay", f"{delay}s", "--truth", folder / "truth.csv"]
        options += ["--swap-log", folder / "swaps.csv", "--pilot", config_file("scenarios", "demo.yaml")]
        with EmulatorProcess(folder, list(map(str, options))) as emulator:
            shared = {"host": "127.0.0.1", "port": emulator.port, "listen_for_beacon": False, "display_delay": delay}
            receiver = free_port()
            source = {"source": "sender", "sender": {"listen": f"127.0.0.1:{receiver}"}} if sender else {}
            rospy.set_param(_NAMESPACE, {**shared, "capture_node": {"max_rate": 0.0, **source}})
            nodes = [
                ManagedProcess(name, [node_program(name, env), f"__ns:={_NAMESPACE}"], folder, env=env)
                for name in ("rx_node", "capture_node")
            ]
            recorder = Recorder()
            topics = [
                rospy.Subscriber(
                    f"{_NAMESPACE}/camera/image_raw", Image, recorder.on_image, queue_size=100, buff_size=2**26
                ),
                rospy.Subscriber(f"{_NAMESPACE}/camera/frame_state", FrameState, recorder.on_state, queue_size=1000),
            ]
            with contextlib.ExitStack() as running:
                for node in [*nodes, *([eye(folder, emulator.port, receiver)] if sender else [])]:
                    running.enter_context(node)
                wait_until(lambda: recorder.perfect, _WARM_UP_S, "paired picture")
                recorder.edges.clear()
                time.sleep(seconds)
                stamps = sorted(recorder.edges)
                wait_until(lambda: all(stamp in recorder.states for stamp in stamps), 5.0, "states of all pictures")
                for topic in topics:
                    topic.unregister()
        rospy.signal_shutdown("measured")
    rows = [recorder.row(stamp) for stamp in stamps]
    np.savez(folder / "pictures.npz", **{name: np.array(values) for name, values in zip(COLUMNS, zip(*rows))})


def main() -> int:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fps", type=float, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--sender", action="store_true", help="pictures by xplane_eye")
    parser.add_argument("--pipeline-delay", type=float, required=True, metavar="S")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    fly(args.folder.resolve(), args.fps, args.seconds, args.pipeline_delay, args.sender)
    return 0


if __name__ == "__main__":
    sys.exit(main())
