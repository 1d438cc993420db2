"""The consoles of a test's programs, for the report of its failure."""

from __future__ import annotations

from pathlib import Path

_LINES = 15


def ends_of_consoles(folder: Path) -> list[tuple[str, str]]:
    """Name and last lines of each log file below a test's folder; without those in which nothing stands."""
    logs = [(path, path.read_text(encoding="utf-8", errors="replace")) for path in sorted(folder.rglob("*.log"))]
    return [(str(path.relative_to(folder)), "\n".join(text.splitlines()[-_LINES:])) for path, text in logs if text]
