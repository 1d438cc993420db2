"""Flights as image folders: metadata for Hugging Face datasets, beside the labels that every program reads."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pandas as pd
import pytest

from support.flights.export_flight import export, pictures_in, write_flight
from support.flights.synthetic_flight import FlightBag, stamp_ns, state_at

if TYPE_CHECKING:
    from pathlib import Path

#: Images of `write_flight` that are good, and their times: 0.2 s apart, 1 s missing after 2 s.
KEPT = [k for k in range(20) if k not in (3, 5)]
TIMES = [k * 0.2 + (1.0 if k >= 10 else 0.0) for k in KEPT]


def metadata(flight: Path) -> pd.DataFrame:
    parts = [pd.read_parquet(flight / "images" / split / "metadata.parquet") for split in ("train", "validation")]
    return pd.concat(parts, ignore_index=True)


def test_metadata_has_what_is_known_of_each_picture(tmp_path: Path) -> None:
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "imagefolder", "-o", tmp_path) == 0
    rows = metadata(tmp_path / "flight")
    assert rows.columns[0] == "file_name"
    paths = [tmp_path / "flight" / "images" / split / name for split, name in zip(rows["split"], rows["file_name"])]
    assert paths == pictures_in(tmp_path / "flight")
    assert rows["split"].tolist() == ["train" if t < 4.8 * 0.8 else "validation" for t in TIMES]
    assert rows["stamp_ns"].tolist() == [stamp_ns(t) for t in TIMES]
    np.testing.assert_allclose(rows["state_roll_deg"], [state_at(t)["roll_deg"] for t in TIMES], atol=1e-12)
    four, six = KEPT.index(4), KEPT.index(6)
    assert not rows["quality_pose_unsure"].any()
    np.testing.assert_allclose(rows["body_to_camera_translation_x"], [0.1 * k for k in KEPT], atol=1e-12)
    assert rows["body_to_camera_rotation_w"].tolist() == [-0.5] * len(KEPT)
    assert rows["quality_words"].tolist() == ["interpolated, delay assumed" if k == four else "" for k in range(18)]
    assert rows.index[rows["quality_interpolated"]].tolist() == [four]
    assert not rows["quality_frozen"].any()
    assert rows["display_delay_s"].tolist() == [0.0 if k == 4 else 0.058 for k in KEPT]
    assert rows["display_delay_source"].tolist() == ["assumed" if k == 4 else "set" for k in KEPT]
    matrix = rows[[f"camera_matrix_{k}" for k in range(9)]].to_numpy()
    expected = np.array([[30 + k, 0, 16, 0, 31, 12, 0, 0, 1] if k != 6 else [np.nan] * 9 for k in KEPT])
    np.testing.assert_array_equal(matrix, expected)
    assert rows.index[rows["camera_width_px"].isna()].tolist() == [six]
    assert rows["camera_height_px"].dropna().unique().tolist() == [24]


def test_mode_and_failures_are_those_of_the_frame_shown(tmp_path: Path) -> None:
    _, jpg = cv2.imencode(".jpg", np.zeros((24, 32, 3), np.uint8))
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(20):
            t, shown = k / 10, stamp_ns(k / 10 + 0.25)
            state = bag.state(t, k)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
            header = bag.header(shown, "camera_optical")
            frame = {"header": header, "display_delay": 0.25, "frame_sim_time": t}
            frame.update({"state": state} if k % 2 else {"quality": 1})  # every other one has no state
            bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", shown, frame)
            values = {"header": header, "format": "jpeg", "data": jpg.reshape(-1)}
            bag.add("/xplane/camera/image_raw/compressed", "sensor_msgs/CompressedImage", shown, values)
        at = stamp_ns(0.95)
        lists = {"names": ["engine_1"], "kinds": ["failed"], "values": [np.nan], "active": [True]}
        header = bag.header(at, "")
        bag.add("/xplane/failures/state", "xplane_bridge/FailureState", at, {"header": header, **lists})
        bag.add("/xplane/control/mode", "xplane_bridge/ControlMode", at, {"header": header, "mode": 2})
    options = ("--format", "imagefolder", "--keep-bad-frames", "-o", tmp_path)
    assert export(tmp_path / "flight.bag", *options) == 0
    rows = pd.read_csv(tmp_path / "flight" / "labels.csv")
    for name, value in (("failures", "engine_1:failed"), ("mode", 2)):
        assert rows[name].dropna().unique().tolist() == [value]
        assert rows["frame_sim_time_s"][rows[name].notna()].min() == 1.0, "0.9 s and earlier are before it"


def test_labels_csv_has_the_same_rows(tmp_path: Path) -> None:
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "imagefolder", "-o", tmp_path) == 0
    labels, rows = pd.read_csv(tmp_path / "flight" / "labels.csv"), metadata(tmp_path / "flight")
    assert list(labels.columns[1:]) == list(rows.columns[1:])
    assert labels["file"].tolist() == [f"images/{s}/{name}" for s, name in zip(rows["split"], rows["file_name"])]
    assert labels["quality_words"].fillna("").tolist() == rows["quality_words"].tolist()
    np.testing.assert_array_equal(labels["camera_matrix_0"], rows["camera_matrix_0"])


def test_a_flight_without_modes_failures_and_camera_info_has_the_same_types(tmp_path: Path) -> None:
    write_flight(tmp_path / "flight.bag", 2.0)
    with FlightBag(tmp_path / "bare.bag") as bag:
        for k in range(5):
            ns = stamp_ns(100.0 + k)
            header = bag.header(ns, "camera")
            frame = {"header": header, "state": bag.state(100.0 + k, k)}
            bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", ns, frame)
            pixels = {"height": 2, "width": 2, "encoding": "mono8", "step": 2, "data": [0, 1, 2, 3]}
            bag.add("/xplane/camera/image_raw", "sensor_msgs/Image", ns, {"header": header, **pixels})
    bags = [tmp_path / "flight.bag", tmp_path / "bare.bag"]
    assert export(*bags, "--format", "imagefolder", "-o", tmp_path) == 0
    full, bare = metadata(tmp_path / "flight"), metadata(tmp_path / "bare")
    assert full.dtypes.equals(bare.dtypes)
    assert bare[["mode", "failsafe", "failures", "excitation", "camera_width_px"]].isna().all(axis=None)


def test_hugging_face_datasets_loads_pictures_states_and_splits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("datasets", reason="Hugging Face datasets is not installed")
    bags = [write_flight(tmp_path / f"f{k}.bag", 2.0, offset=10.0 * k) for k in range(3)]
    out = tmp_path / "data"
    options = ["--split-by", "flight", "--train-share", "0.7"]
    assert export(*bags, "--format", "imagefolder", *options, "-o", out) == 0
    loaded = datasets.load_dataset("imagefolder", data_dir=str(out), cache_dir=str(tmp_path / "cache"))
    manifest = json.loads((out / "manifest.json").read_text())["exports"]["imagefolder"]
    for split in ("train", "validation"):
        assert len(loaded[split]) == sum(record["counts"][split] for record in manifest.values()) > 0
    assert len(loaded["train"]) == 2 * len(loaded["validation"])
    row = loaded["validation"][0]
    assert row["image"].size == (32, 24)
    t = row["stamp_ns"] / 1e9 - stamp_ns(0) / 1e9
    assert row["state_roll_deg"] == pytest.approx(state_at(t)["roll_deg"], abs=1e-4)


def test_an_export_of_an_earlier_version_is_made_anew(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag", 1.0)
    out = tmp_path / "out"
    assert export(bag, "--format", "images", "-o", out) == 0
    # As it was: the record below the old name, pictures without folders of splits.
    (out / ".flights" / "imagefolder").rename(out / ".flights" / "images")
    (out / "flight" / "images" / "000000.jpg").write_bytes(b"")
    assert export(bag, "--format", "imagefolder", "-o", out) == 0
    assert export("--verify", "-o", out) == 0
    assert list(json.loads((out / "manifest.json").read_text())["exports"]) == ["imagefolder"]
