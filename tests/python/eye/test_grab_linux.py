"""The eye's way of reading a window of an X display, on a display of its own."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Set, Tuple

import pytest

from xplane_bridge.doctor.observe.windows import Display, Window
from xplane_bridge.eye import grab, grab_linux
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


class ForeignMemory:
    """Xext of a program whose memory the X server does not see, as in a container."""

    def __init__(self, xext: Any) -> None:
        self._xext = xext

    def __getattr__(self, name: str) -> Any:
        return getattr(self._xext, name)

    def XShmAttach(self, display: int, segment: Any) -> int:  # noqa: N802 - Xext's name
        info = segment._obj
        own, info.shmid = info.shmid, 0x7FFFFFF0
        try:
            return self._xext.XShmAttach(display, segment)
        finally:
            info.shmid = own


def problem_of(grabber: LinuxGrabber) -> str:
    """What the grabber says; it must not become less certain at the next try."""
    not_yet = grabber.problem
    grabber.start()
    try:
        wait_until(lambda: grabber.problem not in ("", not_yet), LONGEST_S, "the reason")
        time.sleep(WATCH_S)
    finally:
        grabber.stop()
    return grabber.problem


def shapes_from_now_on(pictures: List[Tuple[Tuple[int, ...], int]]) -> Set[Tuple[int, ...]]:
    """Shapes of the next few pictures; each is with the time when it was read [ns]."""
    now_ns = time.perf_counter_ns()
    wait_until(lambda: sum(read_ns > now_ns for _, read_ns in pictures) > 3, LONGEST_S, "pictures")
    return {shape for shape, read_ns in pictures if read_ns > now_ns}


def segments() -> int:
    """How many pieces of shared memory this process has made that are still there."""
    rows = [line.split() for line in Path("/proc/sysvipc/shm").read_text("ascii").splitlines()]
    creator = rows[0].index("cpid")
    return sum(row[creator] == str(os.getpid()) for row in rows[1:])


def test_an_x_server_that_does_not_see_the_memory_is_said(display: str):
    pictures: List[Tuple[int, ...]] = []
    with window(display) as move:
        move("320x240+100+50")
        grabber = LinuxGrabber(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels.shape))
        grabber._xext = ForeignMemory(grabber._xext)
        said = problem_of(grabber)
        assert "the X server shares no memory with this program (a container? start it with --ipc host" in said
        assert not pictures
        assert segments() == 0, "memory is given back"
        whole = LinuxGrabber(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels.shape))
        whole.start()
        try:
            wait_until(lambda: whole.problem == "" and len(pictures) > 3, LONGEST_S, "pictures")
        finally:
            whole.stop()


def test_a_system_without_shared_memory_is_said(display: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(grab_linux, "_IPC_PRIVATE", 0x7FFF1234)  # a key that nothing has, and it is not made either
    monkeypatch.setattr(grab_linux, "_IPC_CREAT", 0)
    with window(display) as move:
        move("320x240+100+50")
        said = problem_of(LinuxGrabber(("X-Plane",), None, lambda *_: None))
    assert "the system gives no shared memory of 307200 bytes (No such file or directory)" in said


def test_a_window_partly_off_the_screen_is_said_and_not_searched_without_rest(display: str):
    pictures: List[Tuple[int, ...]] = []
    with window(display) as move:
        move("320x240+-100+50")
        grabber = Counted(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels.shape))
        grabber.start()
        try:
            wait_until(lambda: "wholly onto the screen" in grabber.problem, LONGEST_S, "the reason")
            before, began_s = grabber.searches, time.monotonic()
            time.sleep(WATCH_S)
            assert grabber.searches - before <= (time.monotonic() - began_s) / grab_linux._SEARCH_S + 2
            assert "wholly onto the screen" in grabber.problem
            assert not pictures
            move("320x240+100+50")
            wait_until(lambda: grabber.problem == "" and len(pictures) > 3, LONGEST_S, "pictures")
            move("320x240+-100+50")
            wait_until(lambda: "wholly onto the screen" in grabber.problem, LONGEST_S, "the reason again")
        finally:
            grabber.stop()
    assert set(pictures) == {(240, 320, 4)}


def test_a_window_that_grows_is_not_sent_by_its_upper_left_part(display: str):
    pictures: List[Tuple[Tuple[int, ...], int]] = []
    with window(display) as move:
        move("320x240+100+50")
        grabber = LinuxGrabber(("X-Plane",), None, lambda pixels, at_ns, _: pictures.append((pixels.shape, at_ns)))
        grabber.start()
        try:
            wait_until(lambda: len(pictures) > 3, LONGEST_S, "pictures")
            for width, height in ((400, 300), (480, 360), (640, 480)):
                move(f"{width}x{height}+100+50")
                assert shapes_from_now_on(pictures) == {(height, width, 4)}
        finally:
            grabber.stop()


class OtherColours:
    """Xext of a display whose colours have other numbers of bits."""

    def __init__(self, xext: Any, depth: int, masks: Tuple[int, int, int]) -> None:
        self._xext, self._depth, self._masks = xext, depth, masks

    def __getattr__(self, name: str) -> Any:
        return getattr(self._xext, name)

    def XShmCreateImage(self, *arguments: Any) -> Any:  # noqa: N802 - Xext's name
        image = self._xext.XShmCreateImage(*arguments)
        head = grab_linux.windows.Image.from_address(image)
        head.depth, (head.red_mask, head.green_mask, head.blue_mask) = self._depth, self._masks
        return image


@pytest.mark.parametrize(
    ("depth", "masks"), [(30, (0x3FF00000, 0xFFC00, 0x3FF)), (24, (0xFF, 0xFF00, 0xFF0000))], ids=["deep", "RGBX"]
)
def test_a_display_of_other_colours_is_said_and_nothing_sent(display: str, depth: int, masks: Tuple[int, int, int]):
    pictures: List[Tuple[int, ...]] = []
    with window(display) as move:
        move("320x240+100+50")
        grabber = LinuxGrabber(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels.shape))
        grabber._xext = OtherColours(grabber._xext, depth, masks)
        said = problem_of(grabber)
    assert said.startswith(f"the display has {depth}-bit colour in 32 bits a pixel; expected bytes of blue, ")
    assert not pictures


SMALL, LARGE = (640, 480, True), (1280, 900, True)  #: width, height [px], shown


@pytest.mark.parametrize(
    ("windows", "found", "problem"),
    [
        ([("nautilus", LARGE), ("X-Plane-x86_64", SMALL)], 1, ""),
        ([("nautilus", LARGE), ("X-Plane-x86_64", (640, 480, False))], None, grab.MINIMISED),
        ([("", LARGE), ("", SMALL)], 0, ""),  # of another computer
        ([("nautilus", SMALL), ("", LARGE)], 1, ""),
    ],
)
def test_of_windows_alike_that_of_x_planes_own_process_is_taken(
    display: str, monkeypatch: pytest.MonkeyPatch, windows: list, found: Optional[int], problem: str
):
    seen = [Window("X-Plane", *of, program=program, number=k) for k, (program, of) in enumerate(windows)]
    monkeypatch.setattr(grab_linux.windows, "observe", lambda *_: Display(display, tuple(seen)))
    grabber = LinuxGrabber(("X-Plane",), None, lambda *_: None)
    grabber.problem = ""
    assert grabber._find() == (None if found is None else seen[found])
    assert grabber.problem == problem


def test_a_file_manager_of_its_title_does_not_take_the_place_of_x_planes_window(
    display: str, monkeypatch: pytest.MonkeyPatch
):
    flight = Window("X-Plane", *SMALL, program="X-Plane-x86_64", number=1)
    folder = Window("X-Plane", *LARGE, program="nautilus", number=2)
    seen = [flight, folder]
    monkeypatch.setattr(grab_linux.windows, "observe", lambda *_: Display(display, tuple(seen)))
    grabber = LinuxGrabber(("X-Plane",), None, lambda *_: None)
    assert grabber._find() == flight
    seen.remove(flight)  # X-Plane has ended
    assert grabber._find() is None
    assert grabber.problem.startswith("the window that was captured is hidden or closed, and another that was there")
    restarted = Window("X-Plane", *SMALL, program="X-Plane-x86_64", number=3)
    seen.append(restarted)
    assert grabber._find() == restarted
