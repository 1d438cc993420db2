"""Lock-step on the wire: every frame ends with a fence on every client's socket, and waits for one that comes back.

The fence is a dataref that no X-Plane has, `FENCE`: its elements are the frame's number, whole seconds and microseconds
of simulated time, each exact in float32. Who subscribes to it, at whatever rate, gets it after everything else that is
sent in a frame. A DREF that writes a frame's number to it lets the simulator fly on from that frame.

Frame 0 does not fly: it is sent again and again, in real time, until it is answered, so that clients can subscribe.
"""

from __future__ import annotations

import math
import re
import select
import time
from typing import Callable, Dict, Optional, Tuple

from xplane_bridge import protocol
from xplane_bridge.emulator.wire.server import Server
from xplane_bridge.emulator.wire.subscriptions import Address

FENCE = "xplane_bridge/lockstep"
#: Of a client: its index and the element.
Pairs = Tuple[Tuple[int, int], ...]
_ELEMENT = re.compile(re.escape(FENCE) + r"(?:\[([0-2])\])?")
_MICROSECONDS = 1_000_000
#: Longest wait without looking whether to stop [s].
_PATIENCE_S = 0.25


class Fences:
    """Who wants fences, and which frame was answered last."""

    def __init__(self) -> None:
        self.answered = -1  #: number of the newest frame that may be left; -1: none
        self._clients: Dict[Address, Dict[int, int]] = {}  # of a client: its index to the element

    def request(self, request: protocol.RrefRequest, client: Address) -> bool:
        """Takes a subscription or its end; returns whether it is one of the fence."""
        match = _ELEMENT.fullmatch(request.path)
        if match is None:
            return False
        indices = self._clients.setdefault(client, {})
        if request.rate_hz > 0:
            indices[request.index] = int(match.group(1) or 0)
        else:
            indices.pop(request.index, None)
        if not indices:
            del self._clients[client]
        return True

    def write(self, request: protocol.DrefWrite) -> bool:
        """Takes the answer to a frame; returns whether it is one."""
        if _ELEMENT.fullmatch(request.path) is None:
            return False
        if math.isfinite(request.value):
            self.answered = max(self.answered, int(request.value))
        return True

    def send(self, server: Server, now: float, frame: int, sim_time: float) -> None:
        """Ends a frame.

        Args:
            server: The sockets.
            now: Time of the frame on the loop's clock [s].
            frame: Its number.
            sim_time: Simulated time [s].
        """
        microseconds = round(sim_time * _MICROSECONDS)
        values = (float(frame), float(microseconds // _MICROSECONDS), float(microseconds % _MICROSECONDS))
        packets: Dict[Pairs, bytes] = {}  # mostly one: clients ask for the elements alike
        datagrams = []
        for client, indices in self._clients.items():
            key = tuple(indices.items())
            if key not in packets:
                packets[key] = protocol.encode_rref_response([(index, values[element]) for index, element in key])
            datagrams.append((packets[key], client))
        server.send_all(now, datagrams)


class LockstepLoop:
    """Flies a frame whenever the one before was answered.

    Args:
        server: Gives the sockets.
        fences: Of these.
        fly: Flies a frame and sends what is due in it.
        hold: Sends what is due without flying; gets the time on the loop's clock [s].
        sim_time: Gives the simulated time [s].
        period: Time of one frame [s].
        pace: Simulated time may go by so many times faster than real time; 0: as fast as it goes.
    """

    def __init__(
        self,
        server: Callable[[], Server],
        fences: Fences,
        fly: Callable[[], None],
        hold: Callable[[float], None],
        sim_time: Callable[[], float],
        period: float,
        pace: float = 0.0,
    ) -> None:
        self._server = server
        self._fences = fences
        self._fly = fly
        self._hold = hold
        self._sim_time = sim_time
        self._period = period
        self._pace = pace
        self.waited = 0.0  #: [s] of wall time for answers to frames that were flown

    def run(self, frames: Optional[int], stopping: Callable[[], bool]) -> None:
        """Flies so many frames; None: until `stopping` says so."""
        held = 0
        while self._fences.answered < 0 and not stopping():
            self._hold(held * self._period)
            self._fences.send(self._server(), held * self._period, 0, self._sim_time())
            held += 1
            self._await(0, self._period, stopping)
        self._server().subscriptions.restart_pacers()
        began, frame = time.monotonic(), 0
        while (frames is None or frame < frames) and not stopping():
            frame += 1
            if self._pace > 0.0:
                time.sleep(max(0.0, began + frame * self._period / self._pace - time.monotonic()))
            self._fly()
            self._fences.send(self._server(), frame * self._period, frame, self._sim_time())
            sent = time.monotonic()
            while self._fences.answered < frame and not stopping():
                self._await(frame, _PATIENCE_S, stopping)
            self.waited += time.monotonic() - sent

    def _await(self, frame: int, patience: float, stopping: Callable[[], bool]) -> None:
        """Takes what clients send until the answer to this frame, so long at most [s]."""
        end = time.monotonic() + patience
        server = self._server()
        while not stopping() and self._fences.answered < frame:
            left = end - time.monotonic()
            if left <= 0.0:
                return
            if select.select([server], [], [], left)[0]:
                server.receive(enough=lambda: self._fences.answered >= frame)
