"""`python -m xplane_bridge.emulator.renderer`: the window; scenes come as records on standard input."""

from __future__ import annotations

import argparse
import collections
import csv
import os
import queue
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Sequence

import cv2
import numpy as np

from .painter import Painter
from .process import WINDOW_TITLE
from .scene import RECORD_BYTES, Scene

_POLL_S = 0.05
#: Buffers enough for the longest pipeline delay at 120 frames a second.
_LONGEST_QUEUE = 26


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
        except pygame.error as err:
            msg = f"X display {os.environ.get('DISPLAY') or '(DISPLAY is not set)'}: {err}"
            raise SystemExit(msg) from None
        if self._surface.get_bytesize() != 4:
            bits = self._surface.get_bitsize()
            msg = f"the screen has {bits} bits per pixel; expected 24 or 32 (Xvfb: -screen 0 WxHx24)"
            raise SystemExit(msg)

    def closed(self) -> bool:
        """Handles what the server sent; true when the user closed the window."""
        return any(event.type == self._pygame.QUIT for event in self._pygame.event.get())

    def swap(self, bgrx: np.ndarray) -> None:
        """Shows a picture of 4 channels; returns when the server has it."""
        pixels = self._pygame.surfarray.pixels2d(self._surface)
        pixels.T[:] = bgrx.view(np.uint32)[..., 0]
        del pixels  # unlocks the surface
        self._pygame.display.flip()


class Pipeline:
    """Draws scenes as they come, in a thread of its own, newest first when it cannot keep up."""

    def __init__(self, painter: Painter) -> None:
        self._painter = painter
        self.finished: queue.Queue[tuple[Scene, np.ndarray] | None] = queue.Queue(_LONGEST_QUEUE)
        self._spare: collections.deque[np.ndarray] = collections.deque()
        threading.Thread(target=self._run, daemon=True).start()

    def recycle(self, buffer: np.ndarray) -> None:
        """Takes a picture back that was shown."""
        self._spare.append(buffer)

    def _run(self) -> None:
        pipe = sys.stdin.fileno()
        while True:
            data = os.read(pipe, 65536)
            if not data:
                self.finished.put(None)
                return
            scene = Scene.unpack(data[len(data) - RECORD_BYTES :])
            picture = self._painter.paint(scene)
            buffer = self._spare.pop() if self._spare else np.zeros((*picture.shape[:2], 4), np.uint8)
            cv2.cvtColor(picture, cv2.COLOR_BGR2BGRA, dst=buffer)
            self.finished.put((scene, buffer))


def main(argv: Sequence[str] | None = None) -> int:
    """Shows scenes until the pipe or the window is closed."""
    args = _parser().parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal's Ctrl-C is for the emulator, which closes the pipe
    cv2.setNumThreads(1)
    width, height = (int(part) for part in args.size.split("x"))
    painter = Painter(width, height, tuple(args.anchor), args.runway_heading, args.hud, not args.no_strip)
    window = Window(width, height)
    log = args.swap_log.open("w", newline="") if args.swap_log else None
    writer = csv.writer(log) if log else None
    if writer:
        writer.writerow(("frame", "sim_time", "frame_monotonic_ns", "swap_begin_ns", "swap_end_ns"))
    print("READY", flush=True)
    pipeline = Pipeline(painter)
    delay_ns = int(args.pipeline_delay * 1e9)
    while not window.closed():
        try:
            item = pipeline.finished.get(timeout=_POLL_S)
        except queue.Empty:
            continue
        if item is None:
            break
        scene, buffer = item
        time.sleep(max(0.0, (scene.time_ns + delay_ns - time.monotonic_ns()) * 1e-9))
        begin = time.time_ns()
        window.swap(buffer)
        if writer:
            writer.writerow((scene.frame, repr(scene.sim_time), scene.time_ns, begin, time.time_ns()))
        pipeline.recycle(buffer)
    if log:
        log.close()
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="xplane_bridge.emulator.renderer", description=__doc__)
    parser.add_argument("--anchor", nargs=2, type=float, required=True, metavar=("LAT", "LON"), help="[deg]")
    parser.add_argument("--runway-heading", type=float, default=0.0, metavar="DEG")
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--pipeline-delay", type=float, default=0.0, metavar="S")
    parser.add_argument("--hud", action="store_true")
    parser.add_argument("--no-strip", action="store_true")
    parser.add_argument("--swap-log", type=Path, metavar="CSV")
    return parser


if __name__ == "__main__":
    sys.exit(main())
