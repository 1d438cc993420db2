"""What an export folder holds already: other flights, manifests and records stay, and are said to be there."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from support.flights.export_flight import export, files_of, write_flight
from xplane_bridge.export.made import RECORDS, SCHEMA, sides


@pytest.fixture(name="days")
def fixture_days(tmp_path: Path) -> list[Path]:
    """Two flights of one name."""
    paths = []
    for offset, day in enumerate(("monday", "tuesday")):
        (tmp_path / day).mkdir()
        paths.append(write_flight(tmp_path / day / "flight.bag", 0.4, 100.0 * offset))
    return paths


@pytest.mark.parametrize("form", ["csv", "imagefolder"])
def test_another_flight_of_the_same_name_is_not_replaced(
    days: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    out = tmp_path / "out"
    assert export(days[0], "--format", form, "-o", out) == 0
    before = files_of(out)
    assert export(days[1], "--format", form, "-o", out) == 1
    made = out / ("flight.csv" if form == "csv" else "flight")
    err = capsys.readouterr().err
    assert f"{made} is the export of another flight, {days[0]}; expected none but earlier ones of {days[1]}: " in err
    assert "give another folder with -o, or move it away" in err
    assert files_of(out) == before
    made.rename(tmp_path / "elsewhere")
    assert export(days[1], "--format", form, "-o", out) == 0
    assert export("--verify", "-o", out) == 0


def test_the_same_bag_is_exported_again_whatever_its_path(
    days: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "project" / "out"
    assert export(days[0], "-o", out) == 0
    monkeypatch.chdir(days[0].parent)
    (tmp_path / "link.bag").symlink_to(days[0])
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "flight.bag").symlink_to(days[0])
    for number, path in enumerate(("flight.bag", "../links/flight.bag", days[0]), 1):
        assert export(path, "--rate", number, "-o", out) == 0
    # Moved together, and recorded anew at the same place.
    moved = tmp_path / "moved"
    (tmp_path / "project").rename(moved)
    assert export(days[0].rename(moved / "flight.bag"), "--rate", "4", "-o", moved / "out") == 0
    write_flight(tmp_path / "new.bag", 0.2, offset=7.0).replace(moved / "flight.bag")
    assert export(moved / "flight.bag", "-o", moved / "out") == 0
    # A copy without its time of change may be any bag.
    (tmp_path / "copy").mkdir()
    shutil.copyfile(moved / "flight.bag", tmp_path / "copy" / "flight.bag")
    assert export(tmp_path / "copy" / "flight.bag", "-o", moved / "out") == 1


def test_a_flight_is_not_exported_under_two_names(
    days: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    options = ("--format", "imagefolder", "--split-by", "flight", "--jobs", "1", "-o", out)
    assert export(days[0], *options) == 0
    assert export(*days, *options) == 1
    err = capsys.readouterr().err
    assert (
        f"{days[0]}: a bag of it is exported to {out} as flight already, and would be there twice as monday_fl" in err
    )
    assert "give all flights to a new folder with -o" in err
    assert sorted(path.parent.name for path in out.glob("*/labels.csv")) == ["flight", "tuesday_flight"]
    assert export(*days, "-o", out) == 0, "another format"


@pytest.mark.parametrize(
    "text",
    [
        '{"name": "my extension", "version": 3}',
        '[{"file": "x"}]',
        '{"files": ["x.csv", "y.csv"]}',
        '{"schema": 2}',
        '{"schema": 2, "xplane_bridge": "1", "files": [], "exports": {}}',
        '{"schema": 2, "xplane_bridge": "1", "files": {}, "exports": {"csv": {"flight": []}}}',
        "no JSON",
    ],
)
def test_a_manifest_of_something_else_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    manifest = tmp_path / "out" / "manifest.json"
    manifest.parent.mkdir()
    manifest.write_text(text)
    for arguments in ([bag], ["--verify"]):
        assert export(*arguments, "-o", manifest.parent) == 1
        err = capsys.readouterr().err
        assert f"{manifest}: no manifest of an export; expected none, or one that bag_export wrote: give another" in err
        assert err.count("\n") == 1
    assert files_of(manifest.parent) == {"manifest.json": text.encode()}, "nothing was exported first"


@pytest.mark.parametrize("text", ['{"schema": 1, "xplane_bridge": "0.0.1", "flights": {}}', None])
def test_a_manifest_of_an_earlier_version_is_written_anew(tmp_path: Path, text: str) -> None:
    bag, out = write_flight(tmp_path / "flight.bag", 0.2), tmp_path / "out"
    assert export(bag, "-o", out) == 0
    content = json.loads((out / "manifest.json").read_text())
    del content["files"]
    (out / "manifest.json").write_text(text or json.dumps(content))
    (out / "README.md").unlink()
    assert export(bag, "-o", out) == 0
    assert export("--verify", "-o", out) == 0


@pytest.mark.parametrize(
    "text",
    [
        "[1]",
        '{"a": 1}',
        '{"key": {"schema": 2}, "record": {"files": {}}}',
        '{"key": {"schema": 2, "sources": ["a.bag"]}, "record": {"files": {}}}',
        '{"key": {"schema": 2, "sources": []}, "record": {}}',
    ],
)
@pytest.mark.parametrize("name", ["flight", "other"])
def test_a_record_of_something_else_is_said_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str
) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    record = tmp_path / "out" / ".flights" / "csv" / f"{name}.json"
    record.parent.mkdir(parents=True)
    record.write_text(text)
    assert export(bag, "-o", tmp_path / "out") == 1
    err = capsys.readouterr().err
    assert f"{record}: no record of a flight's export; expected one that bag_export wrote: move this file away" in err
    assert err.count("\n") == 1
    assert list(files_of(tmp_path / "out")) == [f".flights/csv/{name}.json"]


@pytest.mark.parametrize("parameters", [None, [], {}, {"train_flight": None}, {"train_flight": True}])
def test_only_a_record_that_has_a_side_has_one(tmp_path: Path, parameters: object) -> None:
    content = {"key": {"schema": SCHEMA, "sources": []}, "record": {"files": {}, "parameters": parameters}}
    file = tmp_path / RECORDS / "imagefolder" / "a.json"
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps(content), encoding="utf-8")
    assert sides(tmp_path, "imagefolder") == ({"a": True} if parameters == {"train_flight": True} else {})
