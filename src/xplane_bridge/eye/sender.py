"""Takes pictures to `capture_node`: the newest first, never more than two on their way.

A picture is made JPEG when it may be sent, not before; while `capture_node` is slow, newer pictures replace the one
that waits. So what arrives is young, however slow the network.
"""

from __future__ import annotations

import contextlib
import select
import socket
import threading
import time
from typing import Any, Callable, List, Optional, Tuple

from xplane_bridge.eye import wire
from xplane_bridge.eye.jpeg import Encode
from xplane_bridge.eye.pairing import Decision

Address = Tuple[str, int]

#: Pictures that may be on their way: sent and not yet taken over.
CREDIT = 2
_RETRY_S = (0.25, 2.0)
_CONNECT_TIMEOUT_S = 2.0
_SEND_TIMEOUT_S = 5.0
_STATUS_S = 0.5
_BUFFER = 256 * 1024


class Sender:
    """The connection to `capture_node`; use it with ``with``. Connects again, after 0.25 s and up to 2 s.

    Args:
        receiver: Address and port that `capture_node` listens on (`sender/listen`).
        window: Number of the window, in each message.
        token: That of `sender/token`; empty: none.
        xplane: Which X-Plane, for people.
        encode: Makes JPEG of pixels.
        say: Prints what happens.
    """

    def __init__(
        self,
        receiver: Address,
        window: int,
        token: str,
        xplane: str,
        encode: Encode,
        say: Callable[[str], None] = print,
    ) -> None:
        self._receiver = receiver
        self._window = window
        self._hello = wire.encode_hello(window, token, xplane)
        self._encode = encode
        self._say = say
        self._said = ""
        self._lock = threading.Lock()
        self._next: Optional[Decision] = None
        self._problem = ""
        self._unsendable = ""  # why the newest picture cannot be sent
        self._size: Tuple[int, ...] = ()  # of the newest picture [px]
        self._warned = False  # that one of this size cannot be sent: some JPEGs of a size may be too large, others not
        self._stop = False
        # Windows waits for sockets only: a pair of them wakes the thread.
        self._waker, self._awake = socket.socketpair()
        self._waker.setblocking(False)
        self._awake.setblocking(False)
        self._thread = threading.Thread(target=self._run, name="sender", daemon=True)
        self._request = 0
        self._answers: List[bytes] = []
        self._asked = False  # whether a hello is to be said once more, for what its welcome says
        self._tried = threading.Event()  # set when that has come, or capture_node does not take pictures
        self._recorded = False  # as the last welcome says
        #: Pictures that newer ones have replaced, and pictures sent.
        self.replaced = 0
        self.sent = 0

    def __enter__(self) -> Sender:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop = True
        self._wake()
        self._thread.join()
        self._waker.close()
        self._awake.close()

    def offer(self, decision: Decision) -> None:
        """Hands over a picture; it replaces one that waits."""
        with self._lock:
            self.replaced += self._next is not None
            self._next = decision
        self._wake()

    def report_problem(self, problem: str) -> None:
        """Reports to `capture_node` why there are no pictures; empty when there are."""
        self._problem = problem

    def recorded(self, timeout_s: float) -> bool:
        """Whether `capture_node`'s pictures are being recorded now, which it is asked.

        Args:
            timeout_s: It answers within so long, or what it has said last counts; False where it never has.
        """
        with self._lock:
            self._asked = True
            self._tried.clear()
        self._wake()
        self._tried.wait(timeout_s)
        return self._recorded

    def take_request(self) -> int:
        """The number of a request to measure the delay that waits for an answer, once; 0: there is none."""
        with self._lock:
            number, self._request = self._request, 0
        return number

    def answer(self, number: int, measured: bool, text: str) -> None:
        """Answers a request; nothing where its connection has ended."""
        with self._lock:
            self._answers.append(wire.encode_calibration(self._window, number, measured, text))
        self._wake()

    def _wake(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._waker.send(b"x")

    def _report(self, text: str) -> None:
        if text != self._said:
            self._said = text
            self._say(text)

    def _run(self) -> None:
        pause_s = _RETRY_S[0]
        where = f"{self._receiver[0]}:{self._receiver[1]}"
        while not self._stop:
            try:
                with socket.create_connection(self._receiver, _CONNECT_TIMEOUT_S) as connection:
                    _Session(self, connection).run()
            except _WelcomedError as ended:
                pause_s = _RETRY_S[0]
                self._report(f"capture_node at {where} is gone ({ended}); looking for it again")
            except (OSError, wire.WireError) as error:
                reason = getattr(error, "strerror", None) or str(error)
                self._report(f"capture_node at {where} does not take pictures ({reason}); trying again")
                with self._lock:
                    self._asked = False
                    self._tried.set()
            end = time.monotonic() + pause_s
            while not self._stop and time.monotonic() < end:
                time.sleep(0.05)
            pause_s = min(2 * pause_s, _RETRY_S[1])


class _WelcomedError(Exception):
    """A connection ended that had been good: the next is tried soon."""


class _Session:
    """One connection, from its first message to its end."""

    def __init__(self, sender: Sender, connection: socket.socket) -> None:
        self._sender = sender
        self._connection = connection
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        connection.settimeout(_SEND_TIMEOUT_S)
        with sender._lock:  # what an earlier connection was asked is not answered to this one
            sender._request, sender._answers = 0, []
        self._replies = wire.ReplyReader()
        self._credit = 0
        self._welcome = False
        self._greeting = False  # a hello has not been answered yet

    def run(self) -> None:
        """Ends by an exception, or when the sender ends."""
        try:
            self._greet()
            last_status_s = time.monotonic()
            while not self._sender._stop:
                readable, _, _ = select.select([self._connection, self._sender._awake], [], [], _STATUS_S)
                if self._sender._awake in readable:
                    self._sender._awake.recv(4096)
                if self._connection in readable:
                    self._take_replies(self._connection.recv(4096))
                if self._sender._asked and not self._greeting:
                    self._greet()
                self._send_answers()
                self._send_newest()
                if time.monotonic() - last_status_s >= _STATUS_S and self._welcome:
                    last_status_s = time.monotonic()
                    problem = self._sender._problem or self._sender._unsendable
                    self._connection.sendall(wire.encode_status(self._sender._window, problem))
        except OSError as error:
            if self._welcome:
                raise _WelcomedError(error.strerror or str(error)) from None
            raise

    def _greet(self) -> None:
        """Says hello, which each release of `capture_node` answers, also when it is not the first."""
        with self._sender._lock:
            self._sender._asked = False
        self._greeting = True
        self._connection.sendall(self._sender._hello)

    def _take_replies(self, data: bytes) -> None:
        if not data:
            raise ConnectionError("it closed the connection: is this computer its sender/peer?")
        for reply in self._replies.feed(data):
            if reply.code == wire.REFUSED:
                raise wire.WireError(wire.REFUSALS.get(reply.number, f"refused for reason {reply.number}"))
            if reply.code == wire.WELCOME:
                if not self._welcome:
                    self._welcome = True
                    self._credit = CREDIT
                self._greeting = False
                with self._sender._lock:
                    self._sender._recorded = reply.number == wire.RECORDED
                    if not self._sender._asked:
                        self._sender._tried.set()
                self._sender._report("capture_node at {}:{} takes pictures".format(*self._sender._receiver))
            elif reply.code == wire.CALIBRATE:
                with self._sender._lock:
                    self._sender._request = reply.number
            else:
                self._credit = min(self._credit + 1, CREDIT)

    def _send_answers(self) -> None:
        with self._sender._lock:
            answers, self._sender._answers = self._sender._answers, []
        for answer in answers:
            self._connection.sendall(answer)

    def _send_newest(self) -> None:
        if self._credit == 0:
            return
        with self._sender._lock:
            decision, self._sender._next = self._sender._next, None
        if decision is None:
            return
        size = decision.picture.shape[:2]
        if size != self._sender._size:
            self._sender._size, self._sender._warned = size, False
        try:
            message = self._message(decision)
        except wire.WireError as error:  # one of another size may follow
            if not self._sender._warned:
                self._sender._say(str(error))
            self._sender._warned = True
            self._sender._unsendable = str(error)
            return
        self._sender._unsendable = ""
        self._connection.sendall(message)
        self._credit -= 1
        self._sender.sent += 1

    def _message(self, decision: Decision) -> bytes:
        pixels: Any = decision.picture
        jpeg = self._sender._encode(pixels)
        header = wire.PictureHeader(
            width=pixels.shape[1],
            height=pixels.shape[0],
            key=decision.frame.key,
            flags=decision.flags,
            index=decision.frame.index,
            change_ns=decision.change_ns,
            arrival_ns=decision.frame.arrival_ns,
            sent_ns=time.perf_counter_ns(),
            delay_s=decision.delay_s,
            residual_s=decision.residual_s,
        )
        return wire.encode_picture(self._sender._window, header, jpeg)
