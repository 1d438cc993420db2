"""Pictures of a window as ROS images: capture_node against what else people use, one after the other on one display."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
import xmlrpc.client
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from bench_offline import cpp_program
from measuring import measuring, report_of
from registry import Context, Measure, benchmark

from xplane_bridge.harness import HarnessError, ManagedProcess, RosMaster
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ports import free_tcp_port

_TITLE = "bench window"
_DRAWN_FPS = 57.0  # not a divisor of any rate here: periods vary, too
_ASKED_FPS = 60.0  # of all that run at a rate
_SYSTEM_PYTHON = "/usr/lib/python3/dist-packages"
_OURS = "capture_node"


@dataclass
class _Figures:
    """What one program reached."""

    pictures_per_s: float  #: each counted once
    delivered: float  #: [%] of the pictures drawn
    distinct: float  #: [%] of the images
    cpu_ms: float  #: per distinct picture, of the program, its helpers, and the X server beyond its own drawing
    grab_p50_ms: float  #: age of the picture when it was grabbed
    grab_p95_ms: float
    age_p50_ms: float  #: the same when the subscriber has it
    age_p95_ms: float
    period_p99_ms: float  #: between distinct pictures at the subscriber
    period_worst_ms: float

    def measures(self, where: str, budgets: Dict[str, Dict[str, object]]) -> List[Measure]:
        """One line each.

        Args:
            where: what they are of.
            budgets: arguments of Measure, by the names of figures.
        """
        named = (
            ("distinct pictures", self.pictures_per_s, "/s"),
            ("of the drawn pictures", self.delivered, "%"),
            ("distinct ones of the images", self.distinct, "%"),
            ("CPU a picture", self.cpu_ms, "ms"),
            ("age when grabbed, p50", self.grab_p50_ms, "ms"),
            ("age when grabbed, p95", self.grab_p95_ms, "ms"),
            ("age at the subscriber, p50", self.age_p50_ms, "ms"),
            ("age at the subscriber, p95", self.age_p95_ms, "ms"),
            ("period, p99", self.period_p99_ms, "ms"),
            ("period, worst", self.period_worst_ms, "ms"),
        )
        return [Measure(f"{where}: {name}", value, unit, **budgets.get(name, {})) for name, value, unit in named]


class _Stage:
    """A display that just holds a window of pictures with their own number and time, and a ROS master."""

    def __init__(self, folder: Path, size: Tuple[int, int], seconds: float) -> None:
        self.size = size
        self._folder = folder
        self._seconds = seconds
        self._stack = contextlib.ExitStack()

    def __enter__(self) -> _Stage:
        with contextlib.ExitStack() as stack:
            self._display = stack.enter_context(VirtualDisplay(self._folder, *self.size))
            self._master = stack.enter_context(RosMaster(self._folder / "master"))
            width, height = self.size
            window = ["bench_window", f"title={_TITLE}", f"width={width}", f"height={height}", f"fps={_DRAWN_FPS}"]
            stack.enter_context(self.program(window)).wait_for_line("^READY", 30.0)
            self._idle = self._x_server_alone()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def process(self, name: str, command: Sequence[object]) -> ManagedProcess:
        """A program on this display and under this master."""
        env = {**self._master.env, "DISPLAY": self._display.display}
        return ManagedProcess(name, [str(part) for part in command], self._folder, env=env)

    def program(self, words: Sequence[object]) -> ManagedProcess:
        """One of tests/bench's, or a node."""
        return self.process(str(words[0]), [cpp_program(str(words[0])), *words[1:]])

    @property
    def display(self) -> str:
        """DISPLAY."""
        return self._display.display

    def set_param(self, key: str, value: object) -> None:
        """Sets a parameter."""
        with xmlrpc.client.ServerProxy(self._master.uri) as master:
            master.setParam("/bench_capture", key, value)

    def _x_server_alone(self) -> float:
        """CPU [s] a second that the server takes for what the window draws."""
        meter = self.process("pause", ["sh", "-c", f"echo MEASURING; sleep {self._seconds}; echo MEASURED; sleep 5"])
        with meter, measuring(meter, [self._display]) as (use,):
            return use.cpu_s() / self._seconds

    def measure(self, grabber: ManagedProcess, topic: str, states: str = "") -> _Figures:
        """Runs a program that publishes images, and measures what comes of it."""
        words = [f"topic={topic}", f"seconds={self._seconds:g}", *([f"states={states}"] if states else [])]
        with grabber, self.program(["bench_images", *words]) as meter:
            with measuring(meter, [grabber, self._display]) as (use, server):
                cpu = use.cpu_s() + max(0.0, server.cpu_s() - self._idle * self._seconds)
            grabber.check_running()
            report = report_of(meter, 30.0)
        if report["unreadable"]:
            raise HarnessError(grabber.describe(f"published {report['unreadable']} pictures without a readable strip"))
        return _Figures(
            pictures_per_s=report["distinct"] / report["elapsed_s"],
            delivered=100.0 * report["distinct"] / report["drawn"],
            distinct=100.0 * report["distinct"] / report["images"],
            cpu_ms=1e3 * cpu / report["distinct"],
            grab_p50_ms=report["grab_p50_ms"],
            grab_p95_ms=report["grab_p95_ms"],
            age_p50_ms=report["age_p50_ms"],
            age_p95_ms=report["age_p95_ms"],
            period_p99_ms=report["period_p99_ms"],
            period_worst_ms=report["period_worst_ms"],
        )

    def grab_and_convert(self) -> Dict[str, float]:
        """How long our node's way from the window to the published pixels takes, alone."""
        width, height = self.size
        words = [f"title={_TITLE}", f"width={width}", f"height={height}", f"seconds={self._seconds:g}"]
        with self.program(["bench_grab", *words]) as grab:
            if grab.wait(self._seconds + 30.0) != 0:
                raise HarnessError(grab.describe("failed"))
            return json.loads(grab.output())


def _capture_node(stage: _Stage) -> _Figures:
    width, height = stage.size
    own = {"window": {"title": _TITLE}, "width": width, "height": height, "max_rate": 0.0}
    shared = {"host": "127.0.0.1", "port": free_tcp_port(), "listen_for_beacon": False}
    stage.set_param("/bench", {**shared, "capture_node": own})
    node = stage.program(["capture_node", "__ns:=/bench"])
    return stage.measure(node, "/bench/camera/image_raw", "/bench/camera/frame_state")


def _ffmpeg(stage: _Stage) -> _Figures:
    if shutil.which("ffmpeg") is None:
        raise HarnessError("there is no ffmpeg: apt-get install ffmpeg (scripts/setup --test does)")
    width, height = stage.size
    grab = f"-f x11grab -draw_mouse 0 -framerate {_ASKED_FPS:g} -video_size {width}x{height} -i {stage.display}"
    publish = f"{cpp_program('bench_pipe_publisher')} /ffmpeg/image_raw {width} {height}"
    pipe = f"ffmpeg -nostdin -loglevel error {grab} -f rawvideo -pix_fmt bgr24 - | {publish}"
    return stage.measure(stage.process("ffmpeg", ["sh", "-c", pipe]), "/ffmpeg/image_raw")


def _mss(stage: _Stage) -> _Figures:
    script = Path(__file__).with_name("mss_node.py")
    # cv_bridge goes with the system's OpenCV and numpy, not with those of the environment that has mss.
    env = ["env", f"PYTHONPATH={_SYSTEM_PYTHON}:{os.environ.get('PYTHONPATH', '')}"]
    node = stage.process("mss", [*env, sys.executable, script, "/mss/image_raw", *stage.size, _ASKED_FPS])
    return stage.measure(node, "/mss/image_raw")


def _get_image(stage: _Stage) -> _Figures:
    node = stage.program(["bench_get_image", "/get_image/image_raw", *stage.size, _ASKED_FPS])
    return stage.measure(node, "/get_image/image_raw")


#: Every picture, each once, fresh.
_WANTED: Dict[str, Dict[str, object]] = {
    "of the drawn pictures": {"budget": 99.0, "at_least": True},
    "distinct ones of the images": {"budget": 100.0, "at_least": True},
    "age when grabbed, p95": {"budget": 3.0},
    "period, p99": {"budget": 2e3 / _DRAWN_FPS},  # one picture may come late
    "period, worst": {"budget": 100.0},
}
_PEERS: Dict[str, Callable[[_Stage], _Figures]] = {"ffmpeg": _ffmpeg, "mss": _mss, "GetImage": _get_image}


def _verdicts(where: str, ours: _Figures, peers: Sequence[_Figures]) -> Iterator[Measure]:
    """Behind no peer in anything."""
    for name, value in (
        ("CPU a picture", lambda f: f.cpu_ms),
        ("age when grabbed, p50", lambda f: f.grab_p50_ms),
        ("age when grabbed, p95", lambda f: f.grab_p95_ms),
        ("age at the subscriber, p50", lambda f: f.age_p50_ms),
        ("age at the subscriber, p95", lambda f: f.age_p95_ms),
    ):
        ratio = min(map(value, peers)) / value(ours)
        yield Measure(f"{where} {name}, best peer / ours", ratio, "times", budget=1.0, at_least=True)


def _against_peers(context: Context, size: Tuple[int, int], grab_budget: Optional[float]) -> List[Measure]:
    where = f"{size[0]}x{size[1]}"
    with _Stage(context.folder, size, context.seconds / 2.0) as stage:
        ours = _capture_node(stage)
        peers = {name: peer(stage) for name, peer in _PEERS.items()}
        grab = stage.grab_and_convert()
    measures = ours.measures(f"{where} {_OURS}", _WANTED)
    for name, figures in peers.items():
        measures += figures.measures(f"{where} {name}", {})
    measures.append(Measure(f"{where} grab and convert, p50", grab["p50_ms"], "ms", budget=grab_budget))
    measures.append(Measure(f"{where} grab and convert, p95", grab["p95_ms"], "ms"))
    return [*measures, *_verdicts(where, ours, list(peers.values()))]


@benchmark
def capture(context: Context) -> List[Measure]:
    """A 640x480 window at 57 pictures/s as images: capture_node, ffmpeg x11grab, mss + cv_bridge, plain GetImage."""
    return _against_peers(context, (640, 480), 1.0)


@benchmark
def capture_1080p(context: Context) -> List[Measure]:
    """The same at 1920x1080."""
    return _against_peers(context, (1920, 1080), None)
