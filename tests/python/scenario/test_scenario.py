"""Scenarios: what the loader accepts and refuses, and how the player plays."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.scenario import (
    FlightSample,
    Player,
    ScenarioError,
    load_scenario,
    parse_scenario,
)

SCENARIOS = Path(__file__).resolve().parents[3] / "config" / "scenarios"


def scenario(*events, **more):
    return parse_scenario({"name": "test", "events": list(events), **more})


LEVEL = FlightSample()


def play(player, until, sample=LEVEL, step=0.1):
    """Steps the player up to a time; gives (time, commands) of all steps."""
    out = []
    start = 0 if player.time == 0.0 else round(player.time / step) + 1
    for i in range(start, round(until / step) + 1):
        out.append((i * step, player.step(100.0 + i * step, sample)))
    return out


def labels(steps):
    return [
        (round(t, 6), action.value) for t, commands in steps for action in commands.actions if action.kind == "label"
    ]


# --- the loader ---


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_scenario_of_the_package_loads(path):
    assert load_scenario(path).events


def test_the_example_of_the_manual_is_a_scenario():
    manual = (SCENARIOS / "README.md").read_text(encoding="utf-8")
    example = manual.split("```yaml")[1].split("```")[0]
    assert parse_scenario(yaml.safe_load(example)).name == "left_aileron_stuck"


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], r"scenario: \[\]; expected a mapping"),
        ({"events": [{"at": 0}]}, "name: missing"),
        ({"name": "x"}, "events: None; expected a list"),
        ({"name": "x", "events": []}, "events: .*at least one"),
        ({"name": "x", "events": [{}]}, r"events\[0\]: is empty"),
        ({"name": "x", "events": [{"at": 0, "stik": {}}]}, r"events\[0\].stik: unknown key; expected one of at, after"),
        ({"name": "x", "events": [{"at": -1}]}, r"events\[0\].at: -1; expected a number from 0"),
        ({"name": "x", "events": [{"at": True}]}, r"events\[0\].at: True; expected a number"),
        ({"name": "x", "events": [{"at": float("nan")}]}, r"events\[0\].at: nan"),
        ({"name": "x", "events": [{"at": 1, "after": 1}]}, "both 'at' and 'after'"),
        ({"name": "x", "events": [{"at": 3}, {"at": 2}]}, r"events\[1\].at: 2.0; expected 3.0 or more"),
        ({"name": "x", "repeat_every": 5, "events": [{"at": 5}]}, "less than repeat_every"),
        (
            {"name": "x", "events": [{"at": 0, "stick": {"roll": 1.5}}]},
            r"stick.roll: 1.5; expected a number from -1 to 1",
        ),
        ({"name": "x", "events": [{"at": 0, "stick": {}}]}, "expected some of roll, pitch"),
        ({"name": "x", "events": [{"at": 0, "hold": {"bank": 3}}]}, "hold.bank: unknown key"),
        ({"name": "x", "events": [{"at": 0, "mode": "off"}]}, "mode: 'off'; expected one of manual, auto"),
        ({"name": "x", "events": [{"at": 0, "mode": ["auto"]}]}, r"mode: \['auto'\]; expected one of manual, auto"),
        (
            {"name": "x", "events": [{"at": 0, "stick": {"roll": 10**400}}]},
            r"roll: 1000.*; expected a number from -1 to 1",
        ),
        ({"name": "x", "events": [{"at": 0, "failure": {"kind": "stuck"}}]}, "failure.name: missing"),
        ({"name": "x", "events": [{"at": 0, "failure": {"name": "a", "kind": "bent"}}]}, "failure.kind: 'bent'"),
        ({"name": "x", "events": [{"at": 0, "excitation": {"kind": "chirp", "target": "roll"}}]}, "amplitude: missing"),
        (
            {"name": "x", "events": [{"at": 0, "excitation": {"kind": "chirp", "target": "roll,pitch"}}]},
            "only a multisine moves several axes",
        ),
        ({"name": "x", "events": [{"at": 0, "when": {"speed": {"over": 3}}}]}, "when.speed.over: unknown key"),
        ({"name": "x", "events": [{"at": 0, "when": {"speed": [1]}}]}, r"expected two bounds"),
        ({"name": "x", "events": [{"at": 0, "when": {"altitude": [1000, 900]}}]}, "altitude: above 1000 and below 900"),
        ({"name": "x", "events": [{"at": 0, "when": {"roll": {"above": 5, "below": 5}}}]}, "roll: above 5 and below 5"),
        ({"name": "x", "events": [{"at": 0, "when": {"altitude": True}}]}, "altitude: True; expected .low, high."),
        ({"name": "x", "events": [{"at": 0, "timeout": 3}]}, "timeout: without 'when'"),
        ({"name": "x", "events": [{"at": 0, "over": 5, "handles": {"flaps": 1}}]}, "over: without 'stick'; expected"),
        ({"name": "x", "events": [{"at": 0, "reset": {"start": [1]}}]}, r"reset\.start: \[1\]; expected one of place"),
        ({"name": "x", "events": [{"at": 0, "hat": {"y": 1}}]}, r"events\[0\].hat: unknown key; .*handles"),
        ({"name": "x", "events": [{"at": 0, "buttons": {"press": [99]}}]}, "button numbers 0..63"),
        (
            {
                "name": "x",
                "events": [
                    {"at": 0, "failure": {"name": "engine_1"}},
                    {"at": 1, "failure": {"name": "engine_l", "clear": True}},
                ],
            },
            r"events\[1\]\.failure\.name: 'engine_l' is cleared, but no event breaks it; expected engine_1",
        ),
        ({"name": "x", "gains": {"rol": 1}, "events": [{"at": 0}]}, "gains.rol: unknown key"),
        ({"name": "x", "start": {"altitude": 1e6}, "events": [{"at": 0}]}, "start.altitude: 1000000.0"),
        ({"name": "x", "start": {"on_ground": 1}, "events": [{"at": 0}]}, "start.on_ground: 1; expected true or false"),
        ({"name": "x", "start": {"ground": True}, "events": [{"at": 0}]}, "start.ground: unknown key"),
        ({"name": "x", "aerodrome": {"latitude": 1}, "events": [{"at": 0}]}, "aerodrome.longitude: missing"),
        ({"name": "x", "aerodrome": {"runway": 1}, "events": [{"at": 0}]}, "aerodrome.runway: unknown key"),
        ({"name": "x", "controller": "fly", "events": [{"at": 0}]}, "controller: 'fly'; expected module:class"),
        ({"name": "x", "controller": "fly:", "events": [{"at": 0}]}, "controller: 'fly:'; expected module:class"),
    ],
)
def test_what_is_wrong_is_said_with_its_key(document, message):
    with pytest.raises(ScenarioError, match=message):
        parse_scenario(document)


@pytest.mark.parametrize("seed", [-1, 2**32, 2**40, True, 1.5, "1"])
def test_a_seed_of_an_excitation_is_one_of_the_service(seed):
    excitation = {"kind": "multisine", "target": "roll", "amplitude": 0.1, "duration": 1}
    for good in (0, 2**32 - 1):
        parse_scenario({"name": "x", "events": [{"at": 0, "excitation": {**excitation, "seed": good}}]})
    with pytest.raises(ScenarioError, match=r"excitation\.seed: .*; expected a whole number from 0 to 4294967295"):
        parse_scenario({"name": "x", "events": [{"at": 0, "excitation": {**excitation, "seed": seed}}]})


def test_files_that_are_no_scenarios(tmp_path):
    with pytest.raises(ScenarioError, match=r"no\.yaml: cannot be read: No such file"):
        load_scenario(tmp_path / "no.yaml")
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: [")
    with pytest.raises(ScenarioError, match=r"bad\.yaml: does not parse as YAML: line 1, column 8: "):
        load_scenario(bad)
    bad.write_bytes(b"name: M\xfcnchen")
    with pytest.raises(ScenarioError, match=r"bad\.yaml: is not UTF-8 text"):
        load_scenario(bad)
    twice = "failure: {name: engine_1}, failure: {name: engine_2}"
    bad.write_text(f"name: x\nevents:\n- {{at: 5, {twice}}}\n")
    with pytest.raises(ScenarioError, match=r"YAML: line 3, column 38: 'failure' is there twice; expected each key"):
        load_scenario(bad)
    bad.write_text("name: x\nevents:\n- &a {at: 1, label: b}\n- {<<: *a, label: c}\n- *a\n- {<<: *a, at: 2}\n")
    assert [event.at for event in load_scenario(bad).events] == [1.0, 1.0, 1.0, 2.0]  # that is none
    bad.write_text("name: x\nevents: 3\n")
    with pytest.raises(ScenarioError, match=r"bad\.yaml: events: 3"):
        load_scenario(bad)


# --- time ---


def test_events_happen_at_their_times_and_after_each_other():
    player = Player(scenario({"at": 1, "label": "a"}, {"after": 0.5, "label": "b"}, {"at": 3, "label": "c"}))
    assert labels(play(player, 4.0)) == [(1.0, "a"), (1.5, "b"), (3.0, "c")]


def test_several_events_of_one_step_happen_in_their_order():
    player = Player(scenario({"at": 1, "label": "a"}, {"at": 1, "label": "b"}, {"label": "c"}))
    assert labels(play(player, 2.0)) == [(1.0, "a"), (1.0, "b"), (1.0, "c")]


def test_a_condition_is_waited_for():
    player = Player(
        scenario({"at": 1, "when": {"altitude": {"above": 500}}, "label": "high"}, {"after": 1, "label": "later"})
    )
    assert labels(play(player, 3.0, FlightSample(altitude=400.0))) == []
    assert labels(play(player, 5.0, FlightSample(altitude=600.0))) == [(3.1, "high"), (4.1, "later")]


def test_a_condition_times_out():
    player = Player(scenario({"at": 1, "when": {"stall_warning": True}, "timeout": 2, "label": "go on"}))
    assert labels(play(player, 5.0)) == [(3.0, "go on")]


def rolled_at(player, moment, pitched_at=math.inf):
    """Plays half a minute with 20 deg of roll from a moment on, and 10 deg of pitch."""
    out = []
    for i in range(300):
        t = i * 0.1
        sample = FlightSample(roll=20.0 * (t >= moment), pitch=10.0 * (t >= pitched_at))
        out.append((t, player.step(100.0 + t, sample)))
    return labels(out)


def test_it_is_an_events_turn_when_the_one_before_it_has_happened():
    late = {"at": 5, "when": {"roll": {"above": 10}}, "label": "rolled"}
    player = Player(scenario(late, {"at": 10, "label": "next"}, {"after": 5, "label": "last"}))
    assert rolled_at(player, 20.0) == [(20.0, "rolled"), (20.0, "next"), (25.0, "last")]
    # So its condition is waited for, too, and its time-out begins then.
    pitched = {"at": 10, "when": {"pitch": {"above": 5}}, "timeout": 5, "label": "pitched"}
    assert rolled_at(Player(scenario(late, pitched)), 20.0, 22.0) == [(20.0, "rolled"), (22.0, "pitched")]
    assert rolled_at(Player(scenario(late, pitched)), 20.0) == [(20.0, "rolled"), (25.0, "pitched")]


def test_all_conditions_must_hold():
    events = scenario({"when": {"roll": [-5, 5], "on_ground": False, "mode": "auto"}, "label": "now"})
    for sample, met in (
        (FlightSample(roll=3.0, mode=2), True),
        (FlightSample(roll=6.0, mode=2), False),
        (FlightSample(roll=3.0, mode=1), False),
        (FlightSample(roll=3.0, mode=2, on_ground=True), False),
    ):
        assert bool(labels(play(Player(events), 0.5, sample))) is met


def test_it_finishes_when_all_is_done_or_at_an_end():
    player = Player(scenario({"at": 1, "label": "a"}))
    steps = play(player, 2.0)
    assert [commands.finished for _, commands in steps][9:11] == [False, True]
    player = Player(scenario({"at": 1, "end": True}, {"at": 2, "label": "never"}))
    steps = play(player, 4.0)
    assert labels(steps) == []
    assert steps[-1][1].finished


def test_it_finishes_after_the_excitation_of_its_first_step():
    doublet = {"kind": "doublet", "target": "roll", "amplitude": 0.1, "duration": 1}
    steps = play(Player(scenario({"at": 0, "excitation": doublet, "end": True})), 1.0)
    assert [commands.finished for _, commands in steps][:2] == [False, True]
    assert [action.kind for action in steps[1][1].actions] == ["excitation"]


def test_it_repeats():
    player = Player(scenario({"at": 1, "label": "a"}, {"after": 1, "label": "b"}, repeat_every=4))
    assert labels(play(player, 10.0)) == [(1, "a"), (2, "b"), (5, "a"), (6, "b"), (9, "a"), (10, "b")]
    assert not player.step(111.0, FlightSample()).finished


def test_a_round_that_still_waits_is_ended_by_the_next():
    player = Player(
        scenario({"at": 1, "label": "a"}, {"when": {"speed": {"above": 999}}, "label": "never"}, repeat_every=4)
    )
    assert labels(play(player, 6.0)) == [(1, "a"), (5, "a")]


def test_time_that_runs_backwards_starts_it_anew():
    player = Player(scenario({"at": 1, "label": "a"}))
    assert len(labels(play(player, 2.0))) == 1
    assert player.step(0.0, FlightSample()).actions == []
    assert [a.value for a in player.step(1.0, FlightSample()).actions] == ["a"]


# --- stick, handles, holds ---


def test_stick_moves_at_once_or_over_a_time():
    player = Player(
        scenario({"at": 1, "stick": {"roll": 0.5}}, {"at": 2, "stick": {"roll": -0.5, "throttle": 1.0}, "over": 1})
    )
    steps = {round(t, 1): c for t, c in play(player, 4.0)}
    assert steps[0.9].stick["roll"] == 0.0
    assert steps[1.0].stick["roll"] == 0.5
    assert steps[2.5].stick["roll"] == pytest.approx(0.0, abs=1e-9)
    assert steps[3.0].stick["roll"] == pytest.approx(-0.5)
    assert steps[1.9].throttle is None  # never said: the lever stays where it is
    assert steps[2.5].throttle == pytest.approx(0.5)
    assert steps[4.0].throttle == 1.0


def test_a_stick_movement_begins_where_the_hold_of_its_axis_has_it():
    player = Player(
        scenario(
            {"at": 0, "stick": {"throttle": 1.0, "roll": 0.5}},
            {"at": 1, "hold": {"speed": 60, "roll": 0, "pitch": 5}},
            {"at": 5, "stick": {"throttle": 0.0, "roll": 0.0, "pitch": 0.0}, "over": 2},
        )
    )
    steps = {round(t, 1): c for t, c in play(player, 8.0, FlightSample(speed=70.0, roll=3.0))}
    held, begun, half = steps[4.9], steps[5.0], steps[6.0]
    assert held.throttle < 0.9
    assert held.stick["roll"] < 0.0 < held.stick["pitch"]
    for axis in ("roll", "pitch"):
        assert begun.stick[axis] == pytest.approx(held.stick[axis])
        assert half.stick[axis] == pytest.approx(held.stick[axis] / 2)
    assert (begun.throttle, half.throttle) == pytest.approx((held.throttle, held.throttle / 2))


@pytest.mark.parametrize("released", ["none", {"speed": None, "roll": None, "pitch": None, "yaw_rate": None}])
def test_what_a_hold_lets_go_does_not_go_back_to_an_earlier_stick(released):
    """The lever stays where it is, as without a stick before; a stick that is let go is in its middle."""
    holds = [
        {"at": 1, "hold": {"speed": 60, "roll": 0, "pitch": 5, "yaw_rate": 1}},
        {"at": 5, "hold": released},
    ]
    stick = {"throttle": 1.0, "roll": 0.4, "pitch": 0.3, "yaw": -0.2}
    ends = []
    for before in ([{"at": 0, "stick": stick}], []):
        flown = play(Player(scenario(*before, *holds)), 8.0, FlightSample(speed=66.0, roll=3.0))
        steps = {round(t, 1): c for t, c in flown}
        assert steps[6.0].throttle == pytest.approx(steps[4.9].throttle, abs=0.02)
        assert 0.0 < steps[6.0].throttle < 0.95
        ends.append(steps[7.9].stick)
    assert ends == [{"roll": 0.0, "pitch": 0.0, "yaw": 0.0}] * 2


def test_a_pitch_hold_takes_over_where_the_stick_is():
    """Without an error, the stick is what was integrated: that begins with what the stick was."""
    held = scenario({"at": 0, "stick": {"pitch": 0.25}}, {"at": 1, "hold": {"pitch": LEVEL.pitch}})
    pitch = {round(t, 1): commands.stick["pitch"] for t, commands in play(Player(held), 2.0)}
    assert pitch[0.9] == 0.25
    assert (pitch[1.0], pitch[1.9]) == (pytest.approx(0.25), pytest.approx(0.25))


def test_a_pitch_hold_that_begins_again_knows_nothing_of_the_last():
    holds = ({"at": at, "hold": {"pitch": pitch}} for at, pitch in ((1, 20.0), (3, None), (5, 0.0)))
    pitch = {round(t, 1): commands.stick["pitch"] for t, commands in play(Player(scenario(*holds)), 6.0)}
    assert pitch[2.9] > 0.8  # 0.6 of the error, and what was integrated
    assert pitch[4.0] == 0.0
    assert pitch[5.0] == pitch[5.9] == 0.0


def test_handles_have_the_names_of_the_command_and_old_names_still_work():
    old = {"speed_brake": 0.5, "roll_trim": 0.1, "pitch_trim": -0.2, "yaw_trim": 0.3}
    new = {"speedbrake": 0.5, "trim_roll": 0.1, "trim_pitch": -0.2, "trim_yaw": 0.3}
    with pytest.warns(FutureWarning, match="handles.speed_brake: is now called speedbrake"):
        accepted = parse_scenario({"name": "s", "events": [{"at": 0, "handles": old}]})
    assert accepted == parse_scenario({"name": "s", "events": [{"at": 0, "handles": new}]})


def test_buttons_and_handles():
    player = Player(
        scenario(
            {"at": 1, "buttons": {"press": [2], "tap": 5}},
            {"at": 2, "buttons": {"release": 2}, "handles": {"flaps": 0.5, "gear": 0}},
        )
    )
    steps = {round(t, 1): c for t, c in play(player, 3.0)}
    assert steps[0.5].buttons == set()
    assert steps[1.0].buttons == {2, 5}
    assert steps[1.1].buttons == {2}
    assert steps[2.0].buttons == set()
    assert steps[2.0].handles == {"flaps": 0.5, "gear": 0.0}


def test_actions_are_given_once_with_their_values():
    player = Player(
        scenario(
            {
                "at": 1,
                "mode": "auto",
                "failure": {"name": "aileron1_wing2_left", "kind": "stuck", "value": 5},
                "dataref": {"sim/time/sim_speed": 2},
                "command": "sim/operation/pause_on",
                "clear_failures": True,
            }
        )
    )
    actions = [action for _, commands in play(player, 3.0) for action in commands.actions]
    assert [(a.kind, a.value) for a in actions] == [
        ("mode", 2),
        ("failure", {"name": "aileron1_wing2_left", "kind": "stuck", "value": 5.0, "clear": False}),
        ("dataref", {"sim/time/sim_speed": 2.0}),
        ("command", "sim/operation/pause_on"),
        ("clear_failures", True),
    ]
    assert all(action.time == pytest.approx(1.0) for action in actions)


def test_holds_push_towards_their_targets():
    player = Player(scenario({"at": 0, "hold": {"roll": 20, "climb": 3, "speed": 70}}))
    first = player.step(0.0, FlightSample(roll=0.0, climb=0.0, speed=60.0))
    second = player.step(0.1, FlightSample(roll=30.0, climb=6.0, pitch=8.0, speed=90.0))
    assert first.stick["roll"] > 0.0 > second.stick["roll"]
    assert first.stick["pitch"] > 0.0 > second.stick["pitch"]
    assert first.throttle > second.throttle


def test_heading_hold_turns_the_short_way():
    player = Player(scenario({"at": 0, "hold": {"heading": 350}}))
    assert player.step(0.0, FlightSample(heading=10.0)).stick["roll"] < 0.0
    assert player.step(0.1, FlightSample(heading=330.0)).stick["roll"] > 0.0


def test_a_stick_movement_ends_the_hold_of_its_axis_and_a_hold_the_one_of_its_group():
    player = Player(
        scenario(
            {"at": 0, "hold": {"roll": 30, "altitude": 1000}},
            {"at": 1, "stick": {"roll": 0.1}},
            {"at": 2, "hold": {"pitch": 5}},
            {"at": 3, "hold": "none"},
        )
    )
    play(player, 0.5)
    assert (player.targets.roll, player.targets.altitude) == (30.0, 1000.0)
    play(player, 1.5)
    assert (player.targets.roll, player.targets.altitude) == (None, 1000.0)
    play(player, 2.5)
    assert (player.targets.pitch, player.targets.altitude) == (5.0, None)
    play(player, 3.5)
    assert player.targets.pitch is None


# --- the emulator's pilot ---


def fly(tmp_path, text, seconds, **options):
    path = tmp_path / "scenario.yaml"
    path.write_text(text)
    bench = EmulatorFixture(pilot=path, fps=60.0, **options)
    bench.step(round(seconds * 60))
    return bench


def test_demo_turns_climbs_stalls_and_recovers_within_twenty_seconds():
    with EmulatorFixture(aircraft="fixed_wing", pilot=SCENARIOS / "demo.yaml", fps=60.0) as bench:
        bank = climb = 0.0
        stalled = recovered = False
        for _ in range(24 * 60):
            bench.step()
            frame = bench.sim.frame
            bank = max(bank, abs(frame.true_phi))
            climb = max(climb, -frame.m.v_down_mps)
            stalled = stalled or (frame.m.stall_warning and bench.sim.clocks.flight < 20.0)
            recovered = recovered or (stalled and not frame.m.stall_warning and frame.m.true_airspeed_mps > 40.0)
        assert bank > 30.0
        assert climb > 5.0
        assert stalled
        assert recovered
        bench.step((2 * 90 - 24) * 60)  # and it goes on, and ends each round where it began
        assert not bench.sim.model.state.crashed
        assert bench.sim.model.state.altitude_m == pytest.approx(1000.0, abs=20.0)


def test_multisine_shakes_enough_to_measure_a_delay_by_and_stays_where_it_is():
    with EmulatorFixture(aircraft="fixed_wing", pilot=SCENARIOS / "multisine.yaml", fps=60.0) as bench:
        accelerations = []
        for _ in range(60 * 23):
            bench.step()
            accelerations.append(math.degrees(bench.sim.model.state.p_dot_rad_s2))
        tail = accelerations[60 * 3 :]
        assert math.sqrt(sum(a * a for a in tail) / len(tail)) > 2 * 14.0
        assert bench.sim.model.state.altitude_m == pytest.approx(1000.0, abs=10.0)


def test_pilot_holds_what_it_is_given(tmp_path):
    text = "name: t\nevents:\n- {hold: {heading: 30, altitude: 1050, speed: 72}}\n"
    bench = fly(tmp_path, text, 90.0, aircraft="fixed_wing")
    state = bench.sim.model.state
    bench.close()
    assert bench.sim.frame.true_psi == pytest.approx(30.0, abs=3.0)
    assert state.altitude_m == pytest.approx(1050.0, abs=8.0)
    assert state.calibrated_airspeed_mps == pytest.approx(72.0, abs=2.0)


def test_pilot_flies_until_a_client_does(tmp_path):
    with fly(tmp_path, "name: t\nevents:\n- {stick: {roll: 0.4}}\n", 0.1) as bench:
        yoke = "sim/joystick/yoke_roll_ratio"
        assert bench.read(yoke) == [pytest.approx(0.4)]
        bench.write({"sim/operation/override/override_joystick": 1.0, yoke: -0.2})
        assert bench.read(yoke) == [pytest.approx(-0.2)]
        bench.write({"sim/operation/override/override_joystick": 0.0})
        assert bench.read(yoke) == [pytest.approx(0.4)]


def test_pilot_fails_an_engine(tmp_path):
    with fly(tmp_path, "name: t\nevents:\n- {at: 0.5, failure: {name: engine_2}}\n", 1.0) as bench:
        running = "sim/flightmodel/engine/ENGN_running"
        assert bench.read(running + "[0]", running + "[1]") == [1.0, 0.0]


def test_scenario_of_another_aircraft_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="is a scenario for multirotor, not for fixed_wing"):
        fly(tmp_path, "name: t\naircraft: multirotor\nevents:\n- {at: 0}\n", 0.1, aircraft="fixed_wing")
