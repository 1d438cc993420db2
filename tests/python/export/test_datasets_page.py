"""docs/pictures/datasets.md: its table names the formats there are, and each example runs as it stands there."""

from __future__ import annotations

import importlib.util
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from support.flights.drawn_approach import write_approach
from support.flights.export_flight import export, write_flight
from support.markdown import blocks
from support.white_lines import airport_file
from xplane_bridge.cli.sight import label_images
from xplane_bridge.export.formats import FORMATS

PAGE = Path(__file__).resolve().parents[3] / "docs/pictures/datasets.md"
BLOCKS = blocks(PAGE)


def test_the_table_and_the_sections_are_the_formats() -> None:
    table = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert table == list(FORMATS)
    for language in ("bash", "python"):
        assert [block.section for block in BLOCKS if block.language == language] == table


@pytest.mark.parametrize("form", FORMATS)
def test_the_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    command, code = (block.text for block in BLOCKS if block.section == form and block.language in ("bash", "python"))
    program, *arguments = shlex.split(command)
    assert program == "scripts/bag_export"
    if "--labels" in arguments:
        bag = write_approach(tmp_path / "flight.bag", 5)
        assert label_images.main([str(bag), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]) == 0
    else:
        write_flight(tmp_path / "flight.bag", 2.0)
    for module in re.findall(r"^(?:import|from) (\w+)", code, re.MULTILINE):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    assert export(*arguments) == 0
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
