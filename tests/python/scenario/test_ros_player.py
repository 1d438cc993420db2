"""The player on the bridge's side: what it does with flight states, without ROS."""

from __future__ import annotations

import math
import sys
from types import SimpleNamespace
from unittest import mock

import pytest

from support.flights.states import state
from xplane_bridge.constants import ResultCode
from xplane_bridge.scenario import ScenarioError, parse_scenario, ros_player
from xplane_bridge.scenario.lockstep_player import LockstepPlayer
from xplane_bridge.scenario.player import Action
from xplane_bridge.scenario.ros_player import RosPlayer


def player(*events):
    return RosPlayer(parse_scenario({"name": "test", "events": list(events)}), "/xplane")


def test_the_stick_is_let_go_when_flight_states_end(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(ros_player.time, "monotonic", lambda: now[0])
    flying = player({"at": 0, "stick": {"roll": 0.5}}, {"at": 60, "end": True})
    assert flying._to_send() is None, "nothing is known yet"
    flying._on_state(state(10.0))
    now[0] += 0.9
    assert flying._to_send().stick["roll"] == 0.5
    now[0] += 0.2
    assert flying._to_send() is None, "rx_node may be gone; tx_node's failsafe must have its chance"
    flying._on_state(state(10.1))
    assert flying._to_send().stick["roll"] == 0.5


def test_a_state_that_cannot_be_played_ends_it_and_is_said():
    flying = player({"at": 0, "hold": {"roll": 0}}, {"at": 60, "end": True})
    flying._on_state(state(10.0))
    with pytest.raises(TypeError):
        flying._on_state(state(10.1, roll_deg="left"))
    assert flying._finished.is_set()
    assert "test, at 0.1 s: TypeError" in flying._error


def test_what_is_unknown_for_a_moment_is_forgotten_after_it():
    flying = player({"at": 0, "hold": {"roll": 0, "climb": 0, "speed": 60}}, {"at": 60, "end": True})
    flying._on_state(state(10.0, calibrated_airspeed=50.0))
    before = flying._to_send()
    flying._on_state(state(10.1, calibrated_airspeed=math.nan, vertical_speed=math.nan, roll_deg=math.nan))
    unknown = flying._to_send()
    assert math.isnan(unknown.stick["roll"]), "tx_node refuses and counts it"
    assert unknown.throttle == before.throttle
    flying._on_state(state(10.2, calibrated_airspeed=50.0))
    after = flying._to_send()
    assert after.throttle == pytest.approx(before.throttle, abs=0.05)
    assert all(math.isfinite(value) for value in after.stick.values())


def test_tx_node_hears_the_mode_requests_of_a_second_run(monkeypatch):
    """It ignores a number that it has had from the same node; a run asks for a mode less than once a second."""
    monkeypatch.setattr(ros_player.time, "time", lambda: 1000.0)
    first = player({"at": 60, "end": True})
    monkeypatch.setattr(ros_player.time, "time", lambda: 1060.0)
    assert player({"at": 60, "end": True})._mode_sequence >= first._mode_sequence + 60


def calls_of(monkeypatch, codes, event, flying_class=RosPlayer, **options):
    """Plays an event whose service answers with these codes, one after the other; gives how often it was called, and
    what was said.
    """
    answers = [
        SimpleNamespace(success=code <= ResultCode.ACCEPTED, result=SimpleNamespace(code=code, message=code.name))
        for code in codes
    ]
    calls = []

    def proxy(name, _):
        def call(**fields):
            calls.append((name, fields))
            return answers[min(len(calls), len(answers)) - 1]

        return call

    errors = {name: type(name, (Exception,), {}) for name in ("ROSException", "ServiceException")}
    rospy = SimpleNamespace(wait_for_service=lambda *_: None, ServiceProxy=proxy, **errors)
    monkeypatch.setitem(sys.modules, "rospy", rospy)
    monkeypatch.setitem(sys.modules, "xplane_bridge.srv", mock.MagicMock())
    now = [100.0]
    monkeypatch.setattr(ros_player.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(ros_player.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    said = []
    scenario = parse_scenario({"name": "test", "events": [{"at": 0, **event}, {"at": 60, "end": True}]})
    flying = flying_class(scenario, "/xplane", say=said.append, **options)
    ((kind, value),) = scenario.events[0].actions
    flying._act(Action(kind, value, 0.0))
    return len(calls), said


BREAK = {"failure": {"name": "engine_1", "kind": "failed"}}
NO_LINK, OK, ACCEPTED, REFUSED = ResultCode.NO_LINK, ResultCode.OK, ResultCode.ACCEPTED, ResultCode.REFUSED


def test_what_is_refused_for_want_of_a_link_is_asked_for_again(monkeypatch):
    assert calls_of(monkeypatch, [OK], BREAK) == (1, [])
    assert calls_of(monkeypatch, [NO_LINK, NO_LINK, ACCEPTED], BREAK) == (3, ["failure of engine_1: NO_LINK"])
    with pytest.raises(ScenarioError, match="failure of engine_1: NO_LINK"):
        calls_of(monkeypatch, [NO_LINK], BREAK)
    with pytest.raises(ScenarioError, match="failure of engine_1: REFUSED"):
        calls_of(monkeypatch, [NO_LINK, REFUSED], BREAK)


def test_an_excitation_is_asked_for_again_without_a_link_but_not_where_a_mode_is_needed(monkeypatch):
    doublet = {"excitation": {"kind": "doublet", "target": "roll", "amplitude": 0.1, "duration": 2}}
    assert calls_of(monkeypatch, [NO_LINK, ACCEPTED], doublet)[0] == 2
    with pytest.raises(ScenarioError, match="REFUSED"):
        calls_of(monkeypatch, [REFUSED, ACCEPTED], doublet)


def test_a_repair_without_a_link_is_not_asked_for_again_but_said(monkeypatch):
    """tx_node repairs when the link is back; a second request finds nothing that is broken, and is refused."""
    repairs = {"clear_failures": True}
    assert calls_of(monkeypatch, [NO_LINK, REFUSED], repairs) == (1, ["repairing everything: NO_LINK"])


def test_in_lock_step_no_link_comes_while_a_frame_waits(monkeypatch):
    with pytest.raises(ScenarioError, match="failure of engine_1: NO_LINK"):
        calls_of(monkeypatch, [NO_LINK, OK], BREAK, LockstepPlayer, check=lambda: None)
