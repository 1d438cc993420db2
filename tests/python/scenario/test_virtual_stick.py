"""The joystick that is not there: its axes must come out of the mapper's equation (1) as what the scenario wants."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from xplane_bridge.resources import config_file
from xplane_bridge.scenario import Commands, ScenarioError, parse_scenario
from xplane_bridge.scenario.virtual_stick import VirtualStick, load_stick

DEVICES = sorted(file.stem for file in config_file("joysticks", "README.md").parent.glob("*.yaml"))
LEVER = "logitech_extreme_3d_pro"


def device(name):
    return yaml.safe_load(config_file("joysticks", f"{name}.yaml").read_text(encoding="utf-8"))


def equation_1(j, entry):
    """delta = xi * j after dead zone and expo, and the travel it is mapped to (config/joysticks/README.md)."""
    dead_zone, expo = entry.get("dead_zone", 0.0), entry.get("expo", 0.0)
    beyond = max(0.0, abs(j) - dead_zone) / (1.0 - dead_zone)
    shaped = ((1.0 - expo) * beyond + expo * beyond**3) * (1.0 if j >= 0.0 else -1.0)
    delta = entry.get("scale", 1.0) * shaped
    return 0.5 * (1.0 + delta) if entry.get("travel") == "full" else delta


@pytest.mark.parametrize("name", DEVICES)
@pytest.mark.parametrize("mode", [1, 2])
@pytest.mark.parametrize("value", [-1.0, -0.37, 0.0, 0.02, 0.5, 1.0])
def test_axes_are_the_inverse_of_the_mappers_equation(name, mode, value):
    content = device(name)
    stick = VirtualStick(content, mode)
    axes, _ = stick.joy(Commands(stick={"roll": value, "pitch": -value, "yaw": 0.5 * value}))
    for axis, wanted in (("roll", value), ("pitch", -value), ("yaw", 0.5 * value)):
        entry = content["direct"][axis]
        index = entry.get("axis", entry.get(f"axis_mode_{mode}"))
        assert equation_1(axes[index], entry) == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("throttle", [0.0, 0.3, 1.0])
def test_a_lever_is_moved_over_its_whole_travel(throttle):
    content = device(LEVER)
    axes, _ = VirtualStick(content).joy(Commands(throttle=throttle))
    entry = content["direct"]["throttle"]
    assert equation_1(axes[entry["axis"]], entry) == pytest.approx(throttle, abs=2e-3)


@pytest.mark.parametrize("dead_zone", [0.0, 0.1])
def test_a_lever_in_its_middle_has_been_moved(dead_zone):
    content = device(LEVER)
    entry = content["direct"]["throttle"]
    entry["dead_zone"] = dead_zone
    stick = VirtualStick(content)
    assert stick.joy(Commands())[0][entry["axis"]] == 0.0, "the scenario has not moved it yet"
    sent = float(np.float32(stick.joy(Commands(throttle=0.5))[0][entry["axis"]]))
    assert sent != 0.0, "the mapper commands nothing while it is silent_until_moved"
    assert equation_1(sent, entry) == 0.5
    assert stick.joy(Commands())[0][content["direct"]["roll"]["axis"]] == 0.0


def test_a_device_has_all_axes_that_its_file_names():
    content = device(LEVER)
    content["direct"]["yaw"]["axis"] = 9
    content["integrated"]["flaps"]["axis"] = 11
    axes, _ = VirtualStick(content).joy(Commands(stick={"roll": 0.0, "pitch": 0.0, "yaw": 0.5}))
    assert len(axes) == 12
    assert equation_1(axes[9], content["direct"]["yaw"]) == pytest.approx(0.5, abs=2e-3)
    assert len(VirtualStick(device(LEVER)).joy(Commands())[0]) == 8


@pytest.mark.parametrize(
    ("changed", "commands", "part"),
    [
        ({}, Commands(throttle=-0.5), r"throttle at -0\.5: its axis gives 0 to 1; fly .* commands"),
        ({"travel": "positive"}, Commands(throttle=-0.5), "its axis gives 0 to 1;"),
        ({"scale": 0.5}, Commands(throttle=0.8), r"throttle at 0\.8: its axis gives 0\.25 to 0\.75;"),
        ({"scale": -0.5, "travel": "symmetric"}, Commands(throttle=-0.6), r"gives -0\.5 to 0\.5;"),
        ({"scale": 2.0, "travel": "symmetric"}, Commands(throttle=-1.0), None),
        ({"travel": "symmetric"}, Commands(throttle=-1.0), None),
        ({"scale": 0.6}, Commands(throttle=0.2 - 1e-12), None),
    ],
)
def test_a_value_beyond_the_travel_of_its_axis_is_said(changed, commands, part):
    content = device(LEVER)
    entry = content["direct"]["throttle"]
    entry.update(changed)
    if part is None:
        axes, _ = VirtualStick(content).joy(commands)
        assert equation_1(axes[entry["axis"]], entry) == pytest.approx(commands.throttle, abs=2e-3)
        return
    with pytest.raises(ScenarioError, match=part):
        VirtualStick(content).joy(commands)


def test_buttons_for_modes_gear_and_brakes():
    stick = VirtualStick(device(LEVER))
    assert stick.mode_button("auto", "manual") == 11
    assert stick.mode_button("manual", "auto") == 10
    _, buttons = stick.joy(Commands(handles={"gear": 1.0, "brakes": 1.0}, buttons={3}))
    assert [i for i, pressed in enumerate(buttons) if pressed] == [1, 3, 7]
    with pytest.raises(ScenarioError, match="there is no button for gear up"):
        VirtualStick({**device(LEVER), "buttons": {}}).joy(Commands(handles={"gear": 0.0}))
    toggling = VirtualStick({**device(LEVER), "mode": {"toggle": 0}})
    assert toggling.mode_button("auto", "manual") == 0
    assert toggling.mode_button("auto", "auto") is None


def test_sections_go_by_their_target_and_not_by_their_name():
    content = device(LEVER)
    plain = VirtualStick(content)
    renamed = {
        **content,
        "direct": {
            f"my_{key}" if key != "roll" else key: {"target": key, **entry} for key, entry in content["direct"].items()
        },
        "buttons": {
            "wheels_in": {"target": "gear", "button": 3, "value": 0.0},
            "wheels_out": {"target": "gear", "button": 4, "value": 1.0},
            "gear_up": {"target": "parking_brake", "button": 5, "value": 1.0},
            "stop": {"target": "brakes", "button": 6, "value": 1.0, "released": 0.0},
        },
    }
    stick = VirtualStick(renamed)
    moved = Commands(stick={"roll": 0.3, "pitch": -0.2, "yaw": 0.1}, throttle=0.7)
    assert stick.joy(moved)[0] == plain.joy(moved)[0]
    for handles, pressed in (({"gear": 1.0, "brakes": 1.0}, [4, 6]), ({"gear": 0.0, "brakes": 0.0}, [3])):
        assert [i for i, down in enumerate(stick.joy(Commands(handles=handles))[1]) if down] == pressed


def test_mode_buttons_below_0_are_none():
    toggling = VirtualStick({**device(LEVER), "mode": {"toggle": 0, "manual": -1, "auto": -1}})
    assert toggling.mode_button("auto", "manual") == 0
    silent = VirtualStick({**device(LEVER), "mode": {"toggle": -1, "manual": -1, "auto": -1}})
    with pytest.raises(ScenarioError, match="no button for mode auto"):
        silent.mode_button("auto", "manual")


@pytest.mark.parametrize(
    ("content", "commands", "pressed"),
    [
        ({"mode": {"toggle": 13, "manual": -1}}, Commands(buttons={13}), 13),
        ({"mode": {"toggle": 255}}, Commands(buttons={255}), 255),
        ({"buttons": {"wheels": {"target": "gear", "button": 12}}}, Commands(handles={"gear": 1.0}), 12),
        ({"functions": {"pause": {"button": 20, "does": "pause"}}}, Commands(buttons={20}), 20),
        ({"surfaces": {"rudder1": {"axis": 5, "select_button": 21}}}, Commands(buttons={21}), 21),
    ],
)
def test_there_are_as_many_buttons_as_the_file_names(content, commands, pressed):
    _, buttons = VirtualStick({**device(LEVER), **content}).joy(commands)
    assert len(buttons) == pressed + 1
    assert [i for i, down in enumerate(buttons) if down] == [pressed]


def test_there_are_the_buttons_that_a_scenario_presses():
    stick = VirtualStick(device(LEVER))
    assert len(stick.joy(Commands())[1]) == 12
    events = [{"at": 0, "buttons": {"press": [12, 3]}}, {"at": 1, "label": "a", "buttons": {"tap": 40}}]
    events.append({"at": 2, "buttons": {}})
    stick.provide_buttons(parse_scenario({"name": "test", "events": events}))
    assert stick.joy(Commands(buttons={12}))[1] == [0] * 12 + [1] + [0] * 28


@pytest.mark.parametrize(
    ("content", "commands", "part"),
    [
        ({"direct": {"bank": {"target": "roll", "axis": -1}}}, None, r"direct\.bank names no axis"),
        ({"mode": {}}, None, "no button for mode auto"),
        ({"direct": {"roll": {"axis": 0}}}, None, "direct.pitch is missing"),
        ({}, Commands(handles={"flaps": 0.5}), "flaps is moved by a hat"),
        ({}, Commands(handles={"brakes": 0.4}), r"brakes at 0\.4: a button moves it to 0 or 1 only; fly .* commands"),
        ({}, Commands(handles={"brakes": 0.9}), r"brakes at 0\.9: a button"),
        ({}, Commands(handles={"gear": 0.4}), r"gear at 0\.4: a button"),
    ],
)
def test_what_a_device_cannot_do_is_said(content, commands, part):
    def use():
        stick = VirtualStick({**device(LEVER), **content})
        return stick.mode_button("auto", "manual") if commands is None else stick.joy(commands)

    with pytest.raises(ScenarioError, match=part):
        use()


def test_a_throttle_without_a_lever_is_said():
    stick = VirtualStick(device("xbox"))
    with pytest.raises(ScenarioError, match="throttle has no lever"):
        stick.joy(Commands(throttle=0.5))


def test_files_that_are_no_devices_are_said(tmp_path):
    with pytest.raises(ScenarioError, match=r"missing\.yaml"):
        load_stick(tmp_path / "missing.yaml")
    (tmp_path / "list.yaml").write_text("[1, 2]", encoding="utf-8")
    with pytest.raises(ScenarioError, match="expected a mapping"):
        load_stick(tmp_path / "list.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"device: Kn\xfcppel")
    with pytest.raises(ScenarioError, match=r"latin\.yaml: is not UTF-8 text; expected a file of config/joysticks"):
        load_stick(tmp_path / "latin.yaml")


def test_a_section_without_entries_is_none(tmp_path):
    text = config_file("joysticks", "xbox.yaml").read_text(encoding="utf-8")
    assert "functions:" not in text
    (tmp_path / "xbox.yaml").write_text(f"{text}\nfunctions:\n  # none\n", encoding="utf-8")
    commands = Commands(stick={"roll": 0.5, "pitch": 0.0, "yaw": 0.0})
    assert load_stick(tmp_path / "xbox.yaml").joy(commands) == VirtualStick(device("xbox")).joy(commands)
