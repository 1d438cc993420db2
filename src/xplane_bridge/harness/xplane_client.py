"""A client of X-Plane beside the bridge, on a socket of its own."""

from __future__ import annotations

import socket
from typing import Dict, List, Optional, Sequence, Union

from xplane_bridge import protocol


class XPlaneClient:
    """One UDP socket on the loopback interface that talks to an X-Plane on this machine.

    Args:
        port: X-Plane's port.
    """

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # rospy sets a default timeout, under which Python waits even for MSG_DONTWAIT.
        self.socket.settimeout(None)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        #: The port it receives on.
        self.port = self.socket.getsockname()[1]
        self._target = ("127.0.0.1", port)

    def send(self, message: Union[bytes, protocol.Request]) -> None:
        """Sends a request, or any bytes."""
        self.socket.sendto(message if isinstance(message, bytes) else message.encode(), self._target)

    def subscribe(self, paths: Sequence[str], rate_hz: int = 100, first_index: int = 0) -> None:
        """Subscribes to datarefs; they answer with indices counted from `first_index`."""
        for index, path in enumerate(paths, first_index):
            self.send(protocol.RrefRequest(rate_hz, index, path))

    def received(self) -> List[bytes]:
        """All that has arrived. Over loopback, a datagram has arrived when the sender's call returns."""
        packets = []
        while True:
            try:
                packets.append(self.socket.recv(protocol.MAX_DATAGRAM, socket.MSG_DONTWAIT))
            except (BlockingIOError, ConnectionRefusedError):
                return packets

    def wait(self, timeout_s: float = 10.0) -> Optional[bytes]:
        """The next datagram, or None if none comes in time."""
        self.socket.settimeout(timeout_s)
        try:
            return self.socket.recv(protocol.MAX_DATAGRAM)
        except (socket.timeout, ConnectionRefusedError):
            return None
        finally:
            self.socket.settimeout(None)

    def values(self) -> Dict[int, float]:
        """The newest value by index among the RREF datagrams that have arrived."""
        newest: Dict[int, float] = {}
        for packet in self.received():
            if packet[:4] == b"RREF":
                newest.update(protocol.decode_rref_response(packet))
        return newest

    def close(self) -> None:
        """Closes the socket."""
        self.socket.close()
