"""What becomes of changes that tx_node has accepted, and of disturbances that have to wait for them; without ROS."""

from __future__ import annotations

import sys
import threading
from types import SimpleNamespace
from typing import Any, Callable, Dict, List, Tuple
from unittest import mock

import pytest

from support.flights.states import state
from support.room_table import ROOT
from xplane_bridge.constants import ResultCode
from xplane_bridge.scenario import ScenarioError, parse_scenario, tx_services
from xplane_bridge.scenario.lockstep_player import LockstepPlayer
from xplane_bridge.scenario.ros_player import RosPlayer
from xplane_bridge.scenario.tx_services import CHANGE_WAIT_S, Outcomes

UNDER_WAY = "a change of the flight or its weather is under way: wait for its event"
RESET = {"reset": {"start": "runway", "airport": "NOPE"}}
GUST = {"disturb": {"kind": "gust", "from_deg": 270, "speed": 8, "duration": 6, "horizontal_only": True}}
NOT_BEGUN = "reset_flight: X-Plane begins no flight at runway 0, end 0 of NOPE"


def event(number: int, success: bool = True, text: str = "done") -> SimpleNamespace:
    return SimpleNamespace(number=number, success=success, text=text)


def listed(*events: SimpleNamespace) -> SimpleNamespace:
    return SimpleNamespace(events=list(events))


def outcomes() -> Tuple[Outcomes, List[Tuple[float, str]]]:
    failed: List[Tuple[float, str]] = []
    return Outcomes(lambda at, text: failed.append((at, text)), CHANGE_WAIT_S), failed


@pytest.mark.parametrize("before_the_answer", [False, True])
def test_a_change_that_does_not_come_about_has_failed(before_the_answer: bool) -> None:
    found, failed = outcomes()
    calls: List[Callable[[], None]] = [
        lambda: found.expect(7, 2.0, "reset"),
        lambda: found.take(listed(event(6, False, "of another"), event(7, False, NOT_BEGUN))),
    ]
    for call in reversed(calls) if before_the_answer else calls:
        assert failed == []
        call()
    assert failed == [(2.0, f"reset: {NOT_BEGUN}")]
    assert not found.pending()


def test_a_change_is_pending_until_it_is_reported() -> None:
    found, failed = outcomes()
    found.expect(3, 1.0, "wind")
    found.expect(4, 1.0, "weather")
    found.take(listed(event(3)))
    assert found.pending()
    found.take(listed(event(3), event(4)))
    assert not found.pending()
    assert failed == []


def test_a_change_that_is_never_reported_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(tx_services.time, "monotonic", lambda: now[0])
    found, failed = outcomes()
    found.expect(3, 1.0, "wind")
    found.expect(4, 1.0, "weather")
    now[0] += CHANGE_WAIT_S - 1.0
    found.take(listed(event(3)))
    now[0] += CHANGE_WAIT_S - 1.0
    assert found.pending(), "it began when the one before it had ended"
    now[0] += 2.0
    assert not found.pending()
    assert failed == [(1.0, "weather: tx_node has not reported event 4 within 150 s: see whether it still runs")]


def test_a_change_of_a_tx_node_that_was_started_anew_has_failed() -> None:
    found, failed = outcomes()
    found.take(listed(event(1), event(2)))
    found.expect(3, 1.0, "wind")
    found.take(listed(event(1)))
    found.take(listed(event(1), event(2), event(3)))
    assert failed == [(1.0, "wind: tx_node was started anew, and does not report event 3")]


# --- in a flight ---


class TxNode:
    """Accepts changes, and refuses disturbances as long as one is under way."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.busy = False
        self.called: List[str] = []
        errors = {name: type(name, (Exception,), {}) for name in ("ROSException", "ServiceException")}
        rospy = SimpleNamespace(wait_for_service=lambda *_: None, ServiceProxy=self._proxy, **errors)
        monkeypatch.setitem(sys.modules, "rospy", rospy)
        monkeypatch.setitem(sys.modules, "xplane_bridge.srv", mock.MagicMock())

    def _proxy(self, name: str, _: Any) -> Callable[..., SimpleNamespace]:
        service = name.rsplit("/", 1)[-1]

        def call(**_: Any) -> SimpleNamespace:
            self.called.append(service)
            refused = service == "disturb" and self.busy
            self.busy = self.busy or service != "disturb"
            result = SimpleNamespace(
                code=ResultCode.REFUSED if refused else ResultCode.ACCEPTED, message=UNDER_WAY if refused else ""
            )
            return SimpleNamespace(success=not refused, result=result, event_number=1)

        return call


def flight(kind: type, event_of_it: Dict[str, Any], **options: Any) -> RosPlayer:
    events = [{"at": 0, **event_of_it}, {"at": 0.5, "end": True}]
    player: RosPlayer = kind(parse_scenario({"name": "test", "events": events}), "/xplane", **options)
    return player


def test_the_refusal_is_tx_nodes() -> None:
    assert UNDER_WAY in (ROOT / "lib/actuation/actuation.cpp").read_text(encoding="utf-8")
    assert tx_services._UNDER_WAY in UNDER_WAY


def test_a_failed_change_ends_the_flight_with_its_text(monkeypatch: pytest.MonkeyPatch) -> None:
    TxNode(monkeypatch)
    flying = flight(RosPlayer, RESET)
    monkeypatch.setattr(flying, "_advertise", lambda: None)

    def play(_: Any) -> None:
        flying._on_state(state(10.0))
        flying._act(flying._of_others.get_nowait())
        assert flying._outcomes.pending()
        flying._outcomes.take(listed(event(1, False, NOT_BEGUN)))

    monkeypatch.setattr(flying, "_play", play)
    with pytest.raises(ScenarioError, match=f"test, at 0.0 s: reset: {NOT_BEGUN}"):
        flying.run()


def test_a_flight_that_is_ended_before_a_change_is_reported_has_not_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    flying = flight(RosPlayer, RESET)
    monkeypatch.setattr(flying, "_advertise", lambda: None)

    def play(_: Any) -> None:
        flying._outcomes.expect(1, 0.0, "reset")
        flying._finished.set()

    monkeypatch.setattr(flying, "_play", play)
    with pytest.raises(ScenarioError, match=r"test: ended by ROS after 0\.0 s"):
        flying.run()
    assert not flying.report()["finished"]


def test_a_disturbance_waits_for_the_change_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    tx_node, said = TxNode(monkeypatch), []
    flying = flight(RosPlayer, {"wind": {"speed": 5, "from_deg": 270}, **GUST}, say=said.append)
    refused = threading.Event()

    def sleep(_: float) -> None:
        refused.set()
        shown.wait(10.0)

    shown = threading.Event()
    monkeypatch.setattr(tx_services.time, "sleep", sleep)
    worker = threading.Thread(target=flying._act_all, args=(flying._of_others,), daemon=True)
    flying._on_state(state(10.0))
    worker.start()
    assert refused.wait(10.0)
    flying._on_state(state(10.4))
    tx_node.busy = False
    shown.set()
    flying._of_others.put(None)
    worker.join(10.0)
    assert flying._error is None
    assert tx_node.called == ["set_wind", "disturb", "disturb"]
    assert said[-1] == "warning: disturb of 0.0 s was carried out 0.4 s late"


def test_a_disturbance_waits_no_longer_than_a_change_may_take(monkeypatch: pytest.MonkeyPatch) -> None:
    TxNode(monkeypatch)
    now = [100.0]
    monkeypatch.setattr(tx_services.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(tx_services.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    flying = flight(RosPlayer, {"wind": {"speed": 5, "from_deg": 270}, **GUST})
    flying._on_state(state(10.0))
    flying._act_all(flying._of_others)
    assert flying._error == f"test, at 0.0 s: disturbance gust: {UNDER_WAY}"
    assert now[0] == pytest.approx(100.0 + CHANGE_WAIT_S, abs=1.0)


def test_in_lock_step_a_disturbance_is_asked_for_in_each_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """And events decide on nothing: neither on a command nor on the frame in which the flight is held."""
    tx_node = TxNode(monkeypatch)
    held: List[bool] = []
    events = {"wind": {"speed": 5, "from_deg": 270}, **GUST, "label": "asked for"}
    flying = flight(LockstepPlayer, events, check=lambda: None, say=lambda _: None)
    assert isinstance(flying, LockstepPlayer)
    flying._modes = flying._warnings = None
    flying._out = flying._label_publisher = mock.MagicMock()
    flying._hold = lambda: held.append(True)
    calls = []
    for frame in range(8):
        tx_node.busy = tx_node.busy and frame < 3
        stamped = SimpleNamespace(header=SimpleNamespace(stamp=frame), **vars(state(10.0 + 0.125 * frame)))
        if flying._answer(stamped) is not None:
            calls.append(len(tx_node.called))
    assert calls == [2, 3, 4, 5, 5]
    assert held == [True]
    assert flying._outcomes.pending()
    assert flying._has_ended()
