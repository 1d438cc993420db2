"""X-Plane's stand-in as a child process."""

from __future__ import annotations

import json
import re
import signal
import sys
from pathlib import Path
from typing import Any, Sequence

from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.harness.processes import ManagedProcess, wait_until
from xplane_bridge.resources import program

_STATUS_TIMEOUT_S = 10.0


class EmulatorProcess(ManagedProcess):
    """`xplane_emulator` on a free port of the loopback interface, without a beacon, so that several run side by side.

    After `restart` it listens on the same port again, as a restarted X-Plane does.

    Args:
        log_dir: folder of its log.
        options: further options, e.g. ``["--fps", "60", "--pilot", path]``.
        name: of the log, for programs that start several.
        port: UDP port to listen on; 0 for a free one.
        command: that starts it, to which options are appended; xplane_emulator when empty.
    """

    _READY = r"^READY\b.*?\bport\W+(\d+)"
    _START_TIMEOUT_S = 60.0

    def __init__(
        self,
        log_dir: Path,
        options: Sequence[str | Path] = (),
        name: str = "xplane_emulator",
        port: int = 0,
        command: Sequence[str] = (),
    ) -> None:
        self._options = list(options)
        self._program = list(command) or [sys.executable, str(program("xplane_emulator"))]
        #: The UDP port it listens on; known after `start`.
        self.port = port
        super().__init__(name, [], log_dir)

    def start(self) -> None:
        """Starts it and waits until it says on which port it listens.

        Raises:
            HarnessError: It ends before that, or is silent for a minute.
        """
        self.port = self.port or free_udp_port()
        where = ["--bind", "127.0.0.1", "--port", self.port, "--no-beacon"]
        self.command = [str(part) for part in [*self._program, *where, *self._options]]
        super().start()
        try:
            self.port = int(self.wait_for_line(self._READY, self._START_TIMEOUT_S).group(1))
        except BaseException:
            self.stop()
            raise

    def status(self) -> dict[str, Any]:
        """Its statistics as of now: frames, what it ignored, how many subscriptions each client has.

        Raises:
            HarnessError: It does not answer.
        """
        seen = len(self._status_lines())
        self.send_signal(signal.SIGUSR1)

        def newer() -> list[str]:
            self.check_running()
            return self._status_lines()[seen:]

        status: dict[str, Any] = json.loads(wait_until(newer, _STATUS_TIMEOUT_S, f"status of {self.name}")[0])
        return status

    def _status_lines(self) -> list[str]:
        """All of them so far, each whole."""
        return re.findall(r"^STATUS (.*)\n", self.output(), re.MULTILINE)

    def restart(self) -> None:
        """Kills it if it runs and starts it anew on the same port."""
        if self.running:
            self.kill()
        self.start()
