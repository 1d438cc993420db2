"""What rerun_flight --commands asks for while it plays."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from xplane_bridge.cli.flights.recorded_commands import Commands, Played, _Player, far
from xplane_bridge.units import EARTH_RADIUS_M

START = {"latitude": 37.5, "longitude": 127.0, "altitude_msl": 900.0}
AUTO = 2


class ModeMessage:
    """As of control/mode; its bytes are the mode."""

    def deserialize(self, raw: bytes) -> ModeMessage:
        self.mode = raw[0]
        return self


def state(time: float, epoch: int) -> Any:
    return SimpleNamespace(**START, sim_time_unwrapped=time, epoch=epoch)


def test_a_recorded_mode_is_asked_for_where_the_flight_begins_again_and_a_refusal_said():
    commands = Commands([Played(0.5, "control/mode", bytes([AUTO]), "")], START, 10.0)
    asked: list[int] = []
    said: list[str] = []

    def set_mode(mode: int) -> Any:
        asked.append(mode)
        return SimpleNamespace(success=len(asked) > 1, result=SimpleNamespace(message="another aircraft"))

    player = _Player(commands, {}, {"control/mode": ModeMessage}, set_mode, said.append)
    for epoch, begin in ((1, 100.0), (2, 0.0)):  # placed in two steps
        for time in (0.0, 1.0):
            player.on_state(state(begin + time, epoch))
            player.change_mode()
            player.change_mode()
    assert asked == [AUTO, AUTO]
    assert said == ["mode 2 of the recording is not set: another aircraft"]


@pytest.mark.parametrize(("shown", "placed"), [(179.9999, -179.9999), (-179.9999, 179.9999), (0.0001, -0.0001)])
def test_how_far_it_is_from_where_it_was_placed_is_known_also_across_the_date_line(shown: float, placed: float):
    there = SimpleNamespace(latitude=60.0, longitude=shown, altitude_msl=900.0)
    start = {"latitude": 60.0, "longitude": placed, "altitude_msl": 900.0}
    assert far(there, start) == pytest.approx(math.radians(0.0002) * EARTH_RADIUS_M * 0.5, rel=1e-6)
