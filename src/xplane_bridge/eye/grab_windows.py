"""Pictures of X-Plane's window on Windows, by windows-capture (Windows.Graphics.Capture).

Written against windows-capture 2.0.1 and Microsoft's documentation; not yet run on Windows by us. The compositor
delivers a picture when the window has changed, with the time at which it was composed, on the clock of
QueryPerformanceCounter: that of time.perf_counter_ns.
"""

from __future__ import annotations

import ctypes
import importlib
import time
from typing import Any, List, Optional, Tuple

import numpy as np

from xplane_bridge.eye.grab import MINIMISED, Grabber, GrabError, Rect, Take, Which, is_xplane

_SEARCH_S = 0.5
_CHECK_S = 0.25
_ROWS = 16
_EXTENDED_FRAME_BOUNDS = 9  # DWMWA_EXTENDED_FRAME_BOUNDS
_PER_MONITOR_AWARE_V2 = -4  # DPI_AWARENESS_CONTEXT_PER_MONITOR_AWARE_V2
_QUERY_LIMITED_INFORMATION = 0x1000  # PROCESS_QUERY_LIMITED_INFORMATION
_LONGEST_PATH = 32768
#: A composition time farther from the arrival than this is not taken [ns].
_PLAUSIBLE_NS = 1_000_000_000


class _Rect(ctypes.Structure):
    _fields_ = (
        ("left", ctypes.c_long),
        ("top", ctypes.c_long),
        ("right", ctypes.c_long),
        ("bottom", ctypes.c_long),
    )


class _Point(ctypes.Structure):
    _fields_ = (("x", ctypes.c_long), ("y", ctypes.c_long))


def client_area(
    bounds: Tuple[int, int, int, int], origin: Tuple[int, int], size: Tuple[int, int], picture: Tuple[int, int]
) -> Optional[Tuple[int, int, int, int]]:
    """The part of a window's picture without title bar and frame: left, top, right, bottom [px].

    Args:
        bounds: Of the window as it is composed: left, top, right, bottom on the screen [px].
        origin: Of the client area on the screen [px].
        size: Of the client area [px].
        picture: Width and height of the picture [px].

    Returns:
        None while the window is being resized: picture and window do not fit together.
    """
    left, top = origin[0] - bounds[0], origin[1] - bounds[1]
    right, bottom = left + size[0], top + size[1]
    fits = 0 <= left < right <= picture[0] and 0 <= top < bottom <= picture[1]
    return (left, top, right, bottom) if fits else None


class _Desktop:
    """Windows' own functions that are needed."""

    def __init__(self) -> None:
        self._user, self._kernel, self._dwm = (
            getattr(ctypes, "windll").LoadLibrary(name)  # noqa: B009 -- there is none on other systems
            for name in ("user32", "kernel32", "dwmapi")
        )
        # A handle is a pointer: without this, ctypes would cut it to an int of 32 bits.
        self._handle = ctypes.c_void_p
        self._kernel.OpenProcess.restype = self._handle
        # Sizes in real pixels, whatever the desktop is scaled to.
        self._user.SetProcessDpiAwarenessContext(self._handle(_PER_MONITOR_AWARE_V2))

    def windows(self) -> List[Tuple[int, str]]:
        """Number and title of each visible window."""
        found: List[Tuple[int, str]] = []
        callback_type = getattr(ctypes, "WINFUNCTYPE")(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)  # noqa: B009

        def look(window: Optional[int], _: Any) -> int:
            text = ctypes.create_unicode_buffer(512)
            if self._user.IsWindowVisible(self._handle(window)):
                self._user.GetWindowTextW(self._handle(window), text, len(text))
                if text.value:
                    found.append((window or 0, text.value))
            return 1

        self._user.EnumWindows(callback_type(look), None)
        return found

    def program_of(self, window: int) -> str:
        """The path of the program that a window belongs to; empty where Windows does not say."""
        number = ctypes.c_ulong()
        self._user.GetWindowThreadProcessId(self._handle(window), ctypes.byref(number))
        process = self._kernel.OpenProcess(_QUERY_LIMITED_INFORMATION, 0, number.value)
        if not process:
            return ""
        path = ctypes.create_unicode_buffer(_LONGEST_PATH)
        length = ctypes.c_ulong(len(path))
        self._kernel.QueryFullProcessImageNameW(self._handle(process), 0, path, ctypes.byref(length))
        self._kernel.CloseHandle(self._handle(process))
        return path.value

    def place(self, window: int) -> Rect:
        """Where it is on the screen."""
        outer = _Rect()
        self._user.GetWindowRect(self._handle(window), ctypes.byref(outer))
        return outer.left, outer.top, outer.right - outer.left, outer.bottom - outer.top

    def minimised(self, window: int) -> bool:
        """Whether it is."""
        return bool(self._user.IsIconic(self._handle(window)))

    def client_area(self, window: int, picture: Tuple[int, int]) -> Optional[Tuple[int, int, int, int]]:
        """See the function of this name."""
        bounds, inner, origin = _Rect(), _Rect(), _Point()
        failed = self._dwm.DwmGetWindowAttribute(
            self._handle(window), _EXTENDED_FRAME_BOUNDS, ctypes.byref(bounds), ctypes.sizeof(bounds)
        )
        asked = self._user.GetClientRect(self._handle(window), ctypes.byref(inner))
        if failed or not asked or not self._user.ClientToScreen(self._handle(window), ctypes.byref(origin)):
            return None
        outer = (bounds.left, bounds.top, bounds.right, bounds.bottom)
        return client_area(outer, (origin.x, origin.y), (inner.right, inner.bottom), picture)


class WindowsGrabber(Grabber):
    """Reads the window of X-Plane's own process.

    Raises:
        GrabError: windows-capture is not installed.
    """

    def __init__(self, titles: Tuple[str, ...], which: Which, take: Take) -> None:
        super().__init__(titles, which, take)
        try:
            self._library = importlib.import_module("windows_capture")
        except ImportError as error:
            raise GrabError(f"{error}: run pip install 'xplane_bridge[eye]', or pip install windows-capture") from None
        self._desktop = _Desktop()

    def run(self) -> None:
        """Looks for the window and has it captured until the end."""
        while not self._stop.is_set():
            try:
                window = self._find()
                if window is not None:
                    self._capture(window)
                    continue
            except Exception as error:  # the library's own, some of them plain Exceptions
                self.problem = f"Windows gives no pictures of X-Plane's window: {error}"
            self._stop.wait(_SEARCH_S)

    def _find(self) -> Optional[int]:
        windows = self._desktop.windows()
        fitting = [window for window, title in windows if title in self._titles]
        own = [window for window in fitting if is_xplane(self._desktop.program_of(window))]
        # Windows has minimised ones far left of every screen: they would come first by number.
        shown = [window for window in own if not self._desktop.minimised(window)]
        if shown:
            return self._chosen([(self._desktop.place(window), window) for window in shown], own)
        if own:
            self.problem = MINIMISED
        elif fitting:
            self.problem = "a window has X-Plane's title but belongs to another program"
        else:
            self.problem = self._no_window(tuple(title for _, title in windows))
        return None

    def _capture(self, window: int) -> None:
        """Has the library call `arrived` until the window is closed; raises where the capture fails."""
        before: List[Any] = [None]
        closed: List[bool] = []

        def on_frame_arrived(frame: Any, _control: Any) -> None:
            now_ns = time.perf_counter_ns()
            area = self._desktop.client_area(window, (frame.width, frame.height))
            if area is None:
                return
            # The library's memory is its own again when this returns: one copy here, and nothing slow.
            pixels = np.ascontiguousarray(frame.frame_buffer[area[1] : area[3], area[0] : area[2]])
            sample = pixels[np.linspace(0, len(pixels) - 1, _ROWS).astype(int)]
            if before[0] is not None and np.array_equal(sample, before[0]):
                return  # another window was drawn
            first, before[0] = before[0] is None, sample
            if not first:
                composed_ns = 100 * int(frame.timespan)
                self._take(pixels, composed_ns if 0 <= now_ns - composed_ns < _PLAUSIBLE_NS else now_ns, 0)

        def on_closed() -> None:
            closed.append(True)

        control = self._started(window, on_frame_arrived, on_closed)
        try:
            while not closed and not self._stop.wait(_CHECK_S) and not control.is_finished():
                self.problem = MINIMISED if self._desktop.minimised(window) else ""
        finally:
            control.stop()
        if not closed and not self._stop.is_set():
            raise GrabError("the capture has ended")

    def _started(self, window: int, *handlers: Any) -> Any:
        """A capture that runs; without the yellow border where Windows can leave it out: version 10 cannot."""

        def begin(border: Optional[bool]) -> Any:
            capture = self._library.WindowsCapture(cursor_capture=False, draw_border=border, window_hwnd=window)
            for handler in handlers:
                capture.event(handler)
            return capture.start_free_threaded()

        try:
            return begin(False)
        except Exception:
            return begin(None)
