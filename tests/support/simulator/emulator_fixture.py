"""An emulator in this process that flies only when a test says so, and clients of it, for tests without wall time."""

from __future__ import annotations

from typing import Dict, List

from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.options import KINEMATIC, Options
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.harness.xplane_client import XPlaneClient


class EmulatorFixture:
    """A stepped emulator on a free loopback port, without a beacon. A context manager.

    Args:
        options: Fields of `Options`; the aircraft is the kinematic one unless given.
    """

    def __init__(self, **options: object) -> None:
        options.setdefault("aircraft", KINEMATIC)
        chosen = Options(bind="127.0.0.1", port=0, beacon=False, stepped="lines", **options)  # type: ignore[arg-type]
        self.emulator = Emulator(chosen)
        self._clients: List[XPlaneClient] = []

    def __enter__(self) -> EmulatorFixture:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def sim(self) -> Simulator:
        """The simulator; another object after a restart."""
        return self.emulator.sim

    def client(self) -> XPlaneClient:
        """A new client."""
        client = XPlaneClient(self.emulator.port)
        self._clients.append(client)
        return client

    def step(self, frames: int = 1) -> None:
        """Flies so many frames."""
        self.emulator.step_frames(frames)

    def read(self, *paths: str) -> List[float]:
        """Values as a fresh client gets them in the next frame."""
        client = XPlaneClient(self.emulator.port)
        try:
            client.subscribe(paths)
            self.step()
            values = client.values()
            for index in range(len(paths)):
                client.send(protocol.RrefRequest(0, index, ""))
            self.emulator.server.receive()
            return [values[index] for index in range(len(paths))]
        finally:
            client.close()

    def write(self, values: Dict[str, float]) -> None:
        """Sends a DREF for each dataref; they act in the next frame."""
        client = XPlaneClient(self.emulator.port)
        for path, value in values.items():
            client.send(protocol.DrefWrite(path, value))
        self.emulator.server.receive()
        client.close()

    def close(self) -> None:
        """Closes all sockets."""
        self.emulator.close()
        for client in self._clients:
            client.close()
