"""A scenario in lock-step that waits for the stall warning: never for messages that rx_node does not send."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any, Callable, Dict, List

import pytest
import yaml

from support.flights.states import state
from xplane_bridge.lockstep import TopicInStep
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import ScenarioError, parse_scenario
from xplane_bridge.scenario.lockstep_player import LockstepPlayer
from xplane_bridge.scenario.ros_player import RosPlayer
from xplane_bridge.scenario.stall_warnings import RATE

FPS, FRAMES = 60, 240
NAME = "/xplane/rx_node/rates/warnings"
EVENTS = [{"at": 0}, {"when": {"stall_warning": True}, "label": "stalls"}, {"at": 60, "end": True}]


class Stamp:
    """As much of a time as the player takes."""

    def __init__(self, nsecs: int) -> None:
        self._ns = nsecs

    def to_nsec(self) -> int:
        return self._ns

    def __lt__(self, other: Stamp) -> bool:
        return self._ns < other._ns


class Ros:
    """What TopicInStep and the player use of rospy; nothing comes while they wait, so that would be for ever."""

    def __init__(self, params: Dict[str, Any]) -> None:
        self._params = params
        self._looks = 0
        self.take: Callable[[Any], None] = lambda _: None

    def get_param(self, name: str, default: Any) -> Any:
        return self._params.get(name, default)

    def Subscriber(self, _: str, __: Any, take: Callable[[Any], None], **___: Any) -> None:  # noqa: N802
        self.take = take

    def begin_frame(self) -> None:
        self._looks = 0

    def is_shutdown(self) -> bool:
        self._looks += 1
        assert self._looks == 1, "it waits for a message"
        return False


def make(monkeypatch: pytest.MonkeyPatch, params: Dict[str, Any]) -> LockstepPlayer:
    ros = Ros(params)
    monkeypatch.setitem(sys.modules, "rospy", ros)  # type: ignore[arg-type]
    player = LockstepPlayer(
        parse_scenario({"name": "stall", "events": EVENTS}), "/xplane", check=lambda: None, say=lambda _: None
    )
    player._modes = None
    player._warnings = TopicInStep("/xplane/mission/warnings", None)
    return player


def seen(player: LockstepPlayer, rate: int, stalls_from: int) -> List[bool]:
    """What it sees frame by frame, where warnings come at a rate as X-Plane sends it."""
    ros: Any = sys.modules["rospy"]
    sees = []
    begin, period = 10**18, 10**9 // FPS
    for frame in range(FRAMES):
        stamp = Stamp(begin + frame * period)
        if frame % (FPS // rate) == 0:
            ros.take(SimpleNamespace(header=SimpleNamespace(stamp=stamp), stall=float(frame >= stalls_from)))
        ros.begin_frame()
        player._look_around(state(frame / FPS, header=SimpleNamespace(stamp=stamp)))
        sees.append(player._stall)
    return sees


@pytest.mark.parametrize("rate", [1, 2, 3, 4])
def test_slow_warnings_count_after_a_period_of_theirs(monkeypatch: pytest.MonkeyPatch, rate: int) -> None:
    player = make(monkeypatch, {NAME: rate})
    assert player._find_warnings_age()
    first = seen(player, rate, FPS).index(True)
    assert first == FPS + FPS // rate + 1


@pytest.mark.parametrize("params", [{}, {NAME: 5}, {NAME: 20}])
def test_at_the_shipped_rate_and_above_they_count_after_a_fifth_of_a_second(
    monkeypatch: pytest.MonkeyPatch, params: Dict[str, Any]
) -> None:
    player = make(monkeypatch, params)
    assert player._find_warnings_age()
    assert seen(player, params.get(NAME, 5), FPS).index(True) == FPS + FPS // 5 + 1


def test_the_rate_without_a_parameter_is_the_shipped_one() -> None:
    shipped = yaml.safe_load(config_file("rx.yaml").read_text(encoding="utf-8"))
    assert shipped["rates"]["warnings"] == RATE


@pytest.mark.parametrize("real_time", [False, True])
def test_where_no_warnings_come_it_is_refused_at_the_start(monkeypatch: pytest.MonkeyPatch, real_time: bool) -> None:
    player: RosPlayer = make(monkeypatch, {NAME: 0})
    if real_time:
        player = RosPlayer(parse_scenario({"name": "stall", "events": EVENTS}), "/xplane", say=lambda _: None)
    monkeypatch.setattr(player, "_advertise", lambda: None)
    with pytest.raises(ScenarioError, match=f"stall waits for stall_warning, but {NAME} is 0, .* expected 1 to 1000"):
        player.run()
