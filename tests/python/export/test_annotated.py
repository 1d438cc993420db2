"""Labelled data sets, each loaded by a library of its own: boxes, outlines and corners are those of the labels."""

from __future__ import annotations

import json
import shutil
import uuid
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
import yaml

from support.flights.drawn_approach import BELLY, FORWARD, LEVER, scene, write_approach
from support.flights.export_flight import export, write_flight
from support.flights.synthetic_flight import stamp_ns
from support.white_lines import airport_file
from xplane_bridge.cli.sight import label_images
from xplane_bridge.labels import table

if TYPE_CHECKING:
    from pathlib import Path

FRAMES = 6
FORMATS = ("coco", "yolo", "lard")


@pytest.fixture(scope="module", name="flight")
def fixture_flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag with its labels beside it; the last picture shows the sun too."""
    path = write_approach(tmp_path_factory.mktemp("flight") / "flight.bag", FRAMES)
    assert label_images.main([str(path), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]) == 0
    return path


def labelled(flight: Path, form: str, output: Path, *options: object) -> Path:
    assert export(flight, "--format", form, "--labels", table.beside(flight), "-o", output, *options) == 0
    return output / (f"flight.{form}" if form != "imagefolder" else "flight")


def runways(flight: Path) -> list[dict[str, Any]]:
    frames = table.read(table.beside(flight)).frames.values()
    return [next(thing for thing in frame["objects"] if thing["kind"] == "runway") for frame in frames]


def test_coco_is_read_by_pycocotools(flight: Path, tmp_path: Path) -> None:
    coco = pytest.importorskip("pycocotools.coco", reason="pycocotools is not installed")
    folder = labelled(flight, "coco", tmp_path)
    expected = runways(flight)
    seen = 0
    for split in ("train", "validation"):
        data = coco.COCO(str(folder / "annotations" / f"{split}.json"))
        (category,) = data.loadCats(data.getCatIds(catNms=["runway"]))
        assert category["keypoints"][:4] == ["TL", "TR", "BR", "BL"]
        for image in data.loadImgs(data.getImgIds()):
            assert (folder / "images" / split / image["file_name"]).is_file()
            label = expected[image["id"] - 1]
            (note,) = data.loadAnns(data.getAnnIds(imgIds=image["id"], catIds=[category["id"]]))
            left, top, right, bottom = label["box"]
            assert note["bbox"] == pytest.approx([left + 0.5, top + 0.5, right - left, bottom - top], abs=2e-3)
            assert data.annToMask(note).sum() == pytest.approx(note["area"], rel=0.1, abs=8.0)
            points = np.array(note["keypoints"]).reshape(-1, 3)
            for name, point in zip(category["keypoints"], points):
                known = label["points"][name]
                if known["state"] == "visible":
                    assert tuple(point) == pytest.approx((known["u"] + 0.5, known["v"] + 0.5, 2), abs=2e-3)
                else:
                    assert tuple(point) == (0, 0, 0)
            assert note["num_keypoints"] == sum(points[:, 2] > 0)
            assert note["sigma_px"] == label["sigma_px"]
            assert len(note["keypoint_sigmas_px"]) == len(points)
            assert image["camera_matrix"][0] == pytest.approx(554.256, abs=1e-3)
            assert image["body_to_camera"]["translation_m"] == pytest.approx([LEVER[0], -LEVER[1], -LEVER[2]])
            assert image["body_to_camera"]["uncertainty_deg"] == pytest.approx(0.002, abs=1e-6)
            assert (image["display_delay_s"], image["display_delay_source"]) == (0.058, "set")
            assert image["horizon"]["level"][0][0][0] == pytest.approx(0.0, abs=1e-2)
            seen += 1
    assert seen == FRAMES
    content = json.loads((folder / "annotations" / "train.json").read_text())
    assert content["info"]["labels"]["airport"] == "XEMU"
    ids = [note["id"] for note in content["annotations"]]
    assert len(ids) == len(set(ids))


def test_coco_and_yolo_are_read_by_supervision_alike(flight: Path, tmp_path: Path) -> None:
    supervision = pytest.importorskip("supervision", reason="supervision needs Python 3.10")
    coco, yolo = (labelled(flight, form, tmp_path) for form in ("coco", "yolo"))
    boxes = {}
    for split in ("train", "validation"):
        read = {
            "coco": supervision.DetectionDataset.from_coco(
                str(coco / "images" / split), str(coco / "annotations" / f"{split}.json")
            ),
            "yolo": supervision.DetectionDataset.from_yolo(
                str(yolo / "images" / split), str(yolo / "labels" / split), str(yolo / "data.yaml")
            ),
        }
        assert read["yolo"].classes == ["runway", "sun", "aircraft"]
        for form, data in read.items():
            for path, _, found in data:
                name = path.rsplit("/", 1)[1]
                names = [data.classes[int(k)] for k in found.class_id]
                boxes[form, name] = found.xyxy[names.index("runway")]
    assert len(boxes) == 2 * FRAMES
    for k, label in enumerate(runways(flight)):
        name = f"{k:06d}.jpg"
        np.testing.assert_allclose(boxes["coco", name], np.array(label["box"]) + 0.5, atol=0.01)
        np.testing.assert_allclose(boxes["yolo", name], np.array(label["box"]) + 0.5, atol=1.01)  # whole pixels there
    sigmas = pd.read_csv(yolo / "sigmas.csv")
    assert sigmas.loc[sigmas["class"] == "runway", "sigma_px"].tolist() == [
        label["sigma_px"] for label in runways(flight)
    ]


def test_yolos_text_is_shares_of_the_picture(flight: Path, tmp_path: Path) -> None:
    folder = labelled(flight, "yolo", tmp_path)
    for k, label in enumerate(runways(flight)):
        (path,) = folder.glob(f"labels/*/{k:06d}.txt")
        kind, *shares = path.read_text().splitlines()[0].split()
        assert kind == "0"
        outline = np.array(shares, float).reshape(-1, 2) * (640, 480) - 0.5
        np.testing.assert_allclose(outline, label["polygon"], atol=2e-3)


@pytest.mark.parametrize("form", ["csv", "yolo"])
def test_whole_flights_train_and_validate_by_one_yaml(flight: Path, tmp_path: Path, form: str) -> None:
    bags = [tmp_path / f"{day}.bag" for day in ("monday", "to: 'tuesday'")]
    for bag in bags:
        shutil.copy(flight, bag)
        shutil.copy(table.beside(flight), table.beside(bag))
    output = tmp_path / "out"
    options = ("--labels", tmp_path, "--split-by", "flight") if form == "yolo" else ()
    assert export(*bags, "--format", form, *options, "-o", output) == 0
    assert (output / "data.yaml").exists() == (form == "yolo")
    assert export("--verify", "-o", output) == 0
    named = []
    for path in output.rglob("data.yaml"):
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert content["names"] == {0: "runway", 1: "sun", 2: "aircraft"}
        folders = [content[split] for split in ("train", "val") if split in content]
        assert all(any((path.parent / folder).iterdir()) for folder in folders), "a trainer ends at one that is missing"
        named.append(len(folders))
    assert sorted(named) == ([1, 1, 2] if form == "yolo" else [])


def test_one_yaml_has_the_pictures_of_all_flights(flight: Path, tmp_path: Path) -> None:
    for name in ("b", "a"):
        bag = shutil.copy(flight, tmp_path / f"{name}.bag")
        labels = ("--labels", table.beside(flight))
        assert export(bag, "--format", "yolo", *labels, "-o", tmp_path / "out") == 0
    content = yaml.safe_load((tmp_path / "out" / "data.yaml").read_text())
    assert content["train"] == ["a.yolo/images/train", "b.yolo/images/train"]
    assert content["val"] == ["a.yolo/images/validation", "b.yolo/images/validation"]


def test_lard_is_read_by_its_columns(flight: Path, tmp_path: Path) -> None:
    folder = labelled(flight, "lard", tmp_path)
    parts = [pd.read_csv(folder / f"{split}.csv", sep=";") for split in ("train", "validation")]
    rows = pd.concat(parts, ignore_index=True)
    assert len(rows) == FRAMES
    assert (rows["airport"] == "XEMU").all()
    assert all((folder / name).is_file() for name in rows["image"])
    for (_, row), label in zip(rows.iterrows(), runways(flight)):
        for corner in ("TR", "TL", "BL", "BR"):
            point = label["points"][corner]
            if point["u"] is not None:
                assert (row[f"x_{corner}"], row[f"y_{corner}"]) == pytest.approx((point["u"] + 0.5, point["v"] + 0.5))
        assert row["runway"] == 15
        assert row["slant_distance"] * 1852.0 == pytest.approx(label["slant_distance_m"])
    first = rows.iloc[0]
    # At t = 0 the camera is 1.2 m ahead of 900 m before the threshold, at 3 degrees to 300 m behind it.
    assert first["along_track_distance"] * 1852.0 == pytest.approx(898.8, abs=0.2)
    assert first["height_above_runway"] * 0.3048 == pytest.approx(1200.0 * np.tan(np.radians(3.0)) + 0.56, abs=0.05)
    assert (first["yaw"], first["pitch"], first["roll"]) == pytest.approx((155.5, 88.0, 0.0), abs=1e-6)
    shown = scene(0.0)
    ahead, right, down = LEVER  # of an aircraft that is level but for its nose, 0.5 degrees down, and flies to 155.5
    pitch, heading = np.radians((-0.5 - 1.5, 155.5))
    level = ahead * np.cos(pitch) + down * np.sin(pitch)
    north, east = level * np.cos(heading) - right * np.sin(heading), level * np.sin(heading) + right * np.cos(heading)
    metres = 6378145.0 * np.pi / 180.0
    assert (first["lat_cam"] - shown.latitude_deg) * metres == pytest.approx(north, abs=1e-3)
    across = metres * np.cos(np.radians(shown.latitude_deg))
    assert (first["lon_cam"] - shown.longitude_deg) * across == pytest.approx(east, abs=1e-3)
    above = ahead * np.sin(pitch) - down * np.cos(pitch)
    assert first["alt_cam"] - shown.altitude_m == pytest.approx(above, abs=1e-6)
    assert first["lateral_path_angle"] == pytest.approx(np.degrees(np.arctan2(-0.3, 898.8)), abs=0.02)


def test_lard_has_the_columns_of_its_version_2(flight: Path, tmp_path: Path) -> None:
    folder = labelled(flight, "lard", tmp_path)
    rows = pd.read_csv(folder / "train.csv", sep=";")
    theirs = (
        "uuid image height width type original_dataset scenario airport runway time_to_landing weather night time "
        "lat_cam lon_cam alt_cam yaw pitch roll slant_distance along_track_distance height_above_runway "
        "lateral_path_angle vertical_path_angle watermark_height runway_in_cone "
        "x_TR y_TR x_TL y_TL x_BL y_BL x_BR y_BR "
    )
    assert " ".join(rows).startswith(theirs)
    assert rows["watermark_height"].isna().all(), "its tools crop to [0:-0], which is nothing"
    assert (rows["runway_in_cone"] == "UNKNOWN").all()
    assert len({uuid.UUID(text) for text in rows["uuid"]}) == len(rows)


def test_an_image_folder_takes_labels_too(flight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("datasets", reason="Hugging Face datasets is not installed")
    labelled(flight, "imagefolder", tmp_path / "data")
    loaded = datasets.load_dataset("imagefolder", data_dir=str(tmp_path / "data"), cache_dir=str(tmp_path / "cache"))
    rows = [row for split in ("train", "validation") for row in loaded[split]]
    assert len(rows) == FRAMES
    for row, label in zip(sorted(rows, key=lambda row: row["stamp_ns"]), runways(flight)):
        (k,) = (k for k, name in enumerate(row["objects"]["category"]) if name == "runway")
        left, top, right, bottom = label["box"]
        assert row["objects"]["bbox"][k] == pytest.approx([left + 0.5, top + 0.5, right - left, bottom - top])
        assert json.loads(row["labels_json"])[0]["points"] == label["points"]


def gapped(flight: Path, path: Path) -> Path:
    """The labels of a flight, less the second picture's; of the third, other aircraft are known."""
    lines = table.beside(flight).read_text().splitlines()
    content = json.loads(lines[3])
    lines[3] = json.dumps({**content, "others_known": True})
    path.write_text("".join(f"{line}\n" for line in (lines[0], lines[1], *lines[3:])))
    return path


def test_yolo_leaves_out_what_could_not_be_labelled(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = gapped(flight, tmp_path / "x.jsonl")
    assert export(flight, "--format", "yolo", "--labels", labels, "-o", tmp_path / "out") == 0
    assert "left out: 1 no labels" in capsys.readouterr().out
    folder = tmp_path / "out" / "flight.yolo"
    frames = pd.read_csv(folder / "frames.csv")
    assert frames["stamp_ns"].tolist() == [stamp_ns(0.5 * k) for k in range(FRAMES) if k != 1]
    assert frames["labelled"].tolist() == [1] * (FRAMES - 1)
    assert frames["others_known"].tolist() == [0, 1, 0, 0, 0]
    pictures, texts = (
        {path.relative_to(folder / part).with_suffix("") for path in (folder / part).rglob("*.*")}
        for part in ("images", "labels")
    )
    assert pictures == texts
    assert len(pictures) == FRAMES - 1
    record = json.loads((tmp_path / "out" / "manifest.json").read_text())["exports"]["yolo"]["flight"]
    assert record["counts"]["left_out"] == {"no labels": 1}
    assert "no labels 1" in (tmp_path / "out" / "README.md").read_text()


@pytest.mark.parametrize("form", ["coco", "lard", "imagefolder"])
def test_what_is_labelled_is_said_of_each_picture(flight: Path, tmp_path: Path, form: str) -> None:
    labels = gapped(flight, tmp_path / "x.jsonl")
    assert export(flight, "--format", form, "--labels", labels, "-o", tmp_path / "out") == 0
    folder = tmp_path / "out" / ("flight" if form == "imagefolder" else f"flight.{form}")
    tables = [pd.read_csv(folder / ("labels.csv" if form == "imagefolder" else "frames.csv"))]
    if form == "imagefolder":
        parts = [pd.read_parquet(folder / "images" / split / "metadata.parquet") for split in ("train", "validation")]
        tables.append(pd.concat(parts))
        assert {str(tables[1][name].dtype) for name in ("labelled", "others_known")} == {"bool"}
    for rows in tables:
        assert rows["labelled"].astype(int).tolist() == [1, 0, 1, 1, 1, 1]
        assert rows["others_known"].astype(int).tolist() == [0, 0, 1, 0, 0, 0]


@pytest.mark.parametrize("form", FORMATS)
def test_without_labels_there_are_none_and_that_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    assert export(write_flight(tmp_path / "flight.bag", 2.0), "--format", form, "-o", tmp_path / "out") == 0
    out = capsys.readouterr()
    assert f"no labels are exported: {form} gets them by --labels, label_images makes them" in out.err
    assert "0 labelled" in out.out
    assert "no pictures are labelled" in (tmp_path / "out" / "README.md").read_text()
    folder = tmp_path / "out" / f"flight.{form}"
    if form == "coco":
        content = json.loads((folder / "annotations" / "train.json").read_text())
        assert len(content["images"]) == 6
        assert content["annotations"] == []
        assert content["info"]["labels"] == "none"
        assert content["images"][0]["labelled"] is False
    elif form == "yolo":
        assert not (folder / "labels").exists()
        assert 'labels: "none"' in (folder / "data.yaml").read_text()
    else:
        assert len(pd.read_csv(folder / "train.csv", sep=";")) == 0
    frames = pd.read_csv(folder / "frames.csv")
    assert not {"labelled", "others_known"} & set(frames)
    assert frames["display_delay_s"].tolist() == [0.058] * 3 + [0.0] + [0.058] * 4
    assert {"camera_matrix_0", "body_to_camera_rotation_w", "display_delay_source", "quality_words"} <= set(frames)
    assert export("--verify", "-o", tmp_path / "out") == 0


def test_the_card_and_the_manifest_name_the_labels(flight: Path, tmp_path: Path) -> None:
    labelled(flight, "coco", tmp_path)
    record = json.loads((tmp_path / "manifest.json").read_text())["exports"]["coco"]["flight"]
    assert record["counts"]["labelled"] == FRAMES
    assert record["counts"]["objects"]["runway"] == FRAMES
    assert record["parameters"]["labels_sha256"] == table.digest(table.beside(flight))
    card = (tmp_path / "README.md").read_text()
    assert f"| flight | {FRAMES} of {FRAMES} |" in card
    assert export("--verify", "-o", tmp_path) == 0


def test_new_labels_make_the_export_anew(flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    labels = tmp_path / "x.jsonl"
    labels.write_bytes(table.beside(flight).read_bytes())
    arguments = (flight, "--format", "yolo", "--labels", labels, "-o", tmp_path / "out")
    assert export(*arguments) == 0
    assert export(*arguments) == 0
    assert "made earlier" in capsys.readouterr().out
    labels.write_text(labels.read_text().replace('"sigma_px":', '"sigma_px": '))
    assert export(*arguments) == 0
    assert "made earlier" not in capsys.readouterr().out


def test_labels_that_do_not_fit_are_refused(flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = write_flight(tmp_path / "other.bag", 2.0, offset=100.0)
    labels = table.beside(flight)
    for form in ("coco", "yolo"):
        assert export(other, "--format", form, "--labels", labels, "-o", tmp_path / "a") == 1
        assert "labels of another recording, made from flight.bag; expected those of" in capsys.readouterr().err
    bags = tmp_path / "cameras.bag"
    write_approach(bags, 1, views=(FORWARD, BELLY))
    given = [str(bags), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world", "--camera", "belly"]
    assert label_images.main(given) == 0
    options = ("--labels", table.beside(bags), "--camera", "camera", "-o", tmp_path / "a")
    assert export(bags, "--format", "coco", *options) == 1
    assert "labels none of these pictures: it is of cameras.bag" in capsys.readouterr().err
    assert export(other, flight, "--format", "coco", "--labels", labels, "-o", tmp_path / "b") == 1
    assert "a file for 2 flights" in capsys.readouterr().err
    assert export(flight, other, "--format", "coco", "--labels", labels.parent, "-o", tmp_path / "b") == 1
    assert "other.labels.jsonl: No such file or directory; label_images writes it" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        export(flight, "--format", "csv", "--labels", labels, "-o", tmp_path / "c")
    assert "--labels is not for csv; it is for imagefolder, coco, yolo, lard" in capsys.readouterr().err


@pytest.mark.parametrize("form", FORMATS)
def test_a_flight_with_the_same_stamps_is_another_one(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    other = write_approach(tmp_path / "flight.bag", FRAMES, far=300.0)  # as lock-step stamps it
    labels = table.beside(flight)
    assert export(other, "--format", form, "--labels", labels, "-o", tmp_path / "out") == 1
    assert f"{labels}: labels of another recording, made from flight.bag" in capsys.readouterr().err
    assert not (tmp_path / "out" / f"flight.{form}").exists()


def test_lards_uuids_of_two_flights_with_the_same_stamps_differ(flight: Path, tmp_path: Path) -> None:
    other = write_approach(tmp_path / "flight.bag", FRAMES, far=300.0)
    assert label_images.main([str(other), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]) == 0
    found = [labelled(bag, "lard", tmp_path / str(k)) for k, bag in enumerate((flight, other, flight))]
    uuids = [set(pd.read_csv(folder / "train.csv", sep=";")["uuid"]) for folder in found]
    assert not uuids[0] & uuids[1]
    assert uuids[0] == uuids[2]


def test_the_stamp_is_the_key(flight: Path) -> None:
    expected = [("camera", stamp_ns(0.5 * k)) for k in range(FRAMES)]
    assert list(table.read(table.beside(flight)).frames) == expected
