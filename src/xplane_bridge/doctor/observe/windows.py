"""Lists the windows of the X display, by Xlib itself: no package, no program is needed for it."""

from __future__ import annotations

import contextlib
import ctypes
import time
from dataclasses import dataclass
from typing import Any, Callable, Iterator, List, Optional, Tuple

from xplane_bridge.doctor.observe.ports import program_name

_LIBRARY = "libX11.so.6"
_VIEWABLE = 2  # IsViewable
_Z_PIXMAP = 2
_ALL_PLANES = ctypes.c_ulong(-1)
_ANY_TYPE = 0
#: A window manager puts a program's window at most a few frames deep.
_DEEPEST = 6
_GRABS = 5


@dataclass(frozen=True)
class Window:
    """A window with a title.

    Attributes:
        title: Its title.
        width: [px]
        height: [px]
        shown: Whether it is mapped, not minimised.
        program: Name of the program it belongs to; empty where it does not say.
        grab_s: Shortest time in which its picture could be read through the display's socket [s]; None where that was
            not tried or failed.
        number: X's own of it.
    """

    title: str
    width: int
    height: int
    shown: bool
    program: str = ""
    grab_s: Optional[float] = None
    number: int = 0


@dataclass(frozen=True)
class Display:
    """The X display.

    Attributes:
        name: DISPLAY; empty where it is not set.
        windows: Those with a title.
        error: Why it cannot be looked at; empty when it can.
    """

    name: str = ""
    windows: Tuple[Window, ...] = ()
    error: str = ""


class Image(ctypes.Structure):
    """The beginning of XImage."""

    _fields_ = (
        ("width", ctypes.c_int),
        ("height", ctypes.c_int),
        ("xoffset", ctypes.c_int),
        ("format", ctypes.c_int),
        ("data", ctypes.c_void_p),
        ("byte_order", ctypes.c_int),
        ("bitmap_unit", ctypes.c_int),
        ("bitmap_bit_order", ctypes.c_int),
        ("bitmap_pad", ctypes.c_int),
        ("depth", ctypes.c_int),
        ("bytes_per_line", ctypes.c_int),
        ("bits_per_pixel", ctypes.c_int),
        ("red_mask", ctypes.c_ulong),
        ("green_mask", ctypes.c_ulong),
        ("blue_mask", ctypes.c_ulong),
    )


class Attributes(ctypes.Structure):
    """XWindowAttributes."""

    _fields_ = (
        ("x", ctypes.c_int),
        ("y", ctypes.c_int),
        ("width", ctypes.c_int),
        ("height", ctypes.c_int),
        ("border_width", ctypes.c_int),
        ("depth", ctypes.c_int),
        ("visual", ctypes.c_void_p),
        ("root", ctypes.c_ulong),
        ("class_", ctypes.c_int),
        ("bit_gravity", ctypes.c_int),
        ("win_gravity", ctypes.c_int),
        ("backing_store", ctypes.c_int),
        ("backing_planes", ctypes.c_ulong),
        ("backing_pixel", ctypes.c_ulong),
        ("save_under", ctypes.c_int),
        ("colormap", ctypes.c_ulong),
        ("map_installed", ctypes.c_int),
        ("map_state", ctypes.c_int),
        ("all_event_masks", ctypes.c_long),
        ("your_event_mask", ctypes.c_long),
        ("do_not_propagate_mask", ctypes.c_long),
        ("override_redirect", ctypes.c_int),
        ("screen", ctypes.c_void_p),
    )


#: Xlib ends the process on an error unless a handler is set; windows may go while they are looked at.
ErrorHandler = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
IGNORE_ERRORS = ErrorHandler(lambda _display, _error: 0)


def observe(name: str, is_wanted: Callable[[str], bool]) -> Display:
    """Lists the windows of a display, and reads the picture of those that are wanted.

    Args:
        name: As in DISPLAY, e.g. `:0`.
        is_wanted: Whether a window of this title is looked for.
    """
    if not name:
        return Display()
    try:
        x11 = declared(ctypes.CDLL(_LIBRARY))
    except OSError:
        return Display(name, error=f"there is no {_LIBRARY} on this computer")
    x11.XSetErrorHandler(IGNORE_ERRORS)
    connection = x11.XOpenDisplay(name.encode())
    if not connection:
        return Display(name, error="it takes no connection (is it there, and is this user allowed?)")
    try:
        found: List[Window] = []
        walker = _Walker(x11, connection, is_wanted)
        for screen in range(x11.XScreenCount(connection)):
            walker.collect(x11.XRootWindow(connection, screen), 0, found)
        return Display(name, tuple(found))
    finally:
        x11.XCloseDisplay(connection)


@contextlib.contextmanager
def reader(name: str) -> Iterator[Callable[[Window], Optional[bytes]]]:
    """Gives a function that reads a window's picture, or None where that fails; for a display that `observe` saw."""
    x11 = declared(ctypes.CDLL(_LIBRARY))
    x11.XSetErrorHandler(IGNORE_ERRORS)
    connection = x11.XOpenDisplay(name.encode())

    def read(window: Window) -> Optional[bytes]:
        arguments = (0, 0, window.width, window.height, _ALL_PLANES, _Z_PIXMAP)
        image = x11.XGetImage(connection, window.number, *arguments) if connection else None
        if not image:
            return None
        head = Image.from_address(image)
        picture = ctypes.string_at(head.data, head.bytes_per_line * head.height)
        x11.XDestroyImage(image)
        return picture

    try:
        yield read
    finally:
        if connection:
            x11.XCloseDisplay(connection)


class _Walker:
    """Goes through a display's tree of windows."""

    def __init__(self, x11: Any, connection: int, is_wanted: Callable[[str], bool]) -> None:
        self._x11 = x11
        self._connection = connection
        self._is_wanted = is_wanted
        self._net_name = x11.XInternAtom(connection, b"_NET_WM_NAME", 0)
        self._net_pid = x11.XInternAtom(connection, b"_NET_WM_PID", 0)

    def collect(self, window: int, depth: int, found: List[Window]) -> None:
        """Adds the windows with a title below a window."""
        root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
        children = ctypes.POINTER(ctypes.c_ulong)()
        arguments = map(ctypes.byref, (root, parent, children, count))
        if depth > _DEEPEST or not self._x11.XQueryTree(self._connection, window, *arguments):
            return
        below = [children[index] for index in range(count.value)]
        if below:
            self._x11.XFree(children)
        for child in below:
            described = self._describe(child)
            if described is not None:
                found.append(described)
            self.collect(child, depth + 1, found)

    def _describe(self, window: int) -> Optional[Window]:
        title = self._title(window)
        attributes = Attributes()
        if not title or not self._x11.XGetWindowAttributes(self._connection, window, ctypes.byref(attributes)):
            return None
        size = (attributes.width, attributes.height)
        shown = attributes.map_state == _VIEWABLE
        grab_s = self._grab(window, *size) if shown and self._is_wanted(title) else None
        return Window(title, *size, shown, self._program(window), grab_s, window)

    def _title(self, window: int) -> str:
        modern = self._property(window, self._net_name)
        if modern:
            return modern.decode("utf-8", "replace")
        text = ctypes.c_void_p()
        if not self._x11.XFetchName(self._connection, window, ctypes.byref(text)) or not text.value:
            return ""
        title = ctypes.string_at(text.value).decode("latin-1")
        self._x11.XFree(text)
        return title

    def _program(self, window: int) -> str:
        raw = self._property(window, self._net_pid)
        # 32-bit properties come as C longs, whatever their size here.
        return (
            program_name(ctypes.c_ulong.from_buffer_copy(raw).value)
            if len(raw) == ctypes.sizeof(ctypes.c_ulong)
            else ""
        )

    def _property(self, window: int, atom: int) -> bytes:
        type_, format_, count, left = ctypes.c_ulong(), ctypes.c_int(), ctypes.c_ulong(), ctypes.c_ulong()
        value = ctypes.c_void_p()
        results = map(ctypes.byref, (type_, format_, count, left, value))
        failed = self._x11.XGetWindowProperty(self._connection, window, atom, 0, 256, 0, _ANY_TYPE, *results)
        if failed or not value.value:
            return b""
        size = {8: 1, 16: ctypes.sizeof(ctypes.c_short), 32: ctypes.sizeof(ctypes.c_long)}.get(format_.value, 0)
        raw = ctypes.string_at(value.value, count.value * size)
        self._x11.XFree(value)
        return raw

    def _grab(self, window: int, width: int, height: int) -> Optional[float]:
        """The shortest of some readings of a window's picture [s]."""
        times = []
        for _ in range(_GRABS):
            begin = time.perf_counter()
            image = self._x11.XGetImage(self._connection, window, 0, 0, width, height, _ALL_PLANES, _Z_PIXMAP)
            if not image:
                return None
            times.append(time.perf_counter() - begin)
            self._x11.XDestroyImage(image)
        return min(times)


def declared(x11: Any) -> Any:
    """Xlib with the types of what is called: pointers are not ints of 32 bits."""
    pointer, window, integer = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_int
    signatures = {
        "XOpenDisplay": (pointer, [ctypes.c_char_p]),
        "XCloseDisplay": (integer, [pointer]),
        "XSetErrorHandler": (pointer, [ErrorHandler]),
        "XScreenCount": (integer, [pointer]),
        "XRootWindow": (window, [pointer, integer]),
        "XInternAtom": (ctypes.c_ulong, [pointer, ctypes.c_char_p, integer]),
        "XQueryTree": (integer, [pointer, window, *[pointer] * 4]),
        "XGetWindowAttributes": (integer, [pointer, window, pointer]),
        "XFetchName": (integer, [pointer, window, pointer]),
        "XGetWindowProperty": (
            integer,
            [pointer, window, ctypes.c_ulong, ctypes.c_long, ctypes.c_long, integer, ctypes.c_ulong, *[pointer] * 5],
        ),
        "XGetImage": (pointer, [pointer, window, integer, integer, ctypes.c_uint, ctypes.c_uint, window, integer]),
        "XDestroyImage": (integer, [pointer]),
        "XFree": (integer, [pointer]),
        "XDefaultScreen": (integer, [pointer]),
        "XDefaultVisual": (pointer, [pointer, integer]),
        "XDefaultDepth": (integer, [pointer, integer]),
        "XDefaultRootWindow": (window, [pointer]),
        "XTranslateCoordinates": (integer, [pointer, window, window, integer, integer, *[pointer] * 3]),
        "XSync": (integer, [pointer, integer]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(x11, name)
        function.restype, function.argtypes = result, arguments
    return x11
