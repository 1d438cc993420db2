"""A flight with two cameras: labelled, drawn and exported each by its own pose and optics."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest

from support.flights.drawn_approach import BELLY, FORWARD, add_picture, frame_state, scene, write_approach
from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.white_lines import airport_file, flight_of, measure_flight
from xplane_bridge.bags import Bags
from xplane_bridge.cli import flight_report
from xplane_bridge.cli.sight import label_images
from xplane_bridge.constants import ImageQuality
from xplane_bridge.labels import table

if TYPE_CHECKING:
    from pathlib import Path

FRAMES = 8
AIRPORT = ["--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]
#: Focal lengths [px] by camera: 320 / tan(30 deg), 320 / tan(40 deg).
FOCAL = {"camera": 554.256, "belly": 381.361}


@pytest.fixture(scope="module", name="flight")
def fixture_flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag whose pictures of two cameras have the same stamps, with its labels beside it."""
    path = write_approach(tmp_path_factory.mktemp("flight") / "flight.bag", FRAMES, views=(FORWARD, BELLY))
    assert label_images.main([str(path), *AIRPORT]) == 0
    return path


def exported(flight: Path, form: str, output: Path, *options: str) -> Path:
    assert export(flight, "--format", form, "--labels", table.beside(flight), "-o", output, *options) == 0
    return output / (f"flight.{form}" if form != "imagefolder" else "flight")


def test_white_lines_of_each_camera_lie_where_its_labels_say(tmp_path: Path) -> None:
    with Bags(write_approach(tmp_path / "flight.bag", 28, views=(FORWARD, BELLY))) as bags:
        flight = flight_of(bags)
        for camera in ("camera", "belly"):
            lines = measure_flight(bags, flight, camera=camera)
            assert len(lines.error) > 50, camera
            assert np.median(np.abs(lines.error)) <= 0.2, camera


def test_all_cameras_are_labelled_or_those_that_are_chosen(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = table.read(table.beside(flight))
    assert labels.cameras == labels.about["cameras"] == ["camera", "belly"]
    assert len(labels.frames) == 2 * FRAMES
    sizes = {camera: (frame["width"], frame["height"]) for (camera, _), frame in labels.frames.items()}
    assert sizes == {"camera": (640, 480), "belly": (640, 360)}
    capsys.readouterr()
    output = tmp_path / "l.jsonl"
    assert label_images.main([str(flight), *AIRPORT, "--camera", "belly", "-o", str(output)]) == 0
    assert "of cameras" not in capsys.readouterr().out
    only = table.read(output)
    assert only.cameras == ["belly"]
    assert only.frames == {key: frame for key, frame in labels.frames.items() if key[0] == "belly"}
    assert label_images.main([str(flight), *AIRPORT, "-o", str(output)]) == 0
    assert f"of cameras: camera {FRAMES}, belly {FRAMES}" in capsys.readouterr().out
    assert label_images.main([str(flight), *AIRPORT, "--camera", "tail", "-o", str(tmp_path / "none")]) == 1
    assert "no camera tail; expected some of: camera, belly" in capsys.readouterr().err


def runway(frame: dict) -> dict[str, Any]:
    return next((thing for thing in frame["objects"] if thing["kind"] == "runway"), {})


def test_what_a_picture_shows_is_what_its_frame_state_says(tmp_path: Path) -> None:
    """By hand: rows 60 to 419 of 480 show the world, so that nothing visible lies above -0.5 + 60 or below 419.5."""
    flight = tmp_path / "flight.bag"
    bars = {"picture_x": 0, "picture_y": 60, "picture_width": 640, "picture_height": 360}
    with FlightBag(flight) as bag:
        for k, shows in enumerate(({}, bars)):
            frame = frame_state(bag, scene(25.0), stamp_ns(k), **shows)
            add_picture(bag, FORWARD, np.zeros((2, 2, 3), np.uint8), frame)
    assert label_images.main([str(flight), *AIRPORT]) == 0
    whole, boxed = table.read(table.beside(flight)).frames.values()
    assert (whole["picture"], boxed["picture"]) == ([0, 0, 0, 0], [0, 60, 640, 360])
    assert runway(whole)["box"][3] > 419.5, "near the threshold it reaches below"
    assert runway(boxed)["box"][3] == pytest.approx(419.5)
    folder = exported(flight, "coco", tmp_path / "coco", "--train-share", "1")
    content = json.loads((folder / "annotations" / "train.json").read_text())
    assert [image["picture"] for image in content["images"]] == [[0, 0, 0, 0], [0, 60, 640, 360]]


def test_coco_has_each_cameras_pictures_with_its_own_matrix_pose_and_runway(flight: Path, tmp_path: Path) -> None:
    folder = exported(flight, "coco", tmp_path)
    frames = table.read(table.beside(flight)).frames
    seen = []
    for split in ("train", "validation"):
        content = json.loads((folder / "annotations" / f"{split}.json").read_text())
        boxes = {note["image_id"]: note["bbox"] for note in content["annotations"] if note["category_id"] == 1}
        for image in content["images"]:
            camera = image["camera"]
            seen.append((camera, image["stamp_ns"]))
            assert image["file_name"].startswith(f"{camera}_")
            assert (folder / "images" / split / image["file_name"]).is_file()
            assert image["camera_matrix"][0] == pytest.approx(FOCAL[camera], abs=1e-3)
            view = BELLY if camera == "belly" else FORWARD
            assert image["body_to_camera"]["rotation_xyzw"] == pytest.approx(view.rotation)
            label = runway(frames[camera, image["stamp_ns"]])
            assert (image["id"] in boxes) == bool(label)
            if label:
                left, top, right, bottom = label["box"]
                assert boxes[image["id"]] == pytest.approx(
                    [left + 0.5, top + 0.5, right - left, bottom - top], abs=2e-3
                )
    assert sorted(seen) == sorted(frames)


def test_one_instant_splits_all_cameras_also_when_one_is_exported(flight: Path, tmp_path: Path) -> None:
    rows = pd.read_csv(exported(flight, "yolo", tmp_path / "both") / "frames.csv")
    card = (tmp_path / "both" / "README.md").read_text(encoding="utf-8")
    for camera in ("camera", "belly"):
        assert f"| flight, camera {camera} | {FRAMES} | {FRAMES} | nothing |" in card
    splits = rows.groupby("stamp_ns")["split"].nunique()
    assert len(rows) == 2 * FRAMES
    assert (splits == 1).all()
    only = pd.read_csv(exported(flight, "yolo", tmp_path / "one", "--camera", "belly") / "frames.csv")
    assert (only["camera"] == "belly").all()
    assert only["file"].str.match(r"images/\w+/\d{6}\.jpg").all(), "a camera alone has names as ever"
    assert only["split"].tolist() == rows.loc[rows["camera"] == "belly", "split"].tolist()
    manifest = json.loads((tmp_path / "one" / "manifest.json").read_text())["exports"]["yolo"]["flight"]
    assert manifest["parameters"]["cameras"] == ["belly"]
    assert manifest["quality"]["frames"] == FRAMES
    assert export("--verify", "-o", tmp_path / "one") == 0


def test_a_frame_that_two_cameras_show_at_different_times_is_in_one_split(tmp_path: Path) -> None:
    flight = tmp_path / "flight.bag"
    with FlightBag(flight) as bag:
        for k in range(60):
            t = k / 30.0
            for view, delay in ((FORWARD, 0.045), (BELLY, 0.085)):
                frame = frame_state(bag, scene(t), stamp_ns(t + delay), display_delay=delay)
                if k % 7 == 3:  # no state was paired, or the simulator stood: what is known is when it was shown
                    frame.update(state={}, quality=int(ImageQuality.STATE_MISSING), frame_sim_time=math.nan)
                add_picture(bag, view, np.zeros((2, 2, 3), np.uint8), frame)
    assert export(flight, "--format", "imagefolder", "--keep-bad-frames", "-o", tmp_path) == 0
    rows = pd.read_csv(tmp_path / "flight" / "labels.csv")
    assert len(rows) == 120
    for camera in ("camera", "belly"):  # each has its 48 first frames, of 60
        own = rows[rows["camera"] == camera].sort_values("stamp_ns")
        assert own["split"].tolist() == ["train"] * 48 + ["validation"] * 12, camera


def test_yolo_is_read_by_supervision(flight: Path, tmp_path: Path) -> None:
    supervision = pytest.importorskip("supervision", reason="supervision needs Python 3.10")
    folder = exported(flight, "yolo", tmp_path)
    pictures = 0
    for split in ("train", "validation"):
        data = supervision.DetectionDataset.from_yolo(
            str(folder / "images" / split), str(folder / "labels" / split), str(folder / "data.yaml")
        )
        pictures += len(data)
    assert pictures == 2 * FRAMES


def test_lard_names_the_camera_of_each_row(flight: Path, tmp_path: Path) -> None:
    folder = exported(flight, "lard", tmp_path)
    rows = pd.concat([pd.read_csv(folder / f"{split}.csv", sep=";") for split in ("train", "validation")])
    frames = table.read(table.beside(flight)).frames
    assert set(rows["camera"]) == {"camera", "belly"}
    for _, row in rows.iterrows():
        points = runway(frames[row["camera"], row["stamp_ns"]])["points"]
        if points["TL"]["u"] is not None:
            assert row["x_TL"] == pytest.approx(points["TL"]["u"] + 0.5, abs=1e-3)
        assert (folder / row["image"]).is_file()


def test_an_image_folder_is_loaded_with_the_pictures_of_both(
    flight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("datasets", reason="Hugging Face datasets is not installed")
    exported(flight, "imagefolder", tmp_path / "data")
    loaded = datasets.load_dataset("imagefolder", data_dir=str(tmp_path / "data"), cache_dir=str(tmp_path / "cache"))
    rows = [row for split in ("train", "validation") for row in loaded[split]]
    assert len(rows) == 2 * FRAMES
    frames = table.read(table.beside(flight)).frames
    for row in rows:
        assert row["image"].size == ((640, 360) if row["camera"] == "belly" else (640, 480))
        assert row["camera_matrix_0"] == pytest.approx(FOCAL[row["camera"]], abs=1e-3)
        assert json.loads(row["labels_json"]) == frames[row["camera"], row["stamp_ns"]]["objects"]


def test_the_report_shows_each_camera_with_its_own_labels(flight: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    assert flight_report.main([str(flight), "--labels", str(table.beside(flight)), "-o", str(page)]) == 0
    section = page.read_text(encoding="utf-8").split('<section id="labels">')[1].split("</section>")[0]
    first, second = section.split("<h3>Camera ")[1:]
    assert first.startswith("camera<")
    assert second.startswith("belly<")
    labels = table.read(table.beside(flight)).frames
    for part, name in ((first, "camera"), (second, "belly")):
        with_runway = sum(bool(runway(frame)) for (camera, _), frame in labels.items() if camera == name)
        assert part.count('alt="picture with labels"') == with_runway > 0


def test_a_camera_without_pictures_or_camera_info_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = write_approach(tmp_path / "whole.bag", 2, views=(FORWARD, BELLY))
    for lost, words in (
        ("camera_info", "no /xplane/belly/camera/camera_info; record it"),
        ("image_raw/compressed", "no images of camera belly; record /xplane/belly/camera/image_raw/compressed"),
    ):
        path = tmp_path / f"without_{lost.split('/')[0]}.bag"
        with Bags(whole) as bags, FlightBag(path) as bag:
            for topic, time, raw in bags.recorded():
                if topic.topic != f"/xplane/belly/camera/{lost}":
                    bag.add_recorded(topic, time, raw)
        program = label_images.main if lost == "camera_info" else None
        ended = (
            program([str(path), *AIRPORT]) if program else export(path, "--format", "coco", "-o", tmp_path / lost[:5])
        )
        assert ended == 1
        said = capsys.readouterr().err
        assert words in said
        assert "--camera" in said
        only = ["--camera", "camera"]
        if program:
            assert program([str(path), *AIRPORT, *only]) == 0
        else:
            assert export(path, "--format", "coco", "-o", tmp_path / lost[:5], *only) == 0
