"""What rerun_flight --commands asks for while it plays."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Table
from xplane_bridge.cli.flights.recorded_commands import (
    PLACED_BY,
    Commands,
    Played,
    _Player,
    far,
    fields_of,
    first_of,
    read_commands,
)
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


def test_it_is_placed_as_in_the_first_state_that_knows_all_that_takes():
    known = {name: np.array([np.nan, 1.0, 2.0]) for name in PLACED_BY}
    known["pitch_deg"] = np.array([0.0, np.nan, 3.0])
    known["orientation"] = np.zeros((3, 4))
    table = Table("", "", np.zeros(3, dtype=np.int64), known)
    assert fields_of(table, first_of(table)) == {**dict.fromkeys(PLACED_BY, 2.0), "pitch_deg": 3.0}


def test_commands_are_played_from_the_state_as_which_it_is_placed(tmp_path: Path):
    with FlightBag(tmp_path / "f.bag") as bag:
        for k in range(50):
            known = {} if k >= 20 else {"pitch_deg": math.nan}
            state = {**bag.state(k / 10, k), **known}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), state)
            command = {"fields": 1, "roll": k / 50}
            bag.add("/xplane/control/auto", "xplane_bridge/ControlCommand", stamp_ns(k / 10), command)
    commands = read_commands(tmp_path / "f.bag")
    assert [message.time for message in commands.messages] == pytest.approx([max(k - 20, 0) / 10 for k in range(50)])
    assert commands.duration == pytest.approx(2.9)


def test_an_aircraft_whose_place_is_not_known_is_not_where_it_was_placed():
    player = _Player(Commands([], START, 10.0), {}, {}, None, print)
    player.on_state(SimpleNamespace(**{**START, "latitude": math.nan}, sim_time_unwrapped=0.0, epoch=1))
    assert not player.placed.is_set()
    player.on_state(state(0.0, 1))
    assert player.placed.is_set()
