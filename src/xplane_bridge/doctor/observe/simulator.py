"""Asks X-Plane for datarefs, and keeps from where answers come."""

from __future__ import annotations

import contextlib
import errno
import select
import socket
import time
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor import names

Address = Tuple[str, int]

#: X-Plane reads at most about 148 requests a frame; batches of 100 are what Laminar recommends, 100 ms apart.
_BATCH = 100
_BETWEEN_BATCHES_S = 0.1
#: Times a second a value is sent: often enough to see time move, too seldom to be a load.
_RATE_HZ = 5
_REPEAT_S = 0.6
#: The first values are watched for so long: whether simulated time moves.
_WATCH_S = 0.7
#: What is not answered this long after the first answer is taken not to exist in this version.
_MORE_S = 1.2
#: So soon it is noticed that it is to end [s].
_NOTICED_S = 0.1
_UNREACHABLE = (errno.EHOSTUNREACH, errno.ENETUNREACH, errno.EHOSTDOWN, errno.ENETDOWN)


@dataclass(frozen=True)
class Answers:
    """What came back.

    Attributes:
        values: The newest value of each dataref that was answered.
        first: The first value of each.
        sources: Datagrams of answers by the address and port they came from.
        refused: Whether the computer said that nothing listens on the port (ICMP).
        unreachable: Why there is no way to the computer, in the system's words; empty otherwise.
    """

    values: Dict[str, float] = field(default_factory=dict)
    first: Dict[str, float] = field(default_factory=dict)
    sources: Dict[Address, int] = field(default_factory=dict)
    refused: bool = False
    unreachable: str = ""

    @property
    def any(self) -> bool:
        """Whether X-Plane answers."""
        return bool(self.values)


class Questions:
    """A socket of one's own on which an X-Plane is asked; use it with ``with``: it ends all its subscriptions.

    Args:
        address: IPv4 address.
        port: UDP port X-Plane listens on.
        ends: Whether to ask and watch no longer; asked about ten times a second.
    """

    def __init__(self, address: str, port: int, ends: Callable[[], bool] = lambda: False) -> None:
        self._to = (address, port)
        self._ends = ends
        # Not connected: X-Plane may answer from another address of its computer.
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # Connected: only such a socket gets ICMP's answers, and that on all systems.
        self._probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._paths: Dict[int, str] = {}
        self._answers = Answers()
        self._refused = False
        self._unreachable = ""

    def __enter__(self) -> Questions:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._request(list(self._paths), 0)
        self._socket.close()
        self._probe.close()

    @property
    def answers(self) -> Answers:
        """All so far."""
        kept = self._answers
        return Answers(dict(kept.values), dict(kept.first), dict(kept.sources), self._refused, self._unreachable)

    def ask(self, paths: Sequence[str], patience_s: float, enough: Callable[[], bool] = lambda: False) -> None:
        """Asks for datarefs until all are answered.

        Args:
            paths: Datarefs.
            patience_s: Not longer than this [s].
            enough: Ends it before that, though not all are answered.
        """
        asked = range(len(self._paths), len(self._paths) + len(paths))
        self._paths.update(zip(asked, paths))
        end = time.monotonic() + patience_s
        repeat = 0.0
        while time.monotonic() < end and not enough() and not self._ends():
            missing = [index for index in asked if self._paths[index] not in self._answers.values]
            if not missing:
                return
            if time.monotonic() >= repeat:
                self._request(missing, _RATE_HZ)
                repeat = time.monotonic() + _REPEAT_S
            self._receive(min(end, repeat))

    def watch(self, duration_s: float) -> None:
        """Takes further answers for some time [s]."""
        end = time.monotonic() + duration_s
        while time.monotonic() < end and not self._ends():
            self._receive(end)

    def _request(self, indexes: List[int], rate_hz: int) -> None:
        for start in range(0, len(indexes), _BATCH):
            if start:
                time.sleep(_BETWEEN_BATCHES_S)  # answers wait in the socket
            for index in indexes[start : start + _BATCH]:
                self._send(protocol.RrefRequest(rate_hz, index, self._paths[index]).encode())
        self._probe_port()

    def _send(self, datagram: bytes) -> None:
        try:
            self._socket.sendto(datagram, self._to)
        except OSError as error:
            self._failed(error)

    def _probe_port(self) -> None:
        """Sends what X-Plane does nothing upon (the end of a subscription that is not there)."""
        try:
            self._probe.connect(self._to)
            self._probe.send(protocol.RrefRequest(0, 0, names.VERSION).encode())
        except OSError as error:
            self._failed(error)

    def _receive(self, until: float) -> None:
        """Takes what comes next, for a moment and until a point of the monotonic clock [s] at the latest."""
        wait = min(_NOTICED_S, max(0.0, until - time.monotonic()))
        ready, _, _ = select.select([self._socket, self._probe], [], [], wait)
        for receiver in ready:
            try:
                datagram, source = receiver.recvfrom(protocol.MAX_DATAGRAM)
            except OSError as error:
                self._failed(error)
                continue
            with contextlib.suppress(protocol.DecodeError):
                self._take(protocol.decode_rref_response(datagram), source)

    def _take(self, pairs: Sequence[Tuple[int, float]], source: Address) -> None:
        kept = self._answers
        kept.sources[source] = kept.sources.get(source, 0) + 1
        for index, value in pairs:
            path = self._paths.get(index)
            if path is not None:
                kept.first.setdefault(path, value)
                kept.values[path] = value

    def _failed(self, error: OSError) -> None:
        if error.errno in (errno.ECONNREFUSED, errno.ECONNRESET):
            self._refused = True
        elif error.errno in _UNREACHABLE:
            self._unreachable = error.strerror or str(error)


def ask(address: str, port: int, patience_s: float, ends: Callable[[], bool] = lambda: False) -> Answers:
    """Asks an X-Plane what the checks need to know.

    Args:
        address: IPv4 address.
        port: UDP port X-Plane listens on.
        patience_s: How long the first answer is waited for [s].
        ends: Whether to go on no longer; subscriptions are ended then, too.
    """
    with Questions(address, port, ends) as questions:
        questions.ask(names.BASIC, patience_s, enough=lambda: questions.answers.any)
        if questions.answers.any:
            questions.watch(_WATCH_S)
            rows = [names.data_row(index) for index in range(protocol.ROW_COUNT)]
            questions.ask([*names.OVERRIDES, *rows], _MORE_S)
        return questions.answers
