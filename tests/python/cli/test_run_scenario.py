"""run_scenario: what it starts for its command line."""

from __future__ import annotations

import json
from argparse import Namespace
from contextlib import nullcontext

import pytest

from xplane_bridge.analysis.scoring import Score
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.cli import run_scenario
from xplane_bridge.cli.run_scenario import lockstep_of, parser, plan_of
from xplane_bridge.cli.scenario_player import play
from xplane_bridge.scenario import ScenarioError, load_scenario, parse_scenario


@pytest.mark.parametrize(
    ("options", "fps"),
    [("", 60.0), ("--fps 30", 30.0), ("--fps=24 --seed 3", 24.0), ("--turbulence 1 --fps 30 --fps 50", 50.0)],
)
def test_lockstep_goes_by_the_emulators_frames(options, fps):
    lockstep = lockstep_of(parser().parse_args(["demo", "--lockstep", f"--emulator={options}"]))
    assert lockstep is not None
    assert lockstep.fps == fps


def test_frames_a_second_that_are_none_are_refused(capsys):
    with pytest.raises(SystemExit):
        lockstep_of(parser().parse_args(["demo", "--lockstep", "--emulator=--fps=none"]))
    assert "run_scenario --emulator: error: argument --fps: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--speed", "2"], "--speed 2.0: needs --lockstep"),
        (["--controller-node", "law"], "--controller-node law: needs --lockstep"),
        (["--lockstep", "--transport", "data"], "--lockstep flies with --transport rref"),
    ],
)
def test_options_that_do_not_go_together_are_refused(arguments, said):
    with pytest.raises(ScenarioError, match=said):
        lockstep_of(parser().parse_args(["demo", *arguments]))


def test_buttons_without_a_joystick_are_refused_before_anything_starts(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text("name: s\nevents:\n- {at: 0, label: a}\n- {at: 1, buttons: {tap: 0}}\n")
    pressing, arguments = load_scenario(file), [str(file), "--output", str(tmp_path / "out")]
    with pytest.raises(ScenarioError, match=r"s: events\[1\]\.buttons: .* a joystick \(--joystick NAME\)"):
        plan_of(pressing, parser().parse_args(arguments))
    assert plan_of(pressing, parser().parse_args([*arguments, "--joystick", "xbox"]))
    with pytest.raises(ScenarioError, match=r"s: events\[1\]\.buttons: .* a joystick \(--joystick\)"):
        play(Namespace(scenario=str(file)), [], "scenario_player", joystick=False)


def stand_in_for_a_flight(monkeypatch, late=(), scores=()):
    """Lets run_scenario find a flight that was flown to its end."""
    played = json.dumps({"finished": True, "labels": {}, "late": late})
    monkeypatch.setattr(run_scenario, "fly", lambda plan, **_: (plan.output / "played.json").write_text(played))
    monkeypatch.setattr(run_scenario, "Bags", nullcontext)
    monkeypatch.setattr(run_scenario, "read_flight", lambda _: None)
    monkeypatch.setattr(run_scenario, "judge", lambda *_: scores)


def test_what_was_carried_out_late_is_on_the_console(monkeypatch, tmp_path, capsys):
    entry = {"action": "failure", "value": {"name": "engine_1"}, "time": 8.2, "late": 1.07}
    stand_in_for_a_flight(monkeypatch, late=[entry])
    assert run_scenario.main(["engine_failure", "--output", str(tmp_path)]) == 0
    assert "run_scenario: warning: failure of 8.2 s was carried out 1.1 s late\n" in capsys.readouterr().err


def test_scores_are_strict_json(monkeypatch, tmp_path):
    scores = [Score(str(value), "settling", value, False, "below 5") for value in (1.5, float("inf"), float("nan"))]
    stand_in_for_a_flight(monkeypatch, scores=scores)
    assert run_scenario.main(["engine_failure", "--output", str(tmp_path)]) == 1
    text = (tmp_path / "scores.json").read_text(encoding="utf-8")
    criteria = json.loads(text, parse_constant=pytest.fail)["criteria"]
    assert {each["name"]: each["value"] for each in criteria} == {"1.5": 1.5, "inf": "never", "nan": None}


@pytest.mark.parametrize(
    ("options", "screens"),
    [
        ([], []),
        (["--headless"], []),
        (["--camera"], [False]),
        (["--camera", "--headless"], [True]),
        (["--emulator=--fps 30 --window=320x240"], [False]),
    ],
)
def test_a_screen_is_had_only_where_something_is_drawn(monkeypatch, tmp_path, options, screens):
    had = []
    stand_in_for_a_flight(monkeypatch)
    monkeypatch.setattr(run_scenario, "screen", lambda _, headless: had.append(headless) or nullcontext())
    assert run_scenario.main(["engine_failure", "--output", str(tmp_path), *options]) == 0
    assert had == screens


def test_a_file_that_is_named_like_a_shipped_scenario_is_not_meant(monkeypatch, tmp_path):
    stand_in_for_a_flight(monkeypatch)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "engine_failure").touch()
    assert run_scenario.main(["engine_failure", "--output", "out"]) == 0


def test_a_link_may_name_a_scenario_without_ending(monkeypatch, tmp_path):
    stand_in_for_a_flight(monkeypatch)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.txt").write_text("name: mine\nevents: [{at: 1, end: true}]\n", encoding="utf-8")
    (tmp_path / "mine.yaml").symlink_to("mine.txt")
    assert run_scenario.main(["mine.yaml", "--output", "out"]) == 0


def level(_state):
    """A controller that is a function."""
    return {"roll": 0.0}


def scenario(controller):
    return parse_scenario({"name": "s", "controller": controller, "events": [{"at": 1, "end": True}]})


@pytest.mark.parametrize("controller", [f"{__name__}:level", "xplane_bridge.controllers.twin:Hold"])
def test_a_controller_is_a_class_or_a_function(controller):
    plan = plan_of(scenario(controller), parser().parse_args(["s"]))
    assert plan.programs["controller"][1:] == [controller]


@pytest.mark.parametrize(
    ("controller", "said"),
    [
        ("nowhere:level", "'nowhere:level' cannot be had"),
        ("math:level", "'math:level' cannot be had"),
        ("collections:Counter", "collections:Counter has no method fly"),
        ("xplane_bridge.cli.attitude_hold:AttitudeHold", "AttitudeHold does not take them .* 'wanted'"),
    ],
)
def test_a_controller_that_cannot_fly_is_said_before_anything_starts(controller, said):
    with pytest.raises(CampaignError, match=said):
        plan_of(scenario(controller), parser().parse_args(["s"]))
    assert plan_of(scenario(controller), parser().parse_args(["s", "--controller", "my_own"]))


@pytest.mark.parametrize(
    ("events", "options", "longest"),
    [
        ("[{at: 0, label: a}]", [], 600.0),
        ("[{at: 900, label: a}, {after: 20, label: b}, {at: 910, label: c}]", [], 1520.0),
        ("[{at: 5, when: {roll: {above: 20}}, timeout: 100, label: a}, {after: 1, label: b}]", [], 706.0),
        ("[{at: 5, when: {roll: {above: 20}}, label: a}, {at: 30, label: b}]", [], 630.0),
        ("[{at: 900, label: a}]", ["--duration", "50"], 50.0),
    ],
)
def test_a_long_scenario_flies_to_its_end(tmp_path, events, options, longest):
    file = tmp_path / "s.yaml"
    file.write_text(f"name: s\nevents: {events}\n")
    args = parser().parse_args([str(file), "--output", str(tmp_path / "out"), *options])
    assert plan_of(load_scenario(file), args).duration == longest
