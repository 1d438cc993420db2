"""The sender with a capture_node that the test plays."""

from __future__ import annotations

import socket
import struct
import threading
from typing import Iterator

import numpy as np
import pytest

from xplane_bridge.eye import sender as sender_module
from xplane_bridge.eye import wire
from xplane_bridge.eye.jpeg import encoder
from xplane_bridge.eye.pairing import Decision, Frame
from xplane_bridge.eye.sender import CREDIT, Sender
from xplane_bridge.harness import wait_until

PREFIX = struct.Struct("<4sHHII")
HELLO, PICTURE, STATUS, CALIBRATION = 1, 2, 3, 4
WELCOME, TAKEN, REFUSED, CALIBRATE = 0, 1, 2, 3
MOST_OTHERS = 40  #: messages before one that is waited for


class Receiver:
    """Takes one connection after the other, and says what the test wants."""

    def __init__(self) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.settimeout(20.0)
        self.connection: socket.socket | None = None

    @property
    def address(self) -> tuple:
        return self.server.getsockname()

    def accept(self) -> None:
        self.connection, _ = self.server.accept()
        self.connection.settimeout(20.0)

    def exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            piece = self.connection.recv(count - len(data))
            assert piece, "the sender closed the connection"
            data += piece
        return data

    def message(self, *kinds: int) -> tuple:
        """The next message of these kinds: header and body."""
        for _ in range(MOST_OTHERS):
            _, _, header_bytes, body_bytes, _ = PREFIX.unpack(self.exactly(PREFIX.size))
            header, body = self.exactly(header_bytes), self.exactly(body_bytes)
            if header[0] in kinds:
                return header, body
        raise AssertionError(f"no message of kinds {kinds} among {MOST_OTHERS}")

    def picture_index(self) -> int:
        return struct.unpack_from("<Q", self.message(PICTURE)[0], 16)[0]

    def reply(self, code: int, value: int = 0) -> None:
        self.connection.sendall(struct.pack("<4sHHQ", b"XEYA", 1, code, value))


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    one = Receiver()
    yield one
    one.server.close()
    if one.connection is not None:
        one.connection.close()


def picture(index: int, rows: int = 48) -> Decision:
    pixels = np.full((rows, 64, 4), index % 256, np.uint8)
    return Decision(pixels, 1000, Frame(900, float(index), index), 0.0, 0.0, 0)


def start(receiver: Receiver, said: list | None = None) -> Sender:
    say = (said if said is not None else []).append
    return Sender(receiver.address, 0, "secret", "here:49000", encoder(90), say)


def test_no_more_than_two_are_on_their_way_and_the_newest_is_next(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        assert receiver.message(HELLO)[1] == b"secrethere:49000"
        eye.offer(picture(1))
        receiver.reply(WELCOME)
        assert receiver.picture_index() == 1
        eye.offer(picture(2))
        assert receiver.picture_index() == 2
        for index in range(3, 30):  # nothing is taken over: they replace each other
            eye.offer(picture(index))
        for _ in range(2):  # the second is younger than these; had one of them been sent, it would have come before
            receiver.message(STATUS)
        assert eye.sent == CREDIT
        receiver.reply(TAKEN, 1)
        assert receiver.picture_index() == 29
        assert eye.replaced == 26


def test_pictures_are_jpeg_of_their_size(receiver: Receiver):
    import cv2

    with start(receiver) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        eye.offer(picture(200))
        header, body = receiver.message(PICTURE)
    assert struct.unpack_from("<HH", header, 4) == (64, 48)
    decoded = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    assert decoded.shape == (48, 64, 3)
    assert abs(int(decoded.mean()) - 200) <= 1


def test_nothing_is_sent_before_the_welcome(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.message(HELLO)
        eye.offer(picture(1))
        receiver.connection.settimeout(0.3)
        with pytest.raises(socket.timeout):
            receiver.connection.recv(1)


def test_it_connects_again_and_the_newest_picture_waits(receiver: Receiver):
    said: list = []
    with start(receiver, said) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        eye.offer(picture(1))
        assert receiver.picture_index() == 1
        receiver.connection.close()
        eye.offer(picture(2))
        receiver.accept()
        receiver.reply(WELCOME)
        eye.offer(picture(3))
        assert receiver.picture_index() in (2, 3)
    assert any("is gone" in line for line in said)


def test_a_refusal_is_said_in_words(receiver: Receiver):
    said: list = []
    with start(receiver, said):
        receiver.accept()
        receiver.reply(REFUSED, 1)
        wait_until(lambda: any("sender/token" in line for line in said), 10.0, "the reason")


def test_a_status_reports_why_there_are_no_pictures(receiver: Receiver):
    with start(receiver) as eye:
        eye.report_problem("no window")
        receiver.accept()
        receiver.reply(WELCOME)
        assert receiver.message(STATUS)[1] == b"no window"


def test_a_window_of_a_size_that_cannot_be_sent_is_reported_and_its_next_size_sent(receiver: Receiver):
    said: list = []
    with start(receiver, said) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        eye.offer(picture(1, rows=15))
        reason = "X-Plane's window has 64x15 px; expected sides of 16 to"
        wait_until(lambda: receiver.message(STATUS)[1].startswith(reason.encode()), 10.0, "the reason")
        assert any(line.startswith(reason) for line in said)
        eye.offer(picture(2))
        assert receiver.picture_index() == 2
        assert receiver.message(STATUS)[1] == b""


def test_jpegs_about_the_limit_are_reported_once_for_a_size(receiver: Receiver, monkeypatch: pytest.MonkeyPatch):
    said: list = []
    limits = {0: wire.MOST_BODY, 1: 0}  # by the picture's index, even or odd

    def offered(index: int, rows: int = 48) -> None:
        before = eye.sent
        monkeypatch.setattr(wire, "MOST_BODY", limits[index % 2])
        eye.offer(picture(index, rows))
        if index % 2:
            wait_until(lambda: eye._next is None and eye._unsendable, 10.0, "the picture's refusal")
        else:
            assert receiver.picture_index() == index
            receiver.reply(TAKEN, index)
            assert eye.sent >= before

    with start(receiver, said) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        for index in range(8):
            offered(index)
        assert sum("JPEG" in line for line in said) == 1
        offered(9, rows=64)
        wait_until(lambda: sum("JPEG" in line for line in said) == 2, 10.0, "the reason of another size")


def test_a_request_is_handed_over_once_and_answered_by_its_number(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        assert eye.take_request() == 0
        receiver.reply(CALIBRATE, 7)
        taken: list = []
        wait_until(lambda: taken.append(eye.take_request()) or taken[-1], 10.0, "the request")
        assert (taken[-1], eye.take_request()) == (7, 0)
        eye.answer(7, True, "42.5 ms")
        header, body = receiver.message(CALIBRATION)
        assert struct.unpack("<BBHQ", header) == (CALIBRATION, 0, 1, 7)
        assert body == b"42.5 ms"


def test_what_an_ended_connection_was_asked_is_not_answered_to_the_next(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.reply(WELCOME)
        receiver.reply(CALIBRATE, 7)
        wait_until(lambda: eye._request == 7, 10.0, "the request")
        receiver.connection.close()
        receiver.accept()
        receiver.reply(WELCOME)
        receiver.message(STATUS)
        assert eye.take_request() == 0


class Asking(threading.Thread):
    """Asks whether pictures are recorded, on a thread of its own."""

    answer: bool

    def __init__(self, eye: Sender) -> None:
        super().__init__(daemon=True)
        self._eye = eye
        self.start()

    def run(self) -> None:
        self.answer = self._eye.recorded(20.0)

    def answered(self) -> bool:
        self.join(20.0)
        return self.answer


def test_whether_pictures_are_recorded_is_asked_anew_and_sends_no_more_pictures(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.message(HELLO)
        receiver.reply(WELCOME, 0)
        for index in (1, 2):
            eye.offer(picture(index))
            assert receiver.picture_index() == index
        for recorded in (1, 0, 1):
            asking = Asking(eye)
            assert receiver.message(HELLO)[1] == b"secrethere:49000"
            receiver.reply(WELCOME, recorded)
            assert asking.answered() == bool(recorded)
        eye.offer(picture(3))
        for _ in range(2):  # the second is younger than the picture
            receiver.message(STATUS)
        assert eye.sent == CREDIT


def test_a_question_that_comes_before_the_welcome_is_not_answered_by_it(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.message(HELLO)
        asking = Asking(eye)
        wait_until(lambda: eye._asked, 10.0, "the question")
        receiver.reply(WELCOME, 0)
        receiver.message(HELLO)
        receiver.reply(WELCOME, 1)
        assert asking.answered()


def test_a_question_of_a_connection_that_ended_is_answered_by_the_next(receiver: Receiver):
    with start(receiver) as eye:
        receiver.accept()
        receiver.message(HELLO)
        receiver.reply(WELCOME, 0)
        asking = Asking(eye)
        receiver.message(HELLO)
        receiver.connection.close()
        receiver.accept()
        receiver.message(HELLO)
        receiver.reply(WELCOME, 1)
        assert asking.answered()


def test_it_ends_while_no_receiver_answers(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sender_module, "_CONNECT_TIMEOUT_S", 0.1)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))  # does not listen
        said: list = []
        eye = Sender(silent.getsockname(), 0, "", "", encoder(90), said.append)
        with eye:
            wait_until(lambda: said, 10.0, "a complaint")
    assert not any(thread.name == "sender" for thread in threading.enumerate())
