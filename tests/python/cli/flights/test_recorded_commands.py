"""What rerun_flight --commands asks for while it plays."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Table
from xplane_bridge.cli.bridge import waiting
from xplane_bridge.cli.flights import recorded_commands
from xplane_bridge.cli.flights.borrowed import ReplayError
from xplane_bridge.cli.flights.recorded_commands import (
    PLACED_BY,
    Commands,
    NotAsAskedError,
    Played,
    _Player,
    fields_of,
    first_of,
    place,
    read_commands,
)

START = {"latitude": 37.5, "longitude": 127.0, "altitude_msl": 900.0}
MANUAL, AUTO = 1, 2


class ModeMessage:
    """As of control/mode; its bytes are the mode."""

    def deserialize(self, raw: bytes) -> ModeMessage:
        self.mode = raw[0]
        return self


def state(time: float, epoch: int) -> Any:
    return SimpleNamespace(**START, sim_time_unwrapped=time, epoch=epoch)


def player(messages: list[Played], said: list[str], set_mode: Any = None) -> _Player:
    return _Player(Commands(messages, START, 10.0), {}, {"control/mode": ModeMessage}, set_mode, said.append)


def mode(number: int, reason: str) -> Any:
    return SimpleNamespace(mode=number, reason=reason)


def test_a_recorded_mode_is_asked_for_once_and_a_refusal_said() -> None:
    asked: list[int] = []
    said: list[str] = []

    def set_mode(number: int) -> Any:
        asked.append(number)
        return SimpleNamespace(success=number == MANUAL, result=SimpleNamespace(message="another aircraft"))

    auto, manual = (Played(time, "control/mode", bytes([number]), "") for time, number in ((0.5, AUTO), (2.0, MANUAL)))
    playing = player([auto, manual], said, set_mode)
    for time in (100.0, 101.0, 103.0):
        playing.on_state(state(time, 1))
        playing.change_mode()
        playing.change_mode()
    assert asked == [AUTO, MANUAL]
    assert said == ["mode auto of the recording is not set: another aircraft"]


def test_a_recorded_mode_that_ends_is_said_and_not_asked_for_again() -> None:
    asked: list[int] = []
    said: list[str] = []
    playing = player(
        [Played(0.0, "control/mode", bytes([AUTO]), "")],
        said,
        lambda number: asked.append(number) or SimpleNamespace(success=True),
    )
    playing.on_mode(mode(MANUAL, "start"))
    playing.on_state(state(100.0, 1))
    playing.change_mode()
    playing.on_mode(mode(AUTO, "request"))
    assert said == []
    for reason in ("stick take-over", "request 7 is refused"):
        playing.on_mode(mode(MANUAL, reason))
        playing.change_mode()
    assert said == ["mode auto of the recording has ended: stick take-over"]
    assert asked == [AUTO]


def test_a_reset_ends_it_and_nothing_is_played_once_more() -> None:
    asked: list[int] = []
    playing = player([Played(0.5, "control/mode", bytes([AUTO]), "")], [], asked.append)
    for time, epoch in ((100.0, 4), (100.2, 4), (0.0, 5), (1.0, 5)):
        playing.on_state(state(time, epoch))
    playing.change_mode()
    assert playing.over.is_set()
    reasons = ("the flight was reset or placed anew", "X-Plane was lost", "its own replay", "clock .* set back")
    assert re.search(".*".join(reasons), playing.problem)
    assert asked == []


class Bridge:
    """tx_node, as far as place() asks it: its answer to reset_flight, and the events that are published after it.

    Args:
        answer: success, message, and number of the event.
        published: lists of events: number, success, text.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, answer: tuple[bool, str, int], published: list[Any]) -> None:
        success, message, number = answer
        self._lists = [[SimpleNamespace(number=n, success=ok, text=text) for n, ok, text in each] for each in published]
        self.topics: list[str] = []
        reply = SimpleNamespace(success=success, result=SimpleNamespace(message=message), event_number=number)
        rospy = SimpleNamespace(
            ServiceProxy=lambda *_: lambda **_: reply, Subscriber=self._subscribe, is_shutdown=lambda: self._publish()
        )
        monkeypatch.setitem(sys.modules, "rospy", rospy)  # type: ignore[arg-type]
        message_type = SimpleNamespace(_type="xplane_bridge/EventList")
        monkeypatch.setitem(sys.modules, "xplane_bridge.msg", SimpleNamespace(EventList=message_type))  # type: ignore[arg-type]
        monkeypatch.setitem(sys.modules, "xplane_bridge.srv", SimpleNamespace(ResetFlight=None))  # type: ignore[arg-type]
        self.now = 0.0
        clock = SimpleNamespace(monotonic=lambda: self.now, sleep=lambda _: None)
        for module in (recorded_commands, waiting):
            monkeypatch.setattr(module, "time", clock)

    def _subscribe(self, topic: str, _type: Any, take: Any, **_: Any) -> Any:
        self.topics.append(topic)
        self._take = take
        return SimpleNamespace(unregister=self.topics.clear)

    def _publish(self) -> bool:
        self.now += 1.0
        if self._lists:
            self._take(SimpleNamespace(events=self._lists.pop(0)))
        return False


PLACED = {**START, **dict.fromkeys(PLACED_BY[3:], 0.0)}
OF_BEFORE = [(6, True, "the flight goes on at the place, attitude and speed asked for")]


def test_it_is_placed_once_the_event_of_the_reset_has_come(monkeypatch: pytest.MonkeyPatch) -> None:
    bridge = Bridge(monkeypatch, (True, "", 7), [OF_BEFORE, OF_BEFORE, [*OF_BEFORE, (7, True, "it goes on")], []])
    place(PLACED, "/xplane")
    assert (bridge.now, bridge.topics) == (3.0, [])


def test_what_is_not_placed_is_an_error(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    Bridge(monkeypatch, (False, "a situation is loaded", 0), [])
    with pytest.raises(ReplayError, match="the aircraft is not placed: a situation is loaded"):
        place(PLACED, "/xplane")
    outcome = (7, False, "reset_flight: X-Plane did not place the aircraft")
    Bridge(monkeypatch, (True, "", 7), [OF_BEFORE, [*OF_BEFORE, outcome]])
    with pytest.raises(NotAsAskedError, match=r"^reset_flight: X-Plane did not place the aircraft"):
        place(PLACED, "/xplane")
    Bridge(monkeypatch, (True, "", 7), [OF_BEFORE])
    with pytest.raises(ReplayError, match=r"no end of reset_flight \(event 7\) on /xplane/events within 180 s"):
        place(PLACED, "/xplane")
    assert "waiting: reset_flight, whose event 7 is not on /xplane/events yet" in capsys.readouterr().err


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
