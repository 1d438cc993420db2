"""The table of the cameras in NumPy's and MATLAB's files, in the manifest and on the data card."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import scipy.io

from support.flights.export_flight import DELAY_ASSUMED, export, write_flight
from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.export.cameras import CameraRow, camera_rows

if TYPE_CHECKING:
    from pathlib import Path

AHEAD = [0.5, -0.5, 0.5, -0.5]
DOWN = [0.7, 0.5, 0.5, 0.1]  #: of length 1


def of_npz(folder: Path) -> dict[str, np.ndarray]:
    content = np.load(folder / "flight.npz", allow_pickle=False)
    return {key.split("/")[1]: content[key] for key in content.files if key.startswith("cameras/")}


def of_mat(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = scipy.io.loadmat(str(folder / "flight.mat"), simplify_cells=True)["cameras"]
    return found


def add_second(path: Path) -> None:
    """Ten pictures of another camera: down, thrice with the other sign, thrice ahead, first a nominal one; no info."""
    with FlightBag(path) as bag:
        for k in range(10):
            ns = stamp_ns(0.2 * k)
            turn = AHEAD if k in (1, 5, 8) else [-part for part in DOWN] if k in (2, 4, 7) else DOWN
            place = {"x": 9.0 if k == 0 else 0.2 if turn is AHEAD else 0.5, "y": 0.0, "z": -0.3}
            pose = {"translation": place, "rotation": dict(zip("xyzw", turn))}
            frame = {"header": bag.header(ns, "belly_optical", k), "quality": DELAY_ASSUMED, "body_to_camera": pose}
            frame["camera_pose_source"] = 1 if k == 0 else 2
            bag.add("/xplane/belly/camera/frame_state", "xplane_bridge/FrameState", ns, frame)


@pytest.mark.parametrize(("form", "read"), [("npz", of_npz), ("mat", of_mat)])
def test_a_camera_reads_back(tmp_path: Path, form: str, read: Any) -> None:
    """Of 20 pictures the camera is 0.1 m and 1 px farther at each; 5 has no frame state, 6 no camera info."""
    assert export(write_flight(tmp_path / "flight.bag"), "--format", form, "-o", tmp_path) == 0
    found = read(tmp_path)
    assert set(found) == set(CameraRow._fields)

    def one(name: str) -> Any:
        return np.asarray(found[name]).reshape(-1)

    assert [str(one(name)[0]) for name in ("name", "display_delay_source")] == ["camera", "both"]
    assert [int(one(name)[0]) for name in ("frames", "width_px", "height_px")] == [19, 32, 24]
    np.testing.assert_array_equal(one("camera_matrix"), [40, 0, 16, 0, 31, 12, 0, 0, 1])
    np.testing.assert_allclose(one("body_to_camera_translation_m"), [1.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_array_equal(one("body_to_camera_rotation_xyzw"), AHEAD)
    assert one("body_to_camera_spread_m")[0] == pytest.approx(1.0)
    assert one("body_to_camera_spread_deg")[0] == 0.0
    assert one("display_delay_s")[0] == pytest.approx(0.058)


@pytest.mark.parametrize(("form", "read"), [("npz", of_npz), ("mat", of_mat)])
def test_of_several_cameras_each_has_a_row(tmp_path: Path, form: str, read: Any) -> None:
    (tmp_path / "flight").mkdir()
    write_flight(tmp_path / "flight" / "flight_0.bag")
    add_second(tmp_path / "flight" / "flight_1.bag")
    assert export(tmp_path / "flight", "--format", form, "-o", tmp_path) == 0
    found = read(tmp_path)
    assert list(found["name"]) == ["camera", "belly"]
    assert list(found["frames"]) == [19, 10]
    assert found["camera_matrix"].shape == (2, 3, 3)
    np.testing.assert_array_equal(found["camera_matrix"][1], np.full((3, 3), np.nan))
    assert list(found["width_px"]) == [32, 0]
    assert list(found["display_delay_source"]) == ["both", "assumed"]
    np.testing.assert_array_equal(found["body_to_camera_translation_m"][1], [0.5, 0.0, -0.3])
    np.testing.assert_array_equal(np.abs(found["body_to_camera_rotation_xyzw"][1]), np.abs(DOWN))
    # To the glance ahead: 0.3 m, and twice the angle of which the quaternions' product is the cosine.
    angle = math.degrees(2.0 * math.acos(0.5 * 0.7 - 0.5 * 0.5 + 0.5 * 0.5 - 0.5 * 0.1))
    assert found["body_to_camera_spread_m"][1] == pytest.approx(0.3)
    assert found["body_to_camera_spread_deg"][1] == pytest.approx(angle)


def test_it_has_units_and_follows_the_topics(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.5)
    assert export(bag, "--format", "npz", "-o", tmp_path) == 0
    assert of_npz(tmp_path)["display_delay_source"].tolist() == ["set"]  # the fifth picture's is assumed
    units = dict(np.load(tmp_path / "flight.npz")["units"])
    assert units["cameras/display_delay_s"] == "s"
    assert units["cameras/body_to_camera_translation_m"] == "m"
    for topic, has in (("camera/frame_state", True), ("odom", False)):
        assert export(bag, "--format", "npz", "--topics", topic, "-o", tmp_path / topic) == 0
        assert bool(of_npz(tmp_path / topic)) == has


def test_poses_that_are_not_known_are_nan_and_null(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        place = dict.fromkeys("xyz", math.nan)
        pose = {"translation": place, "rotation": dict.fromkeys("xyzw", math.nan)}
        for k in range(3):
            frame = {"header": bag.header(stamp_ns(k), "", k), "body_to_camera": pose, "display_delay": 0.1 * k}
            frame["quality"] = DELAY_ASSUMED if k < 2 else 0
            bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", stamp_ns(k), frame)
    with Bags(tmp_path / "flight.bag") as bags:
        (row,) = camera_rows(bags)
        assert list(camera_rows(bags, names=["belly"])) == []
    plain = json.loads(json.dumps(row.plain(), allow_nan=False))
    assert plain["body_to_camera_translation_m"] == [None] * 3
    assert plain["camera_matrix"] == [[None] * 3] * 3
    assert (plain["body_to_camera_spread_m"], plain["body_to_camera_spread_deg"]) == (None, None)
    assert (plain["display_delay_s"], plain["display_delay_source"]) == (0.2, "both")


def test_the_card_and_the_manifest_say_it(tmp_path: Path) -> None:
    (tmp_path / "flight").mkdir()
    write_flight(tmp_path / "flight" / "flight_0.bag")
    add_second(tmp_path / "flight" / "flight_1.bag")
    out = tmp_path / "out"
    assert export(tmp_path / "flight", "--format", "mcap", "-o", out) == 0
    (record,) = json.loads((out / "manifest.json").read_text())["exports"]["mcap"].values()
    assert [row["name"] for row in record["cameras"]] == ["camera", "belly"]
    card = (out / "README.md").read_text(encoding="utf-8")
    pose = "1.000, 0.000, -1.000 | 0.50000, -0.50000, 0.50000, -0.50000 | 1.000 m, 0.00 deg"
    assert f"| flight | camera | 32x24 | 40.00, 31.00, 16.00, 12.00 | {pose} | 58.0 ms, both |" in card
    assert "| flight | belly | not recorded | -, -, -, - |" in card
