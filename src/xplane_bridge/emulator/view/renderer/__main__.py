"""`python -m xplane_bridge.emulator.view.renderer`: the window.

Scenes come as records on standard input; a byte on standard output answers each one when it is drawn, or with
`--answer-shown` when the server has it. Pictures wait for their time in a swap chain: one that is not shown before the
next one is due is left out.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import csv
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Callable, NamedTuple, Optional, Sequence

import cv2
import numpy as np

from xplane_bridge.emulator.priority import RealTimePriority
from xplane_bridge.emulator.view.renderer.painter import Painter
from xplane_bridge.emulator.view.renderer.process import WINDOW_TITLE
from xplane_bridge.emulator.view.renderer.scene import RECORD_BYTES, Scene

#: Between two looks whether the window was closed [s].
_POLL_S = 0.05
#: Pictures enough for the longest pipeline delay at 120 frames a second; then drawing waits.
_LONGEST_QUEUE = 26
#: Of the scene: the camera in the aircraft, as it was drawn.
CAMERA_COLUMNS = ("eye_forward_m", "eye_right_m", "eye_down_m", "head_roll_deg", "head_pitch_deg", "head_heading_deg")
#: The swapping thread gets the interpreter so soon from the drawing one [s].
_SWITCH_INTERVAL_S = 0.0002


class WindowError(Exception):
    """The window cannot be opened; the text says why."""


class Window:
    """An X11 window of 32-bit pixels; a swap is one request to the server."""

    def __init__(self, width: int, height: int) -> None:
        # A texture would be swapped by a driver of its own at a time of its own.
        os.environ.update(
            SDL_VIDEODRIVER="x11",
            SDL_FRAMEBUFFER_ACCELERATION="0",
            PYGAME_HIDE_SUPPORT_PROMPT="1",
            SDL_AUDIODRIVER="dummy",
        )
        import pygame  # late: it opens nothing before, and `--help` works without a display

        self._pygame = pygame
        try:
            pygame.display.init()
            pygame.display.set_caption(WINDOW_TITLE, WINDOW_TITLE)
            self._surface = pygame.display.set_mode((width, height))
        except pygame.error as error:
            msg = f"X display {os.environ.get('DISPLAY') or '(DISPLAY is not set)'}: {error}"
            raise WindowError(msg) from None
        if self._surface.get_bytesize() != 4:
            bits = self._surface.get_bitsize()
            msg = f"the screen has {bits} bits per pixel; expected 24 or 32 (Xvfb: -screen 0 WxHx24)"
            raise WindowError(msg)

    def closed(self) -> bool:
        """Handles what the server sent; true when the user closed the window."""
        return any(event.type == self._pygame.QUIT for event in self._pygame.event.get())

    def prepare(self, bgrx: np.ndarray) -> None:
        """Takes a picture of 4 channels over; it is not shown yet."""
        pixels = self._pygame.surfarray.pixels2d(self._surface)
        pixels.T[:] = bgrx.view(np.uint32)[..., 0]
        del pixels  # unlocks the surface

    def swap(self) -> None:
        """Shows the picture; returns when the server has it."""
        self._pygame.display.flip()


class Picture(NamedTuple):
    """A drawn scene and when it is to be seen."""

    scene: Scene
    pixels: np.ndarray  #: 4 channels
    due_ns: int  #: on the monotonic clock


class SwapChain:
    """Pictures on their way to the screen, oldest first."""

    def __init__(self, width: int, height: int) -> None:
        self._shape = (height, width, 4)
        self._pictures: collections.deque[Picture] = collections.deque()
        self._spare: list[np.ndarray] = []
        self._changed = threading.Condition()
        self._ended = False

    def buffer(self) -> np.ndarray:
        """Memory for a picture."""
        with self._changed:
            return self._spare.pop() if self._spare else np.zeros(self._shape, np.uint8)

    def put(self, picture: Picture) -> None:
        """Appends a picture; waits while the chain is full."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._pictures) < _LONGEST_QUEUE)
            self._pictures.append(picture)
            self._changed.notify_all()

    def end(self) -> None:
        """No more pictures come."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    @property
    def ended(self) -> bool:
        """Whether all pictures were taken and no more come."""
        with self._changed:
            return self._ended and not self._pictures

    def next(self, timeout_s: float) -> Optional[Picture]:
        """The next picture to be shown, the newest of those that are due already; None: there is none."""
        with self._changed:
            self._changed.wait_for(lambda: self._pictures or self._ended, timeout_s)
            now = time.monotonic_ns()
            while len(self._pictures) > 1 and self._pictures[1].due_ns <= now:
                self._spare.append(self._pictures.popleft().pixels)
            picture = self._pictures.popleft() if self._pictures else None
            self._changed.notify_all()
            return picture

    def recycle(self, pixels: np.ndarray) -> None:
        """Takes the memory of a picture back."""
        with self._changed:
            self._spare.append(pixels)


def _answer() -> None:
    with contextlib.suppress(BrokenPipeError):
        os.write(sys.stdout.fileno(), b".")


def _draw(painter: Painter, chain: SwapChain, delay_ns: int, drawn: Callable[[], None]) -> None:
    """Draws scenes as they come, until the pipe is closed."""
    scenes = sys.stdin.fileno()
    record = b""
    try:
        while True:
            data = os.read(scenes, RECORD_BYTES - len(record))
            if not data:
                return
            record += data
            if len(record) < RECORD_BYTES:
                continue
            scene, record = Scene.unpack(record), b""
            pixels = chain.buffer()
            painter.paint_into(scene, pixels)
            chain.put(Picture(scene, pixels, scene.time_ns + delay_ns))
            drawn()
    finally:
        chain.end()  # also where a scene cannot be drawn: the emulator would wait for its picture


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Shows scenes until the pipe or the window is closed."""
    args = _parser().parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal's Ctrl-C is for the emulator, which closes the pipe
    cv2.setNumThreads(1)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    width, height = (int(part) for part in args.size.split("x"))
    painter = Painter(width, height, tuple(args.anchor), args.runway_heading, args.hud, not args.no_strip)
    try:
        window = Window(width, height)
    except WindowError as error:
        print(error, flush=True)
        return 1
    log = args.swap_log.open("w", newline="") if args.swap_log else None
    writer = csv.writer(log) if log else None
    if writer:
        times = ("frame", "sim_time", "frame_monotonic_ns", "swap_begin_ns", "swap_end_ns")
        writer.writerow((*times, *CAMERA_COLUMNS))
    priority = RealTimePriority(args.realtime)
    print("READY", flush=True)
    chain = SwapChain(width, height)
    drawn, shown = ((lambda: None), _answer) if args.answer_shown else (_answer, (lambda: None))
    drawing = threading.Thread(target=_draw, args=(painter, chain, int(args.pipeline_delay * 1e9), drawn), daemon=True)
    drawing.start()
    while not window.closed() and not chain.ended:
        picture = chain.next(_POLL_S)
        if picture is None:
            continue
        window.prepare(picture.pixels)
        chain.recycle(picture.pixels)
        time.sleep(max(0.0, (picture.due_ns - time.monotonic_ns()) * 1e-9))
        begin = time.time_ns()
        window.swap()
        shown()
        priority.watch()
        if writer:
            scene = picture.scene
            camera = (repr(getattr(scene, name)) for name in CAMERA_COLUMNS)
            writer.writerow((scene.frame, repr(scene.sim_time), scene.time_ns, begin, time.time_ns(), *camera))
    if chain.ended:
        drawing.join()  # it may be writing why
    if log:
        log.close()
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="xplane_bridge.emulator.view.renderer", description=__doc__)
    parser.add_argument("--anchor", nargs=2, type=float, required=True, metavar=("LAT", "LON"), help="[deg]")
    parser.add_argument("--runway-heading", type=float, default=0.0, metavar="DEG")
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--pipeline-delay", type=float, default=0.0, metavar="S")
    parser.add_argument("--hud", action="store_true")
    parser.add_argument("--no-strip", action="store_true")
    parser.add_argument("--swap-log", type=Path, metavar="CSV")
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument("--answer-shown", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
