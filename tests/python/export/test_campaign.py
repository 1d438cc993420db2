"""What bag_export writes where: recordings and foreign files stay."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from support.deadlines import PROGRAM_S
from support.flights.export_flight import export, files_of, write_flight
from support.flights.synthetic_flight import stamp_ns
from xplane_bridge.dask_scheduler import SchedulerError
from xplane_bridge.export import campaign, tables
from xplane_bridge.export.campaign import flights
from xplane_bridge.export.card import CARD
from xplane_bridge.export.flight import ExportError
from xplane_bridge.export.formats import Job
from xplane_bridge.export.pictures import Options
from xplane_bridge.export.yolo_yaml import DATA_YAML
from xplane_bridge.labels import table

if TYPE_CHECKING:
    from pathlib import Path

#: Exports to several formats where no file may grow beyond some bytes.
LIMITED = """
import resource, sys
from xplane_bridge.cli.bag_export import main
limit, formats, *rest = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), int(limit)))
for form in formats.split():
    main([*rest, "--format", form])
"""
#: Runs an export that is killed in place of its nth renaming of a file or folder.
KILLED = """
import os, signal, sys
from xplane_bridge.cli.bag_export import main
left, rename = [int(sys.argv[1])], os.replace
def replace(source, target):
    left[0] -= 1
    if not left[0]:
        os.kill(os.getpid(), signal.SIGKILL)
    rename(source, target)
os.replace = replace
main(sys.argv[2:])
"""


@pytest.fixture(name="split")
def fixture_split(tmp_path: Path) -> Path:
    """A folder of split bags."""
    folder = tmp_path / "data" / "monday"
    folder.mkdir(parents=True)
    write_flight(folder / "a.bag", 0.4)
    write_flight(folder / "b.bag", 0.4, offset=10.0)
    return folder


def test_a_recording_is_never_replaced_by_its_export(split: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = files_of(split)
    assert export(split, "--format", "imagefolder", "-o", split.parent) == 1
    err = capsys.readouterr().err
    assert f"{split / 'a.bag'}: the imagefolder export of this bag would replace {split}, where the bag" in err
    assert "give another folder with -o" in err
    assert files_of(split) == before
    # Also where an earlier export's record names that folder.
    other = write_flight(split.parent / "other.bag", 0.4)
    split.rename(split.parent / "later")
    other.rename(split.parent / "monday.bag")
    assert export(split.parent / "monday.bag", "--format", "imagefolder", "-o", split.parent) == 0
    for name in before:
        (split.parent / "later" / name).rename(split / name)
    assert export(split, "--format", "imagefolder", "-o", split.parent) == 1
    assert before.items() <= files_of(split).items()
    assert export(split, "--format", "csv", "-o", split.parent) == 0


def test_a_bag_of_any_name_is_never_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.4).rename(tmp_path / "flight.recorded")
    before = bag.read_bytes()
    assert export(bag, "--format", "imagefolder", "-o", tmp_path) == 1
    assert "would replace" in capsys.readouterr().err
    assert bag.read_bytes() == before


def test_a_bag_whose_name_is_no_text_is_exported(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / os.fsdecode(b"fl\xfcg.bag"), 0.4)
    out = tmp_path / "out"
    assert export(bag, "-o", out) == 0
    assert export("--verify", "-o", out) == 0
    assert sorted(name for name in os.listdir(os.fsencode(out)) if not name.startswith(b".")) == [
        b"README.md",
        b"fl\xfcg.csv",
        b"manifest.json",
    ]


def test_what_lies_behind_links_is_not_replaced(split: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "monday").symlink_to(split)
    before = files_of(split)
    assert export(split, "--format", "imagefolder", "-o", out) == 1
    assert files_of(split) == before
    linked = tmp_path / "links" / "tuesday"
    linked.mkdir(parents=True)
    for name in before:
        (linked / name).symlink_to(split / name)
    assert export(linked, "--format", "imagefolder", "-o", linked.parent) == 1
    assert files_of(split) == before


@pytest.mark.parametrize("form", ["imagefolder", "csv"])
def test_what_no_export_made_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.4)
    out = tmp_path / "out"
    own = out / "flight" / "thesis.tex" if form == "imagefolder" else out / "flight.csv"
    own.parent.mkdir(parents=True)
    own.write_text("years of work")
    assert export(bag, "--format", form, "-o", out) == 1
    err = capsys.readouterr().err
    assert "is there already, made by no export that this folder has a record of" in err
    assert "give another folder with -o, or move it away" in err
    assert own.read_text() == "years of work"


def test_an_export_beside_files_of_ones_own_is_as_it_was_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.4)
    out = tmp_path / "out"
    out.mkdir()
    for name in (CARD, DATA_YAML):
        (out / name).write_text("of my own")
    assert export(bag, "--format", "csv", "-o", out) == 0
    assert export("--verify", "-o", out) == 0
    assert [(out / name).read_text() for name in (CARD, DATA_YAML)] == ["of my own"] * 2
    (out / "notes.txt").write_text("")
    capsys.readouterr()
    assert export("--verify", "-o", out) == 1
    assert "not in the manifest: notes.txt" in "".join(capsys.readouterr())


def test_an_earlier_export_of_the_same_flight_is_replaced(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag", 1.0)
    for form, option in (("imagefolder", "--keep-bad-frames"), ("csv", "--rate=10")):
        assert export(bag, "--format", form, "-o", tmp_path) == 0
        before = files_of(tmp_path)
        assert export(bag, "--format", form, option, "-o", tmp_path) == 0
        assert files_of(tmp_path) != before
    assert export("--verify", "-o", tmp_path) == 1, "the bag itself"


@pytest.mark.parametrize("renaming", [1, 2, 3])
def test_an_export_that_was_killed_goes_on(tmp_path: Path, renaming: int) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.4)
    for arguments in ([], ["--keep-bad-frames"]):  # a first one; one that replaces earlier results
        command = [str(bag), "--format", "yolo", *arguments, "-o", str(tmp_path / "out")]
        run = subprocess.run([sys.executable, "-c", KILLED, str(renaming), *command], timeout=PROGRAM_S, check=False)
        assert run.returncode == -signal.SIGKILL
        assert export(*command) == 0
        assert export("--verify", "-o", tmp_path / "out") == 0


def test_labels_that_cannot_be_used_fail_their_flight_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = [write_flight(tmp_path / f"{name}.bag", 0.4) for name in "ab"]
    header = {"labels": table.SCHEMA, "bags": ["b.bag"], "airport": "XEMU"}
    frame = {"camera": "camera", "stamp_ns": stamp_ns(0.0), "width": 32, "height": 24, "objects": []}
    table.beside(given[0]).write_text('{"labels": 1}\n')
    table.beside(given[1]).write_text(f"{json.dumps(header)}\n{json.dumps(frame)}\n")
    assert export(*given, "--format", "coco", "--labels", tmp_path, "--jobs", "1", "-o", tmp_path / "out") == 1
    out = capsys.readouterr()
    assert f"a: {table.beside(given[0])}: no labels of this version; label_images writes them anew" in out.err
    assert "1 of 2 flights exported" in out.out
    assert list(json.loads((tmp_path / "out" / "manifest.json").read_text())["exports"]["coco"]) == ["b"]


def write_labels(path: Path, t: float) -> None:
    header = {"labels": table.SCHEMA, "bags": ["flight.bag"], "airport": "XEMU"}
    frame = {"camera": "camera", "stamp_ns": stamp_ns(t), "width": 32, "height": 24, "objects": []}
    path.write_text(f"{json.dumps(header)}\n{json.dumps(frame)}\n")


def test_labels_in_a_folder_are_found_by_the_flights_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    labels = tmp_path / "labels"
    labels.mkdir()
    for name, bag, t in (("monday", "flight", 0.0), ("tuesday", "flight", 100.0), ("split", "part_0", 200.0)):
        (tmp_path / name).mkdir()
        write_flight(tmp_path / name / f"{bag}.bag", 0.4, t)
    given = [tmp_path / "monday" / "flight.bag", tmp_path / "tuesday" / "flight.bag", tmp_path / "split"]
    options = ("--format", "coco", "--labels", labels, "--jobs", "1", "-o", tmp_path / "out")

    write_labels(labels / "flight.labels.jsonl", 0.0)  # of either
    write_labels(labels / "split.labels.jsonl", 200.0)
    assert export(*given, *options) == 1
    assert f"{labels / 'monday_flight.labels.jsonl'}: No such file" in capsys.readouterr().err
    write_labels(labels / "monday_flight.labels.jsonl", 0.0)
    write_labels(labels / "tuesday_flight.labels.jsonl", 100.0)
    assert export(*given, *options) == 0
    records = json.loads((tmp_path / "out" / "manifest.json").read_text())["exports"]["coco"]
    for name, record in records.items():
        assert record["parameters"]["labels_sha256"] == table.digest(labels / f"{name}.labels.jsonl")
    assert list(records) == ["monday_flight", "split", "tuesday_flight"]

    (labels / "split.labels.jsonl").rename(labels / "part_0.labels.jsonl")  # as label_images calls it
    assert export(given[2], *options) == 0
    assert export(given[1], *options) == 1, "flight.labels.jsonl is monday's"


def test_a_killed_process_leaves_the_manifest_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made, *given = (write_flight(tmp_path / f"{name}.bag", 0.4) for name in "abc")
    assert export(made, "-o", tmp_path / "out") == 0
    monkeypatch.setattr(campaign, "export_flight", end_this_process)
    assert export(*given, "--jobs", "2", "-o", tmp_path / "out") == 1
    assert_lost_but_a(tmp_path / "out", capsys)


def assert_lost_but_a(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = capsys.readouterr()
    for name in "bc":
        assert f"{name}: a process of the export was killed" in out.err
    assert "0 of 2 flights exported" in out.out
    assert list(json.loads((folder / "manifest.json").read_text())["exports"]["csv"]) == ["a"]


def test_a_library_that_fails_on_a_flight_leaves_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def write_csv(table: tables.FlightTable, path: Path) -> None:
        if path.stem == "b":
            raise ValueError("cannot hold\nwhat is there")
        path.write_text(f"{table.rows}\n")

    monkeypatch.setattr(tables, "write_csv", write_csv)
    paths = [write_flight(tmp_path / f"{name}.bag", 0.2) for name in "ba"]
    assert export(*paths, "--jobs", "1", "-o", tmp_path / "out") == 1
    assert "b: the csv export failed: ValueError: cannot hold what is there; try another" in capsys.readouterr().err
    assert list(json.loads((tmp_path / "out" / "manifest.json").read_text())["exports"]["csv"]) == ["a"]


def end_this_process(_: Job) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_killed_worker_of_a_cluster_leaves_the_manifest_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    dask = pytest.importorskip("dask")
    distributed = pytest.importorskip("distributed")
    import cloudpickle

    made, *given = (write_flight(tmp_path / f"{name}.bag", 0.4) for name in "abc")
    assert export(made, "-o", tmp_path / "out") == 0
    module = sys.modules[__name__]
    cloudpickle.register_pickle_by_value(module)  # the workers cannot import it
    monkeypatch.setattr(campaign, "export_flight", end_this_process)
    try:
        with dask.config.set({"distributed.scheduler.allowed-failures": 0}), distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
        ) as cluster:
            assert export(*given, "--scheduler", cluster.scheduler_address, "-o", tmp_path / "out") == 1
    finally:
        cloudpickle.unregister_pickle_by_value(module)
    assert_lost_but_a(tmp_path / "out", capsys)


def test_a_scheduler_that_ends_midway_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(campaign, "export_flight", take_a_moment)
    jobs = [Job(str(number), (), "", "csv", None, (), Options(), True) for number in range(200)]
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        outcomes = campaign.run_dask(jobs, address)
        next(outcomes)
        cluster.close()
        with pytest.raises(SchedulerError, match=f"the Dask scheduler at {address} ended, or cannot be reached"):
            list(outcomes)


def take_a_moment(job: Job) -> campaign.Outcome:
    time.sleep(0.2)
    return campaign.Outcome(job.name, {}, "", False)


def test_two_exports_on_one_cluster_do_not_mix(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    jobs = []
    for name in ("monday", "tuesday"):
        (tmp_path / name).mkdir()
        bag = write_flight(tmp_path / name / "flight.bag", 0.4, offset=len(jobs))
        jobs.append(Job("flight", (str(bag),), str(tmp_path / name), "csv", None, (), Options(), True))
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as cluster:
        first = campaign.run_dask(jobs[:1], cluster.scheduler_address)
        assert next(first).name == "flight"
        (outcome,) = campaign.run_dask(jobs[1:], cluster.scheduler_address)
        first.close()
    made = tmp_path / "tuesday" / "flight.csv"
    assert outcome.record is not None
    assert outcome.record["files"] == {made.name: hashlib.sha256(made.read_bytes()).hexdigest()}


def bags(folder: Path, *names: str) -> list[str]:
    """Give these files, written, by full name; their content does not matter."""
    paths = [folder / name for name in names]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
    return [str(path) for path in paths]


def test_flights_take_as_many_folders_into_their_names_as_they_need(tmp_path: Path) -> None:
    given = bags(tmp_path, "a/run/flight.bag", "b/run/flight.bag", "b/flight.bag", "tail.bag")
    assert list(flights(given)) == ["a_run_flight", "b_run_flight", "b_flight", "tail"]


def test_flights_whose_names_stay_alike_are_refused(tmp_path: Path) -> None:
    first, other, last = bags(tmp_path, "run/flight.bag", "other/flight.bag", "run_flight.bag")
    with pytest.raises(ExportError, match=f"^{first} and {last} would both be exported as run_flight; .* rename one"):
        flights([first, other, last])
    assert list(flights([first, last])) == ["flight", "run_flight"]


def test_a_folder_and_a_bag_of_one_name_are_refused(tmp_path: Path) -> None:
    _, bag = bags(tmp_path, "data/flight/part.bag", "data/flight.bag")
    folder = str(tmp_path / "data" / "flight")
    with pytest.raises(ExportError, match=f"^{folder} and {bag} would both be exported as .*_data_flight; "):
        flights([folder, bag])


def test_a_bag_of_two_flights_is_refused(tmp_path: Path) -> None:
    first, second = bags(tmp_path, "run/a.bag", "run/b.bag")
    link = tmp_path / "link.bag"
    link.symlink_to(second)
    folder, linked = tmp_path / "run", tmp_path / "linked"
    linked.mkdir()
    (linked / "c.bag").symlink_to(first)
    for given, bag in (([folder, first], first), ([link, folder], second), ([folder, linked], first)):
        with pytest.raises(ExportError, match=f"^{bag} is of two of the given flights, .*; give one of them$"):
            flights([str(path) for path in given])


def test_a_full_disk_is_said_with_what_was_written(tmp_path: Path) -> None:
    bag, out = write_flight(tmp_path / "flight.bag", 1.0), tmp_path / "out"
    files = {"csv": "flight.csv", "tum": "flight.tum", "npz": "flight.npz", "ros2": "flight.ros2"}
    files["imagefolder"] = "flight"
    limited = [sys.executable, "-c", LIMITED, "2000", " ".join(files), str(bag), "-o", str(out)]
    run = subprocess.run(limited, capture_output=True, text=True, timeout=120, check=False)
    reasons = {"ros2": "disk I/O error"}  # of SQLite
    expected = [f"flight: {out / file}: {reasons.get(form, 'File too large')}" for form, file in files.items()]
    assert run.stderr.splitlines() == expected
    assert [path.name for path in out.iterdir()] == ["manifest.json"]


def test_what_is_of_all_flights_is_said_by_its_name(tmp_path: Path) -> None:
    bag, out = write_flight(tmp_path / "flight.bag", 0.2), tmp_path / "out"
    assert export(bag, "--format", "tum", "-o", out) == 0
    (out / "README.md").unlink()
    limited = [sys.executable, "-c", LIMITED, "400", "tum", str(bag), "-o", str(out)]  # it is made already
    run = subprocess.run(limited, capture_output=True, text=True, timeout=120, check=False)
    assert f"{out / 'README.md'}: File too large" in run.stderr
