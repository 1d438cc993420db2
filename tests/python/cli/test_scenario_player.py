"""The device and the stick mode that a player takes where joystick_mapper_node has them; what it writes."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from xplane_bridge.cli import scenario_player
from xplane_bridge.cli.scenario_player import stick_mode_of, stick_of
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import ScenarioError
from xplane_bridge.scenario.player import Commands


@pytest.mark.parametrize(
    ("given", "mapped", "mode"),
    [(None, None, None), (None, 1, 1), (2, None, 2), (2, 2, 2), (1, "a", 1), (None, 3, None)],
)
def test_the_stick_mode_is_the_mappers(given, mapped, mode):
    assert stick_mode_of(given, mapped) == mode


def test_another_stick_mode_than_the_mappers_is_refused():
    with pytest.raises(ScenarioError, match=r"--stick-mode 2: joystick_mapper_node takes the axes as stick mode 1"):
        stick_mode_of(2, 1)


def mapper(stem, **changed):
    """joystick_mapper_node's parameters: the file of a device, and what an argument has changed."""
    return {**yaml.safe_load(config_file("joysticks", f"{stem}.yaml").read_text(encoding="utf-8")), **changed}


LOGITECH, XBOX = "Logitech Extreme 3D Pro", "Xbox-type gamepad"


@pytest.mark.parametrize(
    ("given", "mapped", "name"),
    [
        (None, mapper("xbox"), XBOX),
        ("xbox", mapper("xbox"), XBOX),
        (None, None, LOGITECH),
        ("xbox", None, XBOX),
        (None, {"stick_mode": 1}, LOGITECH),  # a mapper that was given nothing else yet
        (None, "a text", LOGITECH),
    ],
)
def test_the_device_is_the_mappers(given, mapped, name):
    assert stick_of(given, None, mapped).name == name


def test_another_device_than_the_mappers_is_refused():
    with pytest.raises(ScenarioError, match=f"--joy-config xbox is '{XBOX}', but .* flies with '{LOGITECH}'"):
        stick_of("xbox", None, mapper("logitech_extreme_3d_pro"))


def test_what_is_played_is_what_the_mapper_makes_commands_of():
    """A file of the user's, with another axis; and the mode that stick_mode:= has put beside the file."""
    mapped = mapper("xbox", direct={**mapper("xbox")["direct"], "roll": {"axis": 5, "scale": -1.0}})
    commands = Commands(stick={"roll": 0.25, "pitch": 0.0, "yaw": 0.0}, throttle=None, handles={})
    for given in (None, "xbox"):
        axes, _ = stick_of(given, None, mapped).joy(commands)
        assert axes[5] == pytest.approx(-0.25, abs=1e-6)
    pitch = mapper("xbox")["direct"]["pitch"]
    assert pitch["axis_mode_1"] != pitch["axis_mode_2"]
    commands.stick.update(roll=0.0, pitch=1.0)
    for mode in (1, 2):
        axes, _ = stick_of(None, None, mapper("xbox", stick_mode=mode)).joy(commands)
        assert abs(axes[pitch[f"axis_mode_{mode}"]]) == pytest.approx(1.0)


# --- what it writes ---


class Player:
    """Has flown, and fails where there is an error."""

    error = ""

    def __init__(self, *_, **__):
        pass

    def run(self):
        if self.error:
            raise ScenarioError(self.error)

    def report(self):
        return {"error": self.error}


def play(monkeypatch, log, error=""):
    """Runs the program without ROS; gives its exit code."""
    stand_ins = {
        "start_node": lambda *_, **__: SimpleNamespace(),
        "RosPlayer": type("Failing", (Player,), {"error": error}),
        "LoadedAircraft": lambda *_: SimpleNamespace(check=lambda: None),
        "wait_for_state": lambda *_: None,
        "lockstep": SimpleNamespace(is_on=lambda _: False, node_options=lambda _: {}),
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(scenario_player, name, stand_in)
    return scenario_player.main(["left_aileron_stuck", "--log", str(log)])


@pytest.mark.parametrize("error", ["", "the scenario has failed"])
def test_a_log_is_written_also_of_a_flight_that_has_failed(monkeypatch, tmp_path, capsys, error):
    log = tmp_path / "played.json"
    assert play(monkeypatch, log, error) == (1 if error else 0)
    assert json.loads(log.read_text(encoding="utf-8")) == {"error": error}
    assert error in capsys.readouterr().err


def test_a_log_without_its_folder_is_refused_before_anything_starts(monkeypatch, tmp_path, capsys):
    started = []
    monkeypatch.setattr(Player, "run", lambda _: started.append(True))
    assert play(monkeypatch, tmp_path / "none" / "played.json") == 1
    assert f"there is no folder {tmp_path / 'none'}; make it" in capsys.readouterr().err
    assert started == []


@pytest.mark.parametrize("error", ["", "the scenario has failed"])
def test_a_log_that_cannot_be_written_does_not_hide_the_error_of_the_flight(monkeypatch, tmp_path, capsys, error):
    full = Path("/dev/full")
    log = full if full.exists() and os.access(full, os.W_OK) else tmp_path
    assert play(monkeypatch, log, error) == 1
    *before, last = capsys.readouterr().err.splitlines()
    problem = f"--log {log}: "
    assert (error in last and problem in before[-1]) if error else problem in last
    assert "Traceback" not in "".join([*before, last])
