"""label_images: the file beside the bag, what is said of it, and what is said where there is nothing to label."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from support.flights.drawn_approach import frame_state, scene, write_approach
from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.white_lines import airport_file
from xplane_bridge.cli.sight import label_images
from xplane_bridge.labels import table

if TYPE_CHECKING:
    from pathlib import Path

AIRPORT = ["--apt", str(airport_file()), "--airport", "XEMU"]


def label(*arguments: object) -> int:
    return label_images.main([*map(str, arguments), *AIRPORT])


def test_the_file_lies_beside_the_bag_and_says_how_it_was_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_approach(tmp_path / "flight.bag", 3)
    assert label(bag, "--flat-world") == 0
    out = capsys.readouterr().out.splitlines()
    path = tmp_path / "flight.labels.jsonl"
    assert out[0] == f"{path}: 3 pictures labelled; XEMU of {airport_file()}"
    assert out[1] == "height of runway 15/33: apt.dat"
    assert out[2:] == ["no other aircraft: record traffic/state (launch/record.launch does)"], "nothing was left out"
    labels = table.read(path)
    assert list(labels.frames) == [("camera", stamp_ns(k * 0.5)) for k in range(3)]
    assert labels.about["cameras"] == ["camera"]
    assert labels.about["bags"] == ["flight.bag"]
    assert labels.about["apt"]["file"] == "apt.dat"
    assert labels.about["flat_world"] is True
    first = labels.frames["camera", stamp_ns(0.0)]
    assert (first["width"], first["height"]) == (640, 480)
    runway = first["objects"][0]
    assert (runway["kind"], runway["name"]) == ("runway", "15")
    assert all("sigma_px" in point for point in runway["points"].values())
    assert list(tmp_path.glob("*.part")) == []


def test_heights_of_a_table_make_labels_surer(tmp_path: Path) -> None:
    bag = write_approach(tmp_path / "flight.bag", 1)
    heights = tmp_path / "heights.csv"
    heights.write_text("15, 0.0\n# surveyed\n33, 0.0\n", encoding="utf-8-sig")  # as spreadsheets save UTF-8
    sigmas = []
    for arguments in ([], ["--heights", heights]):
        assert label(bag, *arguments, "-o", tmp_path / "l.jsonl") == 0
        (frame,) = table.read(tmp_path / "l.jsonl").frames.values()
        sigmas.append(frame["objects"][0]["points"]["BL"]["sigma_px"])
    assert sigmas[1] < 0.4 * sigmas[0]


def test_heights_measured_over_the_runway_count_from_where_the_aircraft_stands(tmp_path: Path) -> None:
    # 3 s of it over the runway, whose ground is at 0 m, of an aircraft that stands 1.055 m high.
    bag = write_approach(tmp_path / "flight.bag", 7, far=20.0)
    found = {}
    for arguments in ((), ("--standing-height", "0"), ("--standing-height", "1.055")):
        assert label(bag, *arguments, "-o", tmp_path / "l.jsonl") == 0
        frame = next(iter(table.read(tmp_path / "l.jsonl").frames.values()))
        found[arguments[1:]] = frame["objects"][0]["height"]
    assert found["0",]["source"] == "measured"
    assert found["0",]["near_m"] == pytest.approx(1.055, abs=0.01)
    assert found["1.055",]["near_m"] == pytest.approx(0.0, abs=0.01)
    assert found[()]["near_m"] == pytest.approx(0.055, abs=0.01)
    assert found[()]["sigma_m"] > found["0",]["sigma_m"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("15; 3.0\n", "line 1: '15; 3.0'; expected a runway's end and metres"),
        ("15, 3.0\n09, 1\n", "line 2: XEMU has no runway 09; it has: 15, 33"),
    ],
)
def test_a_table_that_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str) -> None:
    (tmp_path / "heights.csv").write_text(text)
    assert label(write_approach(tmp_path / "flight.bag", 1), "--heights", tmp_path / "heights.csv") == 1
    assert said in capsys.readouterr().err
    assert not (tmp_path / "flight.labels.jsonl").exists()


def test_pictures_that_cannot_be_labelled_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(13):
            ns = stamp_ns(0.1 * k)
            changes = {
                1: {"camera_pose_source": 1},
                2: {"quality": 1},
                5: {"quality": 16384},
                6: {"quality": 8192},
                7: {"quality": 16},
                8: {"quality": 8},
                9: {"quality": 32 | 8},
                10: {"quality": 64},
                11: {"quality": 1024},
                12: {"quality": 2},
            }.get(k, {})
            frame = frame_state(bag, scene(0.1 * k), ns, **changes)
            if k == 3:
                frame["state"]["valid"] = 262143 & ~16
            bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", ns, frame)
            info = {"header": frame["header"], "width": 640, "height": 480, "K": [554, 0, 320, 0, 554, 240, 0, 0, 1]}
            if k != 4:
                bag.add("/xplane/camera/camera_info", "sensor_msgs/CameraInfo", ns, info)
    assert label(path) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0].endswith(f"6 pictures labelled; XEMU of {airport_file()}")
    assert out[2].startswith("no sun: record sun_pitch_degrees")
    assert out[3].startswith("no other aircraft")
    assert out[4:] == [
        "left out: 1: black, or almost",
        "left out: 1: frozen: the same pixels while the aircraft moved",
        "left out: 1: no camera_info of the same stamp",
        "left out: 2: no state, or its position or attitude is not known",
        "left out: 1: the camera's pose was not measured",
        "left out: 1: the field of view was assumed, or changed just there",
    ]
    labels = table.read(tmp_path / "flight.labels.jsonl")
    assert [frame["quality"] for frame in labels.frames.values()] == [0, 16384, 8192, 16, 8, 2]
    assert labels.about["left_out"]["black, or almost"] == 1
    sure, *unsure = labels.frames.values()
    for frame in unsure:  # they may be of the neighbouring frame, the last between two states
        assert frame["objects"][1]["sigma_px"] > sure["objects"][1]["sigma_px"] + 0.1


def test_neither_the_recording_nor_what_the_labels_are_made_from_is_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_approach(tmp_path / "flight.bag", 1)
    apt = tmp_path / "apt.dat"
    apt.write_bytes(airport_file().read_bytes())
    heights = tmp_path / "heights.csv"
    heights.write_text("15, 0.0\n")
    before = {path: path.read_bytes() for path in (bag, apt, heights)}
    given = [str(bag), "--apt", str(airport_file()), str(apt), "--airport", "XEMU", "--heights", str(heights)]
    for path, said in (
        (bag, "the recording itself is there; expected another file to write to"),
        (apt, "a file of --apt or --heights itself is there; expected another file to write to"),
        (heights, "a file of --apt or --heights itself is there"),
    ):
        assert label_images.main([*given, "-o", str(path)]) == 1
        assert f"{path}: {said}" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in before} == before


def test_a_bag_without_pictures_and_one_that_is_too_old(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with FlightBag(tmp_path / "none.bag") as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(0.0), bag.state(0.0, 0))
    assert label(tmp_path / "none.bag") == 1
    assert "record camera/frame_state" in capsys.readouterr().err
    with FlightBag(tmp_path / "old.bag") as bag:
        ns = stamp_ns(0.0)
        frame = frame_state(bag, scene(0.0), ns, camera_pose_source=0)
        bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", ns, frame)
        info = {"header": frame["header"], "width": 640, "height": 480, "K": [554, 0, 320, 0, 554, 240, 0, 0, 1]}
        bag.add("/xplane/camera/camera_info", "sensor_msgs/CameraInfo", ns, info)
    assert label(tmp_path / "old.bag") == 1
    assert "no picture can be labelled (1: the camera's pose was not measured)" in capsys.readouterr().err


def test_files_that_are_no_labels(tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    with pytest.raises(table.LabelError, match="label_images writes it"):
        table.read(path)
    for text in ("", "no json\n", json.dumps({"labels": 99}) + "\n", "[1]\n"):
        path.write_text(text)
        with pytest.raises(table.LabelError, match="no labels of this version"):
            table.read(path)
