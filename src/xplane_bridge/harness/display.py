"""An X display of one's own, for programs with windows on machines without a screen."""

from __future__ import annotations

import contextlib
import os
import shutil
from typing import TYPE_CHECKING, Iterator

from xplane_bridge.harness.processes import HarnessError, ManagedProcess

if TYPE_CHECKING:
    from pathlib import Path

_START_TIMEOUT_S = 30.0


class VirtualDisplay(ManagedProcess):
    """Xvfb on a free display number; `name` is valid when ``with`` or `start` returns.

    Args:
        log_dir: Folder of its log.
        width: [px]
        height: [px]
    """

    def __init__(self, log_dir: Path, width: int = 1280, height: int = 1024) -> None:
        screen = f"{width}x{height}x24"
        command = ["Xvfb", "-displayfd", "1", "-screen", "0", screen, "-nolisten", "tcp", "+extension", "Composite"]
        super().__init__("xvfb", command, log_dir)
        self._number = ""

    @property
    def display(self) -> str:
        """What DISPLAY is to be, e.g. ``:3``."""
        return f":{self._number}"

    def start(self) -> None:
        """Start the display and wait until it takes connections.

        Raises:
            HarnessError: Xvfb is not installed or does not come up.
        """
        if shutil.which("Xvfb") is None:
            msg = "Xvfb is not installed: apt-get install xvfb (scripts/setup does)"
            raise HarnessError(msg)
        super().start()
        self._number = self.wait_for_line(r"^(\d+)$", _START_TIMEOUT_S).group(1)


@contextlib.contextmanager
def screen(log_dir: Path, headless: bool) -> Iterator[None]:
    """A screen (DISPLAY) for windows: the user's, or one of our own where there is none or `headless` wants none."""
    if os.environ.get("DISPLAY") and not headless:
        yield
        return
    display = VirtualDisplay(log_dir)
    with display:
        before = os.environ.get("DISPLAY")
        os.environ["DISPLAY"] = display.display
        try:
            yield
        finally:
            del os.environ["DISPLAY"]
            if before is not None:
                os.environ["DISPLAY"] = before
