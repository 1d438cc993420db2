"""The stick mode that a player takes where joystick_mapper_node has one."""

from __future__ import annotations

import pytest

from xplane_bridge.cli.scenario_player import stick_mode_of
from xplane_bridge.scenario import ScenarioError


@pytest.mark.parametrize(
    ("given", "mapped", "mode"),
    [(None, None, None), (None, 1, 1), (2, None, 2), (2, 2, 2), (1, "a", 1), (None, 3, None)],
)
def test_the_stick_mode_is_the_mappers(given, mapped, mode):
    assert stick_mode_of(given, mapped) == mode


def test_another_stick_mode_than_the_mappers_is_refused():
    with pytest.raises(ScenarioError, match=r"--stick-mode 2: joystick_mapper_node takes the axes as stick mode 1"):
        stick_mode_of(2, 1)
