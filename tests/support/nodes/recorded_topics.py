"""What tests/support/nodes/topic_recorder.py writes down, read while it is being written."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Callable, Sequence

from xplane_bridge.harness import wait_until

_RECORDER = Path(__file__).resolve().parent / "topic_recorder.py"


def _full(topic: str) -> str:
    return topic if topic.startswith("/") else f"/xplane/{topic}"


class RecordedTopics:
    """The topics of a bridge on a machine, in the namespace /xplane.

    Args:
        file: that the recorder is to write; one that is there is an earlier recorder's, and removed.
        timeout: of waiting for a message [s].
        topics: below /xplane, or with a leading slash; all that the recorder knows unless given.
    """

    def __init__(self, file: Path, timeout: float, topics: Sequence[str] = ()) -> None:
        self.file = file
        self._timeout = timeout
        self._topics = [_full(topic) for topic in topics]
        self._read = 0  # [bytes] of the file that are in _messages
        self._messages: dict[str, list[dict[str, Any]]] = {}
        file.unlink(missing_ok=True)

    @property
    def command(self) -> list[str]:
        """What is to be started on the machine."""
        return [sys.executable, str(_RECORDER), str(self.file), *self._topics]

    def all(self, topic: str) -> list[dict[str, Any]]:
        """All messages so far of a topic below /xplane, or of one with a leading slash."""
        self._read_on()
        return list(self._messages.get(_full(topic), ()))

    def _read_on(self) -> None:
        """Takes the complete lines that have come since the last time."""
        if not self.file.exists():
            return
        with self.file.open("rb") as file:
            file.seek(self._read)
            complete = file.read()
        complete = complete[: complete.rfind(b"\n") + 1]
        self._read += len(complete)
        for line in complete.splitlines():
            message = json.loads(line)
            self._messages.setdefault(message["topic"], []).append(message)

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
