"""joystick.launch, and the joystick in bridge.launch: who is started by which argument, and what wrong ones meet."""

from __future__ import annotations

import shlex

import pytest
import yaml

from support.deadlines import WAIT_S
from support.nodes.launch_files import load
from xplane_bridge.harness import ManagedProcess, roslaunch, wait_until
from xplane_bridge.resources import config_file

SCENARIO = """
name: stick
description: right
events:
  - {at: 0, stick: {roll: 0.5}}
  - {at: 300, end: true}
"""


def test_the_mapper_alone_where_another_program_reads_the_device(master):
    nodes, params = load(master, "joystick.launch", "joy_config:=xbox", "stick_mode:=1")
    assert set(nodes) == {"joystick_mapper_node"}
    assert params["/xplane/joystick_mapper_node/device"] == "Xbox-type gamepad"
    assert params["/xplane/joystick_mapper_node/stick_mode"] == 1


def test_the_stick_mode_is_that_of_the_devices_file_unless_given(master, tmp_path):
    text = config_file("joysticks", "xbox.yaml").read_text()
    assert "stick_mode: 2" in text
    file = tmp_path / "left_handed.yaml"
    file.write_text(text.replace("stick_mode: 2", "stick_mode: 1"))
    mine = f"joy_config_file:={file}"
    for arguments, mode in (((mine,), 1), ((mine, "stick_mode:=2"), 2), (("joy_config:=xbox",), 2)):
        _, params = load(master, "joystick.launch", *arguments)
        assert params["/xplane/joystick_mapper_node/stick_mode"] == mode


@pytest.mark.parametrize(("given", "device"), [((), ""), (("device:=Extreme 3D",), "Extreme 3D")])
def test_driver_sdl_is_our_reader(master, given, device):
    nodes, _ = load(master, "joystick.launch", "driver:=sdl", "ns:=lab", *given)
    assert set(nodes) == {"joystick_mapper_node", "joy_reader"}
    reader = nodes["joy_reader"]
    assert (reader.package, reader.type, reader.namespace) == ("xplane_bridge", "joy_reader", "/lab/")
    words = shlex.split(reader.args)
    assert words[words.index("--namespace") + 1] == "/lab"
    assert words[words.index("--device") + 1] == device


def test_driver_virtual_plays_a_scenario_as_the_same_device(master):
    of_scenario = ("joy_config:=playstation", "scenario:=multisine", "stick_mode:=1")
    nodes, params = load(master, "joystick.launch", "driver:=virtual", *of_scenario)
    assert set(nodes) == {"joystick_mapper_node", "virtual_joystick"}
    # The device is the mapper's, of the parameter server: no path has to be found, and no stick mode to be repeated.
    assert shlex.split(nodes["virtual_joystick"].args) == ["multisine", "--namespace", "/xplane"]
    assert params["/xplane/joystick_mapper_node/device"] == "PlayStation-type gamepad"
    assert params["/xplane/joystick_mapper_node/stick_mode"] == 1


def test_driver_xplane_reads_the_stick_of_the_x_plane_that_is_meant(master):
    given = ("host:=192.168.1.20", "port:=49010", "listen_for_beacon:=false", "wire_log:=/tmp/stick.pcapng")
    nodes, params = load(master, "joystick.launch", "driver:=xplane", "joy_config:=xplane", *given)
    assert set(nodes) == {"joystick_mapper_node", "xplane_joy_node"}
    assert params["/xplane/joystick_mapper_node/device"] == "X-Plane's joystick"
    shared = {key: params[f"/xplane/{key}"] for key in ("host", "port", "listen_for_beacon", "wire_log")}
    assert shared == {
        "host": "192.168.1.20",
        "port": 49010,
        "listen_for_beacon": False,
        "wire_log": "/tmp/stick.pcapng",
    }


@pytest.mark.parametrize(
    ("file", "given", "device"),
    [
        ("joystick.launch", ("driver:=xplane",), "X-Plane's joystick"),
        ("bridge.launch", ("joystick:=xplane",), "X-Plane's joystick"),
        ("demo.launch", ("joystick:=xplane",), "X-Plane's joystick"),
        ("bridge.launch", ("joystick:=mapper",), "Logitech Extreme 3D Pro"),
        ("demo.launch", ("joystick:=mapper",), "Logitech Extreme 3D Pro"),
        ("bridge.launch", ("joystick:=xplane", "joy_config:=xbox"), "Xbox-type gamepad"),
    ],
)
def test_the_device_is_x_planes_where_its_joystick_is_read(master, file, given, device):
    _, params = load(master, file, *given)
    assert params["/xplane/joystick_mapper_node/device"] == device


@pytest.mark.parametrize(
    ("file", "driver"),
    [("joystick.launch", "driver:=xplane"), ("bridge.launch", "joystick:=xplane"), ("demo.launch", "joystick:=xplane")],
)
def test_the_reader_of_x_planes_joystick_has_a_file_of_parameters(master, tmp_path, file, driver):
    own = tmp_path / "reader.yaml"
    own.write_text("axes: 30\n", encoding="utf-8")
    for given, axes in (((), 100), ((f"joystick_reader_config:={own}",), 30)):
        _, params = load(master, file, driver, *given)
        assert params["/xplane/xplane_joy_node/axes"] == axes


def test_a_scenario_is_played_on_the_mappers_device_unless_one_is_given(master):
    nodes, _ = load(master, "failure.launch", "joystick:=true")
    assert shlex.split(nodes["scenario_player"].args)[3:] == ["--joystick"]


def test_a_scenario_is_played_in_the_stick_mode_that_is_given(master):
    for given, words in ((("stick_mode:=1",), ["--stick-mode", "1"]), ((), [])):
        nodes, _ = load(master, "failure.launch", "joystick:=true", "joy_config:=xbox", *given)
        assert shlex.split(nodes["scenario_player"].args)[6:] == words


def test_a_further_camera_has_its_frames_below_the_bridges_prefix(master):
    given = ("ns:=first", "camera:=belly", "frame_prefix:=first/", "wire_log:=/tmp/belly.pcapng")
    _, params = load(master, "camera.launch", *given)
    assert params["/first/belly/frame_prefix"] == "first/"
    assert params["/first/belly/wire_log"] == "/tmp/belly.pcapng"


def test_driver_joy_is_ros_joy_node_where_it_is_installed(master, tmp_path, monkeypatch):
    package = tmp_path / "joy"
    package.mkdir()
    (package / "package.xml").write_text(
        "<package format='2'><name>joy</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@b.cd'>m</maintainer><license>BSD</license></package>",
        encoding="utf-8",
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path), prepend=":")
    nodes, params = load(master, "joystick.launch", "driver:=joy")
    assert set(nodes) == {"joystick_mapper_node", "joy_node"}
    assert nodes["joy_node"].package == "joy"
    assert params["/xplane/joy_node/dev"] == "/dev/input/js0"
    assert params["/xplane/joy_node/autorepeat_rate"] == 50
    _, params = load(master, "joystick.launch", "driver:=joy", "device:=/dev/input/js3")
    assert params["/xplane/joy_node/dev"] == "/dev/input/js3"


def test_driver_joy_without_ros_joy_says_what_to_take(master, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(config_file("common.yaml").parents[1]))
    with pytest.raises(Exception, match=r"(?s)joy.*install ros-noetic-joy, or take driver:=sdl"):
        load(master, "joystick.launch", "driver:=joy")


def test_an_unknown_driver_is_named(master):
    with pytest.raises(Exception, match="driver:=bluetooth is unknown: expected joy, sdl, virtual, xplane or none"):
        load(master, "joystick.launch", "driver:=bluetooth")


@pytest.mark.parametrize(
    ("joystick", "started"),
    [
        ("none", set()),
        ("mapper", {"joystick_mapper_node"}),
        ("sdl", {"joystick_mapper_node", "joy_reader"}),
        ("virtual", {"joystick_mapper_node", "virtual_joystick"}),
        ("xplane", {"joystick_mapper_node", "xplane_joy_node"}),
    ],
)
def test_the_bridge_with_a_joystick(master, joystick, started):
    nodes, params = load(master, "bridge.launch", f"joystick:={joystick}", "joy_config:=logitech_f710")
    assert set(nodes) == {"rx_node", "tx_node", "capture_node"} | started
    assert ("/xplane/joystick_mapper_node/device" in params) == bool(started)
    without, _ = load(master, "bridge.launch")
    assert set(without) == {"rx_node", "tx_node", "capture_node"}


def test_another_device_than_the_mappers_is_not_played(world):
    device = yaml.safe_load(config_file("joysticks", "logitech_f710.yaml").read_text(encoding="utf-8"))
    world.set_param("joystick_mapper_node", device)
    arguments = {"ns": world.namespace.strip("/"), "joystick": True, "joy_config": "xbox", "required": True}
    with roslaunch(world.master, world.folder, "failure.launch", **arguments) as launch:
        launch.wait_for_line("--joy-config xbox is 'Xbox-type gamepad', but .* flies with 'Logitech F310/F710'", 60)


def test_a_scenario_flies_the_whole_bridge_as_a_joystick(world):
    from xplane_bridge.msg import AppliedCommand, ControlCommand

    scenario = world.folder / "stick.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    emulator = world.emulator("--no-beacon")
    commands = world.watch("control/manual", ControlCommand)
    applied = world.watch("control/applied", AppliedCommand)
    arguments = [f"ns:={world.namespace.lstrip('/')}", "host:=127.0.0.1", f"port:={emulator.port}", "capture:=false"]
    arguments += ["listen_for_beacon:=false", "joystick:=virtual", f"scenario:={scenario}"]
    command = ["roslaunch", "xplane_bridge", "bridge.launch", *arguments]
    with ManagedProcess("roslaunch", command, world.folder, env=world.env) as launch:
        try:
            commands.wait_for(lambda c: c.roll == pytest.approx(0.5, abs=0.01), timeout=60)
            applied.wait_for(lambda a: a.roll == pytest.approx(0.5, abs=0.01))
        except Exception:
            pytest.fail(launch.describe("no flight"))
    wait_until(lambda: not launch.running, WAIT_S, "end of the launch")
