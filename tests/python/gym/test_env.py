from __future__ import annotations

import math
import re
import struct
import warnings
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from support.room_table import ROOT
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.compiled import NotCompiledError
from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.gym import FlyEnv, Hover, Task, WingsLevel
from xplane_bridge.gym.errors import GymError
from xplane_bridge.gym.spaces import FIELDS, Observer
from xplane_bridge.in_process.aircraft import Aircraft, Conditions
from xplane_bridge.in_process.view import place_of

AIRCRAFT = ("FixedWing", "Multirotor", "Tiltrotor")
STICK = ("roll", "pitch", "yaw")


def float32(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


@pytest.mark.parametrize("name", AIRCRAFT)
def test_gymnasiums_checker_has_nothing_to_say(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(f"xplane_bridge/{name}-v0").unwrapped)


@pytest.mark.parametrize("more", [{"task": WingsLevel}, {"image": (84, 60)}, {"frame_rate": 30.0, "frames": 1}])
def test_the_checker_is_content_with_tasks_pictures_and_rates(more: dict) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("xplane_bridge/FixedWing-v0", **more).unwrapped)


def test_what_is_observed_has_the_names_and_units_of_the_message() -> None:
    text = (ROOT / "msg/FlightState.msg").read_text(encoding="utf-8")
    units = dict(re.findall(r"^\S+ (\w+) +# \[([^\]]+)\]", text, re.MULTILINE))
    assert {name: field.unit for name, field in FIELDS.items()} == {
        name: units[name.partition(".")[0]] for name in FIELDS
    }
    page = (ROOT / "docs/experiments/gym.md").read_text(encoding="utf-8")
    for name, field in FIELDS.items():
        bounds = "sine and cosine" if field.turns else f"{field.low:g} .. {field.high:g}"
        assert f"| `{name}` | {field.unit} | {bounds} |" in page


def test_a_field_is_the_same_of_a_flight_in_process_as_of_a_message() -> None:
    conditions = Conditions("fixed_wing", weather={"turbulence": 3.0, "wind_speed": 5.0, "wind_from": 40.0})
    aircraft = Aircraft(conditions)
    for _ in range(30):
        aircraft.step()
    view = aircraft.view()
    places = {name: place_of(name) for name in FIELDS}
    assert {name: view[place] for name, place in places.items()} == {name: attrgetter(name)(view) for name in FIELDS}
    assert len(set(places.values())) == len(FIELDS)
    as_message = SimpleNamespace(**{name.partition(".")[0]: getattr(view, name.partition(".")[0]) for name in FIELDS})
    for fields in (["angular_velocity.y"], ["wind_ned.x", "track_deg", "control_throttle"]):
        observer = Observer(fields)
        assert observer.observe(view).tolist() == observer.observe(as_message).tolist()
    with pytest.raises(ValueError, match="not in tuple"):
        place_of("heading_magnetic_deg")


def test_an_action_flies_in_the_next_frame_as_float32_and_the_first_at_once() -> None:
    env = FlyEnv(fields=("control_roll", "roll_deg", "heading_true_deg"), axes=("roll",), frames=1)
    observed, _ = env.reset(seed=1, options={"heading": 30.0})
    assert env.field_names == ("control_roll", "roll_deg", "sin heading_true_deg", "cos heading_true_deg")
    assert observed.dtype == np.float32
    assert observed[[0, 2, 3]] == pytest.approx([0.0, 0.5, math.sqrt(0.75)], abs=1e-6)
    observed, *_ = env.step(np.array([0.1], np.float32))
    assert observed[0] == float32(0.1)
    assert env.truth.surfaces_deg["wing2r_ail1"] < -1.0  # trailing edge up: it rolls to the right


def test_each_axis_spans_its_own_range_and_the_trim_action_holds_the_flight() -> None:
    env = FlyEnv(axes=("pitch", "throttle", "flaps"), fields=("vertical_speed", "control_throttle"), frames=60)
    _, info = env.reset(seed=1)
    for _ in range(5):
        observed, *_ = env.step(info["trim_action"])
    assert abs(observed[0]) < 0.1
    # -1 is idle and flaps up, 1 is full: the throttle moves at once, the flaps at 7 of 42 degrees a second.
    observed, *_ = env.step(np.array([0.0, 1.0, 1.0], np.float32))
    assert observed[1] == 1.0
    assert env.truth.flap_ratio == pytest.approx(7 / 42, abs=0.005)
    observed, *_ = env.step(np.array([0.0, -1.0, -1.0], np.float32))
    assert observed[1] == 0.0


@pytest.mark.parametrize("axes", [None, ("motors",), ("engine_throttles",), ("throttle",)])
@pytest.mark.parametrize("aircraft", ["fixed_wing", "multirotor", "tiltrotor"])
def test_the_trim_action_holds_the_height_whatever_is_commanded(aircraft: str, axes: Any) -> None:
    env = FlyEnv(aircraft, axes=axes, frames=60)
    _, info = env.reset(seed=1)
    begin = env.truth.altitude_m
    env.step(info["trim_action"])
    assert env.truth.altitude_m == pytest.approx(begin, abs=0.01)  # with its engines off it is 4 cm lower, or metres


def test_motors_are_commanded_one_by_one() -> None:
    env = FlyEnv("multirotor", axes=("motors",), fields=("angular_velocity.x",), frames=1)
    env.reset(seed=1)
    assert env.axis_names == ("motors[0]", "motors[1]", "motors[2]", "motors[3]")
    # Those on the right, 0 and 3, at 60 %, those on the left at 30 %: it rolls to the left.
    for _ in range(10):
        observed, *_ = env.step(np.array([0.2, -0.4, -0.4, 0.2], np.float32))
    assert [engine.throttle for engine in env.truth.engines] == pytest.approx([0.6, 0.3, 0.3, 0.6])
    assert observed[0] < -0.1


def flown(env: FlyEnv, steps: int = 40, **reset: Any) -> np.ndarray:
    """Observations of an episode with fixed random actions."""
    observed, _ = env.reset(**reset)
    actions = np.random.default_rng(5).uniform(-0.3, 0.3, (steps, *env.action_space.shape)).astype(np.float32)
    return np.array([observed, *[env.step(action)[0] for action in actions]])


def test_a_seed_is_an_episode_also_after_others_and_in_a_new_env() -> None:
    episode = {"wind_speed": {"uniform": [0, 8]}, "turbulence": 2.0, "speed": {"uniform": [65, 80]}}
    env = FlyEnv(episode=episode)
    first = flown(env, seed=7)
    second = flown(env)
    assert not np.array_equal(second, first)
    assert np.array_equal(flown(env, seed=7), first)
    assert np.array_equal(flown(env), second)
    assert np.array_equal(flown(FlyEnv(episode=episode), seed=7), first)
    assert not np.array_equal(flown(env, seed=8), first)


def test_what_info_says_of_an_episode_brings_it_about_again() -> None:
    failures = [{"name": "aileron1_wing2_left", "kind": "stuck", "value": {"uniform": [-9, 9]}, "at": 0.2}]
    env = FlyEnv(task=WingsLevel, episode={"wind_from": {"uniform": [0, 360]}, "wind_speed": 5, "failures": failures})
    first = flown(env, seed=3)
    _, info = env.reset(seed=3)
    assert np.array_equal(flown(env, seed=99, options=info["conditions"]), first)


@pytest.mark.parametrize("options", [{"failures": []}, {"turbulence": None}, {"wind_speed": None, "failures": None}])
def test_what_info_says_is_also_what_an_option_switched_off(options: dict) -> None:
    failures = [{"name": "aileron1_wing2_left", "kind": "stuck", "value": 5, "at": 0.2}]
    env = FlyEnv(task=WingsLevel, episode={"wind_speed": 8, "turbulence": 1.0, "failures": failures})
    first = flown(env, seed=3, options=options)
    _, info = env.reset(seed=3, options=options)
    assert np.array_equal(flown(env, seed=99, options=info["conditions"]), first)
    assert not np.array_equal(flown(env, seed=3), first)


def test_a_drawn_start_that_cannot_be_flown_is_drawn_again_the_same_way_each_time() -> None:
    env = FlyEnv(episode={"speed": {"choice": [70, 200]}, "altitude": {"uniform": [500, 1500]}})
    first = [env.reset(seed=2)[1]["conditions"], *(env.reset()[1]["conditions"] for _ in range(20))]
    assert {conditions["speed"] for conditions in first} == {70.0}
    assert [env.reset(seed=2)[1]["conditions"], *(env.reset()[1]["conditions"] for _ in range(20))] == first


def test_a_start_that_no_draw_makes_fly_is_reported() -> None:
    env = FlyEnv(episode={"speed": {"uniform": [200, 201]}})
    with pytest.raises(FlightModelError, match=r"airspeed 20.*\(the last of 20 draws, .*: narrow the distributions"):
        env.reset(seed=1)
    with pytest.raises(FlightModelError) as raised:  # nothing is drawn
        env.reset(seed=1, options={"speed": 200})
    assert "draws" not in str(raised.value)


@pytest.mark.parametrize(
    ("drawn", "options", "text"),
    [
        ("speed", {"turbulence": -1}, "turbulence of -1"),
        ("speed", {"latitude": 200}, "latitude_deg=200.* the latitude within"),
        ("speed", {"altitude": 0}, "cannot start in the air at 0"),
        ("altitude", {"speed": 200}, "airspeed 200"),
        ("payload", {"fuel": 900}, "fuel .*900"),
        ("roll", {"altitude": 20000}, "no steady flight found"),
        ("wind_speed", {"altitude": 20000}, "no steady flight found"),
    ],
)
def test_a_wrong_number_is_an_error_at_once_whatever_is_drawn(drawn: str, options: dict, text: str) -> None:
    env = FlyEnv(episode={drawn: {"uniform": [60, 61]}})
    with pytest.raises(FlightModelError, match=text) as raised:
        env.reset(seed=1, options=options)
    assert "draws" not in str(raised.value)


@pytest.mark.parametrize(
    ("aircraft", "episode"),
    [
        ("fixed_wing", {"on_ground": {"choice": [1, 0]}, "altitude": 0, "speed": 0}),
        ("fixed_wing", {"payload": {"choice": [0, 300]}, "cg_aft": 0.25}),
        ("fixed_wing", {"speed": {"choice": [35, 75]}, "altitude": 4500}),
        ("multirotor", {"wind_speed": {"choice": [90, 0]}}),
        ("fixed_wing", {"wind_speed": {"choice": [-5, 5]}, "altitude": 500}),
    ],
)
def test_a_number_that_goes_with_some_draws_waits_for_them(aircraft: str, episode: dict) -> None:
    env = FlyEnv(aircraft, episode=episode)
    for seed in range(4):
        env.reset(seed=seed)


def test_fixing_one_thing_changes_no_other_draw() -> None:
    env = FlyEnv(episode={key: {"uniform": [0, 9]} for key in ("wind_speed", "wind_from", "turbulence", "payload")})
    _, drawn = env.reset(seed=4)
    _, fixed = env.reset(seed=4, options={"wind_from": 123.0})
    assert fixed["conditions"] == {**drawn["conditions"], "wind_from": 123.0}
    assert drawn["conditions"]["wind_from"] != 123.0


def test_start_wind_and_loading_are_those_of_the_options() -> None:
    env = FlyEnv()
    options = {"speed": 60, "altitude": 1500, "heading": 90, "roll": 25, "latitude": 10, "wind_speed": 10}
    env.reset(seed=1, options={**options, "wind_from": 270, "payload": 50, "fuel": 20, "temperature_offset": 10})
    truth = env.truth
    assert (truth.wind_north_mps, truth.wind_east_mps) == pytest.approx((0.0, 10.0), abs=1e-9)
    assert (truth.payload_kg, truth.fuel_kg) == (50.0, pytest.approx([20.0, 20.0], abs=1e-3))
    assert (truth.latitude_deg, truth.altitude_m) == pytest.approx((10.0, 1500.0), abs=1e-3)
    assert truth.true_airspeed_mps == pytest.approx(60.0, abs=0.05)
    assert (math.degrees(truth.heading_rad), math.degrees(truth.roll_rad)) == pytest.approx((90.0, 25.0), abs=0.05)


def test_a_failure_comes_when_it_is_due_and_is_gone_with_its_episode() -> None:
    env = FlyEnv(axes=("roll",), frames=1)
    failure = {"name": "aileron1_wing2_left", "kind": "stuck", "value": -7.5, "at": 0.5}
    env.reset(seed=1, options={"failures": [failure]})
    angles = []
    for _ in range(60):
        env.step(np.zeros(1, np.float32))
        angles.append(env.truth.surfaces_deg["wing2l_ail1"])
    assert all(abs(angle) < 2.0 for angle in angles[:30])  # the roll trim
    assert angles[-1] == -7.5
    env.reset()
    env.step(np.zeros(1, np.float32))
    assert abs(env.truth.surfaces_deg["wing2l_ail1"]) < 2.0


class Climbing(Task):
    def reward(self, state: Any, command: Any) -> float:
        return state.vertical_speed + 100.0 * command["pitch"]

    def ended(self, state: Any) -> str:
        return "high enough" if state.altitude_msl > 1001.0 else ""


def last_step(env: FlyEnv, action: Any, **options: Any) -> tuple:
    env.reset(seed=1, options=options)
    while True:
        _, reward, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return reward, terminated, truncated, info


@pytest.mark.parametrize(
    ("more", "action", "options", "outcome"),
    [
        ({"duration": 0.5}, [0, 0, 0, 0], {}, "time is up"),
        ({}, [0, -1, 0, 0], {"altitude": 15, "speed": 60}, "crashed"),
        ({}, [0, -0.6, 0, 1], {"altitude": 3000}, "faster than the never-exceed speed"),
        ({"task": Climbing}, [0, 0.5, 0, 0.5], {}, "high enough"),
        ({"task": WingsLevel, "axes": STICK}, [1, 0, 0], {"roll": 40}, "upside down"),
    ],
)
def test_however_an_episode_ends_it_says_so(more: dict, action: list, options: dict, outcome: str) -> None:
    env = FlyEnv(**more)
    _, terminated, truncated, info = last_step(env, np.array(action, np.float32), **options)
    assert info["outcome"] == outcome
    assert (terminated, truncated) == (outcome != "time is up", outcome == "time is up")
    if truncated:
        assert info["sim_time"] == pytest.approx(0.5, abs=1.001 / 60)
    with pytest.raises(GymError, match="call reset first"):
        env.step(np.array(action, np.float32))


def test_the_reward_is_the_tasks_and_none_without_one() -> None:
    env = FlyEnv(task=Climbing, axes=("pitch",), fields=("vertical_speed",))
    env.reset(seed=1)
    observed, reward, *_ = env.step(np.array([0.25], np.float32))
    assert reward == pytest.approx(float(observed[0]) + 25.0)
    env = FlyEnv(axes=("pitch",))
    env.reset(seed=1)
    assert env.step(np.array([0.25], np.float32))[1] == 0.0


def test_standing_still_earns_all_that_hover_has() -> None:
    env = FlyEnv("multirotor", task=Hover)
    _, info = env.reset(seed=1, options={"wind_speed": 0, "turbulence": 0, "altitude": 50})
    assert env.step(info["trim_action"])[1] == pytest.approx(1.0, abs=1e-3)


def test_pictures_show_the_flight_and_are_the_same_again() -> None:
    env = FlyEnv(axes=("roll",), image=(64, 48), render_mode="rgb_array")

    def last_picture(roll: float) -> np.ndarray:
        observed, _ = env.reset(seed=1)
        for _ in range(30):
            observed, *_ = env.step(np.array([roll], np.float32))
        return observed["image"]

    level, banked = last_picture(0.0), last_picture(1.0)
    assert level.shape == (48, 64, 3)
    assert np.array_equal(last_picture(0.0), level)
    # Sky, which is blue, the last of the three colours, above the ground.
    assert int(level[5, 5, 2]) > int(level[40, 5, 2])
    assert not np.array_equal(banked, level)
    assert env.render().shape == (480, 640, 3)


def test_the_size_of_a_picture_may_be_a_list() -> None:
    env = FlyEnv(image=[64, 48])
    assert env.reset(seed=1)[0]["image"].shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"fields": ("roll",)}, "fields: ['roll']; expected some of latitude"),
        ({"axes": ("rolls",)}, "axes: ['rolls']; expected some of roll"),
        ({"axes": ("throttle", "motors")}, "expected one of throttle, engine_throttles, motors at most"),
        ({"episode": {"wind": 3}}, "episode.wind: unknown key; expected latitude"),
        ({"episode": {"seed": -1}}, "episode.seed: -1; expected a whole number, 0 or more"),
        ({"episode": {"speed": "fast"}}, "episode.speed: 'fast'; expected a number, or a distribution"),
        ({"episode": {"speed": {"choice": ["slow"]}}}, "episode.speed.choice: ['slow']; expected a list of numbers"),
        ({"episode": {"failures": [{"kind": "stuck"}]}}, "episode.failures[0]: {'kind': 'stuck'}; expected"),
        ({"episode": {"failures": [{"name": "x", "kind": "bent"}]}}, "episode.failures[0].kind: 'bent'; expected one"),
        ({"episode": {"failures": [{"name": "x", "at": None}]}}, "episode.failures[0].at: None; expected a number"),
        ({"episode": {"failures": [{"name": 5}]}}, "episode.failures[0].name: 5; expected a text"),
        ({"episode": {"fuel": ["a", 2]}}, "episode.fuel: ['a', 2]; expected a number, a list of one for each tank"),
        ({"frame_rate": "60"}, "frame_rate: '60'; expected 20..240 Hz"),
        ({"image": (64.0, 64.0)}, "image: (64.0, 64.0); expected"),
        ({"frame_rate": 10.0}, "frame_rate: 10.0; expected 20..240 Hz"),
        ({"frames": 0}, "frames: 0; expected"),
        ({"duration": 0}, "duration: 0; expected"),
        ({"image": (8, 8)}, "image: (8, 8); expected"),
        ({"render_mode": "human"}, "render_mode: 'human'; expected"),
        ({"bridge": "udp"}, "bridge: 'udp'; expected None or 'ros'"),
    ],
)
def test_a_wrong_environment_is_reported(arguments: dict, text: str) -> None:
    with pytest.raises(GymError) as raised:
        FlyEnv(**arguments)
    assert text in str(raised.value)


def test_a_wrong_reset_or_action_is_reported() -> None:
    env = FlyEnv(axes=("roll",))
    with pytest.raises(GymError, match="call reset first"):
        env.step(np.zeros(1, np.float32))
    with pytest.raises(CampaignError, match=r"episode\.speed\.uniform: \[9, 5\]; expected"):
        env.reset(options={"speed": {"uniform": [9, 5]}})
    with pytest.raises(FlightModelError, match="airspeed 200"):
        env.reset(options={"speed": 200})
    with pytest.raises(GymError, match=r"episode\.failures\[0\]: .* fixed_wing has \(aileron1_wing2_left"):
        env.reset(options={"failures": [{"name": "aileron2_wing1_left", "kind": "stuck", "at": 9}]})
    env.reset(seed=1)
    with pytest.raises(GymError, match=r"action roll is 1\.5: expected -1\.\.1"):
        env.step(np.array([1.5], np.float32))
    with pytest.raises(GymError, match="action roll is nan"):
        env.step(np.array([np.nan], np.float32))
    with pytest.raises(GymError, match=r"action of shape \(2,\); expected 1 numbers: roll"):
        env.step(np.zeros(2, np.float32))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"speed": np.int64(70)}, {"speed": 70.0}),
        ({"speed": np.float32(70)}, {"speed": 70.0}),
        ({"on_ground": np.bool_(True)}, {"on_ground": 1.0}),
        ({"fuel": [np.float32(20), 30]}, {"fuel": [20.0, 30.0]}),
        ({"fuel": (np.int64(20), np.int64(30))}, {"fuel": [20.0, 30.0]}),
        ({"fuel": np.array([20, 30])}, {"fuel": [20.0, 30.0]}),
        ({"speed": {"uniform": [np.int64(70), np.float32(70)]}}, {"speed": 70.0}),
        ({"speed": {"normal": [80, 0], "clip": np.array([60, 70])}}, {"speed": 70.0}),
        ({"payload": {"choice": np.array([50, 50])}}, {"payload": 50}),
    ],
)
def test_numpys_numbers_are_numbers(given: dict, expected: dict) -> None:
    for env, options in ((FlyEnv(), given), (FlyEnv(episode=given), {})):
        conditions = env.reset(seed=1, options=options)[1]["conditions"]
        assert {key: conditions[key] for key in expected} == expected


def test_numpys_numbers_are_numbers_of_failures_too() -> None:
    failure = {
        "name": "aileron1_wing2_left",
        "kind": "stuck",
        "value": np.float32(5.0),
        "at": {"choice": [np.int64(1)]},
    }
    broken = FlyEnv().reset(seed=1, options={"failures": [failure]})[1]["conditions"]["failures"]
    assert broken == [{**failure, "value": 5.0, "at": 1}]


def test_wind_blows_from_where_it_is_said_to() -> None:
    with pytest.raises(FlightModelError, match=r"wind of -8 m/s: expected 0\.\.100"):
        FlyEnv(episode={"wind_speed": -8}).reset(seed=0)


def test_an_episode_may_begin_on_the_ground_by_true() -> None:
    assert FlyEnv(episode={"on_ground": True, "altitude": 0}).reset(seed=0)[1]["conditions"]["on_ground"]


def test_an_episode_without_its_failures_changes_no_later_one() -> None:
    speeds = []
    for options in ({}, {"failures": []}):
        env = FlyEnv(
            episode={"speed": {"uniform": [60, 80]}, "failures": [{"name": "engine_1", "at": {"uniform": [1, 3]}}]}
        )
        env.reset(seed=1, options=options)
        info = env.reset()[1]
        speeds.append((info["conditions"]["speed"], info["conditions"]["failures"][0]["at"]))
    assert speeds[0] == speeds[1]


def test_nothing_is_broken_over_the_bridge() -> None:
    env = FlyEnv(bridge="ros")
    with pytest.raises(GymError, match="failures: over the bridge"):
        env.reset(options={"failures": [{"name": "engine_1"}]})
    env.close()
    env.close()


def test_without_the_compiled_module_the_way_to_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    env = FlyEnv()
    monkeypatch.setattr("xplane_bridge.compiled.core", None)
    with pytest.raises(NotCompiledError, match="scripts/setup"):
        env.reset()
