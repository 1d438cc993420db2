"""The eye's way of reading a window on Windows, with stand-ins for Windows and its library."""

from __future__ import annotations

import sys
import threading
import types
from typing import Any, Callable, List

import numpy as np
import pytest

from support.kept_problems import KeptProblems
from xplane_bridge.eye import grab, grab_windows
from xplane_bridge.eye.grab_windows import WindowsGrabber
from xplane_bridge.harness import wait_until

LONGEST_S = 20.0
PIXELS = 48, 64


class Desktop:
    """One window, of X-Plane."""

    def windows(self) -> list:
        return [(7, "X-Plane")]

    def program_of(self, _: int) -> str:
        return "C:\\X-Plane 12\\X-Plane.exe"

    def place(self, _: int) -> tuple:
        return 0, 0, PIXELS[1], PIXELS[0]

    def minimised(self, _: int) -> bool:
        return False

    def client_area(self, _: int, picture: tuple) -> tuple:
        return (0, 0, *picture)


class Capture:
    """windows_capture.WindowsCapture, and the control that it gives; as it is to go wrong: `fault`."""

    started: List[Any]
    fault: Callable[[str, Capture], None]

    def __init__(self, cursor_capture: bool, draw_border: Any, window_hwnd: int) -> None:
        assert (cursor_capture, window_hwnd) == (False, 7)
        self.border = draw_border
        self._handlers: dict = {}
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._deliver, daemon=True)

    def event(self, handler: Any) -> None:
        self._handlers[handler.__name__] = handler

    def start_free_threaded(self) -> Capture:
        assert self._handlers.keys() == {"on_frame_arrived", "on_closed"}
        self.started.append(self.border)
        type(self).fault("start", self)
        self._thread.start()
        return self

    def _deliver(self) -> None:
        shade = 0
        while not self._end.wait(0.02):
            shade = (shade + 1) % 256
            pixels = np.full((*PIXELS, 4), shade, np.uint8)
            frame = types.SimpleNamespace(width=PIXELS[1], height=PIXELS[0], frame_buffer=pixels, timespan=0)
            self._handlers["on_frame_arrived"](frame, None)

    def is_finished(self) -> bool:
        type(self).fault("check", self)
        return not self._thread.is_alive()

    def end(self) -> None:
        self._end.set()

    def close(self) -> None:
        self.end()
        self._handlers["on_closed"]()

    def stop(self) -> None:
        self.end()
        self._thread.join()
        type(self).fault("stop", self)


class Said(KeptProblems, WindowsGrabber):
    pass


def no_border_setting(stage: str, capture: Capture) -> None:
    """As Windows 10."""
    if stage == "start" and capture.border is False:
        raise RuntimeError("Toggling the capture border is not supported by the Graphics Capture API on this platform.")


def gone_once(stage: str, _: Capture) -> None:
    """The window was closed after it was found."""
    if stage == "start" and len(Capture.started) <= 2:
        raise RuntimeError("the window is gone")


def ends_once(stage: str, capture: Capture) -> None:
    """The library's thread ends by itself."""
    if stage == "check" and len(Capture.started) == 1:
        capture.stop()


def fails_once(stage: str, capture: Capture) -> None:
    """It ends by an error, which is raised when it is stopped."""
    if len(Capture.started) == 1:
        if stage == "check":
            capture.end()
        elif stage == "stop":
            raise RuntimeError("the device was removed")


def closes_once(stage: str, capture: Capture) -> None:
    """The window is closed, and another opened."""
    if stage == "check" and len(Capture.started) == 1:
        capture.close()


@pytest.mark.parametrize(
    ("fault", "started", "reason"),
    [
        (no_border_setting, [False, None], ""),
        (gone_once, [False, None, False], "the window is gone"),
        (ends_once, [False, False], "the capture has ended"),
        (fails_once, [False, False], "the device was removed"),
        (closes_once, [False, False], ""),
    ],
)
def test_a_capture_that_fails_is_said_and_begun_again(
    monkeypatch: pytest.MonkeyPatch, fault: Callable[[str, Capture], None], started: list, reason: str
):
    monkeypatch.setitem(sys.modules, "windows_capture", types.SimpleNamespace(WindowsCapture=Capture))
    monkeypatch.setattr(grab_windows, "_Desktop", Desktop)
    monkeypatch.setattr(grab_windows, "_SEARCH_S", 0.05)
    monkeypatch.setattr(grab_windows, "_CHECK_S", 0.05)
    monkeypatch.setattr(Capture, "started", [], raising=False)
    monkeypatch.setattr(Capture, "fault", staticmethod(fault), raising=False)
    by: List[int] = []  # which of the captures each picture is of
    grabber = Said(("X-Plane",), None, lambda *_: by.append(len(Capture.started)))
    grabber.start()
    try:
        wait_until(lambda: len(started) in by and grabber.problem == "", LONGEST_S, "pictures")
    finally:
        grabber.stop()
    assert Capture.started == started
    reasons = list(dict.fromkeys(filter(None, grabber.problems[1:])))
    assert reasons == ([f"Windows gives no pictures of X-Plane's window: {reason}"] if reason else [])


MINIMISED_PLACE = -32000, -32000, 160, 28  #: where GetWindowRect says that it is


class Two(Desktop):
    """Windows of X-Plane side by side, some of them minimised."""

    def __init__(self) -> None:
        self.shown, self.hidden = [7, 8], []

    def windows(self) -> list:
        return [(window, "X-Plane") for window in sorted(self.shown + self.hidden)]

    def minimised(self, window: int) -> bool:
        return window in self.hidden

    def place(self, window: int) -> tuple:
        return MINIMISED_PLACE if window in self.hidden else (1920 * (window - 7), 0, 1920, 1080)


def choosing(monkeypatch: pytest.MonkeyPatch, desktop: Two, which: Any) -> WindowsGrabber:
    monkeypatch.setitem(sys.modules, "windows_capture", types.SimpleNamespace())
    monkeypatch.setattr(grab_windows, "_Desktop", lambda: desktop)
    grabber = WindowsGrabber(("X-Plane",), which, lambda *_: None)
    grabber.problem = ""
    return grabber


@pytest.mark.parametrize(
    ("minimised", "which", "found", "problem"),
    [
        ((), 0, 7, ""),
        ((), 1, 8, ""),
        ((8,), 0, 7, ""),
        ((8,), 1, None, "there is no window number 1: 1 are alike, counted from 0"),
        ((7,), None, 8, ""),
        ((7, 8), 0, None, grab.MINIMISED),
    ],
)
def test_a_minimised_window_is_not_the_leftmost(
    monkeypatch: pytest.MonkeyPatch, minimised: tuple, which: Any, found: Any, problem: str
):
    desktop = Two()
    desktop.shown, desktop.hidden = [n for n in (7, 8) if n not in minimised], list(minimised)
    grabber = choosing(monkeypatch, desktop, which)
    assert grabber._find() == found
    assert grabber.problem == problem


@pytest.mark.parametrize("which", [0, None])
def test_a_window_that_was_minimised_beside_the_taken_one_does_not_take_its_place(
    monkeypatch: pytest.MonkeyPatch, which: Any
):
    desktop = Two()
    desktop.shown, desktop.hidden = [7], [8]
    grabber = choosing(monkeypatch, desktop, which)
    assert grabber._find() == 7
    desktop.shown, desktop.hidden = [8], []  # one closed, the other restored
    assert grabber._find() is None
    assert grabber.problem.startswith("the window that was captured is hidden or closed, and another that was there")
    desktop.shown = [8, 9]
    desktop.place = lambda window: (0, 0, 1920, 1080) if window == 9 else (1920, 0, 800, 600)  # type: ignore
    assert grabber._find() == 9, "opened anew"
