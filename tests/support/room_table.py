"""The room tables of docs/architecture.md: which part of the sources may know which."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Of one folder.
MOST_FILES = 20


def room_table(heading: str) -> dict[str, set[str]]:
    """The table below a heading: room to the rooms it may use."""
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    section = text.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("| `")]
    table = {re.findall(r"`([^`]+)`", row[0])[0]: set(re.findall(r"`([^`]+)`", row[2])) for row in rows}
    assert table
    return table


def require_floors(table: dict[str, set[str]]) -> None:
    """Fails when rooms use each other, or one that the table does not have."""
    placed: set[str] = set()
    while len(placed) < len(table):
        floor = {room for room, below in table.items() if room not in placed and below <= placed}
        assert floor, f"these rooms use each other, or one that is none: {sorted(set(table) - placed)}"
        placed |= floor


def not_needed(table: dict[str, set[str]], used: dict[str, set[str]]) -> dict[str, set[str]]:
    """What the table allows and no file uses."""
    return {room: below - used[room] for room, below in table.items() if below - used[room]}
