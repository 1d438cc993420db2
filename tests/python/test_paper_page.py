"""docs/paper.md names tests, topics, fields and parameters that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from xplane_bridge.topics import TOPICS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/paper.md").read_text(encoding="utf-8")
WORDS = sorted(set(re.findall(r"`([^`]+)`", PAGE)))


def rows():
    """Cells of each row of the tables."""
    for line in PAGE.splitlines():
        if line.startswith("|") and not line.startswith("|---") and "the paper | here" not in line:
            yield [cell.strip() for cell in line.strip("|").split("|")]


def test_every_row_is_shown_by_a_test_that_exists():
    found = list(rows())
    assert len(found) > 25
    for cells in found:
        tests = re.findall(r"`(tests/[^`]+)`", cells[2])
        assert tests, cells[0]
        assert [path for path in tests if not (ROOT / path).is_file()] == [], cells[0]


@pytest.mark.parametrize("word", [w for w in WORDS if re.fullmatch(r"(mission|control|camera|failures)/\w+", w)])
def test_every_topic_is_one(word):
    assert word in TOPICS


@pytest.mark.parametrize("word", [w for w in WORDS if w.startswith(("config/", "tests/", "scripts/"))])
def test_every_path_is_there(word):
    assert (ROOT / word.split(" ")[0]).exists()


def test_every_page_it_points_to_is_there():
    pages = re.findall(r"\]\(([^)#]+)\)", PAGE)
    assert len(pages) > 5
    assert [page for page in pages if not (ROOT / "docs" / page).is_file()] == []


@pytest.mark.parametrize(
    ("word", "file"),
    [
        ("angular_velocity", "msg/FlightState.msg"),
        ("orientation", "msg/FlightState.msg"),
        ("sim_time", "msg/FlightState.msg"),
        ("MANUAL = 1", "msg/ControlMode.msg"),
        ("AUTO = 2", "msg/ControlMode.msg"),
        ("thrust_vector", "msg/ControlCommand.msg"),
        ("trim_yaw", "msg/ControlCommand.msg"),
        ("stick_mode:=1", "launch/joystick.launch"),
        ("position_source: xpc", "config/rx.yaml"),
        ("get_terrain", "srv/GetTerrain.srv"),
        ("dref", "config/tx.yaml"),
    ],
)
def test_every_name_it_uses_is_where_it_belongs(word, file):
    assert f"`{word}`" in PAGE
    needle = re.split(r":=|: ", word)[0] if word.startswith(("stick_mode", "position_source")) else word
    text = re.sub(r" +", " ", (ROOT / file).read_text(encoding="utf-8"))
    assert needle in text
