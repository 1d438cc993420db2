"""Emulators that start in some milliseconds: forked from a process that has imported their modules already.

The import takes half a second of a processor, and the node tests start hundreds of emulators.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import itertools
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import Any, BinaryIO

from support.nodes import forked_renderer
from xplane_bridge.harness import EmulatorProcess, HarnessError
from xplane_bridge.harness.processes import Process, end_with_parent

_START_TIMEOUT_S = 60.0
_MESSAGE = 1 << 18  #: [bytes] the longest: an environment


class ForkedEmulator(EmulatorProcess):
    """As an `EmulatorProcess`, but for its command line in /proc, which is that of the process it was forked from."""

    def _spawn(self, log: BinaryIO) -> Process:
        return fork_server().start(self.command[2:], log.name)  # without interpreter and script


@functools.lru_cache(maxsize=None)
def fork_server() -> ForkServer:
    """The one of this process; it ends with it."""
    return ForkServer()


class ForkServer:
    """Starts emulators as children of one other process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._numbers = itertools.count()  # of what is started; the system uses those of processes again
        self._pids: dict[int, int] = {}
        self._statuses: dict[int, int] = {}
        self._link, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with other:
            self._process = subprocess.Popen(
                [sys.executable, __file__, str(other.fileno())],
                pass_fds=[other.fileno()],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        atexit.register(self._close)

    def start(self, arguments: list[str], log: str) -> Process:
        """Starts an emulator with these arguments, in this process's folder and environment; its output goes to `log`.

        Raises:
            HarnessError: It does not start.
        """
        number = next(self._numbers)
        order = {
            "number": number, "arguments": arguments, "log": log, "cwd": os.getcwd(), "env": dict(os.environ)
        }  # fmt: skip
        with self._lock:
            self._link.send(json.dumps(order).encode())
            deadline = time.monotonic() + _START_TIMEOUT_S
            while number not in self._pids:
                self._hear(deadline - time.monotonic())
                if time.monotonic() > deadline:
                    msg = f"no emulator was forked within {_START_TIMEOUT_S:g} s"
                    raise HarnessError(msg)
            return _Child(self, number, self._pids[number])

    def status(self, number: int, timeout: float) -> int | None:
        """The exit status of one of them, negative for a signal, once it has ended; waits for that so long [s]."""
        deadline = time.monotonic() + timeout
        while True:
            with self._lock:  # not for long: others may want to know of theirs
                left_s = deadline - time.monotonic()
                self._hear(min(left_s, 0.02))
                if number in self._statuses or left_s <= 0.0:
                    return self._statuses.get(number)

    def _close(self) -> None:
        self._link.close()
        self._process.wait()

    def _hear(self, timeout: float) -> None:
        """Takes all that it has said, or what it says within `timeout` [s]."""
        while select.select([self._link], [], [], max(0.0, timeout))[0]:
            timeout = 0.0
            word = self._link.recv(_MESSAGE)
            if not word:
                msg = "the process that forks emulators has ended"
                raise HarnessError(msg)
            content = json.loads(word)
            self._pids.update(content.get("started", {}))
            self._statuses.update(content.get("ended", {}))


class _Child:
    """What `ManagedProcess` uses of `subprocess.Popen`."""

    def __init__(self, server: ForkServer, number: int, pid: int) -> None:
        self._server = server
        self._number = number
        self._status: int | None = None
        self.pid = pid

    def poll(self) -> int | None:
        if self._status is None:
            self._status = self._server.status(self._number, 0.0)
        return self._status

    def wait(self, timeout: float) -> int:
        if self._status is None:
            self._status = self._server.status(self._number, timeout)
        if self._status is None:
            raise subprocess.TimeoutExpired("xplane_emulator", timeout)
        return self._status

    def send_signal(self, sig: int) -> None:
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, sig)


# ------------------------------------------------------------------------------------- the process that forks them


def serve(link: socket.socket) -> dict[str, Any]:
    """Forks a process for each order and says when it started and ended; returns the order in each of them."""
    ended, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    server = os.getpid()
    numbers: dict[int, int] = {}
    while True:
        ready, _, _ = select.select([link, ended], [], [])
        if ended in ready:
            os.read(ended, 4096)
            _report_ended(link, numbers)
        if link not in ready:
            continue
        word = link.recv(_MESSAGE)
        if not word:
            sys.exit(0)
        order: dict[str, Any] = json.loads(word)
        pid = os.fork()
        if pid:
            numbers[pid] = order["number"]
            _say(link, "started", order["number"], pid)
            continue
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for each in (ended, wake, link.detach()):
            os.close(each)
        os.setsid()
        end_with_parent(server)
        return order


def _report_ended(link: socket.socket, numbers: dict[int, int]) -> None:
    with contextlib.suppress(ChildProcessError):
        while True:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if not pid:
                break
            _say(link, "ended", numbers.pop(pid), forked_renderer.exit_code(status))


def _say(link: socket.socket, what: str, number: int, value: int) -> None:
    link.send(json.dumps({what: [(number, value)]}).encode())


def run() -> int:
    """Imports what an emulator needs, then forks; runs an emulator in each fork."""
    from xplane_bridge.cli import xplane_emulator
    from xplane_bridge.emulator.flight import jsbsim_model  # noqa: F401

    forked_renderer.import_modules()
    forked_renderer.use()
    gc.collect()
    gc.freeze()
    order = serve(socket.socket(fileno=int(sys.argv[1])))
    with open(order["log"], "wb", buffering=0) as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    os.environ.clear()
    os.environ.update(order["env"])
    os.chdir(order["cwd"])
    sys.argv = ["xplane_emulator", *order["arguments"]]
    return xplane_emulator.main()


if __name__ == "__main__":
    sys.exit(run())
