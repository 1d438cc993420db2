"""A client of the emulator for tests, and an emulator in this process that flies only when told to."""

from __future__ import annotations

import socket
import time
from typing import Dict, List, Optional

from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight_model import InitialState
from xplane_bridge.emulator.options import KINEMATIC, Options

SEOUL = InitialState(latitude_deg=37.4602, longitude_deg=126.4407, altitude_m=1000.0, heading_deg=90.0)


class Client:
    """One UDP socket that talks to an emulator."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.port = self.socket.getsockname()[1]
        self._target = ("127.0.0.1", port)

    def send(self, message) -> None:
        self.socket.sendto(message if isinstance(message, bytes) else message.encode(), self._target)

    def subscribe(self, names: List[str], rate: int = 100) -> None:
        for index, name in enumerate(names):
            self.send(protocol.RrefRequest(rate, index, name))

    def received(self) -> List[bytes]:
        """Everything that has arrived (loopback delivers before sendto returns)."""
        packets = []
        while True:
            try:
                packets.append(self.socket.recv(1 << 16, socket.MSG_DONTWAIT))
            except BlockingIOError:
                return packets

    def values(self) -> Dict[int, float]:
        """The newest value of each index among the RREF datagrams that have arrived."""
        newest: Dict[int, float] = {}
        for packet in self.received():
            if packet[:4] == b"RREF":
                newest.update(protocol.decode_rref_response(packet))
        return newest

    def wait(self, timeout: float = 10.0) -> Optional[bytes]:
        """The next datagram, or None if none comes in time."""
        self.socket.settimeout(timeout)
        try:
            return self.socket.recv(1 << 16)
        except socket.timeout:
            return None
        finally:
            self.socket.settimeout(None)

    def close(self) -> None:
        self.socket.close()


class Bench:
    """An emulator in this process, stepped by the test, and clients of it."""

    def __init__(self, **options) -> None:
        options.setdefault("aircraft", KINEMATIC)
        options.setdefault("initial", SEOUL)
        self.emulator = Emulator(Options(bind="127.0.0.1", port=0, beacon=False, stepped="lines", **options))
        self._clients: List[Client] = []

    @property
    def sim(self):
        return self.emulator.sim

    def client(self) -> Client:
        client = Client(self.emulator.port)
        self._clients.append(client)
        return client

    def step(self, frames: int = 1) -> None:
        self.emulator.step_frames(frames)

    def read(self, *names: str) -> List[float]:
        """Values as a fresh client gets them in the next frame."""
        client = self.client()
        client.subscribe(list(names))
        self.step()
        values = client.values()
        return [values[i] for i in range(len(names))]

    def close(self) -> None:
        self.emulator.close()
        for client in self._clients:
            client.close()


def wait_until(condition, timeout: float = 20.0) -> bool:
    """Waits for a condition with a deadline."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.01)
    return False
