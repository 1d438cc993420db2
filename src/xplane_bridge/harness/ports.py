"""Ports of the loopback interface for programs that are started one after the other."""

from __future__ import annotations

import secrets
import socket

from xplane_bridge.harness.processes import HarnessError

#: Below the ports that Linux, macOS and Windows give to sockets that ask for none in particular: one of those would be
#: another program's as soon as the probe lets go of it.
_FIRST, _END = 20000, 32768
_ATTEMPTS = 200


def free_tcp_port() -> int:
    """A TCP port that is free now, and that no socket takes which asks for none in particular.

    Raises:
        HarnessError: None is found.
    """
    return _free_port(socket.SOCK_STREAM)


def free_udp_port() -> int:
    """The same for UDP.

    Raises:
        HarnessError: None is found.
    """
    return _free_port(socket.SOCK_DGRAM)


def _free_port(kind: socket.SocketKind) -> int:
    for _ in range(_ATTEMPTS):
        port = _FIRST + secrets.randbelow(_END - _FIRST)
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("", port))
            except OSError:
                continue
            return port
    msg = f"no free port between {_FIRST} and {_END - 1} on this computer"
    raise HarnessError(msg)
