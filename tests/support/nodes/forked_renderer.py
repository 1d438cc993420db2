"""Renderers that start at once: forked from their emulator, which was forked from a process that knows their modules.

The import of OpenCV and pygame takes more than a second of a processor, as long as many a test draws.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
import traceback
from typing import BinaryIO, Mapping, Sequence

from xplane_bridge.emulator.view.renderer import process

_POLL_S = 0.01


def import_modules() -> None:
    """Takes the time, before the forks."""
    os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
    import pygame  # noqa: F401

    from xplane_bridge.emulator.view.renderer import __main__  # noqa: F401


def exit_code(status: int) -> int:
    """Of what `os.waitpid` gives: negative for a signal."""
    return -os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)


def use() -> None:
    """From now on this process forks its renderers."""
    process.RendererProcess.start_program = staticmethod(_Forked)  # type: ignore[assignment,method-assign]


class _Forked:
    """What `RendererProcess` uses of `subprocess.Popen`."""

    def __init__(self, arguments: Sequence[str], environment: Mapping[str, str]) -> None:
        scenes, to_scenes = os.pipe()
        from_answers, answers = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        self._pid = os.fork()
        if self._pid == 0:
            os.dup2(scenes, 0)
            os.dup2(answers, 1)
            for other in os.listdir("/proc/self/fd"):  # sockets, and the pipes of other renderers
                if int(other) > 2:
                    with contextlib.suppress(OSError):
                        os.close(int(other))
            _run(arguments, environment)
        os.close(scenes)
        os.close(answers)
        self.stdin: BinaryIO = os.fdopen(to_scenes, "wb", buffering=0)
        self.stdout: BinaryIO = os.fdopen(from_answers, "rb", buffering=0)
        self._status: int | None = None

    def poll(self) -> int | None:
        if self._status is None:
            pid, status = os.waitpid(self._pid, os.WNOHANG)
            self._status = exit_code(status) if pid else None
        return self._status

    def wait(self, timeout: float | None = None) -> int:
        end = None if timeout is None else time.monotonic() + timeout
        while self.poll() is None:
            if end is not None and time.monotonic() > end:
                raise subprocess.TimeoutExpired("renderer", timeout or 0.0)
            time.sleep(_POLL_S)
        assert self._status is not None
        return self._status

    def kill(self) -> None:
        if self.poll() is None:
            os.kill(self._pid, signal.SIGKILL)


def _run(arguments: Sequence[str], environment: Mapping[str, str]) -> None:
    """What the forked process does; it never comes back to what its emulator was doing."""
    status = 1
    try:
        from xplane_bridge.emulator.view.renderer import __main__ as program

        os.environ.clear()
        os.environ.update(environment)
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        try:
            status = program.main(arguments)
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
    finally:
        os._exit(status)
