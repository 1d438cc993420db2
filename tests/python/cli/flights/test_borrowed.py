"""What was taken of a bridge is given back whatever ends the program, and what is not, is said in words."""

from __future__ import annotations

import signal
import threading
from types import SimpleNamespace

import pytest

from xplane_bridge.cli.flights.borrowed import Borrowed, ReplayError, answered
from xplane_bridge.cli.flights.recorded_commands import give_stick_back
from xplane_bridge.cli.flights.recorded_poses import give_flight_model_back
from xplane_bridge.harness.processes import interrupted_by_signals

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
NEVER = threading.Event()


class Ros:
    """As much of rospy as it uses."""

    def __init__(self, ended=False):
        self.hooks = []
        self.on_shutdown = self.hooks.append
        self.is_shutdown = lambda: ended


@pytest.fixture(autouse=True)
def _signals_as_before():
    before = [signal.getsignal(number) for number in SIGNALS]
    yield
    for number, handler in zip(SIGNALS, before):
        signal.signal(number, handler)


def refused():
    raise ReplayError("it stays; run the panic tool")


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_the_wait_and_acts_once_all_is_given_back(number):
    done = []

    def play():
        with interrupted_by_signals("test"), Borrowed("test", Ros(), lambda: done.append("given back")) as borrowed:
            signal.raise_signal(number)
            done.append("between two waits")
            borrowed.wait(NEVER)

    with pytest.raises(KeyboardInterrupt):
        play()
    assert done == ["between two waits", "given back"]


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_does_not_cut_the_giving_back_short(number):
    done = []

    def give_back():
        signal.raise_signal(number)
        done.append("given back")
        signal.raise_signal(signal.SIGINT)

    def play():
        over = threading.Event()
        over.set()
        with interrupted_by_signals("test"), Borrowed("test", Ros(), give_back) as borrowed:
            assert borrowed.wait(over)

    with pytest.raises(KeyboardInterrupt):
        play()
    assert done == ["given back"]


def test_ros_ends_only_when_all_is_given_back():
    ros = Ros()
    still_there = []

    def give_back():
        ending.join(0.2)
        still_there.append(ending.is_alive())

    ending = threading.Thread(target=lambda: ros.hooks[0](), daemon=True)

    def play():
        with Borrowed("test", ros, give_back) as borrowed:
            ending.start()
            borrowed.wait(NEVER)

    with pytest.raises(ReplayError, match="ended by ROS"):
        play()
    assert still_there == [True]
    ending.join(10.0)
    assert not ending.is_alive()


def test_where_ros_has_ended_before_nothing_is_taken():
    ros = Ros(ended=True)
    with pytest.raises(ReplayError, match="ended by ROS"), Borrowed("test", ros, refused):
        pytest.fail("the block runs")
    ros.hooks[0]()  # as at the interpreter's exit: holds nothing up


def test_a_wait_has_an_end():
    with Borrowed("test", Ros(), lambda: None) as borrowed:
        assert not borrowed.wait(NEVER, 0.01)


def test_what_is_not_given_back_is_the_programs_error():
    with pytest.raises(ReplayError, match="it stays"), Borrowed("test", Ros(), refused):
        pass


def test_what_is_not_given_back_is_said_beside_what_ended_it(capsys):
    with pytest.raises(ReplayError, match="the first reason"), Borrowed("test", Ros(), refused):
        raise ReplayError("the first reason")
    assert capsys.readouterr().err == "test: it stays; run the panic tool\n"
    with pytest.raises(KeyboardInterrupt), interrupted_by_signals("test"), Borrowed("test", Ros(), refused):
        signal.raise_signal(signal.SIGTERM)
    assert capsys.readouterr().err == "test: it stays; run the panic tool\n\ntest: ending\n"


def test_a_node_that_hangs_or_is_gone_holds_nothing_up():
    hung = threading.Event()
    with pytest.raises(ReplayError, match=r"/tx_node/x: its node has not answered within 0\.05 s"):
        answered("/tx_node/x", lambda: hung.wait(5.0), 0.05)
    hung.set()
    with pytest.raises(ReplayError, match="/tx_node/x: connection refused"):
        answered("/tx_node/x", lambda: (_ for _ in ()).throw(OSError("connection refused")))
    assert answered("/tx_node/x", lambda: 3) == 3


def answer(success, *values):
    return SimpleNamespace(success=success, values=values, result=SimpleNamespace(message="X-Plane is silent"))


def gone():
    raise ReplayError("/tx_node/x: connection refused")


def test_a_flight_model_that_tx_node_or_x_plane_shows_is_given_back():
    give_flight_model_back(lambda: answer(True, 0.0), gone)
    give_flight_model_back(lambda: answer(False, 1.0), lambda: answer(True, 0.0))
    give_flight_model_back(gone, lambda: answer(True, 0.0))  # tx_node has ended, and has given it back


@pytest.mark.parametrize(
    ("write", "shown", "problem"),
    [
        (gone, gone, "connection refused; /tx_node/x: connection refused"),
        (gone, lambda: answer(True, 1.0), "connection refused"),
        (lambda: answer(False), lambda: answer(True, 1.0), "X-Plane is silent"),
        (lambda: answer(False), lambda: answer(False), "X-Plane is silent"),
    ],
)
def test_a_flight_model_that_stays_is_said(write, shown, problem):
    with pytest.raises(ReplayError, match=f"override_planepath.*{problem}.*scripts/release_overrides"):
        give_flight_model_back(write, shown)


@pytest.mark.parametrize(("ask", "problem"), [(gone, "connection refused"), (lambda: answer(False), "is silent")])
def test_a_mode_that_stays_is_said(ask, problem):
    with pytest.raises(ReplayError, match=f'MANUAL is not set.*{problem}.*/x "mode: 1".*scripts/release_overrides'):
        give_stick_back(ask, "/tx_node/x")
