"""bag_export, run as a user runs it, on bags of an analytic flight."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from support.deadlines import PROGRAM_S
from support.flights.cut_off import cut_off
from support.flights.export_flight import RATE, export, files_of, picture, pictures_in, write_flight
from support.flights.synthetic_flight import START, FlightBag, stamp_ns, state_at
from xplane_bridge.export import campaign
from xplane_bridge.export.formats import Job
from xplane_bridge.export.pictures import Options


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_tables_read_back_with_pandas_row_for_row(tmp_path: Path, form: str) -> None:
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", form, "-o", tmp_path / "out") == 0
    file = tmp_path / "out" / f"flight.{form}"
    frame = pd.read_csv(file, float_precision="round_trip") if form == "csv" else pd.read_parquet(file)
    assert len(frame) == 200
    times = np.arange(200) / RATE + (np.arange(200) >= 100)
    np.testing.assert_array_equal(frame["stamp_ns"], [stamp_ns(t) for t in times])
    np.testing.assert_allclose(frame["time_s"], times, atol=1e-9)
    for k in (0, 57, 199):
        expected = state_at(times[k])
        for name in ("roll_deg", "pitch_deg", "heading_true_deg"):
            assert frame[name][k] == expected[name], "CSV must read back to the very same float64"
        assert frame["altitude_msl_m"][k] == expected["altitude_msl"]
        assert frame["velocity_ned_y_mps"][k] == expected["velocity_east"]
        assert frame["angular_velocity_x_radps"][k] == expected["p"]
    modes = frame["mode"].astype(float)
    assert np.isnan(modes[24])
    assert (modes[25], modes[74], modes[75], modes[199]) == (1, 1, 2, 2)
    # 3.5 s lie 0.5 s behind the gap: 100 rows before it, 25 after it.
    safe = frame["failsafe"].astype(float)
    assert np.isnan(safe[24])
    assert (safe[25], safe[99], safe[124], safe[125], safe[199]) == (0, 0, 0, 1, 1)
    assert frame["failures"][199] == "aileron1_left:stuck:5;engine_1:failed"


def test_a_uniform_time_base_leaves_the_gap_out_and_turns_angles_the_short_way(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", "parquet", "--rate", "200", "-o", tmp_path) == 0
    frame = pd.read_parquet(tmp_path / "flight.parquet")
    time = frame["time_s"].to_numpy()
    assert not ((time > 1.98) & (time < 3.0)).any()
    np.testing.assert_allclose(np.diff(time[time < 2]), 0.005, atol=1e-9)
    exact = np.array([state_at(t)["heading_true_deg"] for t in time])
    off = (frame["heading_true_deg"].to_numpy() - exact + 180) % 360 - 180
    assert np.abs(off).max() < 1e-3
    norms = sum(frame[f"orientation_{axis}"] ** 2 for axis in "xyzw")
    np.testing.assert_allclose(norms, 1.0, atol=1e-12)


def test_further_topics_come_beside_the_state(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--topics", "control/mode", "-o", tmp_path) == 0
    frame = pd.read_csv(tmp_path / "flight.csv")
    assert frame["control_mode_reason"].dropna().unique().tolist() == ["r", "rr"]


def test_trajectories_are_what_evo_reads(tmp_path: Path) -> None:
    file_interface = pytest.importorskip("evo.tools.file_interface", reason="evo needs Python 3.10")
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", "tum", "-o", tmp_path / "tum") == 0
    assert export(bag, "--format", "euroc", "-o", tmp_path / "euroc") == 0
    tum = file_interface.read_tum_trajectory_file(str(tmp_path / "tum" / "flight.tum"))
    euroc = file_interface.read_euroc_csv_trajectory(str(tmp_path / "euroc" / "flight.euroc.csv"))
    times = np.arange(200) / RATE + (np.arange(200) >= 100)
    for trajectory in (tum, euroc):
        assert trajectory.check()[0]
        np.testing.assert_allclose(trajectory.timestamps, START + times, atol=1e-6)
        np.testing.assert_allclose(trajectory.positions_xyz, np.outer(times, [1, 2, 3]), atol=1e-8)
        expected = np.stack([np.cos(times), 0 * times, 0 * times, np.sin(times)], axis=1)
        np.testing.assert_allclose(trajectory.orientations_quat_wxyz, expected, atol=1e-8)


@pytest.mark.parametrize("raw_images", [False, True])
def test_data_sets_hold_good_frames_with_their_own_state(tmp_path: Path, raw_images: bool) -> None:
    bag = write_flight(tmp_path / "flight.bag", raw_images=raw_images)
    out = tmp_path / "out"
    assert export(bag, "--format", "images", "-o", out) == 0
    labels = pd.read_csv(out / "flight" / "labels.csv")
    kept = [k for k in range(20) if k not in (3, 5)]
    times = [k * 0.2 + (1.0 if k >= 10 else 0.0) for k in kept]
    assert labels["stamp_ns"].tolist() == [stamp_ns(t) for t in times]
    np.testing.assert_allclose(labels["state_roll_deg"], [state_at(t)["roll_deg"] for t in times], atol=1e-12)
    assert labels["split"].tolist() == ["train" if t < 4.8 * 0.8 else "validation" for t in times]
    assert labels["mode"].tolist()[-1] == 2
    assert labels["failsafe"].dropna().tolist() == [1 if t >= 3.5 else 0 for t in times if t >= 0.5]
    assert len(pictures_in(out / "flight")) == 18
    for k, file in zip(kept, labels["file"]):
        image = cv2.imread(str(out / "flight" / file))
        error = np.abs(image.astype(int) - picture(k).astype(int)).mean()
        assert error == 0 if raw_images else error < 3
    record = json.loads((out / "manifest.json").read_text())["exports"]["imagefolder"]["flight"]
    assert record["counts"]["left_out"] == {"QUALITY_FROZEN": 1, "no frame_state of the same stamp": 1}
    assert (record["counts"]["images"], record["counts"]["exported"]) == (20, 18)

    assert export(bag, "--format", "images", "-o", tmp_path / "all", "--keep-bad-frames") == 0
    assert len(pictures_in(tmp_path / "all" / "flight")) == 19


def test_split_by_flight_keeps_flights_whole_and_is_seeded(tmp_path: Path) -> None:
    bags = [write_flight(tmp_path / f"f{k}.bag", 1.0, offset=10.0 * k) for k in range(4)]
    arguments = ["--format", "images", "--split-by", "flight", "--train-share", "0.5", "--seed", "3"]
    assert export(*bags, *arguments, "-o", tmp_path / "a", "--jobs", "2") == 0
    assert export(*reversed(bags), *arguments, "-o", tmp_path / "b", "--jobs", "1") == 0
    sides = [set(pd.read_csv(tmp_path / "a" / f"f{k}" / "labels.csv")["split"]) for k in range(4)]
    assert sorted(map(sorted, sides)) == [["train"], ["train"], ["validation"], ["validation"]]
    visible = lambda folder: {k: v for k, v in files_of(folder).items() if not k.startswith(".")}  # noqa: E731
    assert visible(tmp_path / "a") == visible(tmp_path / "b")


def test_a_flight_that_is_exported_again_alone_keeps_its_split(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bags = [write_flight(tmp_path / f"{name}.bag", 0.4, offset=10.0 * k) for k, name in enumerate("abcd")]
    arguments = ["--format", "imagefolder", "--split-by", "flight", "-o", tmp_path / "out", "--jobs", "1"]

    def trains() -> dict[str, bool]:
        records = json.loads((tmp_path / "out" / "manifest.json").read_text())["exports"]["imagefolder"]
        return {name: record["parameters"]["train_flight"] for name, record in records.items()}

    assert export(*bags[:3], *arguments) == 0
    drawn = {"a": True, "b": False, "c": True}
    assert trains() == drawn
    for bag in bags[:3]:
        assert export(bag, *arguments, "--keep-bad-frames") == 0
        assert trains() == drawn
    assert "the draw over" not in capsys.readouterr().err
    # A fourth flight draws anew: of flights that are not in the command the folder keeps the earlier draw.
    moved = f"b: the draw over all imagefolder flights of {tmp_path / 'out'} puts it into train; it was exported into"
    assert export(bags[3], *arguments) == 0
    assert trains() == {**drawn, "d": False}
    assert f"{moved} validation, and stays there: give all flights in one command\n" in capsys.readouterr().err
    assert export(*bags, *arguments) == 0
    assert trains() == {"a": True, "b": True, "c": True, "d": False}
    assert capsys.readouterr().err.count(f"{moved} validation\n") == 1


def test_an_interrupted_export_goes_on_and_verify_finds_what_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    first = write_flight(tmp_path / "f1.bag", 1.0)
    second = tmp_path / "f2.bag"
    second.write_bytes(first.read_bytes()[:5000])  # cut off
    out = tmp_path / "out"
    arguments = [first, second, "--format", "images", "-o", out]
    assert export(*arguments) == 1
    captured = capsys.readouterr()
    assert "f2: " in captured.err
    assert "rosbag reindex" in captured.err
    assert "1 of 2 flights exported" in captured.out
    made = (out / "f1" / "labels.csv").stat().st_mtime_ns
    write_flight(tmp_path / "whole.bag", 1.0).replace(second)
    assert export(*arguments) == 0
    assert (out / "f1" / "labels.csv").stat().st_mtime_ns == made, "a finished flight was made again"
    assert "(made earlier)" in capsys.readouterr().out
    assert export("--verify", "-o", out) == 0
    (out / "f1" / "images" / "train" / "000001.jpg").write_bytes(b"x")
    (out / "f2" / "images" / "train" / "000000.jpg").unlink()
    (out / "f2" / "stray").write_text("")
    capsys.readouterr()
    assert export("--verify", "-o", out) == 1
    lines = capsys.readouterr().out.split("\n")
    assert lines[:3] == [
        "changed: f1/images/train/000001.jpg",
        "missing: f2/images/train/000000.jpg",
        "not in the manifest: f2/stray",
    ]


def test_formats_share_a_folder_and_one_manifest(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    first = write_flight(tmp_path / "f1.bag", 1.0)
    second = write_flight(tmp_path / "f2.bag", 1.0, offset=5.0)
    out = tmp_path / "out"
    assert export(first, "--format", "csv", "-o", out) == 0
    table = (out / "f1.csv").read_bytes()
    assert export(first, "--format", "euroc", "-o", out) == 0
    assert export(first, "--format", "images", "-o", out) == 0
    assert export(second, "--format", "csv", "--rate", "10", "-o", out) == 0
    assert (out / "f1.csv").read_bytes() == table, "another format's file was overwritten"
    assert (out / "f1.euroc.csv").read_text().startswith("#timestamp [ns],p_RS_R_x")
    exports = json.loads((out / "manifest.json").read_text())["exports"]
    assert {form: sorted(flights) for form, flights in exports.items()} == {
        "csv": ["f1", "f2"],
        "euroc": ["f1"],
        "imagefolder": ["f1"],
    }
    assert [exports["csv"][name]["parameters"]["rate"] for name in ("f1", "f2")] == [None, 10.0]
    assert export("--verify", "-o", out) == 0
    (out / "f1.csv").write_bytes(table + b"1")
    (out / "f1.euroc.csv").unlink()
    capsys.readouterr()
    assert export("--verify", "-o", out) == 1
    assert capsys.readouterr().out.splitlines() == ["changed: f1.csv", "missing: f1.euroc.csv"]


def test_what_is_not_drawn_is_no_parameter(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bags = [write_flight(tmp_path / f"f{k}.bag", 0.4) for k in range(4)]
    out = tmp_path / "out"
    for given in (bags[:3], bags):
        capsys.readouterr()
        assert export(*given, "--format", "imagefolder", "-o", out) == 0
    assert capsys.readouterr().out.count("(made earlier)") == 3

    def parameters() -> set:
        records = json.loads((out / "manifest.json").read_text())["exports"]["imagefolder"].values()
        return set().union(*(record["parameters"] for record in records))

    always = {"cameras", "keep_bad", "split_by", "train_share"}
    assert parameters() == always
    assert export(*bags, "--format", "imagefolder", "--split-by", "flight", "-o", out) == 0
    assert parameters() == {*always, "seed", "train_flight"}


def test_a_flight_whose_name_ends_as_another_formats_files_does_not_take_them(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    other = write_flight(tmp_path / "flight.euroc.bag", 0.2, offset=5.0)
    folder = write_flight(tmp_path / "flight.csv.bag", 0.2, offset=9.0)
    out = tmp_path / "out"
    assert export(bag, "--format", "csv", "-o", out) == 0
    assert export(bag, "--format", "euroc", "-o", out) == 0
    before = files_of(out)
    for arguments, owner in (
        ([other, "--format", "csv"], "flight.euroc.csv belongs to the euroc export of flight"),
        ([folder, "--format", "images"], "flight.csv belongs to the csv export of flight"),
    ):
        capsys.readouterr()
        assert export(*arguments, "-o", out) == 1
        err = capsys.readouterr().err
        assert owner in err
        assert "-o" in err
    assert files_of(out) == before


def test_a_dask_cluster_gives_the_same_bytes(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    bags = [write_flight(tmp_path / f"f{k}.bag", 1.0, offset=10.0 * k) for k in range(3)]
    assert export(*bags, "--format", "images", "-o", tmp_path / "local", "--jobs", "2") == 0
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster:
        address = cluster.scheduler_address
        assert export(*bags, "--format", "images", "-o", tmp_path / "dask", "--scheduler", address) == 0
    local, dask = files_of(tmp_path / "local"), files_of(tmp_path / "dask")
    assert local == dask
    assert len(local) > 15


@pytest.mark.parametrize(("jobs", "start"), [(1, "fork"), (2, "fork"), (2, "spawn")])
def test_warnings_about_a_recording_are_said_once_wherever_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture, jobs: int, start: str
) -> None:
    pool = partial(ProcessPoolExecutor, mp_context=get_context(start))
    monkeypatch.setattr(campaign, "ProcessPoolExecutor", pool)
    bags = [cut_off(write_flight(tmp_path / f"f{k}.bag", 0.4)) for k in range(2)]
    assert export(*bags, "-o", tmp_path / "o", "--jobs", str(jobs)) == 0
    err = capfd.readouterr().err
    for bag in bags:
        assert err.count(f"{bag.name}: {bag}: the recording was cut off, or is still being recorded; read to ") == 1
    assert err.count("cut off") == 2


def test_a_worker_gives_the_warnings_of_its_flight(tmp_path: Path) -> None:
    bag = cut_off(write_flight(tmp_path / "f.bag", 0.4))
    job = Job("f", (str(bag),), str(tmp_path / "o"), "csv", None, (), Options(), True)
    (warning,) = campaign.export_flight(job).warnings
    assert warning.startswith(f"{bag}: the recording was cut off, or is still being recorded; ")
    assert campaign.export_flight(job._replace(bags=(str(write_flight(tmp_path / "g.bag", 0.4)),))).warnings == ()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["none.bag"], "No such file or directory"),
        (["a.bag", "./a.bag"], "is given twice"),
        (["a.bag", "--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler at tcp://127.0.0.1:1"),
        (["a.bag", "--topics", "engine"], "no topic /xplane/engine"),
        (["--verify", "-o", "nowhere"], "no readable manifest.json of this version; export first"),
        (["a.bag", "-o", "a.bag"], "a.bag: File exists; -o takes a folder that can be written"),
        (["a.bag", "-o", "a.bag/out"], "a.bag/out: Not a directory; -o takes a folder that can be written"),
        (["a.bag", "-o", "/proc/export"], "/proc/export: No such file or directory; -o takes"),
    ],
)
def test_errors_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, arguments: list, text: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_flight(tmp_path / "a.bag", 0.2)
    assert export(*arguments) == 1
    err = capsys.readouterr().err
    assert text in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--train-share", "0.8"], "--train-share is not for csv; it is for imagefolder, coco, yolo, lard"),
        (["--train-share", "0"], "--train-share is not for csv"),
        (["--split-by", "time", "--format", "tum"], "--split-by is not for tum; it is for imagefolder"),
        (["--seed", "0", "--format", "npz"], "--seed is not for npz; it is for imagefolder"),
        (["--keep-bad-frames", "--format", "mcap"], "--keep-bad-frames is not for mcap; it is for imagefolder"),
        (["--seed", "3", "--format", "coco"], "--seed 3: nothing is drawn without --split-by flight"),
        (["--seed", "3", "--split-by", "time", "--format", "coco"], "--seed 3: nothing is drawn without --split-by"),
    ],
)
def test_options_of_data_sets_are_refused_by_other_formats(
    options: list, text: str, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit):
        export("flight.bag", *options)
    assert text in capsys.readouterr().err


def test_bags_without_images_say_what_to_record(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with FlightBag(tmp_path / "a.bag") as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(0), bag.state(0, 0))
    assert export(tmp_path / "a.bag", "--format", "images", "-o", tmp_path / "o") == 1
    assert "record camera/image_raw/compressed" in capsys.readouterr().err


def test_flights_of_one_name_are_distinguished_by_their_folders(tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        (tmp_path / name).mkdir()
        write_flight(tmp_path / name / "flight.bag", 0.2)
    assert export(tmp_path / "monday" / "flight.bag", tmp_path / "tuesday" / "flight.bag", "-o", tmp_path / "o") == 0
    assert {p.name for p in (tmp_path / "o").glob("*.csv")} == {"monday_flight.csv", "tuesday_flight.csv"}


def test_the_launcher_runs() -> None:
    launcher = Path(__file__).parents[3] / "scripts" / "bag_export"
    run = subprocess.run([sys.executable, str(launcher), "--help"], capture_output=True, text=True, timeout=PROGRAM_S)
    assert run.returncode == 0, run.stderr
    assert "--scheduler" in run.stdout
