"""The checks of who flew: each passes a good flight and finds the fault it is there for."""

from __future__ import annotations

import socket
import threading

import numpy as np
import pytest

from support.flights.synthetic_flight import FlightBag
from xplane_bridge import protocol
from xplane_bridge.bags import Table
from xplane_bridge.harness.control_check import check_modes, check_stick, check_stuck, judge_control, spells
from xplane_bridge.harness.override_watch import OVERRIDES, OverrideWatch

S = 1_000_000_000
JOYSTICK = "/xplane/joystick_mapper_node"
TAKEOVER = "stick take-over: roll moved by 0.31 since AUTO was engaged"


def table(seconds, **columns):
    time = (np.asarray(seconds, dtype=float) * S).astype(np.int64)
    return Table("t", "m", time, {key: np.asarray(value) for key, value in columns.items()})


def modes(*changes):
    """control/mode: (time, mode, who asked, why)."""
    time, mode, who, why = zip(*changes)
    return table(time, mode=mode, requested_by=np.array(who, dtype=object), reason=np.array(why, dtype=object))


GOOD = ((0.0, 1, "", "start"), (4.0, 2, JOYSTICK, "request"), (8.0, 1, "control/manual", TAKEOVER))


def applied(sources, end=12.0, sequences=None, shown=None):
    """control/applied, ten a second: (from time, source)."""
    time = np.arange(0.0, end, 0.1)
    source = np.zeros(len(time), dtype=int)
    for begin, value in sources:
        source[time >= begin] = value
    number = np.arange(len(time)) if sequences is None else sequences
    read_back = np.ones(len(time)) if shown is None else shown
    return table(time, source=source, fields=np.where(source, 7, 0), sequence=number, read_back=read_back)


FLOWN = ((0.0, 1), (4.05, 2), (8.05, 1))


# -------------------------------------------------------------------------------------------------------------- modes


def test_repeated_messages_are_one_spell():
    times = modes((0.0, 1, "", "start"), (1.0, 1, "", "alive"), (4.0, 2, "a", "request"), (5.0, 2, "", "again"))
    first, second = spells(times, 9.0)
    assert (first.mode, first.start, first.end) == (1, 0.0, 4.0)
    assert (second.mode, second.start, second.end, second.asked_by) == (2, 4.0, 9.0, "a")


def test_a_controller_that_was_engaged_and_taken_over_has_flown():
    verdict = check_modes(modes(*GOOD), applied(FLOWN), JOYSTICK)
    assert verdict.passed
    assert verdict.text.startswith("4.0 s automatic, engaged by the joystick; back by moving the stick; 100.0%")
    button = (*GOOD[:2], (8.0, 1, JOYSTICK, "request"))
    assert "back by its button" in check_modes(modes(*button), applied(FLOWN), JOYSTICK).text


@pytest.mark.parametrize(
    ("changes", "sources", "part"),
    [
        (GOOD[:1], ((0.0, 1),), "no automatic flight"),
        ((GOOD[0], (4.0, 2, "operator", "request"), GOOD[2]), FLOWN, "no automatic flight"),
        ((GOOD[0], GOOD[1], (4.5, 1, "", TAKEOVER)), ((0.0, 1), (4.0, 2), (4.5, 1)), "no automatic flight of 1 s"),
        (GOOD[:2], ((0.0, 1), (4.0, 2)), "never ended by the stick"),
        (GOOD, ((0.0, 1),), "of the commands from whose turn it was"),
        (GOOD, ((0.0, 1), (4.05, 3), (8.05, 1)), "of the commands from whose turn it was"),
    ],
    ids=["never", "by another", "too short", "not back", "stick all along", "failsafe"],
)
def test_a_flight_without_a_controller_fails(changes, sources, part):
    verdict = check_modes(modes(*changes), applied(sources), JOYSTICK)
    assert not verdict.passed
    assert part in verdict.text


def test_a_stick_that_falls_silent_at_the_end_is_no_fault():
    assert check_modes(modes(*GOOD), applied((*FLOWN, (11.0, 3))), JOYSTICK).passed


# -------------------------------------------------------------------------------------------------------------- stick


def sent(*rows):
    """control/applied: (time, source, sequence, read back)."""
    time, source, sequence, shown = zip(*rows)
    return table(time, source=source, sequence=sequence, read_back=shown)


def frames(*time):
    return table(time, sim_time=time)


def test_a_command_is_reported_when_it_is_sent_and_again_when_it_is_shown():
    joy = table([0.0, 1.0], axes=[0, 1])
    reported = sent((0.0, 1, 1, 0), (0.01, 1, 1, 1), (0.02, 1, 2, 0), (0.03, 1, 2, 1))
    verdict = check_stick(joy, joy, reported, frames(-0.1, 0.005, 0.015, 0.025))
    assert verdict.passed
    assert "2 commands of it sent, 2 seen in X-Plane within 3 frames (wanted 1)" in verdict.text
    assert not check_stick(table([], axes=[]), joy, reported, frames(0.005)).passed


def test_commands_that_xplane_does_not_show_are_found():
    joy = table([0.0, 1.0], axes=[0, 1])
    reported = [(0.01 * k, 1, k, int(k == 0)) for k in range(8)] + [(0.09, 2, 9, 1)]
    every_frame = frames(*(0.01 * k + 0.005 for k in range(8)), 0.1)
    verdict = check_stick(joy, joy, sent(*reported), every_frame)
    assert not verdict.passed
    assert "8 commands of it sent, 1 seen in X-Plane within 8 frames (wanted 4)" in verdict.text
    # A simulator of two frames cannot show eight commands.
    assert check_stick(joy, joy, sent(*reported), frames(0.005, 0.045)).passed
    assert not check_stick(joy, joy, sent(*((t, s, n, 0) for t, s, n, _ in reported)), frames(0.005)).passed


# ------------------------------------------------------------------------------------------------------------ failure

LEFT, ELEMENT = "aileron1_wing2_left", ("aileron1", 2, 3)


def failures(*rows):
    """failures/state, one a second."""
    names, confirmed = np.empty(len(rows), dtype=object), np.empty(len(rows), dtype=object)
    names[:] = [[LEFT] if row else [] for row in rows]
    confirmed[:] = [[row == "confirmed"] if row else [] for row in rows]
    return table(range(len(rows)), names=names, confirmed=confirmed)


def surfaces(stuck_at=5.0, other=6.0, seconds=8):
    """mission/surfaces, ten a second; stuck from 2 to 5 s."""
    time = np.arange(0.0, seconds, 0.1)
    angles = np.zeros((len(time), 8))
    angles[:, 2] = np.where((time >= 1.95) & (time <= 5.05), stuck_at, 10.0 * np.sin(time))
    angles[:, 3] = other * np.sin(time)
    return table(time, aileron1=angles)


BROKEN = ("", "", "confirmed", "confirmed", "confirmed", "confirmed", "", "")


def test_a_surface_that_stands_while_its_counterpart_moves_is_stuck():
    verdict = check_stuck(failures(*BROKEN), surfaces(), ELEMENT, LEFT, 5.0)
    assert verdict.passed
    assert "for 3.0 s" in verdict.text


@pytest.mark.parametrize(
    ("states", "angles", "part"),
    [
        (("",) * 8, {}, "never confirmed"),
        (("", "", "set", "set", "", ""), {}, "never confirmed"),
        (BROKEN[:5], {}, "still broken at the end"),
        (BROKEN, {"stuck_at": 4.5}, "0.50 deg off"),
        (BROKEN, {"other": 0.5}, "counterpart moved by"),
    ],
)
def test_a_failure_that_is_none_is_found(states, angles, part):
    verdict = check_stuck(failures(*states), surfaces(**angles), ELEMENT, LEFT, 5.0)
    assert not verdict.passed
    assert part in verdict.text


# ---------------------------------------------------------------------------------------------------------- overrides


class FakeXPlane:
    """Answers RREF with what it is given, once a request: the watch asks again."""

    def __init__(self):
        self.values = {f"sim/operation/override/{name}": 0.0 for name in OVERRIDES}
        self.mute = False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self.port = self._socket.getsockname()[1]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        asked = {}
        while not self._ended.is_set():
            try:
                datagram, who = self._socket.recvfrom(4096)
                request = protocol.decode_request(datagram)
                asked[request.index] = (request.path, who)
            except socket.timeout:
                pass
            for index, (path, client) in asked.items():
                if not self.mute:
                    self._socket.sendto(protocol.encode_rref_response([(index, self.values[path])]), client)

    def close(self):
        self._ended.set()
        self._thread.join()
        self._socket.close()


@pytest.mark.parametrize(
    ("labels", "why"),
    [((), "too short"), (("stuck",), "ended with it broken")],
)
def test_what_a_short_flight_does_not_come_to_is_skipped(tmp_path, labels, why):
    path = tmp_path / "short.bag"
    types = {"flight_state": "FlightState", "control/mode": "ControlMode", "control/applied": "AppliedCommand"}
    types["control/manual"] = "ControlCommand"
    with FlightBag(path) as bag:
        for topic, kind in types.items():
            bag.add(f"/xplane/{topic}", f"xplane_bridge/{kind}", S, {})
        bag.add("/xplane/joy", "sensor_msgs/Joy", S, {})
        for label in labels:
            bag.add("/xplane/scenario/label", "std_msgs/String", S, {"data": label})
    modes, failure = judge_control(path, back_by="back", stuck="stuck", repaired="repaired")[1:]
    assert modes.line.startswith("skipped  modes ")
    assert failure.line.startswith("skipped  failure ")
    assert why in failure.line


@pytest.fixture
def xplane():
    fake = FakeXPlane()
    yield fake
    fake.close()


@pytest.fixture
def watch(xplane):
    one = OverrideWatch(xplane.port)
    yield one
    one.close()


def take(xplane, watch, name, value):
    from xplane_bridge.harness import wait_until

    xplane.values[f"sim/operation/override/{name}"] = value
    wait_until(lambda: watch.poll().get(name) == value, 10, f"{name} = {value}")


def test_overrides_that_were_taken_and_given_back_are_released(xplane, watch):
    take(xplane, watch, "override_joystick_roll", 1.0)
    take(xplane, watch, "override_joystick_roll", 0.0)
    verdict = watch.judge_end()
    assert verdict.passed
    assert verdict.text.endswith("on during the flight: override_joystick_roll")


def test_an_override_that_is_left_on_is_named(xplane, watch):
    take(xplane, watch, "override_control_surfaces", 1.0)
    verdict = watch.judge_end()
    assert not verdict.passed
    assert verdict.text.endswith("still on: override_control_surfaces")


def test_what_was_never_taken_was_not_flown(xplane, watch):
    assert xplane.port
    verdict = watch.judge_end()
    assert not verdict.passed
    assert "no override was ever on" in verdict.text


def test_an_xplane_that_is_silent_at_the_end_is_no_proof(xplane, watch, monkeypatch):
    monkeypatch.setattr("xplane_bridge.harness.override_watch._ANSWER_S", 0.5)
    take(xplane, watch, "override_joystick_roll", 1.0)
    take(xplane, watch, "override_joystick_roll", 0.0)
    xplane.mute = True
    verdict = watch.judge_end()
    assert not verdict.passed
    assert "not known" in verdict.text
