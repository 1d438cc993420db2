"""Joysticks that only SDL sees: its virtual devices, through the very library that pygame has loaded."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

UP, RIGHT, DOWN, LEFT = 1, 2, 4, 8  # SDL's hat
_FLIGHT_STICK = 4


def library() -> Any:
    """SDL as this process uses it."""
    paths = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines() if "libSDL2-2" in line}
    assert len(paths) == 1, f"pygame has to be imported first, and once: {paths}"
    sdl = ctypes.CDLL(paths.pop())
    sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
    return sdl


class SdlDevice:
    """One joystick, plugged in. All have the same name, "Virtual Flight Stick".

    Args:
        axes: how many.
        buttons: how many.
        hats: how many.
    """

    NAME = "Virtual Flight Stick"

    def __init__(self, axes: int = 4, buttons: int = 3, hats: int = 1) -> None:
        self._sdl = library()
        self._index = self._sdl.SDL_JoystickAttachVirtual(_FLIGHT_STICK, axes, buttons, hats)
        assert self._index >= 0
        self._handle = ctypes.c_void_p(self._sdl.SDL_JoystickOpen(self._index))

    def axis(self, index: int, value: int) -> None:
        """Moves an axis: -32768..32767, right and down +."""
        assert self._sdl.SDL_JoystickSetVirtualAxis(self._handle, index, ctypes.c_int16(value)) == 0

    def button(self, index: int, pressed: int) -> None:
        """Presses or releases."""
        assert self._sdl.SDL_JoystickSetVirtualButton(self._handle, index, ctypes.c_uint8(pressed)) == 0

    def hat(self, index: int, directions: int) -> None:
        """UP | RIGHT, ...; 0: centred."""
        assert self._sdl.SDL_JoystickSetVirtualHat(self._handle, index, ctypes.c_uint8(directions)) == 0

    def pull_out(self) -> None:
        """Unplugs it."""
        assert self._sdl.SDL_JoystickDetachVirtual(self._index) == 0
