"""An X-Plane of a few lines, whose ways of going wrong a test chooses: answers RREF on loopback, and takes DREF."""

from __future__ import annotations

import select
import socket
import threading
import time
from typing import Dict, List, Tuple

from xplane_bridge import protocol

_PERIOD_S = 0.05


class FakeXPlane:
    """Answers requests for datarefs while within ``with``.

    Args:
        values: Datarefs it has, which can be written; others are not answered.
        reply_from: IPv4 address its answers come from; empty: the one that was asked.
        time_step: Added to `sim/time/total_running_time_sec` with each datagram; 0: it stands still.

    Attributes:
        port: The UDP port it listens on, on 127.0.0.1.
        subscriptions: Datarefs of each client, by the client's index.
        others: Datagrams that ask for anything else, those that write included.
    """

    TIME = "sim/time/total_running_time_sec"

    def __init__(self, values: Dict[str, float], reply_from: str = "", time_step: float = 0.1) -> None:
        self._values = dict(values)
        self._time_step = time_step
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # A batch of requests may come while this process has no processor.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self._socket.bind(("127.0.0.1", 0))
        self.port: int = self._socket.getsockname()[1]
        self._sender = self._socket
        if reply_from:
            self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._sender.bind((reply_from, self.port))
        self.subscriptions: Dict[Tuple[str, int], Dict[int, str]] = {}
        self.others: List[bytes] = []
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> FakeXPlane:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self._socket.close()
        self._sender.close()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._end.is_set():
            if select.select([self._socket], [], [], max(0.0, due - time.monotonic()))[0]:
                datagram, client = self._socket.recvfrom(65536)
                self._take(datagram, client)
            else:
                due += _PERIOD_S
                self._answer()

    def _take(self, datagram: bytes, client: Tuple[str, int]) -> None:
        request = protocol.decode_request(datagram)
        if not isinstance(request, protocol.RrefRequest):
            self.others.append(datagram)
            if isinstance(request, protocol.DrefWrite) and request.path in self._values:
                self._values[request.path] = request.value
            return
        mine = self.subscriptions.setdefault(client, {})
        if request.rate_hz:
            mine[request.index] = request.path
        else:
            mine.pop(request.index, None)

    def _answer(self) -> None:
        if self.TIME in self._values:
            self._values[self.TIME] += self._time_step
        for client, paths in self.subscriptions.items():
            pairs = [(index, self._values[path]) for index, path in paths.items() if path in self._values]
            for start in range(0, len(pairs), protocol.RREF_MAX_PAIRS):
                some = pairs[start : start + protocol.RREF_MAX_PAIRS]
                self._sender.sendto(protocol.encode_rref_response(some), client)
