"""The data card of an export: what is in it, and that it is only ever written over itself."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
import yaml

from support.flights.export_flight import export, write_flight
from xplane_bridge import __version__

if TYPE_CHECKING:
    from pathlib import Path


def test_it_says_what_how_made_and_how_good(tmp_path: Path) -> None:
    bags = [write_flight(tmp_path / f"f{k}.bag", 4.0, offset=10.0 * k) for k in range(2)]
    out = tmp_path / "out"
    assert export(*bags, "--format", "imagefolder", "--split-by", "flight", "--seed", "3", "-o", out) == 0
    assert export(bags[0], "--format", "csv", "--rate", "10", "-o", out) == 0
    card = (out / "README.md").read_text(encoding="utf-8")
    assert f"xplane_bridge {__version__}" in card
    rows = {tuple(cell.strip() for cell in line.split("|")[1:-1]) for line in card.splitlines() if line.startswith("|")}
    made = {row[0]: row for row in rows if len(row) == 4 and row[1].endswith(".bag") and "seed 3" in row[2]}
    assert set(made) == {"f0", "f1"}
    assert made["f0"][1] == "f0.bag"
    assert "split by flight" in made["f0"][2]
    assert "exported 18" in made["f0"][3]
    assert any(row[0] == "f0" and "rate 10.0" in row[2] for row in rows if len(row) == 4)
    assert ("/xplane/flight_state", "xplane_bridge/FlightState", "400 in 2 of 2 flights") in rows
    assert ("/xplane/control/mode", "xplane_bridge/ControlMode", "6 in 2 of 2 flights") in rows
    # Of 20 pictures one has no frame; one is frozen, one interpolated with an assumed delay.
    for flight in ("f0", "f1"):
        assert (flight, "19", "17", "1 delay assumed, 1 frozen, 1 interpolated") in rows
    head = yaml.safe_load(card.split("---")[1])
    assert [part["split"] for part in head["configs"][0]["data_files"]] == ["train", "validation"]


def test_a_flight_called_test_is_no_split(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("datasets", reason="Hugging Face datasets is not installed")
    out = tmp_path / "data"
    assert export(write_flight(tmp_path / "test_1.bag", 2.0), "--format", "imagefolder", "-o", out) == 0
    loaded = datasets.load_dataset(str(out), cache_dir=str(tmp_path / "cache"))
    assert sorted(loaded) == ["train", "validation"]
    assert (len(loaded["train"]), len(loaded["validation"])) == (6, 2)


def test_it_is_verified_and_a_readme_of_the_users_stays(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    out = tmp_path / "out"
    assert export(bag, "-o", out) == 0
    assert export("--verify", "-o", out) == 0
    assert export(bag, "--format", "npz", "-o", out) == 0
    assert "## npz" in (out / "README.md").read_text(), "made anew with each export"
    (out / "README.md").write_text("mine")
    assert export(bag, "--format", "tum", "-o", out) == 0
    assert (out / "README.md").read_text() == "mine"
    capsys.readouterr()
    assert export("--verify", "-o", out) == 1
    assert capsys.readouterr().out.splitlines() == ["changed: README.md"]

    other = tmp_path / "other"
    other.mkdir()
    (other / "README.md").write_text("theirs")
    assert export(bag, "-o", other) == 0
    assert (other / "README.md").read_text() == "theirs"
    assert json.loads((other / "manifest.json").read_text())["files"] == {}


def test_an_export_that_made_nothing_has_no_card(tmp_path: Path) -> None:
    (tmp_path / "text.bag").write_text("no bag")
    assert export(tmp_path / "text.bag", "-o", tmp_path / "out") == 1
    assert not (tmp_path / "out" / "README.md").exists()
