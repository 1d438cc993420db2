"""What rerun_flight --commands asks for while it plays."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from xplane_bridge.cli.flights.recorded_commands import Commands, Played, _Player

START = {"latitude": 37.5, "longitude": 127.0, "altitude_msl": 900.0}
AUTO = 2


class ModeMessage:
    """As of control/mode; its bytes are the mode."""

    def deserialize(self, raw: bytes) -> ModeMessage:
        self.mode = raw[0]
        return self


def state(time: float, epoch: int) -> Any:
    return SimpleNamespace(**START, sim_time_unwrapped=time, epoch=epoch)


def test_a_recorded_mode_is_asked_for_again_where_the_flight_begins_again():
    commands = Commands([Played(0.5, "control/mode", bytes([AUTO]), "")], START, 10.0)
    asked: list[int] = []
    player = _Player(commands, {}, {"control/mode": ModeMessage}, asked.append)
    for epoch, begin in ((1, 100.0), (2, 0.0)):  # placed in two steps
        for time in (0.0, 1.0):
            player.on_state(state(begin + time, epoch))
            player.change_mode()
            player.change_mode()
    assert asked == [AUTO, AUTO]
