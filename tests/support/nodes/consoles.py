"""The consoles of a test's programs, for the report of its failure."""

from __future__ import annotations

from pathlib import Path

_LINES = 15
_OF_ROS = "log"  # the folder in ROS_HOME


def ends_of_consoles(folder: Path) -> list[tuple[str, str]]:
    """Name and last lines of each log file below a test's folder; without ROS's own, and those where nothing stands."""
    files = [path for path in sorted(folder.rglob("*.log")) if _OF_ROS not in path.relative_to(folder).parts]
    logs = [(path, path.read_text(encoding="utf-8", errors="replace")) for path in files]
    return [(str(path.relative_to(folder)), "\n".join(text.splitlines()[-_LINES:])) for path, text in logs if text]
