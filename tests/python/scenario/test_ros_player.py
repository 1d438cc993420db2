"""The player on the bridge's side: what it does with flight states, without ROS."""

from __future__ import annotations

import math
import sys
import threading
from types import SimpleNamespace
from unittest import mock

import pytest

from support.flights.states import state
from support.room_table import ROOT
from xplane_bridge.constants import ResultCode
from xplane_bridge.scenario import ScenarioError, parse_scenario, ros_player, tx_services
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


def calls_of(monkeypatch, codes, event, flying_class=RosPlayer, message="", before=(), **options):
    """Plays an event whose service answers with these codes, one after the other; gives how often it was called, and
    what was said. The answers' message is the code's name where none is given.
    """
    answers = [
        SimpleNamespace(
            success=code <= ResultCode.ACCEPTED, result=SimpleNamespace(code=code, message=message or code.name)
        )
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
    events = [*before, {"at": 0, **event}, {"at": 60, "end": True}]
    scenario = parse_scenario({"name": "test", "events": events})
    flying = flying_class(scenario, "/xplane", say=said.append, **options)
    ((kind, value),) = scenario.events[len(before)].actions
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


def test_repairing_what_is_not_broken_is_no_error_but_said(monkeypatch):
    """As in process; tx_node refuses it."""
    assert tx_services._NOT_BROKEN in (ROOT / "lib/actuation/failure_requests.cpp").read_text(encoding="utf-8")
    repair = {"failure": {"name": "engine_2", "clear": True}}
    broken = [{"at": 0, "failure": {"name": "engine_2"}}]
    answer = '"engine_2" is not broken: expected nothing, all is well'
    assert calls_of(monkeypatch, [REFUSED], repair, message=answer, before=broken) == (
        1,
        [f"repairing engine_2: {answer}"],
    )
    other = "engine_2 was failed in the simulator: set include_simulator"
    with pytest.raises(ScenarioError, match="set include_simulator"):
        calls_of(monkeypatch, [REFUSED], repair, message=other, before=broken)


def begun(flying):
    """Starts what carries out a player's actions; gives the threads of the modes and of the others."""
    queues = (flying._of_pilot, flying._of_others)
    workers = [threading.Thread(target=flying._act_all, args=(actions,), daemon=True) for actions in queues]
    for worker in workers:
        worker.start()
    return workers


def test_labels_and_modes_do_not_wait_for_a_failure_and_what_does_is_reported(monkeypatch):
    said, labels, carried_out = [], [], []
    scenario = parse_scenario(
        {
            "name": "test",
            "events": [
                {"at": 1, "failure": {"name": "aileron1_wing2_left", "kind": "hard_over_up"}, "label": "aileron"},
                {"at": 1.25, "failure": {"name": "engine_1"}, "mode": "auto", "label": "engine"},
                {"at": 60, "end": True},
            ],
        }
    )
    flying = RosPlayer(scenario, "/xplane", say=said.append)
    flying._label_publisher = SimpleNamespace(publish=labels.append)
    started, shown, asked = (threading.Event() for _ in range(3))

    def fail(value):
        started.set()
        assert shown.wait(10.0)
        carried_out.append(value["name"])

    monkeypatch.setattr(flying._services, "_failure", fail)
    monkeypatch.setattr(flying, "_request_mode", lambda _: asked.set())
    _, others = begun(flying)
    flying._on_state(state(10.0))
    flying._on_state(state(11.0))
    assert started.wait(10.0)
    flying._on_state(state(11.25))
    assert labels == ["aileron", "engine"]
    assert asked.wait(10.0)
    flying._on_state(state(12.375))
    assert carried_out == []
    shown.set()
    flying._of_others.put(None)
    others.join(10.0)
    assert carried_out == ["aileron1_wing2_left", "engine_1"]
    assert said[-1] == "warning: failure of 1.2 s was carried out 1.1 s late"
    (late,) = flying.report()["late"]
    assert (late["action"], late["value"]["name"]) == ("failure", "engine_1")
    assert (late["time"], late["late"]) == (1.25, 1.125)


def test_an_excitation_waits_for_the_first_command_that_is_heard(monkeypatch):
    """tx_node refuses one of an axis that nothing commands."""
    flying = player(
        {"at": 0, "stick": {"roll": 0}, "excitation": {"kind": "doublet", "target": "roll", "amplitude": 0.1,
                                                       "duration": 1}},
        {"at": 60, "end": True},
    )  # fmt: skip
    monkeypatch.setitem(sys.modules, "rospy", SimpleNamespace(get_rostime=lambda: None))
    excited = threading.Event()
    monkeypatch.setattr(flying._services, "_excitation", lambda _: excited.set())
    monkeypatch.setattr(flying, "_message", lambda *_: SimpleNamespace(header=SimpleNamespace(stamp=None)))
    begun(flying)
    flying._on_state(state(10.0))
    flying._on_state(state(10.1))
    publisher = mock.MagicMock()
    for listeners in (0, 1):
        assert not excited.wait(0.1)
        publisher.get_num_connections.return_value = listeners
        flying._publish(publisher)
    assert excited.wait(10.0)


def test_in_lock_step_no_link_comes_while_a_frame_waits(monkeypatch):
    with pytest.raises(ScenarioError, match="failure of engine_1: NO_LINK"):
        calls_of(monkeypatch, [NO_LINK, OK], BREAK, LockstepPlayer, check=lambda: None)


def test_a_pause_that_lasts_is_said_once(monkeypatch):
    now, said = [100.0], []
    monkeypatch.setattr(ros_player.time, "monotonic", lambda: now[0])
    flying = player({"at": 60, "end": True})
    monkeypatch.setattr(flying, "_say", said.append)
    flying._on_state(state(10.0))
    said.clear()

    def pause(seconds):
        for _ in range(seconds + 1):
            flying._on_state(state(12.5, paused=True))
            now[0] += 1.0
        flying._on_state(state(12.5))

    pause(4)
    pause(4)
    assert said == []
    flying._outcomes.expect(1, 0.0, "reset")
    pause(20)
    assert said == [], "reset_flight has paused it"
    flying._outcomes.take(SimpleNamespace(events=[SimpleNamespace(number=1, success=True, text="")]))
    pause(20)
    pause(20)
    (text,) = said
    assert "X-Plane is paused, and scenario time stands at 2.5 s: let it go on" in text
