"""A law as a node, without ROS: what it commands, and what becomes of its mistakes."""

from __future__ import annotations

import logging
import sys
from types import SimpleNamespace
from typing import Any, Callable, List

import pytest

from xplane_bridge.cli.bridge.flown_law import FlownLaw, LawError
from xplane_bridge.constants import ControlField, FlightMode

STATE = SimpleNamespace(
    paused=False, valid=1, VALID_ATTITUDE=1, frame_count=7, sim_time_unwrapped=1.25, header=SimpleNamespace(stamp=0)
)


class Command(SimpleNamespace):
    """A ControlCommand as it is made."""

    def __init__(self, sequence: int) -> None:
        super().__init__(sequence=sequence, fields=0, engine_count=0, header=SimpleNamespace(stamp=None))
        self.engine_throttles, self.motors = [0.0] * 8, [0.0] * 8


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> List[str]:
    """With which reasons ROS was ended."""
    reasons: List[str] = []
    rospy = SimpleNamespace(signal_shutdown=reasons.append, spin=lambda: None, get_param=lambda _, default: default)
    monkeypatch.setitem(sys.modules, "rospy", rospy)  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "xplane_bridge.msg", SimpleNamespace(ControlCommand=Command))  # type: ignore[arg-type]
    monkeypatch.delenv("ROS_LOG_FILENAME", raising=False)
    return reasons


def flown(fly: Callable[[Any], Any], **more: Any) -> FlownLaw:
    law = FlownLaw(SimpleNamespace(fly=fly, **more), "fly_controller", "/xplane", [], needed=["ATTITUDE"])
    law._mode = FlightMode.AUTO
    return law


@pytest.mark.usefixtures("ends")
def test_engines_are_commanded_one_by_one() -> None:
    command = flown(lambda _: {"roll": 0.5, "engine_throttles": [0.7, 0.6]}).command(STATE)
    assert command is not None
    assert command.fields == ControlField.ROLL | ControlField.ENGINE_THROTTLES
    assert (command.sequence, command.engine_count) == (7, 2)
    assert command.engine_throttles == [0.7, 0.6, *[0.0] * 6]


@pytest.mark.parametrize("values", [None, {}])
def test_nothing_to_command_is_no_mistake(ends: List[str], values: Any) -> None:
    assert flown(lambda _: values).command(STATE) is None
    assert ends == []


def misspelt(state: Any) -> dict:
    return {"roll": state.roll_degrees}


def lacking(_: Any) -> dict:
    return {"pitch": {}["gain"]}


@pytest.mark.parametrize(
    ("fly", "text"),
    [
        (misspelt, "AttributeError: .*roll_degrees"),
        (lacking, "KeyError: 'gain'"),
        (lambda _: {"aileron": 0.1}, "ValueError: 'aileron' is no field of ControlCommand"),
        (lambda _: {"roll": "left"}, "ValueError: .*left"),
        (lambda _: 0.5, "AttributeError"),
    ],
)
def test_a_mistake_ends_the_node_at_once_with_a_line(
    ends: List[str], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, fly: Callable, text: str
) -> None:
    monkeypatch.setenv("ROS_LOG_FILENAME", "/var/log/fly_controller.log")
    law = flown(fly)
    with caplog.at_level(logging.ERROR):
        assert law.command(STATE) is None
    assert len(ends) == 1
    assert law.command(STATE) is None, "it flies no more"
    assert len(ends) == 1
    assert "Traceback (most recent call last)" in caplog.text
    monkeypatch.setattr(law, "_fly", lambda _: None)
    line = rf"^at 1\.25 s of simulator time: {text}[^\n]*; the traceback is in /var/log/fly_controller\.log$"
    with pytest.raises(LawError, match=line):
        law.run(engage=False)


def test_a_mistake_in_restart_is_one_too(ends: List[str]) -> None:
    law = flown(lambda _: {"roll": 0.0}, restart=lambda: 1 / 0)
    law._mode = FlightMode.MANUAL
    assert law.command(STATE) is None
    assert ends == ["at 1.25 s of simulator time: ZeroDivisionError: division by zero"]
