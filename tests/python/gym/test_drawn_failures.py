from __future__ import annotations

from typing import Any, Dict, Optional, Set, Tuple

import pytest

from xplane_bridge.gym import FlyEnv, FlyVectorEnv
from xplane_bridge.gym.errors import GymError

AILERON = "aileron1_wing2_left"
MIXED = {"name": AILERON, "kind": {"choice": ["stuck", "floating", "gone"]}, "value": {"uniform": [-9, 9]}}


def drawn(failure: Dict[str, Any], episodes: int = 20) -> Set[Tuple[str, str, Optional[float]]]:
    env = FlyEnv(episode={"failures": [failure]})
    env.reset(seed=1)
    seen = set()
    for _ in range(episodes):
        (broken,) = env.reset()[1]["conditions"]["failures"]
        seen.add((broken["name"], broken["kind"], broken["value"]))
    return seen


@pytest.mark.parametrize(
    ("failures", "text"),
    [
        ([{"name": "engine_3"}], "episode.failures[0]: failure 'engine_3': fixed_wing has none"),
        ([{"name": {"choice": ["engine_1", "engine_3"]}}], "'engine_3': fixed_wing has none"),
        ([{"name": {"choice": [AILERON, "engine_1"]}, "kind": "gone"}], "'engine_1': kind gone"),
        ([{"name": AILERON, "kind": {"choice": ["stuck", "failed"]}}], "kind is missing"),
        ([{**MIXED, "kind": "floating"}], "value is -9.0; expected none for kind floating"),
        ([{**MIXED, "kind": "reduced", "value": {"uniform": [0.5, 1.5]}}], "value is 1.5; expected 0..1"),
        ([{**MIXED, "kind": "slow", "value": {"normal": [10, 2]}}], "expected a rate above 0 deg/s (this may be drawn"),
        ([{**MIXED, "kind": "stuck", "value": {"choice": [0, 5, 100, 9]}}], "value is 100; expected -90..90 deg"),
        ([{**MIXED, "value": {"choice": ["a", "b"]}}], "failures[0].value.choice: ['a', 'b']; expected a list of numb"),
        ([{**MIXED, "at": {"choice": ["a"]}}], "episode.failures[0].at.choice: ['a']; expected a list of numbers"),
        (
            [{"name": {"choice": [AILERON, "engine_1"]}, "kind": {"choice": ["failed"]}}],
            "episode.failures[0]: failure 'aileron1_wing2_left': kind is missing",
        ),
        (
            [{"name": {"choice": ["rel_trim_elv", "engine_1"]}}, {"name": "rel_engfai0"}],
            "episode.failures[1]: failure 'rel_engfai0': broken already as engine_1",
        ),
    ],
)
def test_what_may_be_drawn_and_cannot_fail_is_refused_when_the_environment_is_made(failures: list, text: str) -> None:
    for make in (FlyEnv, FlyVectorEnv):
        with pytest.raises(GymError) as raised:
            make(episode={"failures": failures})
        assert text in str(raised.value)


def test_a_value_that_is_clipped_to_what_can_fail_is_drawn() -> None:
    values = {value for *_, value in drawn({**MIXED, "kind": "slow", "value": {"normal": [10, 9], "clip": [1, 40]}})}
    assert len(values) > 5
    assert all(1.0 <= value <= 40.0 for value in values if value is not None)


def test_of_drawn_kinds_those_without_a_value_leave_it_aside() -> None:
    seen = drawn(MIXED)
    assert {kind for _, kind, _ in seen} == {"stuck", "floating", "gone"}
    assert all((value is None) == (kind != "stuck") for _, kind, value in seen)


def test_every_choice_that_can_fail_is_drawn() -> None:
    assert drawn({"name": {"choice": ["engine_1", "rel_trim_elv"]}}) == {
        ("engine_1", "failed", None),
        ("rel_trim_elv", "failed", None),
    }


def test_a_drawn_failure_does_not_end_environments_that_go_on_by_themselves() -> None:
    envs = FlyVectorEnv(2, workers=1, episode={"failures": [MIXED]}, duration=1 / 30)
    envs.reset(seed=1)
    for _ in range(40):
        envs.step(envs.action_space.sample())
    envs.close()
