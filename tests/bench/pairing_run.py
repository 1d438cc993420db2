#!/usr/bin/env python3
"""One flight of the truth bench: writes down what each picture shows and what it was paired with.

A program of its own because one process is one ROS node; `bench_pairing.py` starts it and reads what it writes:
`pictures.npz` (arrays of `COLUMNS`, a picture each), the emulator's `truth.csv` and `swaps.csv`.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import sys
import time
from pathlib import Path
from typing import NamedTuple, Sequence

import numpy as np
from measuring import Use

from xplane_bridge.emulator.view.renderer import StripError, read_strip
from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess, RosMaster, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ports import free_tcp_port
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
_ATTEMPTS = 6


class Recorder:
    """Keeps the lower edge of each image (decoding it would load the machine that is measured), and its state."""

    def __init__(self) -> None:
        self.edges: dict[int, tuple[int, np.ndarray]] = {}  #: by stamp [ns]: first row, rows
        self.states: dict[int, tuple] = {}
        self.paired = False  #: whether a picture was paired without any flag but, maybe, that of the delay
        self.perfect = False  #: whether without any
        self.knows_view = False  #: whether X-Plane has said its field of view

    def on_image(self, image) -> None:
        first = image.height - image.height // 20
        rows = np.frombuffer(image.data[first * image.step :], np.uint8).reshape(-1, image.width, 3)
        self.edges[image.header.stamp.to_nsec()] = (first, rows)

    def on_state(self, state) -> None:
        self.perfect = self.perfect or not state.quality
        self.knows_view = self.knows_view or not state.quality & state.QUALITY_FOV_ASSUMED
        self.paired = self.paired or not state.quality & ~state.QUALITY_DELAY_ASSUMED
        self.states[state.header.stamp.to_nsec()] = (
            np.nan if state.quality & state.QUALITY_STATE_MISSING else state.state.sim_time,
            state.quality,
            state.display_time.to_nsec(),
            state.grab_time.to_nsec(),
        )

    def ready(self, delay: float) -> bool:
        """Whether pictures are paired as well as they will be: a delay of 0 counts as not measured."""
        return self.perfect or (delay == 0.0 and self.paired)

    def clear(self) -> None:
        """Forgets all pictures."""
        self.edges.clear()
        self.paired = self.perfect = False

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


class Flight(NamedTuple):
    """What is flown."""

    fps: float
    seconds: float
    delay: float  #: of the emulator, from a frame to its display [s]
    display_delays: Sequence[float]  #: what the capture_nodes are to take it for [s]
    calibrate: bool  #: the first capture_node measures it
    jitter: float  #: by which frames come later, at most [s]
    sender: bool  #: pictures by xplane_eye
    windows: int  #: a capture_node for each


def second_window(shared: dict, delay: float) -> dict:
    """Parameters of a further camera's namespace."""
    own = {"own_field_of_view": True, "field_of_view_deg": 90.0, "mount": {"pitch_deg": -90.0}}
    return {
        **shared,
        "display_delay": delay,
        "capture_node": {"max_rate": 0.0, "window": {"index": 1}, "frame_measured": "down", **own},
    }


def calibrated() -> None:
    """Has the capture_node measure the delay of its display; a busy machine draws too late at times."""
    import rospy
    from std_srvs.srv import Trigger

    service = f"{_NAMESPACE}/capture_node/calibrate_display_delay"
    rospy.wait_for_service(service, _WARM_UP_S)
    measure = rospy.ServiceProxy(service, Trigger)
    answers = []
    while len(answers) < _ATTEMPTS:
        answers.append(measure())
        if answers[-1].success:
            return
    raise HarnessError("the delay was not measured: " + "; ".join(answer.message for answer in answers))


def fly(folder: Path, flight: Flight) -> None:
    """Flies and writes the files; the pictures come from the window, or from `xplane_eye`."""
    fps, delay, delays, sender = flight.fps, flight.delay, flight.display_delays, flight.sender
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
        options += ["--frame-jitter", f"{flight.jitter}s", *(["--window2", "down@90"] if flight.windows > 1 else [])]
        with EmulatorProcess(folder, list(map(str, options))) as emulator:
            shared = {
                "host": "127.0.0.1",
                "port": emulator.port,
                "listen_for_beacon": False,
                "display_delay": delays[0],
            }
            receiver = free_tcp_port()
            source = {"source": "sender", "sender": {"listen": f"127.0.0.1:{receiver}"}} if sender else {}
            window = {"window": {"index": 0}} if flight.windows > 1 else {}
            rospy.set_param(_NAMESPACE, {**shared, "capture_node": {"max_rate": 0.0, **source, **window}})
            places = [_NAMESPACE]
            nodes = [
                ManagedProcess(name, [node_program(name, env), f"__ns:={_NAMESPACE}"], folder, env=env)
                for name in ("rx_node", "capture_node")
            ]
            if flight.windows > 1:
                places.append(f"{_NAMESPACE}/down")
                rospy.set_param(places[1], second_window(shared, delays[-1]))
                command = [node_program("capture_node", env), f"__ns:={places[1]}"]
                command += [f"{topic}:={_NAMESPACE}/{topic}" for topic in ("flight_state", "mission/warnings")]
                nodes.append(ManagedProcess("capture_node_2", command, folder, env=env))
            recorders = [Recorder() for _ in places]
            topics = []
            for place, recorder in zip(places, recorders):
                topic = f"{place}/camera/image_raw"
                topics += [
                    rospy.Subscriber(topic, Image, recorder.on_image, queue_size=100, buff_size=2**26),
                    rospy.Subscriber(f"{place}/camera/frame_state", FrameState, recorder.on_state, queue_size=1000),
                ]
            with contextlib.ExitStack() as running:
                eyes = [eye(folder, emulator.port, receiver)] if sender else []
                for node in [*nodes, *eyes]:
                    running.enter_context(node)
                given_up = [one.wait_for_line("delay: (not measured)?", _WARM_UP_S).group(1) for one in eyes]
                if flight.calibrate or any(given_up):
                    wait_until(lambda: recorders[0].knows_view, _WARM_UP_S, "pictures with X-Plane's field of view")
                    calibrated()
                    recorders[0].clear()
                    delays = (math.inf, *delays[1:])  # measured, whatever it is
                wait_until(
                    lambda: all(recorder.ready(given) for recorder, given in zip(recorders, delays)),
                    _WARM_UP_S,
                    "paired pictures",
                )
                for recorder in recorders:
                    recorder.clear()
                cameras = [Use(node.pid) for node in nodes[1:]]
                time.sleep(flight.seconds)
                cpu = sum(camera.cpu_percent(flight.seconds) for camera in cameras)
                stamps = [sorted(recorder.edges) for recorder in recorders]
                wait_until(
                    lambda: all(stamp in r.states for r, of_camera in zip(recorders, stamps) for stamp in of_camera),
                    5.0,
                    "states of all pictures",
                )
                for topic in topics:
                    topic.unregister()
        rospy.signal_shutdown("measured")
    for name, recorder, of_camera in zip(("pictures", "pictures_2"), recorders, stamps):
        columns = zip(*[recorder.row(stamp) for stamp in of_camera])
        arrays = {column: np.array(values) for column, values in zip(COLUMNS, columns)}
        np.savez(folder / f"{name}.npz", cpu_percent=cpu, **arrays)


def main() -> int:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fps", type=float, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--frame-jitter", type=float, default=0.0, metavar="S")
    parser.add_argument("--windows", type=int, choices=(1, 2), default=1, help="of the emulator, a camera for each")
    parser.add_argument("--sender", action="store_true", help="pictures by xplane_eye")
    parser.add_argument("--calibrate", action="store_true", help="the capture_node measures the delay")
    parser.add_argument(
        "--display-delays", type=float, nargs="+", metavar="S", help="given to the capture_nodes (--pipeline-delay)"
    )
    parser.add_argument("--pipeline-delay", type=float, required=True, metavar="S")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    delays = args.display_delays or [args.pipeline_delay] * args.windows
    if len(delays) != args.windows:
        parser.error(f"--display-delays: {len(delays)} for {args.windows} windows")
    flight = Flight(
        args.fps,
        args.seconds,
        args.pipeline_delay,
        delays,
        args.calibrate,
        args.frame_jitter,
        args.sender,
        args.windows,
    )
    fly(args.folder.resolve(), flight)
    return 0


if __name__ == "__main__":
    sys.exit(main())
