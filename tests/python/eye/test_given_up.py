"""The eye where the delay cannot or must not be measured: it goes on without, and leaves X-Plane alone."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import struct
import threading
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Tuple

import numpy as np
import pytest

from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge import protocol
from xplane_bridge.eye import calibrate, names, program, rref
from xplane_bridge.eye.calibrate import CalibrationError, Delay
from xplane_bridge.eye.grab import Grabber
from xplane_bridge.eye.pairing import Decision
from xplane_bridge.eye.sender import Sender
from xplane_bridge.eye.wire import DELAY_ASSUMED
from xplane_bridge.harness import HarnessError, wait_until

OWN_DEG = 71.0
ENOUGH = 5  #: pictures
LONGEST_S = 60.0


class OwnView(Grabber):
    """A window whose view stands still, whatever X-Plane's field of view."""

    def run(self) -> None:
        self.problem = ""
        pixels = np.zeros((48, 64, 4), np.uint8)
        while not self._stop.wait(0.05):
            self._take(pixels, program.time.perf_counter_ns(), 0)


class Receiver:
    """Instead of a connection to `capture_node`; ends the program by Ctrl-C after some pictures."""

    recorded_from = "never"  #: beginning of the problem with which a recording begins
    decisions: List[Decision]
    problems: List[str]

    def __init__(self, *_: object) -> None:
        pass

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        pass

    def offer(self, decision: Decision) -> None:
        self.decisions.append(decision)

    def report_problem(self, problem: str) -> None:
        self.problems.append(problem)

    def recorded(self, _: float) -> bool:
        return any(problem.startswith(self.recorded_from) for problem in self.problems)

    def take_request(self) -> int:
        if len(self.decisions) >= ENOUGH:
            raise KeyboardInterrupt
        return 0


class Run:
    """The eye, with its parts played by the test."""

    def __init__(
        self, xplane: FakeXPlane, folder: Path, receiver_port: int = 9, delay_s: Optional[float] = None
    ) -> None:
        self.xplane = xplane
        self.undo = folder / "undo.json"
        self.said: List[str] = []
        self.eye = program.Eye(
            program.EyeOptions(
                receiver=("127.0.0.1", receiver_port),
                xplane=("127.0.0.1", xplane.port),
                titles=("X-Plane",),
                window=None,
                token="",
                quality=90,
                delay_s=delay_s,
                calibrate=True,
                while_recorded=False,
                local_port=0,
                undo_file=self.undo,
            ),
            lambda line: self.say(line),
        )

    def say(self, line: str) -> None:
        self.said.append(line)

    def __call__(self) -> None:
        limit = threading.Timer(LONGEST_S, os.kill, (os.getpid(), signal.SIGTERM))  # its run ends by that, too
        limit.start()
        try:
            with pytest.raises(KeyboardInterrupt):
                self.eye.run()
        finally:
            limit.cancel()

    def written(self) -> List[float]:
        """Values of the field of view that X-Plane was sent."""
        requests = map(protocol.decode_request, list(self.xplane.others))
        return [request.value for request in requests if getattr(request, "path", "") == names.FIELD_OF_VIEW]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[..., Run]]:
    monkeypatch.setattr(calibrate, "_BETWEEN_S", (0.1, 0.12))
    monkeypatch.setattr(calibrate, "_SETTLE_S", 0.1)
    monkeypatch.setattr(program, "_CALIBRATE_AGAIN_S", 0.05)
    # A busy machine's X-Plane may be silent for a moment.
    monkeypatch.setattr(rref, "_SILENCE_S", LONGEST_S)
    monkeypatch.setattr(calibrate, "_WRITE_TIMEOUT_S", LONGEST_S)
    monkeypatch.setattr(program, "Sender", Receiver)
    monkeypatch.setattr(Receiver, "decisions", [], raising=False)
    monkeypatch.setattr(Receiver, "problems", [], raising=False)
    before = signal.getsignal(signal.SIGTERM)
    with FakeXPlane({FakeXPlane.TIME: 100.0, names.FIELD_OF_VIEW: OWN_DEG}) as xplane:

        def make(grabber: Any, *options: Any) -> Run:
            monkeypatch.setattr(program, "grabber_class", lambda: grabber)
            return Run(xplane, tmp_path, *options)

        yield make
    signal.signal(signal.SIGTERM, before)


def test_after_three_measurements_that_failed_flagged_pictures_go_out(start: Callable[..., Run]):
    run = start(OwnView)
    run()
    assert len(Receiver.decisions) >= ENOUGH, run.said
    assert sum(line.startswith("calibrating") for line in run.said) == 3
    reasons = [line for line in run.said if line.startswith("not calibrated")]
    assert len(reasons) == 3
    assert re.search(r"only 0 of \d+ steps .* field of view of its own does not: give --delay", reasons[-1])
    assert "delay: not measured, as 3 measurements have failed" in run.said[-1]
    assert "--delay gives what is known" in run.said[-1]
    assert all(decision.flags & DELAY_ASSUMED for decision in Receiver.decisions)
    assert all(decision.delay_s == 0.0 for decision in Receiver.decisions)
    wait_until(lambda: run.written()[-1:] == [OWN_DEG], 10.0, "the user's field of view")
    assert OWN_DEG + 8.0 in run.written()
    assert not run.undo.exists()
    assert Receiver.problems[-1] == ""


class Vanishing(OwnView):
    """A window that is found to be gone once after each time that `gone` is set."""

    gone = False

    @property
    def problem(self) -> str:
        was, Vanishing.gone = Vanishing.gone, False
        return "the window is minimised" if was else ""

    @problem.setter
    def problem(self, _: str) -> None:
        pass


@pytest.mark.parametrize(("cut_short", "own_faults", "measured"), [(5, 2, True), (2, 3, False)])
def test_measurements_that_a_lost_window_cuts_short_do_not_count(
    start: Callable[..., Run], monkeypatch: pytest.MonkeyPatch, cut_short: int, own_faults: int, measured: bool
):
    left = [True] * cut_short + [False] * own_faults

    def measure(*_: Any) -> Delay:
        if not left:
            return Delay(0.02, 10, 0.0)
        Vanishing.gone = left.pop(0)
        raise CalibrationError("nothing was seen")

    monkeypatch.setattr(calibrate.Calibration, "run", measure)
    run = start(Vanishing)
    run()
    assert len(Receiver.decisions) >= ENOUGH, run.said
    assert left == []
    outcome = next(line for line in run.said if line.startswith("delay"))
    assert outcome.startswith("delay: 20.0 ms" if measured else "delay: not measured")
    assert bool(Receiver.decisions[-1].flags & DELAY_ASSUMED) != measured


class CaptureNode:
    """Welcomes each hello, and says whether its pictures are being recorded just then; may ask for a measurement."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self.recorded = False
        self.answer: Optional[Tuple[int, int, bytes]] = None  #: whether measured, number of the request, text
        self._connection: Optional[socket.socket] = None
        threading.Thread(target=self._run, daemon=True).start()

    def ask(self, number: int) -> None:
        wait_until(lambda: self._connection is not None, LONGEST_S, "the eye at capture_node")
        self._connection.sendall(struct.pack("<4sHHQ", b"XEYA", 1, 3, number))

    def _run(self) -> None:
        while True:
            try:
                connection, _ = self._server.accept()
            except OSError:
                return
            self._connection = connection
            with connection, connection.makefile("rb") as stream:
                while True:
                    prefix = stream.read(16)
                    if len(prefix) < 16:
                        break
                    header, body = struct.unpack_from("<HI", prefix, 6)
                    content = stream.read(header + body)
                    kind = content[0]
                    if kind == 4:
                        self.answer = (*struct.unpack_from("<HQ", content, 2), content[header:])
                    if kind == 1:
                        connection.sendall(struct.pack("<4sHHQ", b"XEYA", 1, 0, self.recorded))

    def close(self) -> None:
        self._server.close()


class Hidden(OwnView):
    """A window that comes as late as the test wants."""

    shown = threading.Event()

    def run(self) -> None:
        self.problem = "X-Plane has no window yet"
        self.shown.wait()
        super().run()


def test_a_recording_that_began_while_x_planes_window_was_awaited_is_not_measured_in(
    start: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(program, "Sender", Sender)
    monkeypatch.setattr(program, "_ANSWER_S", LONGEST_S)
    monkeypatch.setattr(Hidden, "shown", threading.Event())
    node = CaptureNode()
    try:
        run = start(Hidden, node.port)

        def say(line: str) -> None:
            run.said.append(line)
            if line == "waiting for X-Plane's window":
                node.recorded = True
                Hidden.shown.set()
            elif line.startswith(("delay", "calibrating")):
                raise KeyboardInterrupt

        run.say = say
        run()
    finally:
        node.close()
    assert any(line.endswith("takes pictures") for line in run.said)
    assert "not measured, as capture_node's pictures are being recorded" in run.said[-1]
    assert run.written() == []


def test_a_recording_that_began_after_a_measurement_that_failed_ends_the_attempts(
    start: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(Receiver, "recorded_from", "not calibrated")
    run = start(OwnView)
    run()
    assert sum(line.startswith("calibrating") for line in run.said) == 1
    assert any("as capture_node's pictures are being recorded" in line for line in run.said)
    assert all(decision.flags & DELAY_ASSUMED for decision in Receiver.decisions)
    wait_until(lambda: run.written()[-1:] == [OWN_DEG], 10.0, "the user's field of view")
    assert not run.undo.exists()


def test_a_request_is_refused_at_once_while_x_planes_window_is_awaited(
    start: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(program, "Sender", Sender)
    monkeypatch.setattr(Hidden, "shown", threading.Event())
    node = CaptureNode()
    try:
        run = start(Hidden, node.port)

        def ask() -> None:
            node.ask(7)
            with contextlib.suppress(HarnessError):
                wait_until(lambda: node.answer is not None, 10.0, "the answer")
            Hidden.shown.set()

        def say(line: str) -> None:
            run.said.append(line)
            if line == "waiting for X-Plane's window":
                threading.Thread(target=ask, daemon=True).start()
            elif line.startswith("calibrating"):
                raise KeyboardInterrupt

        run.say = say
        run()
    finally:
        node.close()
    assert node.answer == (0, 7, b"waiting for X-Plane's window")
    assert run.written() == []


class Requests(Receiver):
    """Asks for a measurement, and ends the program by Ctrl-C when `done`."""

    asked = False
    answers: List[Tuple[int, bool, str]]

    @staticmethod
    def done() -> bool:
        return True

    def take_request(self) -> int:
        if not self.asked and self.decisions:
            self.asked = True
            return 5
        if self.answers and self.done():
            raise KeyboardInterrupt
        return 0

    def answer(self, *answer: Any) -> None:
        self.answers.append(answer)


@pytest.fixture
def requests(monkeypatch: pytest.MonkeyPatch) -> List[Tuple[int, bool, str]]:
    """Answers to a request that comes with the first picture; to be had after `start`."""
    monkeypatch.setattr(program, "Sender", Requests)
    monkeypatch.setattr(program, "_MEASUREMENTS", 0)  # at the start
    monkeypatch.setattr(Requests, "answers", [], raising=False)
    return Requests.answers


@pytest.mark.parametrize(
    "begun",
    [
        pytest.param("", id="since it was made"),
        pytest.param("the eye is calibrating", id="while another eye measured"),  # for which this one waited
    ],
)
def test_a_request_is_refused_where_a_recording_has_begun(
    start: Callable[..., Run], requests: List[Tuple[int, bool, str]], monkeypatch: pytest.MonkeyPatch, begun: str
):
    monkeypatch.setattr(Requests, "recorded_from", begun)
    run = start(OwnView)
    run()
    ((number, measured, text),) = requests
    assert (number, measured) == (5, False)
    assert text.startswith("capture_node's pictures are being recorded")
    assert run.written() == []


def test_a_recording_is_not_zoomed_into_at_the_start_either(start: Callable[..., Run], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Receiver, "recorded_from", "the eye is calibrating")
    run = start(OwnView)
    run()
    assert "delay: not measured, as capture_node's pictures are being recorded" in run.said[-1]
    assert run.written() == []


@pytest.mark.parametrize("in_time", [True, False])
def test_what_x_plane_did_not_take_back_as_it_hung_is_given_back_when_it_goes_on_or_at_the_end(
    start: Callable[..., Run], requests: List[Tuple[int, bool, str]], monkeypatch: pytest.MonkeyPatch, in_time: bool
):
    monkeypatch.setattr(calibrate, "_WRITE_TIMEOUT_S", 2.0)
    run = start(OwnView)
    values = run.xplane._values
    hangs = [False]
    before: List[float] = []
    take = run.xplane._take

    def take_unless_it_hangs(datagram: bytes, client: Tuple[str, int]) -> None:
        if not hangs[0]:
            take(datagram, client)
        hangs[0] |= values[names.FIELD_OF_VIEW] != OWN_DEG and not requests

    def done() -> bool:
        hangs[0] = False  # now it takes what it is sent
        before.append(values[names.FIELD_OF_VIEW])
        return not in_time or before[-1] == OWN_DEG

    monkeypatch.setattr(run.xplane, "_take", take_unless_it_hangs)
    monkeypatch.setattr(Requests, "done", staticmethod(done))
    run()
    assert "does not take its field of view of 71 deg back" in requests[0][2]
    assert before[0] == OWN_DEG + 8.0
    assert values[names.FIELD_OF_VIEW] == OWN_DEG
    assert not run.undo.exists()


def test_a_delay_that_was_given_and_no_longer_holds_is_to_be_given_anew(start: Callable[..., Run]):
    for delay_s, remedy in ((0.045, "start xplane_eye anew with another --delay, or without"), (None, "call capture")):
        run = start(OwnView, 9, delay_s)
        run.eye._pairing.set_delay(0.045)
        run.eye._pairing.doubt_delay()
        run.eye._watch_delay()
        run.eye._watch_delay()
        assert len(run.said) == 1
        assert f"are flagged DELAY_ASSUMED; {remedy}" in run.said[0]
