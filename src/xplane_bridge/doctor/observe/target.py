"""Which X-Plane is examined: the one that the bridge's nodes would take."""

from __future__ import annotations

import enum
import socket
from dataclasses import dataclass, replace
from typing import Any, List, Mapping, Optional, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor.observe.beacons import BeaconWatch, Sighting
from xplane_bridge.doctor.observe.computer import is_own, is_same_computer
from xplane_bridge.doctor.settings import Settings


class Chosen(enum.Enum):
    """Who says where X-Plane is."""

    OPTION = "--host"
    PARAMETER = "the nodes' parameter host"
    BEACON = "its beacon"
    ASSUMED = "default: this computer is assumed"


@dataclass(frozen=True)
class Target:
    """The X-Plane that is examined.

    Attributes:
        host: As given: name or address.
        address: IPv4 address; empty when the name is not known.
        port: UDP port.
        chosen: Who says so.
        error: Why the name has no address, in the system's words.
    """

    host: str = "127.0.0.1"
    address: str = "127.0.0.1"
    port: int = protocol.DEFAULT_PORT
    chosen: Chosen = Chosen.ASSUMED
    error: str = ""

    @property
    def here(self) -> bool:
        """Whether it is on this computer."""
        return bool(self.address) and is_own(self.address)

    def __str__(self) -> str:
        """As users write it."""
        return f"{self.host}:{self.port}"


def choose(settings: Settings, parameters: Mapping[str, Any], beacons: BeaconWatch) -> Target:
    """Finds X-Plane as the nodes do: the host that is given, else the beacon.

    Args:
        settings: Options win.
        parameters: The namespace's parameters on the ROS master, where there is one.
        beacons: What was heard.
    """
    configured = parameters.get("host")
    # Only what the nodes would read: a port that is no number is reported by them, not used here.
    port = parameters.get("port") if isinstance(parameters.get("port"), int) else None
    if settings.host:
        given = _named(settings.host, settings.port or protocol.DEFAULT_PORT, Chosen.OPTION)
        return given if settings.port else replace(given, port=_port_at(given, configured, port, beacons))
    if isinstance(configured, str) and configured:
        return _named(configured, settings.port or port or protocol.DEFAULT_PORT, Chosen.PARAMETER)
    flying = distinct(beacons.sightings)
    if flying:
        best = next((seen for seen, _ in flying if seen.port == settings.port), flying[0][0])
        return Target(best.address, best.address, settings.port or best.port, Chosen.BEACON)
    return Target(port=settings.port or protocol.DEFAULT_PORT)


def distinct(sightings: Sequence[Sighting]) -> List[Tuple[Sighting, Tuple[str, ...]]]:
    """The X-Planes that fly, each with all addresses it was heard under.

    A computer with two addresses sends the same beacon from both: one X-Plane is one computer name, port and version.
    """
    found: List[Tuple[Sighting, Tuple[str, ...]]] = []
    for seen in sightings:
        if not seen.flies:
            continue
        for place, (first, addresses) in enumerate(found):
            named_alike = bool(seen.computer) and seen.computer == first.computer
            same = named_alike or any(is_same_computer(seen.address, address) for address in addresses)
            if same and (seen.port, seen.version) == (first.port, first.version):
                found[place] = (first, tuple(dict.fromkeys((*addresses, seen.address))))
                break
        else:
            found.append((seen, (seen.address,)))
    return found


def addresses_of(where: Target, beacons: BeaconWatch) -> Tuple[str, ...]:
    """The address of an X-Plane, and the others that its beacon was heard under."""
    heard: Tuple[str, ...] = ()
    for seen, addresses in distinct(beacons.sightings):
        if seen.port == where.port and any(is_same_computer(where.address, address) for address in addresses):
            heard += addresses
    return tuple(dict.fromkeys((where.address, *heard)))


def _port_at(given: Target, configured: Any, port: Optional[int], beacons: BeaconWatch) -> int:
    """The port of a host without one: the parameter's where that is of the same host, else its beacon's."""
    if not given.address:
        return given.port
    if port and isinstance(configured, str) and configured:
        address = given.address if configured == given.host else _named(configured, port, Chosen.PARAMETER).address
        if address and is_same_computer(given.address, address):
            return port
    announced = (
        seen.port
        for seen, addresses in distinct(beacons.sightings)
        if any(is_same_computer(given.address, address) for address in addresses)
    )
    return next(announced, given.port)


def _named(host: str, port: int, chosen: Chosen) -> Target:
    try:
        return Target(host, socket.gethostbyname(host), port, chosen)
    except (OSError, UnicodeError) as error:
        return Target(host, "", port, chosen, getattr(error, "strerror", None) or str(error))
