"""Pictures of a window of an X display, by Xlib and shared memory.

The window is read again and again, and what differs from the reading before is a new picture; its time is known to the
period of the readings. After a change the window is left alone for half a frame.
"""

from __future__ import annotations

import ctypes
import os
import time
from typing import Any, List, NoReturn, Optional, Tuple

import numpy as np

from xplane_bridge.doctor.observe import windows
from xplane_bridge.eye.grab import MINIMISED, Grabber, GrabError, Rect, Take, Which, is_xplane

_SEARCH_S = 0.5
_POLL_S = 0.002
#: Share of the usual time between two changes for which nothing new is expected.
_REST = 0.5
_LONGEST_REST_S = 0.02
_ROWS = 16
_BGRX = 0xFF0000, 0xFF00, 0xFF  #: where red, green and blue are in a pixel
_Z_PIXMAP, _ALL_PLANES = 2, ctypes.c_ulong(-1)
_IPC_PRIVATE, _IPC_CREAT, _IPC_RMID = 0, 0o1000, 0
_NO_ADDRESS = ctypes.c_void_p(-1).value


class _Segment(ctypes.Structure):
    """XShmSegmentInfo."""

    _fields_ = (
        ("shmseg", ctypes.c_ulong),
        ("shmid", ctypes.c_int),
        ("shmaddr", ctypes.c_void_p),
        ("read_only", ctypes.c_int),
    )


class _SharedImage:
    """A picture that the X server writes into memory which both share; for windows of one size.

    Raises:
        GrabError: The server does not share memory, or its pixels are not blue, green, red and one unused byte.
    """

    def __init__(self, x11: Any, xext: Any, display: int, size: Tuple[int, int]) -> None:
        self._x11, self._xext, self._display = x11, xext, display
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._libc.shmat.restype = ctypes.c_void_p
        self._libc.shmat.argtypes = [ctypes.c_int, ctypes.c_void_p, ctypes.c_int]
        self._libc.shmdt.argtypes = [ctypes.c_void_p]
        self._segment = _Segment()
        screen = x11.XDefaultScreen(display)
        self._image = xext.XShmCreateImage(
            display,
            x11.XDefaultVisual(display, screen),
            x11.XDefaultDepth(display, screen),
            _Z_PIXMAP,
            None,
            ctypes.byref(self._segment),
            *size,
        )
        if not self._image:
            raise GrabError("the X server shares no memory (MIT-SHM): is the display on another computer?")
        head = windows.Image.from_address(self._image)
        masks = head.red_mask, head.green_mask, head.blue_mask
        if head.bits_per_pixel != 32 or head.byte_order != 0 or masks != _BGRX:
            given = f"{head.depth}-bit colour in {head.bits_per_pixel} bits a pixel"
            x11.XDestroyImage(self._image)
            raise GrabError(
                f"the display has {given}; expected bytes of blue, green, red and nothing: set it to 24-bit colour"
            )
        length = head.bytes_per_line * head.height
        self._segment.shmid = self._libc.shmget(_IPC_PRIVATE, ctypes.c_size_t(length), _IPC_CREAT | 0o600)
        if self._segment.shmid < 0:
            self._refuse(length)
        self._segment.shmaddr = self._libc.shmat(self._segment.shmid, None, 0)
        if self._segment.shmaddr == _NO_ADDRESS:
            refused = ctypes.get_errno()
            self._libc.shmctl(self._segment.shmid, _IPC_RMID, None)
            ctypes.set_errno(refused)
            self._refuse(length)
        head.data = self._segment.shmaddr
        attached = self._attach()
        self._libc.shmctl(self._segment.shmid, _IPC_RMID, None)  # goes with the last process that has it
        if not attached:
            self._free()
            raise GrabError(
                "the X server shares no memory with this program (a container? start it with --ipc host; the display "
                "of another computer? start xplane_eye there)"
            )
        memory = (ctypes.c_uint8 * length).from_address(self._segment.shmaddr)
        lines = np.frombuffer(memory, np.uint8).reshape(head.height, head.bytes_per_line)
        #: What was read last; overwritten by the next `read`.
        self.pixels = lines[:, : 4 * size[0]].reshape(size[1], size[0], 4)

    def _attach(self) -> bool:
        """Asks the X server to take the memory as well; False where it does not, which it says only later."""
        errors: List[int] = []

        def note(display: int, _error: int) -> int:
            errors.append(display)
            return 0

        handler = windows.ErrorHandler(note)
        self._x11.XSync(self._display, 0)  # errors of what was asked before are not its own
        self._x11.XSetErrorHandler(handler)
        try:
            asked = self._xext.XShmAttach(self._display, ctypes.byref(self._segment))
            self._x11.XSync(self._display, 0)
        finally:
            self._x11.XSetErrorHandler(windows.IGNORE_ERRORS)
        return bool(asked) and self._display not in errors

    def _refuse(self, length: int) -> NoReturn:
        """Raises what is said where the system gives no shared memory."""
        why = os.strerror(ctypes.get_errno())
        windows.Image.from_address(self._image).data = None
        self._x11.XDestroyImage(self._image)
        raise GrabError(
            f"the system gives no shared memory of {length} bytes ({why}): end programs that hold some (ipcs -m), or "
            "raise kernel.shmmax and kernel.shmall"
        )

    def _free(self) -> None:
        self._libc.shmdt(self._segment.shmaddr)
        windows.Image.from_address(self._image).data = None
        self._x11.XDestroyImage(self._image)

    def read(self, window: int) -> bool:
        """Reads the window; False where it is gone, smaller, or partly off a screen that no compositor draws."""
        return bool(self._xext.XShmGetImage(self._display, window, self._image, 0, 0, _ALL_PLANES))

    def close(self) -> None:
        """Gives the memory back; `pixels` must not be used any more."""
        self._xext.XShmDetach(self._display, ctypes.byref(self._segment))
        self._x11.XSync(self._display, 0)
        self.pixels = np.empty((0, 0, 4), np.uint8)
        self._free()


class LinuxGrabber(Grabber):
    """Reads a window of the display in DISPLAY.

    Raises:
        GrabError: There is no display, or Xlib is not there.
    """

    def __init__(self, titles: Tuple[str, ...], which: Which, take: Take) -> None:
        super().__init__(titles, which, take)
        self._name = os.environ.get("DISPLAY", "")
        try:
            self._x11 = windows.declared(ctypes.CDLL("libX11.so.6"))
            self._xext = _declared(ctypes.CDLL("libXext.so.6"))
        except OSError as error:
            raise GrabError(f"{error}: install libX11 and libXext") from None
        self._display = self._x11.XOpenDisplay(self._name.encode())
        if not self._display:
            raise GrabError(
                f"the display {self._name!r} (DISPLAY) takes no connection: start xplane_eye on X-Plane's own desktop"
            )
        self._x11.XSetErrorHandler(windows.IGNORE_ERRORS)

    def run(self) -> None:
        """Looks for the window and reads it until the end."""
        while not self._stop.is_set():
            found = self._find()
            if found is None:
                self._stop.wait(_SEARCH_S)
                continue
            try:
                image = _SharedImage(self._x11, self._xext, self._display, (found.width, found.height))
            except GrabError as error:
                self.problem = str(error)
                self._stop.wait(_SEARCH_S)
                continue
            if not self._watch(found, image):
                self.problem = "X-Plane's window cannot be read: move it wholly onto the screen, or make it smaller"
                self._stop.wait(_SEARCH_S)
            image.close()

    def _find(self) -> Optional[windows.Window]:
        seen = windows.observe(self._name, lambda _: False)
        alike = [window for window in seen.windows if window.title in self._titles]
        # A file manager in X-Plane's folder may have its title. A window of another computer says no program.
        fitting = [window for window in alike if is_xplane(window.program)] or alike
        shown = [window for window in fitting if window.shown]
        if shown:
            return self._chosen([(self._place(window), window) for window in shown], alike)
        self.problem = (
            MINIMISED
            if fitting
            else seen.error or self._no_window(tuple(dict.fromkeys(window.title for window in seen.windows)))
        )
        return None

    def _number_of(self, window: windows.Window) -> int:
        return window.number

    def _place(self, window: windows.Window) -> Rect:
        x, y, child = ctypes.c_int(), ctypes.c_int(), ctypes.c_ulong()
        root = self._x11.XDefaultRootWindow(self._display)
        results = map(ctypes.byref, (x, y, child))
        self._x11.XTranslateCoordinates(self._display, window.number, root, 0, 0, *results)
        return x.value, y.value, window.width, window.height

    def _watch(self, window: windows.Window, image: _SharedImage) -> bool:
        """Hands over each new picture until the window is gone, or has another size; False where it cannot be read."""
        rows = np.linspace(0, window.height - 1, _ROWS).astype(int)
        before: Optional[np.ndarray] = None
        changed_s, usual_s = time.monotonic(), 0.0
        checked_s = changed_s
        looked_ns = time.perf_counter_ns()  # the look before this one began
        while not self._stop.wait(_POLL_S):
            if time.monotonic() - checked_s > _SEARCH_S:
                checked_s = time.monotonic()
                if self._resized(window):
                    return True
            begun_ns, looked_ns = looked_ns, time.perf_counter_ns()
            if not image.read(window.number):
                return before is not None
            self.problem = ""
            change_ns = time.perf_counter_ns()
            sample = image.pixels[rows]
            if before is not None and np.array_equal(sample, before):
                continue
            if self._resized(window):  # of one that has grown, the upper left part is read
                return True
            if before is not None:  # the first was there before it was looked at
                self._take(image.pixels.copy(), change_ns, change_ns - begun_ns)
            before = sample
            now_s = time.monotonic()
            usual_s += 0.1 * (min(now_s - changed_s, 2 * _LONGEST_REST_S) - usual_s)
            changed_s = now_s
            self._stop.wait(max(0.0, _REST * usual_s - _POLL_S))
        return True

    def _resized(self, window: windows.Window) -> bool:
        """Whether a window is gone, or has another size than where it was found."""
        attributes = windows.Attributes()
        if not self._x11.XGetWindowAttributes(self._display, window.number, ctypes.byref(attributes)):
            return True
        return (attributes.width, attributes.height) != (window.width, window.height)


def _declared(xext: Any) -> Any:
    """Xext with the types of what is called: pointers are not ints of 32 bits."""
    pointer, number, integer, natural = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_int, ctypes.c_uint
    signatures = {
        "XShmCreateImage": (pointer, [pointer, pointer, natural, integer, pointer, pointer, natural, natural]),
        "XShmAttach": (integer, [pointer, pointer]),
        "XShmDetach": (integer, [pointer, pointer]),
        "XShmGetImage": (integer, [pointer, number, pointer, integer, integer, number]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(xext, name)
        function.restype, function.argtypes = result, arguments
    return xext
