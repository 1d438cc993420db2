"""What check_launch says of files that launch arguments name."""

from __future__ import annotations

from pathlib import Path

import pytest

from xplane_bridge.cli.check_launch import problems
from xplane_bridge.resources import config_file


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("host: 127.0.0.1\nlockstep: {enabled: true}\nlockstep/hold: true\n", []),
        ("", []),
        ("max_rate: 10\n", ["max_rate (belongs into tx_config or capture_config)"]),
        ("rates: {engines: 50}\n", ["rates/engines (belongs into rx_config)"]),
        ("command_timeout: 0.1\n", ["command_timeout (belongs into tx_config)"]),
        ("axes: 30\n", ["axes (belongs into joystick_reader_config)"]),
        ("lockstep: {enable: true}\n", ["lockstep/enable (unknown)"]),
        ("one: &one {hots: a}\n", ["one/hots (unknown)"]),
        ("<<: {hots: a}\nport: 49000\n", ["hots (unknown)"]),
    ],
)
def test_keys_of_other_files_are_refused_in_common_config(tmp_path: Path, text: str, said: list[str]) -> None:
    file = tmp_path / "common.yaml"
    file.write_text(text, encoding="utf-8")
    lines = problems({"common_config": str(file)})
    assert len(lines) == len(said)
    for line, part in zip(lines, said):
        assert line.startswith(f"common_config:={file}: take out {part}; it is for host, port, ")


def test_the_shipped_files_are_good() -> None:
    assert problems({f"{name}_config": str(config_file(f"{name}.yaml")) for name in ("common", "rx", "tx")}) == []


ENDLESS = "stands for what it is part of: write it out"
EMPTY, NO_TEXT = "has no value: give it one, or take it out", "is a key that is no text: put it in quotes"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("device: Pad\nbuttons:\n  # gear: {button: 3}\n", f"buttons {EMPTY}"),
        ("buttons:\n  1: {button: 3}\n  on: ~\n", f"buttons/1 {NO_TEXT}; buttons/on {NO_TEXT}"),
        ("direct: {roll: {axis: , scale: 1.0}}\n", f"direct/roll/axis {EMPTY}"),
        ("device: 2026-11-30\n", "device is a date: put it in quotes"),
        ("points: [1, ~]\nviews: [{2: a}]\n", f"points[1] {EMPTY}; views[0]/2 {NO_TEXT}"),
        ("one: &one {a: 1}\ntwo: {<<: [*one, {b: }]}\n", f"two/b {EMPTY}"),
        ("points: &points [1, *points]\n", f"an alias {ENDLESS}"),
        ("one: &one {a: 1, deeper: {of: *one}}\n", f"an alias {ENDLESS}"),
        ("one: &one [1]\ntwo: [*one, *one]\n", ""),
        ('buttons: {"1": {button: 3}, "on": {}}\nangle: !degrees 30\nname: ""\n', ""),
    ],
)
def test_what_roslaunch_cannot_set_is_refused_by_its_key(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "pad.yaml"
    file.write_text(text, encoding="utf-8")
    for name in ("joy_config_file", "aircraft_file", "rx_config"):
        assert problems({name: str(file)}) == ([f"{name}:={file}: {said}"] if said else [])
    assert problems({"joy_config": str(file)}) == [], "scenario_player reads it, without roslaunch"


@pytest.mark.parametrize(
    ("name", "value", "good"),
    [
        ("required", "True", True),  # as $(eval) writes it
        ("required", "FALSE", True),
        ("required", "1", False),
        ("required", "0", False),
        ("rx", "1", True),
        ("rx", "True", True),
        ("rx", "yes", False),
    ],
)
def test_flags_are_what_roslaunch_takes_for_them(name: str, value: str, good: bool) -> None:
    lines = problems({name: value})
    assert [line.startswith(f"{name}:={value}: expected true or false") for line in lines] == ([] if good else [True])


@pytest.mark.parametrize(
    ("name", "value", "good"),
    [
        ("scenario", "mine.yaml", False),
        ("scenario", "../mine.yml", False),
        ("scenario", "left_aileron_stuck", True),
        ("scenario", str(config_file("scenarios", "demo.yaml")), True),
        ("joy_config", "mine.yaml", False),
        ("joy_config", "xbox", True),
        ("joy_config", str(config_file("joysticks", "xbox.yaml")), True),
    ],
)
def test_what_a_node_reads_is_named_or_has_its_full_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str, good: bool
) -> None:
    (tmp_path / "mine.yaml").write_bytes(config_file("scenarios", "demo.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    wanted = f"{name}:={value}: a relative path; give the full one, e.g. {name}:=$PWD/{value}"
    assert problems({name: value}) == ([] if good else [wanted])


@pytest.mark.parametrize(
    ("around", "ns", "place"),
    [
        (None, "lab", ""),
        ("/", "lab", ""),
        ("/hall", "/hall/lab", ""),
        ("/hall", "lab", "/hall/lab"),
        ("hall/", "lab", "/hall/lab"),
    ],
)
def test_a_namespace_around_the_launch_file_is_refused(
    monkeypatch: pytest.MonkeyPatch, around: str | None, ns: str, place: str
) -> None:
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    if around is not None:
        monkeypatch.setenv("ROS_NAMESPACE", around)
    begin = f"ns:={ns}: ROS_NAMESPACE={around} would put nodes below {place}, "
    lines = problems({"ns": ns})
    assert [line.startswith(begin) and line.endswith("; unset ROS_NAMESPACE") for line in lines] == (
        [True] if place else []
    )


@pytest.mark.parametrize(
    ("engage", "set_points", "good"),
    [("true", "false", False), ("True", "", False), ("1", "true", True), ("false", "false", True)],
)
def test_without_set_points_nothing_is_engaged(engage: str, set_points: str, good: bool) -> None:
    assert (problems({"engage": engage, "set_points": set_points}) == []) == good


@pytest.mark.parametrize(
    ("text", "given", "good"),
    [
        ("window: {index: -1, point: [], title: ''}\nwidth: 640\n", {"field_of_view": "main"}, False),
        ("width: 640\n", {"field_of_view": "main", "window_index": "1"}, True),
        ("width: 640\n", {}, True),  # of the bridge's own camera: the largest window
        ("window: {index: 0}\n", {"field_of_view": "main"}, True),
        ("window: {point: [1920, 0]}\n", {"field_of_view": "main"}, True),
        ("source: video\n", {"field_of_view": "main"}, True),
    ],
)
def test_a_further_camera_has_a_window_of_its_own(tmp_path: Path, text: str, given: dict[str, str], good: bool) -> None:
    file = tmp_path / "capture.yaml"
    file.write_text(text, encoding="utf-8")
    assert (problems({"capture_config": str(file), **given}) == []) == good


@pytest.mark.parametrize(
    ("text", "good"),
    [
        (
            config_file("capture.yaml").read_text(encoding="utf-8"),
            True,
        ),  # a copy of the shipped one has the first one's
        ("frame_measured: belly_optical\nframe_rear: belly_rear_optical\n", True),
        ("frame_measured: nose\nframe_down: below\n", False),
    ],
)
def test_a_further_cameras_frames_are_named_after_it(tmp_path: Path, text: str, good: bool) -> None:
    file = tmp_path / "capture.yaml"
    file.write_text(text, encoding="utf-8")
    given = {"capture_config": str(file), "window_index": "1", "field_of_view": "main", "frame": "belly_optical"}
    wanted = "take out frame_measured (here belly_optical), frame_down (here belly_down_optical): a further camera's"
    lines = problems(given)
    assert [wanted in line for line in lines] == ([] if good else [True])


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("camera2", ""),
        ("belly", ""),
        ("wing/left_2", ""),
        ("2", ""),
        (
            "camera",
            "camera:=camera: the first camera has camera_down_optical, camera_forward_optical, camera_optical, ",
        ),
        ("camera_rear", "camera:=camera_rear: the first camera has camera_rear_optical; give a name that is not taken"),
        ("left wing", "camera:=left wing: expected letters, digits and underscores"),
        ("wing-left", "camera:=wing-left: expected letters, digits and underscores"),
        ("/belly", "camera:=/belly: expected letters"),
        ("wing//left", "camera:=wing//left: expected letters"),
        ("h\u00f6he", "camera:=h\u00f6he: expected letters"),
    ],
)
def test_a_further_camera_has_a_name_of_its_own(camera: str, said: str) -> None:
    lines = problems({"camera": camera})
    assert len(lines) == (1 if said else 0)
    assert all(line.startswith(said) for line in lines)
