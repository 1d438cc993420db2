"""The eye's way of reading a window of an X display, on a display of its own."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Callable, Iterator, List, Tuple

import pytest

from xplane_bridge.eye.grab_linux import LinuxGrabber
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.display import VirtualDisplay

LONGEST_S = 20.0
WATCH_S = 1.2  #: two searches and a bit more

#: Shows a window with X-Plane's title that changes all the time; each line of input says where: as Tk's geometry.
WINDOW = """
import sys, tkinter
root = tkinter.Tk(); root.withdraw()
window = tkinter.Toplevel(root); window.title("X-Plane"); window.overrideredirect(True)
shade = 0
def paint():
    global shade
    shade = (shade + 8) % 256
    window.configure(background=f"#{shade:02x}8040"); window.after(20, paint)
def move(*_):
    window.geometry(sys.stdin.readline().strip()); window.update(); print("moved", flush=True)
root.createfilehandler(sys.stdin, tkinter.READABLE, move)
paint(); root.mainloop()
"""


class Counted(LinuxGrabber):
    """Counts its searches."""

    searches = 0

    def _find(self) -> object:
        self.searches += 1
        return super()._find()


@contextlib.contextmanager
def window(display: str) -> Iterator[Callable[[str], None]]:
    """X-Plane's window; gives what moves it."""
    command = [sys.executable, "-c", WINDOW]
    env = {**os.environ, "DISPLAY": display}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=env, **pipes) as shown:  # type: ignore[call-overload]

        def move(geometry: str) -> None:
            print(geometry, file=shown.stdin, flush=True)
            assert shown.stdout.readline() == "moved\n"

        try:
            yield move
        finally:
            shown.kill()


@pytest.fixture(name="display")
def fixture_display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    if shutil.which("Xvfb") is None:
        pytest.skip("there is no Xvfb (apt-get install xvfb)")
    pytest.importorskip("tkinter", reason="there is no tkinter (apt-get install python3-tk)")
    with VirtualDisplay(tmp_path) as display:
        monkeypatch.setenv("DISPLAY", display.display)
        yield display.display


def test_a_window_partly_off_the_screen_is_said_and_not_searched_without_rest(display: str):
    pictures: List[Tuple[int, ...]] = []
    with window(display) as move:
        move("320x240+-100+50")
        grabber = Counted(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels.shape))
        grabber.start()
        try:
            wait_until(lambda: "wholly onto the screen" in grabber.problem, LONGEST_S, "the reason")
            before = grabber.searches
            time.sleep(WATCH_S)
            assert grabber.searches - before <= 4
            assert "wholly onto the screen" in grabber.problem
            assert not pictures
            move("320x240+100+50")
            wait_until(lambda: grabber.problem == "" and len(pictures) > 3, LONGEST_S, "pictures")
            move("320x240+-100+50")
            wait_until(lambda: "wholly onto the screen" in grabber.problem, LONGEST_S, "the reason again")
        finally:
            grabber.stop()
    assert set(pictures) == {(240, 320, 4)}
