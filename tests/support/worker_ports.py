"""Ports of tests that run side by side: each process draws from a part of its own."""

from __future__ import annotations

import socket
from typing import Any

from xplane_bridge.harness import ports

_PROCESSES = 24
_FIRST, _END = ports._FIRST, ports._END
_free_port = ports._free_port


def keep_to_own_ports(config: Any, first: int) -> None:
    """Has this process draw ports that it has not drawn before, and other workers do not draw: a port is free until a
    program takes it, some time after the draw. Programs that tests start draw of all.

    Args:
        config: pytest's.
        first: Of these tests' processes, of 24: there are up to 16 of node tests, and up to 8 of others.
    """
    worker = getattr(config, "workerinput", {}).get("workerid", "gw0")
    number = (first + int(worker[len("gw") :])) % _PROCESSES
    size = (_END - _FIRST) // _PROCESSES
    ports._FIRST = _FIRST + number * size
    ports._END = ports._FIRST + size
    drawn: set[int] = set()

    def new_port(kind: socket.SocketKind) -> int:
        while True:
            port = _free_port(kind)
            if len(drawn) >= size // 2:
                drawn.clear()
            if port not in drawn:
                drawn.add(port)
                return port

    ports._free_port = new_port
