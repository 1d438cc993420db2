"""Listens for the beacons by which X-Planes announce themselves on the local network."""

from __future__ import annotations

import contextlib
import socket
import struct
import sys
import time
from dataclasses import dataclass
from typing import Dict, Tuple

from xplane_bridge import protocol

#: Beacon.host_id of X-Plane (2 is Plane Maker), and Beacon.role of one that flies (others show its views).
X_PLANE = 1
MASTER = 1


@dataclass(frozen=True)
class Sighting:
    """An X-Plane that announced itself.

    Attributes:
        address: IPv4 address the beacon came from.
        port: UDP port it says it listens on.
        version: e.g. 115501.
        computer: Name of its computer.
        flies: Whether it is an X-Plane that flies, not Plane Maker, an external view or an instructor's station.
    """

    address: str
    port: int
    version: int
    computer: str
    flies: bool = True


@dataclass(frozen=True)
class BeaconWatch:
    """What was heard.

    Attributes:
        sightings: Who announced itself, in the order first heard.
        interfaces: Names of the network interfaces that were listened on.
        error: Why nothing could be heard, in the system's words; empty when listening worked.
        odd: Datagrams that are no beacons of X-Plane.
    """

    sightings: Tuple[Sighting, ...] = ()
    interfaces: Tuple[str, ...] = ()
    error: str = ""
    odd: int = 0


def listen(group: str, port: int, duration_s: float) -> BeaconWatch:
    """Listens to a multicast group on every interface.

    Args:
        group: X-Plane's: `protocol.BEACON_GROUP`.
        port: X-Plane's: `protocol.BEACON_PORT`.
        duration_s: [s]
    """
    heard: Dict[Sighting, None] = {}
    odd = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        try:
            interfaces = _open(receiver, group, port)
        except OSError as error:
            return BeaconWatch(error=error.strerror or str(error))
        end = time.monotonic() + duration_s
        while True:
            left = end - time.monotonic()
            if left <= 0:
                break
            receiver.settimeout(left)
            try:
                datagram, (address, _) = receiver.recvfrom(protocol.MAX_DATAGRAM)
                beacon = protocol.decode_beacon(datagram)
            except OSError:  # the time is over
                continue
            except protocol.DecodeError:
                odd += 1
                continue
            flies = beacon.host_id == X_PLANE and beacon.role == MASTER
            heard[Sighting(address, beacon.port, beacon.version, beacon.host_name, flies)] = None
    return BeaconWatch(tuple(heard), interfaces, odd=odd)


def _open(receiver: socket.socket, group: str, port: int) -> Tuple[str, ...]:
    """Binds the port and joins the group on every interface; returns their names. OSError where it joins on none."""
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if sys.platform == "darwin":
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    # Bound to the group where the system allows it: datagrams sent to this computer alone stay with other programs.
    receiver.bind((group if sys.platform.startswith("linux") else "", port))
    joined = []
    failure = OSError("there is no network interface")
    for index, name in socket.if_nameindex():
        request = struct.pack("=4s4si", socket.inet_aton(group), socket.inet_aton("0.0.0.0"), index)
        try:
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
            joined.append(name)
        except OSError as error:
            failure = error
    if not joined:
        with contextlib.suppress(OSError):  # systems that do not take an interface's number
            request = struct.pack("=4s4s", socket.inet_aton(group), socket.inet_aton("0.0.0.0"))
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
            return ("default",)
        raise failure
    return tuple(joined)
