"""What launch files make of their arguments: names and paths as they were given, and which file goes before which."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

from support.nodes.launch_files import load
from xplane_bridge.harness import RosMaster
from xplane_bridge.resources import config_file, program


def options(node: Any) -> list[str]:
    """The options of a node, as it gets them."""
    return [word for word in shlex.split(node.args) if word.startswith("-")]


@pytest.mark.parametrize("lockstep", ["false", "true"])
@pytest.mark.parametrize("name", ["007", "1e3", "2024", "true", "left flight"])
def test_a_recording_is_called_as_it_was_given(master: RosMaster, name: str, lockstep: str) -> None:
    nodes, _ = load(master, "record.launch", f"prefix:={name}", f"lockstep:={lockstep}")
    assert f"--output-prefix={name}" in options(nodes["record"])
    assert ("--split" in options(nodes["record"])) == (lockstep == "false")
    nodes, _ = load(master, "record.launch", f"bag:={name}", f"lockstep:={lockstep}")
    assert f"--output-name={name}" in options(nodes["record"])
    assert "--split" not in options(nodes["record"])


def test_topics_of_a_namespace_of_digits_are_recorded_there(master: RosMaster) -> None:
    nodes, _ = load(master, "record.launch", "ns:=007", "topics:=odom /tf", "cameras:=2")
    of_camera = ["/007/2/camera/image_raw/compressed", "/007/2/camera/camera_info", "/007/2/camera/frame_state"]
    assert shlex.split(nodes["record"].args)[-5:] == ["/007/odom", "/tf", *of_camera]


@pytest.mark.parametrize(
    "words",
    [
        ["bridge.launch", "joystick:=sdl"],
        ["joystick.launch", "driver:=virtual"],
        ["camera.launch"],
        ["record.launch"],
        ["failure.launch"],
        ["mavros.launch"],
    ],
    ids=lambda words: words[0],
)
def test_every_node_is_below_the_namespace(master: RosMaster, words: list[str]) -> None:
    nodes, _ = load(master, *words, "ns:=lab")
    assert nodes
    assert {name: node.namespace for name, node in nodes.items() if not node.namespace.startswith("/lab/")} == {}


def test_a_namespace_of_the_shell_is_refused(
    master: RosMaster, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "/hall")
    for file in ("bridge.launch", "failure.launch"):
        with pytest.raises(Exception, match="check_launch"):
            load(master, file, "ns:=lab")
        assert "programs look for /lab; unset ROS_NAMESPACE\n" in capfd.readouterr().err
    nodes, params = load(master, "rx.launch", "ns:=/hall/lab")
    assert nodes["rx_node"].namespace == "/hall/lab/"
    assert params["/hall/lab/port"] == 49000


def test_a_scenario_may_lie_in_a_folder_with_a_space(master: RosMaster, tmp_path: Path) -> None:
    file = tmp_path / "left wing" / "mine.yaml"
    file.parent.mkdir()
    file.write_bytes(config_file("scenarios", "left_aileron_stuck.yaml").read_bytes())
    nodes, _ = load(master, "failure.launch", f"scenario:={file}")
    assert shlex.split(nodes["scenario_player"].args) == [str(file), "--namespace", "/xplane"]


def test_arguments_may_have_apostrophes(master: RosMaster, tmp_path: Path) -> None:
    file = tmp_path / "o'brien.yaml"
    file.write_text("host: 127.0.0.1\n", encoding="utf-8")
    _, params = load(master, "rx.launch", f"common_config:={file}")
    assert params["/xplane/host"] == "127.0.0.1"


def test_a_clone_may_lie_in_a_folder_with_a_space(
    master: RosMaster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clone, devel = tmp_path / "my work" / "clone", tmp_path / "my work" / "devel"
    programs = devel / "lib" / "xplane_bridge"
    for folder in (clone, programs):
        folder.mkdir(parents=True)
    root = config_file("common.yaml").parents[1]
    for name in ("package.xml", "launch", "config"):
        (clone / name).symlink_to(root / name)
    (programs / "check_launch").symlink_to(program("check_launch"))
    (devel / ".catkin").write_text(str(clone), encoding="utf-8")
    monkeypatch.setenv("CMAKE_PREFIX_PATH", str(devel), prepend=":")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(clone), prepend=":")
    _, params = load(master, "rx.launch")
    assert params["/launch_arguments"] == "good\n"
    with pytest.raises(Exception, match="check_launch"):
        load(master, "rx.launch", "port:=many")


def test_what_common_config_leaves_out_is_as_shipped(master: RosMaster, tmp_path: Path) -> None:
    small = tmp_path / "small.yaml"
    small.write_text("transport: data\nlockstep: {watchdog: 5.0}\n", encoding="utf-8")
    _, params = load(master, "rx.launch", f"common_config:={small}", "port:=49010")
    shared = {
        key: params[f"/xplane/{key}"] for key in ("transport", "lockstep/watchdog", "port", "data_port", "wire_log")
    }
    assert shared == {
        "transport": "data",
        "lockstep/watchdog": 5.0,
        "port": 49010,
        "data_port": 49003,  # an earlier run may have left another one on the roscore
        "wire_log": "",
    }


def test_the_folder_of_mixings_is_the_files_where_it_names_one(master: RosMaster, tmp_path: Path) -> None:
    _, params = load(master, "tx.launch")
    assert params["/xplane/tx_node/mixing/shipped"] == str(config_file("common.yaml").parent / "mixing")
    own = tmp_path / "tx.yaml"
    for folder in ("", "/srv/mixings"):
        own.write_text(f"mixing: {{shipped: '{folder}'}}\n", encoding="utf-8")
        _, params = load(master, "tx.launch", f"tx_config:={own}")
        assert params["/xplane/tx_node/mixing/shipped"] == folder


def test_a_further_cameras_window_is_the_files_where_that_names_one(master: RosMaster, tmp_path: Path) -> None:
    index = "/xplane/belly/capture_node/window/index"
    for given, window in (((), 1), (("window_index:=2",), 2)):
        _, params = load(master, "camera.launch", "camera:=belly", *given)
        assert params[index] == window
    own = tmp_path / "belly.yaml"
    own.write_text("window: {index: 3}\n", encoding="utf-8")
    for given, window in (((), 3), (("window_index:=2",), 2)):
        _, params = load(master, "camera.launch", "camera:=belly", f"capture_config:={own}", *given)
        assert params[index] == window
    own.write_text("window: {point: [1920, 0]}\n", encoding="utf-8")
    _, params = load(master, "camera.launch", "camera:=belly", f"capture_config:={own}")
    assert index not in params
    assert params["/xplane/belly/capture_node/window/point"] == [1920, 0]


def test_a_further_cameras_view_is_the_files_unless_an_argument_gives_it(master: RosMaster, tmp_path: Path) -> None:
    node = "/xplane/belly/capture_node"
    keys = ("mount/heading_deg", "mount/pitch_deg", "mount/roll_deg", "assumed_view")

    def view(*given: str) -> list[Any]:
        _, params = load(master, "camera.launch", "camera:=belly", "window_index:=1", *given)
        assert params[f"{node}/frame_measured"] == "belly_optical"
        assert params[f"{node}/frame_down"] == "belly_down_optical"
        return [params.get(f"{node}/{key}") for key in keys]

    down = ["heading:=0", "pitch:=-90", "roll:=0", "assumed_view:=down"]
    assert view() == [0.0, 0.0, 0.0, "forward"]
    assert view(*down) == [0.0, -90.0, 0.0, "down"]
    own = tmp_path / "belly.yaml"
    own.write_text("mount: {heading_deg: 5.0, pitch_deg: -80.0, roll_deg: 3.0}\nassumed_view: rear\n", encoding="utf-8")
    assert view(f"capture_config:={own}") == [5.0, -80.0, 3.0, "rear"]
    assert view(f"capture_config:={own}", "pitch:=-70") == [5.0, -70.0, 3.0, "rear"]
    assert view(f"capture_config:={own}", *down) == [0.0, -90.0, 0.0, "down"]
    own.write_text("mount: {pitch_deg: -90.0}\n", encoding="utf-8")
    assert view(f"capture_config:={own}") == [None, -90.0, None, None], "the node's own defaults"


@pytest.mark.parametrize("camera", ["belly", "007"])
def test_a_further_cameras_frames_are_not_overwritten_silently(
    master: RosMaster, tmp_path: Path, capfd: pytest.CaptureFixture[str], camera: str
) -> None:
    own = tmp_path / "own.yaml"
    own.write_text(f"window: {{index: 1}}\nframe_measured: {camera}_optical\n", encoding="utf-8")
    load(master, "camera.launch", f"camera:={camera}", f"capture_config:={own}")
    own.write_text("window: {index: 1}\nframe_measured: nose\n", encoding="utf-8")
    with pytest.raises(Exception, match="check_launch"):
        load(master, "camera.launch", f"camera:={camera}", f"capture_config:={own}")
    assert f"take out frame_measured (here {camera}_optical)" in capfd.readouterr().err
