"""The renderer as a child process of the emulator."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Mapping, Optional, Sequence

from xplane_bridge.emulator.view.renderer.scene import RECORD_BYTES, Scene
from xplane_bridge.errors import XplaneBridgeError


class RendererError(XplaneBridgeError):
    """The window cannot be opened, or an option is out of range."""


#: X-Plane's own window title.
WINDOW_TITLE = "X-System"
#: Longest settable pipeline delay [s].
MAX_PIPELINE_DELAY_S = 0.2


@dataclass(frozen=True)
class RendererOptions:
    """What is drawn where.

    Attributes:
        anchor: Latitude and longitude [deg] of the aerodrome.
        runway_heading_deg: True heading of its runway.
        width, height: Of the window [px].
        pipeline_delay: From the frame (`Scene.time_ns`) to its display [s], 0..0.2; 0: as soon as it is drawn.
        hud, strip: Whether the head-up display and the machine-readable strip are drawn.
        swap_log: CSV file for frame, simulator time, frame time and swap time of each picture shown, and its camera.
        realtime: Whether the thread that swaps asks for real-time priority.
        answers_shown: Whether a frame counts as drawn when it is on display only.
        place: Of the window's upper left corner on the screen [px]; None: where the system puts it.
        display: X display; None: `DISPLAY`.
    """

    anchor: tuple[float, float]
    runway_heading_deg: float = 0.0
    width: int = 640
    height: int = 480
    pipeline_delay: float = 0.0
    hud: bool = False
    strip: bool = True
    swap_log: Optional[Path] = None
    realtime: bool = False
    answers_shown: bool = False
    place: Optional[tuple[int, int]] = None
    display: Optional[str] = None

    def __post_init__(self) -> None:
        if not (320 <= self.width <= 4096 and 240 <= self.height <= 4096):
            msg = f"window size {self.width}x{self.height}: expected 320x240 to 4096x4096"
            raise RendererError(msg)
        if not 0.0 <= self.pipeline_delay <= MAX_PIPELINE_DELAY_S:
            msg = f"pipeline delay {self.pipeline_delay} s: expected 0 to {MAX_PIPELINE_DELAY_S}"
            raise RendererError(msg)

    def arguments(self) -> list[str]:
        """The command line of `python -m xplane_bridge.emulator.view.renderer`."""
        words = ["--anchor", *map(str, self.anchor), "--runway-heading", self.runway_heading_deg]
        words += ["--size", f"{self.width}x{self.height}", "--pipeline-delay", self.pipeline_delay]
        words += ["--hud"] if self.hud else []
        words += [] if self.strip else ["--no-strip"]
        words += ["--swap-log", self.swap_log] if self.swap_log else []
        words += ["--realtime"] if self.realtime else []
        words += ["--answer-shown"] if self.answers_shown else []
        return [str(word) for word in words]


class RendererProcess:
    """Starts the window and feeds it scenes.

    Raises:
        RendererError: The window could not be opened; the text says why.
    """

    def __init__(self, options: RendererOptions) -> None:
        environment = dict(os.environ)
        if options.display is not None:
            environment["DISPLAY"] = options.display
        if options.place is not None:
            environment["SDL_VIDEO_WINDOW_POS"] = "{},{}".format(*options.place)
        source = str(Path(__file__).resolve().parents[4])
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [source, environment.get("PYTHONPATH", "")]))
        self._child = self.start_program(options.arguments(), environment)
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        said = self._child.stdout.readline().decode(errors="replace").strip()
        if said != "READY":
            self._child.wait()
            raise RendererError(f"the window could not be opened: {said or 'its program ended before that'}")
        self._scenes, self._answers = self._child.stdin.fileno(), self._child.stdout.fileno()
        self._in_work = 0
        self._silent = False  # the pipes are closed, which comes before the process has ended

    @staticmethod
    def start_program(arguments: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
        """Starts it, with pipes to its standard input and from its standard output."""
        return subprocess.Popen(
            [sys.executable, "-m", __package__, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env=environment,
        )

    @property
    def alive(self) -> bool:
        """Whether the window is still there."""
        return not self._silent and self._child.poll() is None

    def show(self, scene: Scene) -> None:
        """Hands a frame over; not before the last one is drawn."""
        record = scene.pack()
        assert len(record) == RECORD_BYTES
        try:
            os.write(self._scenes, record)  # all or nothing: shorter than PIPE_BUF
            self._in_work += 1
        except BrokenPipeError:
            self._in_work, self._silent = 0, True  # the window was closed; X-Plane's packets go on

    def drawn(self, timeout_s: float) -> bool:
        """Whether all frames handed over are drawn (or the window gone); waits for it so long."""
        if self._in_work and select.select((self._answers,), (), (), timeout_s)[0]:
            answers = os.read(self._answers, 4096)
            self._silent = not answers
            self._in_work = self._in_work - len(answers) if answers else 0
        return self._in_work == 0

    def close(self) -> None:
        """Closes the window."""
        for stream in (self._child.stdin, self._child.stdout):
            if stream is not None:
                stream.close()
        try:
            self._child.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
