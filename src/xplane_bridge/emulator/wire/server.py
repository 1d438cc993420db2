"""X-Plane's sockets: takes requests, hands them to the simulator, sends what each client is due.

Everything runs in the emulator's one thread, once a frame, as in X-Plane: requests are read at the frame's start,
packets go out after the flight model. Nothing a client sends can raise out of here; what X-Plane would ignore is
counted and ignored.
"""

from __future__ import annotations

import errno
import logging
import socket
import struct
from collections import Counter
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge import compiled, protocol
from xplane_bridge.emulator.datarefs.data_rows import DataRows
from xplane_bridge.emulator.wire.faults import FaultyChannel
from xplane_bridge.emulator.wire.subscriptions import Address, Datagram, Pacer, Planner, Subscriptions

_LOG = logging.getLogger(__name__)

_RECEIVE_BUFFER = 4 << 20
#: Of Linux; Python's socket module does not name it.
_IP_PKTINFO = 8
#: RREF requests X-Plane takes in one frame; more are lost (Laminar: up to about 148, clients send batches of 100).
RREF_REQUESTS_PER_FRAME = 148
BEACON_PERIOD_S = 1.0


#: A datagram's target and the socket it leaves from.
Route = Tuple[Address, socket.socket]


class PortInUseError(OSError):
    """The port to listen on is taken."""


class Server:
    """The wire side of one emulator.

    Attributes:
        port: The port it listens on.
        ignored: Datagrams ignored, by reason: a decode reason, or what the handler says (`dataref`, `command`, ...).
    """

    def __init__(
        self,
        bind: str,
        port: int,
        handlers: Dict[type, Callable[..., Any]],
        subscriptions: Subscriptions,
        channel: FaultyChannel[Route],
        request_limit: int = RREF_REQUESTS_PER_FRAME,
        answer_from: Optional[str] = None,
    ) -> None:
        self.subscriptions = subscriptions
        self.ignored: Counter[str] = Counter()
        self._handlers = handlers
        self._channel = channel
        self._request_limit = request_limit
        self._answer_from = answer_from
        self._socket = _bound_socket(bind, port)
        self.port = self._socket.getsockname()[1]
        self._data_socket = _data_socket(bind, port)
        self.data_target: Optional[Address] = None
        self._data_pacer: Optional[Pacer] = None
        self._data_rate = 0
        self._held: Optional[List[Datagram]] = None

    def close(self) -> None:
        """Closes it."""
        self._socket.close()
        self._data_socket.close()

    def fileno(self) -> int:
        """For select."""
        return self._socket.fileno()

    # --- in -----------------------------------------------------------------------------------------------------------

    def receive(self, discard: bool = False, enough: Callable[[], bool] = lambda: False) -> int:
        """Takes all datagrams that have come.

        Args:
            discard: Drops them unread.
            enough: Asked after each datagram; what comes after it says yes stays in the socket.

        Returns:
            How many came.
        """
        count = rref = 0
        while not enough():
            try:
                datagram, sender = self._socket.recvfrom(protocol.MAX_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                return count
            except OSError as error:  # an ICMP answer to something sent to a client that is gone
                if error.errno not in (errno.ECONNREFUSED, errno.ECONNRESET):
                    raise
                continue
            count += 1
            if discard or self._channel.loses_incoming():
                continue
            if datagram[:4] == b"RREF":
                rref += 1
                if rref > self._request_limit:
                    self.ignored["flood"] += 1
                    continue
            self.handle(datagram, sender)
        return count

    def handle(self, datagram: bytes, sender: Address) -> None:
        """Handles one datagram as if it had come from `sender`."""
        try:
            request = protocol.decode_request(datagram)
        except protocol.DecodeError as error:
            self.ignored[error.reason] += 1
            _LOG.debug("ignored a datagram from %s:%d: %s", *sender[:2], error)
            return
        try:
            reason = self._handlers[type(request)](request, sender)
        except (ArithmeticError, ValueError) as error:  # a FlightModelError too: what no handler refuses
            reason = "value"
            _LOG.warning("%s from %s:%d could not be carried out: %s", request, *sender[:2], error)
        if reason is not None:
            self.ignored[reason] += 1
            _LOG.debug("ignored %s from %s:%d: %s", request, *sender[:2], reason)

    # --- out ----------------------------------------------------------------------------------------------------------

    def send_frame(
        self,
        now: float,
        frame_period: float,
        rows: DataRows,
        values: np.ndarray,
        selected: Callable[[], np.ndarray],
        data_rate: int,
        position: Callable[[], bytes],
        plan: Planner,
    ) -> None:
        """Sends what is due in this frame: DATA, RREF, RPOS.

        Args:
            now: Time of the frame [s]; wall time, or frames times the period in stepped mode.
            frame_period: Time between frames [s].
            rows: Rows of this frame.
            values: The store's values.
            selected: Gives the rows selected for the network.
            data_rate: DATA datagrams a second, at most one a frame.
            position: Gives the RPOS datagram.
            plan: Gives what computes slots, where they are not computed in each frame.
        """
        if self.data_target is not None and data_rate > 0:
            if self._data_pacer is None or data_rate != self._data_rate:
                self._data_pacer, self._data_rate = Pacer(data_rate), data_rate
            if self._data_pacer.due(now, frame_period):
                packet = rows.packet(selected())
                if packet:
                    self.send(now, packet, self.data_target, self._data_socket)
        datagrams = self.subscriptions.datagrams(now, frame_period, values, plan)
        due = [client for client, pacer in self.subscriptions.rpos.items() if pacer.due(now, frame_period)]
        if due:
            packet = position()
            datagrams += [(packet, client) for client in due]
        if self._held is None:
            self.send_all(now, datagrams)
        else:
            self._held += datagrams

    def restart_pacers(self) -> None:
        """Everything is due in the next frame, and from then on at its rate: for when the loop's clock begins anew."""
        self._data_pacer = None
        self.subscriptions.restart_pacers()

    def hold(self) -> None:
        """Keeps from now on what `send_frame` would send, for `take_held`; but for DATA."""
        self._held = []

    def take_held(self) -> List[Datagram]:
        """What it has kept since the last call."""
        held, self._held = self._held or [], []
        return held

    def send_all(self, now: float, datagrams: Sequence[Datagram]) -> None:
        """Sends datagrams in their order, through the faults if there are any."""
        send = getattr(compiled.core, "send_datagrams", None)
        if send is None or self._channel.active or self._answer_from is not None:
            for packet, target in datagrams:
                self.send(now, packet, target)
        elif datagrams:
            refused = send(self._socket.fileno(), datagrams)
            if refused:
                self.ignored["send"] += refused

    def send(self, now: float, packet: bytes, target: Address, source: Optional[socket.socket] = None) -> None:
        """Sends one datagram, through the faults if there are any."""
        source = source or self._socket
        if self._channel.active:
            self._channel.put(now, packet, (target, source))
        else:
            self._send_now(packet, target, source)

    def flush_delayed(self, now: float) -> None:
        """Sends held-back datagrams whose time has come."""
        for packet, (target, source) in self._channel.ready(now):
            self._send_now(packet, target, source)

    def next_delayed(self) -> float:
        """When the next held-back datagram is due."""
        return self._channel.next_due()

    def _send_now(self, packet: bytes, target: Address, source: socket.socket) -> None:
        try:
            if self._answer_from is None or source is not self._socket:
                source.sendto(packet, target)
            else:
                send_from(source, packet, target, self._answer_from)
        except OSError as error:  # no such host, no route, buffer full: X-Plane goes on, so do we
            _LOG.debug("could not send %d bytes to %s:%d: %s", len(packet), target[0], target[1], error)
            self.ignored["send"] += 1


class Beacon:
    """Announces the emulator on X-Plane's multicast group once a second."""

    def __init__(
        self, bind: str, message: protocol.Beacon, group: str, port: int, second_address: Optional[str] = None
    ) -> None:
        self._second_address = second_address
        self._packet = message.encode()
        self._target = (group, port)
        self._next = float("-inf")
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
        self._interfaces = [bind] if bind != "0.0.0.0" else ["0.0.0.0", "127.0.0.1"]

    def poll(self, now: float) -> None:
        """Sends the beacon if a second has passed since the last one."""
        if now < self._next:
            return
        self._next = now + BEACON_PERIOD_S
        for interface in self._interfaces:  # loopback only where there is no network: one simulator, one beacon
            try:
                self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
                self._socket.sendto(self._packet, self._target)
                if self._second_address is not None:
                    send_from(self._socket, self._packet, self._target, self._second_address)
                return
            except OSError as error:
                _LOG.debug("no beacon on %s: %s", interface, error)

    def close(self) -> None:
        """Closes it."""
        self._socket.close()


def send_from(sock: socket.socket, packet: bytes, target: Address, address: str) -> None:
    """Sends a datagram from another address of this machine than the socket's, but from its port."""
    interface = struct.pack("=i4s4x", 0, socket.inet_aton(address))
    sock.sendmsg([packet], [(socket.IPPROTO_IP, _IP_PKTINFO, interface)], 0, target)


def _bound_socket(bind: str, port: int) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
    sock.setblocking(False)
    try:
        sock.bind((bind, port))
    except OSError as error:
        sock.close()
        if error.errno == errno.EADDRINUSE:
            raise PortInUseError(
                error.errno,
                f"UDP port {port} on {bind} is in use: another X-Plane or emulator runs there. Stop it, or choose "
                f"another port (--port N, or --port 0 for any free one)",
            ) from None
        raise
    return sock


def _data_socket(bind: str, listening: int) -> socket.socket:
    """The socket DATA leaves from: X-Plane's is port 49001; any other for an emulator that is one of several."""
    for port in (protocol.DATA_SOURCE_PORT, 0) if listening == protocol.DEFAULT_PORT else (0,):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((bind, port))
        except OSError:
            sock.close()
            continue
        sock.setblocking(False)
        return sock
    raise PortInUseError(errno.EADDRINUSE, f"no free UDP port on {bind}")
