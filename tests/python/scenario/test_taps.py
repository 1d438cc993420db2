"""Buttons that a scenario taps: none is lost, however the stick's messages lie between the states."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Dict, List

import pytest

from support.flights.states import state
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import parse_scenario
from xplane_bridge.scenario.lockstep_player import LockstepPlayer
from xplane_bridge.scenario.ros_player import STICK_RATE, RosPlayer
from xplane_bridge.scenario.taps import Taps
from xplane_bridge.scenario.virtual_stick import load_stick

BUTTON = 10
JOY = SimpleNamespace(data_class=SimpleNamespace)


def stick_player(events: list, kind: type = RosPlayer, **options: object) -> RosPlayer:
    stick = load_stick(config_file("joysticks", "logitech_extreme_3d_pro.yaml"))
    scenario = parse_scenario({"name": "taps", "events": [*events, {"at": 60, "end": True}]})
    return kind(scenario, "/xplane", stick=stick, say=lambda _: None, **options)


def shown(player: RosPlayer, rate: float, end: float, button: int = BUTTON) -> Dict[float, int]:
    """What each message shows of a button, by its time, where states come at a rate [1/s]."""
    buttons: Dict[float, int] = {}
    states = messages = 0
    while messages / STICK_RATE < end:
        if states / rate <= messages / STICK_RATE:
            player._play_on(state(states / rate))
            states += 1
        else:
            now = messages / STICK_RATE
            assert player._commands is not None
            buttons[round(now, 3)] = player._message(JOY, player._commands, now).buttons[button]
            messages += 1
    return buttons


def presses(buttons: Dict[float, int]) -> int:
    values = [0, *buttons.values()]
    return sum(after > before for before, after in zip(values, values[1:]))


@pytest.mark.parametrize("rate", [20.0, 60.0, 100.0])
def test_each_tap_is_a_press_whatever_the_rate_of_the_states(rate: float):
    events = [{"at": 0.1 + 0.21 * number, "buttons": {"tap": [BUTTON]}} for number in range(100)]
    assert presses(shown(stick_player(events), rate, 22.0)) == 100


def test_taps_in_close_succession_are_presses_of_their_own():
    events = [{"at": 1, "buttons": {"tap": [BUTTON]}}, {"at": 1.05, "buttons": {"tap": [BUTTON]}}]
    buttons = shown(stick_player(events), 60.0, 3.0)
    assert presses(buttons) == 2
    pressed = [time for time, value in buttons.items() if value]
    assert pressed[0] == pytest.approx(1.0, abs=0.04)
    assert pressed[-1] < 1.4


def test_a_tap_is_a_press_though_the_stick_is_not_looked_at_for_long():
    taps = Taps()
    taps.add(3)
    assert taps.look(100.0) == ({3}, set())
    taps.add(3)
    assert taps.look(200.0) == (set(), {3})
    assert taps.look(300.0) == ({3}, set())
    assert taps.pending
    assert taps.look(400.0) == (set(), set())
    assert not taps.pending


def test_a_button_that_a_mode_has_used_can_be_pressed_later():
    player = stick_player([{"at": 1, "buttons": {"press": [BUTTON]}}, {"at": 2, "buttons": {"release": [BUTTON]}}])
    player._taps.add(BUTTON)
    buttons = shown(player, 60.0, 3.0)
    assert presses(buttons) == 2
    assert (buttons[0.1], buttons[0.5], buttons[1.5], buttons[2.5]) == (1, 0, 1, 0)


def test_a_tap_leaves_a_button_that_is_held_pressed():
    events = [{"at": 1, "buttons": {"press": [BUTTON]}}, {"at": 2, "buttons": {"tap": [BUTTON]}}]
    buttons = shown(stick_player(events), 60.0, 3.0)
    assert presses(buttons) == 1
    assert buttons[2.9] == 1


def test_in_lock_step_a_tap_is_the_message_of_its_step():
    player = stick_player([{"at": 0.5, "buttons": {"tap": [BUTTON]}}], LockstepPlayer, check=lambda: None)
    values: List[int] = []
    for frame in range(60):
        player._play_on(state(frame / 20.0))
        values.append(player._message(JOY, player._commands, player._clock.now).buttons[BUTTON])
    assert [frame for frame, value in enumerate(values) if value] == [10]
