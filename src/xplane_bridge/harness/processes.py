"""Child processes with logs, deadlines and an orderly end."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import FrameType
from typing import BinaryIO, Callable, Iterator, Mapping, Optional, Protocol, Sequence, TypeVar

from xplane_bridge.errors import XplaneBridgeError

_POLL_S = 0.02
_KILLED_S = 60.0  # until a killed process is gone: one that waits for a disk goes when that answers
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True)

T = TypeVar("T")


class HarnessError(XplaneBridgeError):
    """Something that was started did not do its part; the text says what, and shows the end of its log."""


def wait_until(condition: Callable[[], T], timeout: float, what: str) -> T:
    """Calls `condition` until it gives something true, and returns that.

    Args:
        condition: called about every 20 ms; what it raises is passed on.
        timeout: [s]
        what: what is waited for, for the error: "no <what> within ...".

    Raises:
        HarnessError: `timeout` has passed.
    """
    deadline = time.monotonic() + timeout
    while True:
        result = condition()
        if result:
            return result
        if time.monotonic() > deadline:
            msg = f"no {what} within {timeout:g} s"
            raise HarnessError(msg)
        time.sleep(_POLL_S)


@contextlib.contextmanager
def interrupted_by_signals(name: str) -> Iterator[None]:
    """Within it, Ctrl-C, SIGTERM and SIGHUP raise KeyboardInterrupt, once: later ones do not cut the orderly end short.

    Args:
        name: the program's, for the line that says it ends.
    """

    def interrupt(_number: int, _frame: Optional[FrameType]) -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)
        print(f"\n{name}: ending", file=sys.stderr)
        raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, interrupt) for number in numbers]
    yield
    for number, handler in zip(numbers, before):
        signal.signal(number, handler)


class Process(Protocol):
    """What a `ManagedProcess` needs of the process it has started; `subprocess.Popen` has it."""

    @property
    def pid(self) -> int:
        """Its process id."""

    def poll(self) -> Optional[int]:
        """Its exit status, negative for a signal; None while it runs."""

    def wait(self, timeout: float) -> int:
        """Waits for its exit status, at most so long [s], or raises `subprocess.TimeoutExpired`."""

    def send_signal(self, sig: int) -> None:
        """Sends it a signal, unless it has ended."""


def end_with_parent(parent: int) -> None:
    """Asks the system for SIGINT when the parent of this process, which has this process id, dies."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # shells ignore it for what they run in the background
    if os.getppid() != parent:
        os._exit(1)


class ManagedProcess:
    """A child process in a session of its own (the terminal's Ctrl-C does not reach it), its output in a log file.

    It is started by `start` or by ``with``, and gets SIGINT when this process dies without having stopped it.

    Args:
        name: for messages and for the log's name.
        command: program and arguments.
        log_dir: folder of the log file, `<name>.log`; made if need be.
        env: its environment; this process's own when omitted.
        cwd: its working folder; this process's own when omitted.
    """

    #: Signals that `stop` sends one after the other, and how long it waits after each [s].
    STOP_SIGNALS = ((signal.SIGINT, 15.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0))

    def __init__(
        self,
        name: str,
        command: Sequence[str | Path],
        log_dir: Path,
        env: Optional[Mapping[str, str]] = None,
        cwd: Optional[Path] = None,
    ) -> None:
        self.name = name
        self.command = [str(part) for part in command]
        self.log = Path(log_dir) / f"{name}.log"
        self._env = dict(env) if env is not None else None
        self._cwd = cwd
        self._process: Optional[Process] = None

    def __enter__(self) -> ManagedProcess:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Starts the process.

        Raises:
            HarnessError: It runs already, or the program cannot be started.
        """
        if self.running:
            msg = f"{self.name} runs already"
            raise HarnessError(msg)
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("wb") as log:
            try:
                self._process = self._spawn(log)
            except OSError as error:
                msg = f"{self.name}: {self.command[0]} cannot be started: {error.strerror}"
                raise HarnessError(msg) from None

    def _spawn(self, log: BinaryIO) -> Process:
        """Starts the process, its output to `log`."""
        parent = os.getpid()
        return subprocess.Popen(
            self.command,
            env=self._env,
            cwd=self._cwd,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=lambda: end_with_parent(parent),
        )

    @property
    def running(self) -> bool:
        """Whether the process has been started and has not ended."""
        return self._process is not None and self._process.poll() is None

    @property
    def pid(self) -> int:
        """Its process id, which is also its process group's.

        Raises:
            HarnessError: It has never been started.
        """
        if self._process is None:
            msg = f"{self.name} has not been started"
            raise HarnessError(msg)
        return self._process.pid

    @property
    def returncode(self) -> Optional[int]:
        """Its exit status, negative for a signal; None while it runs."""
        return None if self._process is None else self._process.poll()

    def output(self) -> str:
        """All that it has written so far."""
        return self.log.read_text(encoding="utf-8", errors="replace") if self.log.exists() else ""

    def check_running(self) -> None:
        """Raises a `HarnessError` with the end of its log unless it runs."""
        if not self.running:
            raise HarnessError(self.describe(f"ended with status {self.returncode}"))

    def describe(self, problem: str) -> str:
        """A message for `problem`, followed by the last lines of the log."""
        tail = "\n".join("    " + line for line in self.output().splitlines()[-15:])
        return f"{self.name} {problem}; log: {self.log}" + (f"\n{tail}" if tail else "")

    def wait_for_line(self, pattern: str, timeout: float) -> re.Match[str]:
        """Waits until a line of its output matches a regular expression.

        Args:
            pattern: searched for in the output, lines apart (``re.MULTILINE``).
            timeout: [s]

        Raises:
            HarnessError: It ends, or `timeout` passes, before that.
        """
        compiled = re.compile(pattern, re.MULTILINE)
        deadline = time.monotonic() + timeout
        while True:
            ended = not self.running
            found = compiled.search(self.output())
            if found:
                return found
            if ended:
                raise HarnessError(self.describe(f"ended with status {self.returncode} before it was ready"))
            if time.monotonic() > deadline:
                raise HarnessError(self.describe(f"did not say {pattern!r} within {timeout:g} s"))
            time.sleep(_POLL_S)

    def wait(self, timeout: float) -> int:
        """Waits for its end and returns its exit status.

        Raises:
            HarnessError: It has not ended within `timeout` [s].
        """
        if self._process is None:
            msg = f"{self.name} has not been started"
            raise HarnessError(msg)
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise HarnessError(self.describe(f"has not ended within {timeout:g} s")) from None

    def send_signal(self, number: int) -> None:
        """Sends it a signal; nothing happens when it has ended."""
        if self._process is not None:
            self._process.send_signal(number)

    def kill(self) -> None:
        """Kills its whole process group at once, as a crash would."""
        self._signal_group(signal.SIGKILL)
        self.wait(_KILLED_S)

    def stop(self) -> None:
        """Ends it in good order, and by force what is left of its process group; harmless when it has ended."""
        if self._process is None:
            return
        for number, patience in self.STOP_SIGNALS:
            if not self.running:
                break
            self._process.send_signal(number)
            try:
                self._process.wait(patience)
            except subprocess.TimeoutExpired:
                continue
        self._signal_group(signal.SIGKILL)

    def _signal_group(self, number: int) -> None:
        # The system gives the number of a process that has ended, and whose group is empty, to another one.
        if not self.running and Path(f"/proc/{self.pid}").exists():
            return
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)
