"""What tests/support/topic_recorder.py writes down, read while it is being written."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Callable

from xplane_bridge.harness import wait_until

_RECORDER = Path(__file__).resolve().parent / "topic_recorder.py"


class RecordedTopics:
    """The topics of a bridge on a machine, in the namespace /xplane.

    Args:
        file: that the recorder writes.
        timeout: of waiting for a message [s].
    """

    def __init__(self, file: Path, timeout: float) -> None:
        self.file = file
        self._timeout = timeout

    @property
    def command(self) -> list[str]:
        """What is to be started on the machine."""
        return [sys.executable, str(_RECORDER), str(self.file)]

    def all(self, topic: str) -> list[dict[str, Any]]:
        """All messages so far of a topic below /xplane, or of one with a leading slash."""
        if not self.file.exists():
            return []
        name = topic if topic.startswith("/") else f"/xplane/{topic}"
        complete = self.file.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()
        messages = [json.loads(line) for line in complete]
        return [message for message in messages if message["topic"] == name]

    def wait_for(
        self, topic: str, condition: Callable[[dict[str, Any]], bool], what: str, after: int = 0
    ) -> dict[str, Any]:
        """Waits for a message that fulfils `condition`, the first `after` ones left out."""
        return wait_until(
            lambda: next(filter(condition, self.all(topic)[after:]), None), self._timeout, f"{what} on {topic}"
        )

    def wait_for_status(self, node: str, condition: Callable[[int, str], bool], what: str) -> None:
        """Waits for a diagnostic status of a node from now on."""

        def fits(message: dict[str, Any]) -> bool:
            return any(node in name and condition(level, text) for name, level, text in message["status"])

        self.wait_for("/diagnostics", fits, what, after=len(self.all("/diagnostics")))
