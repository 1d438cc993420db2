"""Listens on a port for Data Output rows that no program here has requested."""

from __future__ import annotations

import errno
import select
import socket
import time
from dataclasses import dataclass, field
from typing import Dict, Sequence, Set, Tuple

from xplane_bridge import protocol


@dataclass(frozen=True)
class DataWatch:
    """What came.

    Attributes:
        rows: Indices of the rows that came, by the port they came to and the address they came from.
        taken: Ports that another program holds, so that nothing could be listened to there.
    """

    rows: Dict[Tuple[int, str], Tuple[int, ...]] = field(default_factory=dict)
    taken: Tuple[int, ...] = ()


def watch(ports: Sequence[int], duration_s: float) -> DataWatch:
    """Listens on UDP ports for some time [s]; a port that is taken is left to the program that has it."""
    taken = []
    open_: Dict[socket.socket, int] = {}
    rows: Dict[Tuple[int, str], Set[int]] = {}
    try:
        for port in ports:
            receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            open_[receiver] = port
            try:
                receiver.bind(("", port))
            except OSError as error:
                del open_[receiver]
                receiver.close()
                if error.errno in (errno.EADDRINUSE, errno.EACCES):
                    taken.append(port)
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            ready, _, _ = select.select(list(open_), [], [], max(0.0, end - time.monotonic()))
            for receiver in ready:
                try:
                    datagram, (address, _) = receiver.recvfrom(protocol.MAX_DATAGRAM)
                    packet = protocol.decode_data(datagram)
                except (OSError, protocol.DecodeError):
                    continue
                rows.setdefault((open_[receiver], address), set()).update(index for index, _ in packet.rows)
    finally:
        for receiver in open_:
            receiver.close()
    return DataWatch({key: tuple(sorted(found)) for key, found in rows.items()}, tuple(taken))
