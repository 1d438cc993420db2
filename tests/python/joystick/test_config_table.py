"""What joy_config_check shows and writes: the words for each axis and button, without ROS."""

from __future__ import annotations

import pytest
import yaml

from xplane_bridge.cli import joy_config_check
from xplane_bridge.cli.joy_config_check import complaint
from xplane_bridge.joystick.config_table import JoyConfigError, Live, load_joy_config, screen, skeleton
from xplane_bridge.resources import config_file
from xplane_bridge.scenario.virtual_stick import VirtualStick

DEVICE = """
device: My Pad
stick_mode: 2
direct:
  roll:  {axis: 0, scale: -1.0}
  lever: {target: throttle, axis_mode_1: 4, axis_mode_2: 1}
integrated:
  flaps:      {axis: 2, rate: 0.2, select_button: 3}
  trim_pitch: {axis: 2, rate: 0.1, select_button: 4}
  speedbrake: {increase_button: 5, decrease_button: 6, rate: 0.5}
buttons:
  gear_up: {target: gear, button: 0, value: 0.0}
  brakes:  {target: brakes, button: 1, value: 0.8, released: 0.0}
mode: {toggle: 2, auto: -1}
"""


@pytest.fixture
def config(tmp_path):
    file = tmp_path / "pad.yaml"
    file.write_text(DEVICE, encoding="utf-8")
    return lambda mode=None: load_joy_config(file, mode)


FUNCTIONS = """
device: Buttons
surfaces:
  rudder1_fin1:        {axis: 0, low: -20.0, high: 20.0, select_button: 0}
  aileron1_wing2_left: {increase_button: 1, decrease_button: 2, rate: 0.5, low: -25.0, high: 15.0, select_button: 3}
functions:
  halt:   {button: 4, does: pause}
  astern: {button: 5, does: view, view: rear}
  stuck:  {button: 6, does: failure, name: rudder1_fin1, kind: stuck, value: 5.0}
  anew:   {button: 7, does: command, command: sim/operation/reset_flight}
"""


def rows(lines, word):
    """The lines of one table: index to line."""
    begin = next(k for k, line in enumerate(lines) if line.lstrip().startswith(word)) + 2
    found = {}
    for line in lines[begin:]:
        if not line:
            break
        found[int(line.split()[0])] = line
    return found


def test_each_axis_says_what_it_does_what_it_reads_and_what_comes_of_it(config):
    live = Live(
        axes=[-0.5, 0.25, 1.0, 0.125],
        buttons=[0] * 8,
        name="Pad of mine",
        rate=50.0,
        commands={"roll": 0.5, "throttle": 0.625, "flaps": 0.3, "trim_pitch": -0.00001},
        chosen=["integrated.flaps"],
    )
    lines = screen(config(), live)
    assert lines[0].startswith("My Pad: ")
    assert lines[0].endswith("pad.yaml, stick mode 2")
    assert lines[1] == "50 messages/s of 'Pad of mine': 4 axes, 8 buttons"
    axes = rows(lines, "axis")
    assert list(axes) == [0, 1, 2, 3]
    assert "-0.500" in axes[0]
    assert "····████|········" in axes[0]
    assert "roll [direct.roll]" in axes[0]
    assert "  roll +0.500  " in axes[0]
    assert "throttle [direct.lever]" in axes[1]
    assert "  throttle +0.625  " in axes[1]
    assert "moves flaps [integrated.flaps]; (moves trim_pitch)" in axes[2]
    assert "  flaps +0.300  " in axes[2]
    assert "trim_pitch +" not in axes[2], "what is not chosen is not moved"
    assert axes[3].endswith("- not mapped -")
    live.chosen = ["integrated.trim_pitch"]
    assert rows(screen(config(), live), "axis")[2].count("  trim_pitch +0.000  ") == 1


def test_the_other_stick_mode_is_another_axis(config):
    live = Live(axes=[0.0] * 5, buttons=[])
    assert "throttle" in rows(screen(config(1), live), "axis")[4]
    assert "throttle" not in rows(screen(config(1), live), "axis")[1]


def test_each_button_says_what_it_does_and_whether_it_is_pressed(config):
    live = Live(axes=[0.0] * 3, buttons=[0, 1, 0, 0, 0, 0, 0, 1], commands={"brakes": 0.8}, requests=["AUTO"])
    lines = screen(config(), live)
    buttons = rows(lines, "button")
    assert "gear 0 [buttons.gear_up]" in buttons[0]
    assert "pressed" not in buttons[0]
    assert "brakes 0.8, 0 when released [buttons.brakes]" in buttons[1]
    assert "pressed" in buttons[1]
    assert "  brakes +0.800  " in buttons[1]
    assert "asks for the other mode [mode.toggle]" in buttons[2]
    assert "chooses flaps" in buttons[3]
    assert "moves speedbrake up" in buttons[5]
    assert "moves speedbrake down" in buttons[6]
    assert "not mapped" in buttons[7]
    assert "mode requests: AUTO" in lines


def test_what_the_device_lacks_and_what_is_wrong_is_said(config):
    lines = screen(config(), Live(axes=[0.0], buttons=[0], problems="this is wrong; that too"))
    assert "no such axis" in rows(lines, "axis")[2]
    assert "no such button" in rows(lines, "button")[3]
    assert "no such" not in rows(lines, "axis")[0]
    assert lines[2:4] == ["ERROR: this is wrong", "ERROR: that too"]
    silent = screen(config(), Live())
    assert silent[1] == "no message of a joystick yet"
    assert not [line for line in silent if "no such" in line]


@pytest.mark.parametrize(
    "name", sorted(file.stem for file in config_file("joysticks", "xbox.yaml").parent.glob("*.yaml"))
)
def test_every_key_of_the_shipped_files_is_shown(name):
    config = load_joy_config(config_file("joysticks", f"{name}.yaml"))
    text = "\n".join(screen(config, Live()))
    for section in ("direct", "integrated", "buttons", "mode"):
        for key in config.content.get(section, {}):
            assert f"[{section}.{key}]" in text


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (None, "No such file"),
        ("roll: {axis: 0", "pad.yaml: does not parse as YAML: line 1, column 15: "),
        ("- 1\n", "expected keys like device"),
        ("buttons: {1: {button: 3}}\n", "pad.yaml: buttons.1 is a key that is no text: put it in quotes"),
        ("device: 2026-11-30\n", "pad.yaml: device is a date: put it in quotes"),
        ("direct: &all {roll: *all}\n", "pad.yaml: an alias stands for what it is part of"),
        ("1:\n", "pad.yaml: 1 is a key that is no text"),
        ("direct: {roll: }\nmode: {auto: ~}\n", "direct.roll has no value: .* out; mode.auto has no value"),
    ],
)
def test_a_file_that_is_none_is_said(tmp_path, content, part):
    file = tmp_path / "pad.yaml"
    if content is not None:
        file.write_text(content, encoding="utf-8")
    with pytest.raises(JoyConfigError, match=part):
        load_joy_config(file)


def test_a_section_whose_lines_are_all_comments_is_none(tmp_path):
    file = tmp_path / "pad.yaml"
    file.write_text("device:\ndirect: {roll: {axis: 0}}\nbuttons:\n  # gear: {button: 3}\n", encoding="utf-8")
    config = load_joy_config(file)
    assert config.content == {"direct": {"roll": {"axis": 0}}}, "joystick_mapper_node gets it"
    assert config.device == "pad"


@pytest.mark.parametrize(("axes", "buttons", "keys"), [(2, 0, 2), (3, 1, 3), (8, 12, 4)])
def test_a_skeleton_is_a_device_file_with_what_is_there(tmp_path, axes, buttons, keys):
    file = tmp_path / "new.yaml"
    file.write_text(skeleton("Pad: the #1", axes, buttons), encoding="utf-8")
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    assert content["device"] == "Pad: the #1"
    assert [entry["axis"] for entry in content["direct"].values()] == list(range(keys))
    assert content["mode"]["toggle"] == (0 if buttons else -1)
    assert load_joy_config(file).device == "Pad: the #1"
    if axes > 2:
        VirtualStick(content)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["nosuchpad", "--once"], "logitech_f710.yaml"),
        (["nosuchpad.yaml"], "No such file"),
        ([], "expected a joystick's file to check, or --skeleton FILE"),
        (["xbox", "--skeleton", "new.yaml"], "expected a joystick's file to check, or --skeleton FILE"),
    ],
)
def test_what_needs_no_ros_is_said_without_it(monkeypatch, capsys, arguments, part):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")  # no master there; rospy would wait for ever
    assert joy_config_check.main(arguments) == 1
    assert part in capsys.readouterr().err


def test_a_device_without_a_stick_has_no_skeleton():
    with pytest.raises(JoyConfigError, match="has 1 axes; a stick needs at least 2"):
        skeleton("Pedal", 1, 0)


def test_a_nodes_last_words_are_reported_with_the_keys_of_the_file():
    output = "\x1b[31m[FATAL] [1700.5]: unknown parameter /check_1/joystick_mapper_node/direct/roll/expos (a)\x1b[0m\n"
    assert complaint(output, "/check_1/joystick_mapper_node/") == "unknown parameter direct.roll.expos (a)"
    assert complaint("Segmentation fault\n", "/x/") == "Segmentation fault"
    assert complaint("", "/x/") == "joystick_mapper_node ended without a word"


def test_surfaces_and_functions_are_in_the_table(tmp_path):
    file = tmp_path / "buttons.yaml"
    file.write_text(FUNCTIONS, encoding="utf-8")
    lines = screen(load_joy_config(file), Live(axes=[0.0], buttons=[0] * 8, chosen=["surfaces.rudder1_fin1"]))
    assert "sets rudder1_fin1 [surfaces.rudder1_fin1]" in rows(lines, "axis")[0]
    buttons = rows(lines, "button")
    for button, text in enumerate(
        (
            "chooses rudder1_fin1, or gives it back",
            "(moves aileron1_wing2_left down)",
            "(moves aileron1_wing2_left up)",
            "chooses aileron1_wing2_left, or gives it back",
            "pauses and resumes",
            "view rear",
            "breaks and repairs rudder1_fin1: stuck at 5",
            "command sim/operation/reset_flight",
        )
    ):
        assert text in buttons[button]
