"""Programs that fly one kind of aircraft look which one is loaded before they touch it, and while they fly it."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

import yaml

from xplane_bridge.cli.bridge.waiting import Listener, link_text, print_waiting, wait_until
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.resources import ResourceError, config_file


class AircraftError(XplaneBridgeError):
    """Another aircraft is loaded than the program is for."""


def identities_of(names: Sequence[str], bridge_has: Mapping[str, Sequence[str]]) -> Dict[str, List[str]]:
    """Identities of aircraft: what the bridge was started with, else what config/aircraft/<name>.yaml lists.

    Args:
        names: Stems of files in config/aircraft.
        bridge_has: Name to codes of the aircraft that tx_node knows.

    Returns:
        Name to ICAO codes, or descriptions of what has no code; none of them stand for any aircraft.

    Raises:
        AircraftError: The bridge was started with another one, and there is no such file.
    """
    found = {}
    for name in names:
        if name in bridge_has:
            found[name] = list(bridge_has[name])
            continue
        try:
            file = config_file("aircraft", f"{name}.yaml")
        except ResourceError as error:
            raise AircraftError(f"which aircraft is {name}? {error}; start the bridge with aircraft:={name}") from None
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
        found[name] = [str(code) for code in content.get("identity", [])]
    return found


def refusal(identities: Mapping[str, Sequence[str]], icao: str, description: str) -> str:
    """Why the loaded aircraft is none of those wanted; empty when it is one, or when any will do."""
    # Blanks at the ends do not count, as for tx_node.
    shown = {icao.strip(" "), description.strip(" ")} - {""}
    if not identities or any(not codes or shown & {code.strip(" ") for code in codes} for codes in identities.values()):
        return ""
    wanted = " or ".join(f"{name} ({', '.join(codes)})" for name, codes in identities.items())
    loaded = f"{icao or 'one without ICAO code'} ({description})"
    return f"this is for {wanted}, but the aircraft loaded is {loaded}"


class LoadedAircraft:
    """Watches which aircraft is loaded.

    Args:
        namespace: Of the bridge, without a slash at its end.
        program: For the lines that say what is waited for.
        wanted: Stems of files in config/aircraft; empty: any aircraft will do, and nothing is waited for.
        remedy: What to do about another one.
        on_change: Called with the refusal when another one is loaded later.
    """

    def __init__(
        self, namespace: str, program: str, wanted: Sequence[str], remedy: str, on_change: Callable[[str], None]
    ) -> None:
        self._namespace = namespace
        self._program = program
        self._remedy = remedy
        self._on_change = on_change
        self._identities: Dict[str, List[str]] = {}
        self._passed = False
        self._link: Optional[Listener] = None
        self._wanted = list(wanted)

    def check(self) -> None:
        """Waits until the aircraft is known; from then on `on_change` is called with others.

        Raises:
            AircraftError: It is none of those wanted.
            WaitError: ROS ended.
        """
        if not self._wanted:
            return
        from xplane_bridge.msg import LinkState

        link = self._link = Listener(f"{self._namespace}/link_state", LinkState, self._look)
        wait_until(lambda: _flies(link.last), self._why, print_waiting(self._program))
        self._identities = identities_of(self._wanted, self._of_bridge())
        text = self._refusal(link.last)
        if text:
            raise AircraftError(text)
        self._passed = True
        self._look(link.last)  # it may have changed in between

    def _look(self, link: Any) -> None:
        text = self._refusal(link) if self._passed and _flies(link) else ""
        if text:
            self._on_change(text)

    def _refusal(self, link: Any) -> str:
        text = refusal(self._identities, link.aircraft_icao, link.aircraft_description)
        return f"{text}; {self._remedy}" if text else ""

    def _why(self) -> str:
        assert self._link is not None
        if self._link.last is None:
            return self._link.why_none()
        link = link_text(self._link.last)
        return f"{self._link.topic} does not say yet which aircraft is loaded; link to X-Plane: {link}"

    def _of_bridge(self) -> Dict[str, List[str]]:
        import rospy

        name = rospy.get_param(f"{self._namespace}/tx_node/aircraft/name", "")
        codes = rospy.get_param(f"{self._namespace}/tx_node/aircraft/identity", [])
        return {str(name): [str(code) for code in codes]} if name else {}


def _flies(link: Any) -> bool:
    """Whether flight data come, of an aircraft that is known."""
    return (
        link is not None
        and link.state in (link.CONNECTED, link.PAUSED)
        and bool(link.aircraft_icao or link.aircraft_description)
    )
