"""Hears each of X-Plane's frames: when its datagram came, its time and its field of view."""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import sys
import threading
import time
from dataclasses import dataclass
from typing import Callable, Iterable, List, Optional, Tuple

from xplane_bridge import protocol
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye import names

Address = Tuple[str, int]

#: X-Plane on this computer, on its usual port.
THIS_COMPUTER: Address = ("127.0.0.1", protocol.DEFAULT_PORT)

#: Above any frame rate: X-Plane then sends with every frame.
_EVERY_FRAME_HZ = 999
#: X-Plane is asked again after so long a silence [s].
_SILENCE_S = 1.0
#: And after so long for what its frames lack [s]: the request was lost, or this X-Plane has no such dataref.
_LACKS_S = 3.0
_LISTEN_S = 0.25
_SAME_MOMENT_NS = 100_000
#: Indices of what is asked for.
_ALL = range(len(names.SUBSCRIBED))
_STAMP = struct.Struct("@qq")
_SO_TIMESTAMPNS = 35


class RrefError(XplaneBridgeError):
    """X-Plane cannot be listened to."""


@dataclass(frozen=True)
class Heard:
    """A frame's datagram.

    Attributes:
        arrival_ns: When it came, on the clock of time.perf_counter_ns [ns].
        key: Simulator time, the float32 as received [s].
        field_of_view_deg: Horizontal [deg]; nan where X-Plane does not say.
        times_on_screen: Whether it prints its times into the picture, 0 or 1; nan where it does not say.
    """

    arrival_ns: int
    key: float
    field_of_view_deg: float
    times_on_screen: float


class FrameStream:
    """A subscription to X-Plane's frames; use it with ``with``.

    Asks again when X-Plane was restarted, and for what a lost request did not bring.

    Args:
        xplane: IPv4 address and port X-Plane listens on.
        local_port: Our own. The same each time: X-Plane then replaces what a killed eye has left; 0: any.
        on_frame: Called for each frame, in the receiving thread; must be quick.

    Raises:
        RrefError: The port is taken.
    """

    def __init__(self, xplane: Address, local_port: int, on_frame: Callable[[Heard], None]) -> None:
        self._xplane = xplane
        self._on_frame = on_frame
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("", local_port))
        except OSError as error:
            self._socket.close()
            raise RrefError(
                f"UDP port {local_port} is taken ({error.strerror}): does another xplane_eye run? "
                "End it, or give each a --local-port and an --undo-file of its own"
            ) from None
        self._kernel_stamps = False
        if sys.platform.startswith("linux"):
            with contextlib.suppress(OSError):
                self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
                self._kernel_stamps = True
        self._socket.settimeout(_LISTEN_S)
        self._stop = threading.Event()
        self._heard_ns: Optional[int] = None
        self._lacks: List[int] = []  # of _ALL, in the newest frame
        self._thread = threading.Thread(target=self._run, name="rref", daemon=True)

    def __enter__(self) -> FrameStream:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        with contextlib.suppress(OSError):
            self._subscribe(0, _ALL)
        self._socket.close()

    @property
    def alive(self) -> bool:
        """Whether X-Plane has sent a frame within the last second."""
        return self._heard_ns is not None and time.perf_counter_ns() - self._heard_ns < _SILENCE_S * 1e9

    def write(self, path: str, value: float) -> None:
        """Writes a dataref of X-Plane's; whether that was done shows in the next frames."""
        with contextlib.suppress(OSError):
            self._socket.sendto(protocol.DrefWrite(path, value).encode(), self._xplane)

    def _subscribe(self, rate_hz: int, indices: Iterable[int]) -> None:
        for index in indices:
            self._socket.sendto(protocol.RrefRequest(rate_hz, index, names.SUBSCRIBED[index]).encode(), self._xplane)

    def _run(self) -> None:
        asked_s = -math.inf
        while not self._stop.is_set():
            lacks, patience_s = (self._lacks, _LACKS_S) if self.alive else (_ALL, _SILENCE_S)
            if lacks and time.monotonic() - asked_s > patience_s:
                asked_s = time.monotonic()
                with contextlib.suppress(OSError):
                    self._subscribe(_EVERY_FRAME_HZ, lacks)
            try:
                heard = self._receive()
            except (OSError, protocol.DecodeError):  # silence, ICMP's answer, or a datagram from another program
                continue
            if heard is not None:
                self._heard_ns = heard.arrival_ns
                self._on_frame(heard)

    def _receive(self) -> Optional[Heard]:
        if self._kernel_stamps:
            datagram, ancillary, _, sender = self._socket.recvmsg(65536, 64)
            arrival_ns, wall_ns = _both_clocks()
            for level, kind, data in ancillary:
                if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(data) == _STAMP.size:
                    seconds, nanoseconds = _STAMP.unpack(data)
                    late_ns = wall_ns - (seconds * 1_000_000_000 + nanoseconds)
                    # Not where the host's clock was just set.
                    arrival_ns -= late_ns if 0 <= late_ns < 1_000_000_000 else 0
        else:
            datagram, sender = self._socket.recvfrom(65536)
            arrival_ns = time.perf_counter_ns()
        if sender[0] != self._xplane[0]:
            return None
        values = dict(protocol.decode_rref_response(datagram))
        key, field_of_view_deg, times_on_screen = (values.get(index, math.nan) for index in _ALL)
        if not math.isfinite(key):
            return None
        self._lacks = [index for index in _ALL if index not in values]
        return Heard(arrival_ns, key, field_of_view_deg, times_on_screen)


def _both_clocks() -> Tuple[int, int]:
    """The same moment by time.perf_counter_ns and by time.time_ns, to some microseconds on a machine however busy."""
    while True:
        before_ns, wall_ns, after_ns = time.perf_counter_ns(), time.time_ns(), time.perf_counter_ns()
        if after_ns - before_ns < _SAME_MOMENT_NS:
            return before_ns, wall_ns
