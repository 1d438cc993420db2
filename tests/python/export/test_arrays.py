"""Flights as NumPy and MATLAB tables, read back with numpy and scipy."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Callable

import numpy as np
import pytest
import scipy.io

from support.flights.export_flight import export, write_flight
from support.flights.synthetic_flight import CLIMB, FlightBag, record_a_clock_set_back, stamp_ns, state_at
from xplane_bridge.bags import Bags
from xplane_bridge.export import arrays

if TYPE_CHECKING:
    from pathlib import Path

#: Of `write_flight`: states every 20 ms, 1 s missing after 2 s.
TIMES = np.arange(200) / 50.0 + (np.arange(200) >= 100)


def npz(folder: Path) -> Callable[[str, str], np.ndarray]:
    content = np.load(folder / "flight.npz", allow_pickle=False)
    return lambda topic, column: content[f"{topic}/{column}"]


def mat(folder: Path) -> Callable[[str, str], np.ndarray]:
    content = scipy.io.loadmat(str(folder / "flight.mat"), simplify_cells=True)
    return lambda topic, column: content[topic][column]


READERS = {"npz": npz, "mat": mat}


@pytest.mark.parametrize("form", ["npz", "mat"])
def test_every_value_time_and_unit_reads_back(tmp_path: Path, form: str) -> None:
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", form, "-o", tmp_path) == 0
    read = READERS[form](tmp_path)
    stamps = [stamp_ns(t) for t in TIMES]
    for column in ("stamp_ns", "receive_ns"):
        assert read("flight_state", column).dtype == np.int64
        np.testing.assert_array_equal(read("flight_state", column), stamps)
    np.testing.assert_allclose(read("flight_state", "time_s"), TIMES, atol=1e-9)
    np.testing.assert_array_equal(read("flight_state", "roll_deg"), [state_at(t)["roll_deg"] for t in TIMES])
    np.testing.assert_array_equal(read("flight_state", "altitude_msl_m"), 1000.0 + CLIMB * TIMES)
    np.testing.assert_array_equal(read("flight_state", "angular_velocity_x_radps"), [state_at(t)["p"] for t in TIMES])
    np.testing.assert_allclose(read("odom", "pose_pose_position_y"), 2 * TIMES, atol=1e-12)
    # Modes at 0.5, 1.5 and 3.5 s; the simulator's time of this flight is its time.
    np.testing.assert_array_equal(read("control_mode", "mode"), [1, 2, 2])
    assert [bool(flag) for flag in read("control_mode", "failsafe")] == [False, False, True]
    np.testing.assert_allclose(read("control_mode", "sim_time_unwrapped_s"), [0.5, 1.5, 3.5], atol=1e-9)
    assert list(read("control_mode", "reason")) == ["r", "rr", "rr"]


@pytest.mark.parametrize("form", ["npz", "mat"])
def test_a_topic_that_is_given_twice_is_written_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    bag = write_flight(tmp_path / "flight.bag", 1.0)
    assert export(bag, "--format", form, "--topics", "odom", "/xplane/odom", "-o", tmp_path) == 0
    assert "1 topics, 50 messages" in capsys.readouterr().out


def test_npz_has_units_topics_and_lists_without_pickle(tmp_path: Path) -> None:
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "npz", "-o", tmp_path) == 0
    content = np.load(tmp_path / "flight.npz", allow_pickle=False)
    units = dict(content["units"])
    assert units["flight_state/roll_deg"] == "deg"
    assert units["flight_state/angular_velocity_x_radps"] == "rad/s"
    assert units["camera_frame_state/state_altitude_msl_m"] == "m"
    assert "control_mode/reason" not in units
    assert ["failures_state", "/xplane/failures/state", "xplane_bridge/FailureState"] in content["topics"].tolist()
    assert not any(name.startswith("camera_image") for name, _, _ in content["topics"])
    assert content["failures_state/names"].tolist() == [["aileron1_left", "engine_1", "pitot_1"]]
    assert content["failures_state/names_count"].tolist() == [3]
    np.testing.assert_array_equal(content["failures_state/values"], np.float32([[5.0, np.nan, np.nan]]))
    assert content["failures_state/active"].tolist() == [[True, True, False]]


def test_mat_has_units_and_cells(tmp_path: Path) -> None:
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "mat", "-o", tmp_path) == 0
    content = scipy.io.loadmat(str(tmp_path / "flight.mat"), simplify_cells=True)
    assert content["units"]["flight_state"]["velocity_ned_y_mps"] == "m/s"
    assert list(content["failures_state"]["names"]) == ["aileron1_left", "engine_1", "pitot_1"]
    assert "/xplane/odom" in content["topics"][:, 1].tolist()
    assert content["about"].startswith("written by xplane_bridge ")
    first = (tmp_path / "flight.mat").read_bytes()
    assert export(tmp_path / "flight.bag", "--format", "mat", "-o", tmp_path / "again") == 0
    assert (tmp_path / "again" / "flight.mat").read_bytes() == first


def test_simulator_time_is_never_interpolated_across_a_gap(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "flight.bag")
    with FlightBag(tmp_path / "more.bag") as bag:
        for t in (1.0, 2.5, 3.01, 9.0):  # 2.5 s lies in the gap, 9 s after the flight
            text = {"data": f"at {t}"}
            bag.add("/xplane/scenario/label", "std_msgs/String", stamp_ns(t), text)
    with Bags([path, tmp_path / "more.bag"]) as bags:
        (label,) = arrays.topic_arrays(bags, ["scenario/label"])
    np.testing.assert_allclose(label.columns["sim_time_unwrapped_s"], [1.0, np.nan, 3.01, np.nan], atol=1e-9)
    assert label.columns["data"].tolist() == ["at 1.0", "at 2.5", "at 3.01", "at 9.0"]


def test_simulator_time_is_none_between_two_times_of_a_clock_set_back(tmp_path: Path) -> None:
    paths = [tmp_path / "states.bag", tmp_path / "labels.bag"]
    record_a_clock_set_back(paths[0], order_lost=True)
    with FlightBag(paths[1]) as bag:
        for t in (0.503, 1.183, 1.503):  # the states' stamps from 1.07 to 1.30 s are of two times
            bag.add("/xplane/scenario/label", "std_msgs/String", stamp_ns(t), {"data": ""})
    with Bags(paths) as bags:
        (label,) = arrays.topic_arrays(bags, ["scenario/label"])
    np.testing.assert_allclose(label.columns["sim_time_unwrapped_s"], [0.503, np.nan, 1.753], atol=1e-9)


def test_each_topic_has_the_clock_of_its_own_bridge(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(20):
            for space, later, sim_later in (("/a", 0.0, 0.0), ("/b", 0.5, 1000.0), ("/b/inner", 0.25, 5000.0)):
                t = k / 10 + later
                state = {**bag.state(t, k), "sim_time_unwrapped": t + sim_later}
                bag.add(f"{space}/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
        for space in ("/a", "/a/mine", "/b", "/b/inner", "/b/inner/camera", "/c", ""):
            bag.add(f"{space}/label", "std_msgs/String", stamp_ns(1.0), {"data": space})
    with Bags(tmp_path / "flight.bag") as bags:
        found = {topic.topic: topic.columns for topic in arrays.topic_arrays(bags) if topic.topic.endswith("/label")}
    times = {topic[: -len("/label")]: columns["sim_time_unwrapped_s"][0] for topic, columns in found.items()}
    expected = {"/a": 1.0, "/a/mine": 1.0, "/b": 1001.0, "/b/inner": 5001.0, "/b/inner/camera": 5001.0}
    assert {space: round(time, 9) for space, time in times.items() if time == time} == expected
    since = {topic[: -len("/label")]: round(columns["time_s"][0], 9) for topic, columns in found.items()}
    inner = {"/b/inner": 0.75, "/b/inner/camera": 0.75}
    assert since == {"/a": 1.0, "/a/mine": 1.0, "/b": 0.5, **inner, "/c": 1.0, "": 1.0}


def test_an_only_bridge_has_the_clock_of_all_topics(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(20):
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), bag.state(k / 10, k))
        bag.add("/mine/label", "std_msgs/String", stamp_ns(1.0), {"data": ""})
    with Bags(tmp_path / "flight.bag") as bags:
        (label,) = arrays.topic_arrays(bags, ["/mine/label"])
    np.testing.assert_allclose(label.columns["sim_time_unwrapped_s"], [1.0], atol=1e-9)


def test_lists_that_vary_are_filled_up_and_lists_of_messages_are_json(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k, axes in enumerate(([0.5], [], [1.0, 2.0])):
            values = {"header": bag.header(stamp_ns(k), ""), "axes": axes, "buttons": [1] * k}
            bag.add("/xplane/joy", "sensor_msgs/Joy", stamp_ns(k), values)
        event = {"number": 7, "stamp": {"sec": 3, "nanosec": 4}, "sim_time": np.nan, "kind": 5, "text": "é"}
        values = {"header": bag.header(stamp_ns(1), ""), "events": [event]}
        bag.add("/xplane/events", "xplane_bridge/EventList", stamp_ns(1), values)
    assert export(tmp_path / "flight.bag", "--format", "npz", "-o", tmp_path) == 0
    content = np.load(tmp_path / "flight.npz", allow_pickle=False)
    axes = content["xplane_joy/axes"]
    np.testing.assert_array_equal(axes, np.float32([[0.5, np.nan], [np.nan, np.nan], [1.0, 2.0]]))
    assert content["xplane_joy/axes_count"].tolist() == [1, 0, 2]
    assert content["xplane_joy/buttons"].tolist() == [[0, 0], [1, 0], [1, 1]]
    (read,) = json.loads(str(content["xplane_events/events"][0]))
    assert read.pop("stamp") == {"sec": 3, "nanosec": 4}
    expected = {"number": 7, "sim_time": None, "kind": 5, "text": "é", "requested_by": "", "success": False}
    assert read == expected


def test_arrays_of_lists_are_the_same_in_every_flight(tmp_path: Path) -> None:
    found = set()
    for number, counts in enumerate(([0, 0], [1, 1], [0, 2])):
        path = tmp_path / f"{number}.bag"
        with FlightBag(path) as bag:
            for k, count in enumerate(counts):
                header, event = bag.header(stamp_ns(k), ""), {"number": 1}
                lists = {name: [text] * count for name, text in (("names", "engine_1"), ("active", True))}
                bag.add(
                    "/xplane/failures/state", "xplane_bridge/FailureState", stamp_ns(k), {"header": header, **lists}
                )
                events = {"header": header, "events": [event] * count}
                bag.add("/xplane/events", "xplane_bridge/EventList", stamp_ns(k), events)
        assert export(path, "--format", "npz", "-o", tmp_path) == 0
        content = np.load(tmp_path / f"{number}.npz")
        found.add(tuple((name, content[name].ndim, content[name].dtype.kind) for name in content.files))
        assert content["xplane_failures_state/active_count"].tolist() == counts
    assert len(found) == 1


def test_topics_choose(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    assert export(bag, "--format", "npz", "--topics", "odom", "control/mode", "-o", tmp_path) == 0
    names = {key.split("/")[0] for key in np.load(tmp_path / "flight.npz").files}
    assert names == {"odom", "control_mode", "units", "topics", "about"}


@pytest.mark.parametrize("form", ["csv", "parquet", "npz", "mat"])
@pytest.mark.parametrize("raw", [False, True])
def test_pictures_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture, form: str, raw: bool) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2, raw_images=raw)
    pictures = "camera/image_raw" if raw else "camera/image_raw/compressed"
    assert export(bag, "--format", form, "--topics", "odom", pictures, "-o", tmp_path / "o") == 1
    error = f"/xplane/{pictures}: pictures do not go into a table; use --format imagefolder, mcap or ros2"
    assert error in capsys.readouterr().err
    assert not list((tmp_path / "o").glob("flight*"))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--format", "npz", "--rate", "50"], "--rate is not for npz; it is for csv, parquet, tum, euroc"),
        (
            ["--format", "tum", "--topics", "odom"],
            "--topics is not for tum; it is for csv, parquet, npz, mat, mcap, ros2",
        ),
        (["--format", "voc"], "'voc' (choose from"),
    ],
)
def test_what_a_format_does_not_have_is_refused(arguments: list, text: str, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        export("flight.bag", *arguments)
    assert text in capsys.readouterr().err


def test_names_are_such_as_matlab_takes(tmp_path: Path) -> None:
    long = "a_very_long_name_space/" * 4
    with FlightBag(tmp_path / "flight.bag") as bag:
        for topic in (f"/{long}one", f"/{long}two", "/3d/label", "/a/b", "/a_b"):
            bag.add(topic, "std_msgs/String", stamp_ns(0), {"data": topic})
    with Bags(tmp_path / "flight.bag") as bags:
        names = {topic.topic: topic.name for topic in arrays.topic_arrays(bags)}
    assert len(set(names.values())) == 5
    assert all(name.isidentifier() and len(name) <= 63 for name in names.values())
    assert (names["/3d/label"], names["/a/b"], names["/a_b"]) == ("x3d_label", "a_b", "a_b_2")


def test_a_topic_beyond_the_limit_of_mat_files_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(arrays, "_MAT_LIMIT", 10_000)
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "mat", "-o", tmp_path) == 1
    assert "are too many for a .mat file (limit 10000); use --format npz" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.mat"))
