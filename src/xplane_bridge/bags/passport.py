"""How a recorded flight was made: the passport that rx_node publishes on `experiment`."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Iterator, Mapping, Optional, Sequence

from xplane_bridge.bags import BagError

if TYPE_CHECKING:
    from xplane_bridge.bags import Bags

MESSAGE = "xplane_bridge/Experiment"
#: Characters of a text on a line of a table.
LONGEST = 160
_BEFORE = 40  # of them before the first one that differs


@dataclass(frozen=True)
class Passport:
    """One message of `experiment` (msg/Experiment.msg).

    Attributes:
        parameters: All parameters of the namespace.
        settings: What is set in X-Plane, by dataref; NaN where it has not answered.
        others: The other fields of the message, by name.
    """

    parameters: Mapping[str, Any]
    settings: Mapping[str, float]
    others: Mapping[str, Any] = field(default_factory=dict)

    @property
    def flight(self) -> Mapping[str, Any]:
        """What the program that has started the flight says of it (section `experiment/flight`); may be empty."""
        found = self.section("experiment").get("flight", {})
        return found if isinstance(found, dict) else {}

    def section(self, name: str) -> Mapping[str, Any]:
        """Give the parameters below a name; empty where there are none."""
        found = self.parameters.get(name, {})
        return found if isinstance(found, dict) else {}

    def says_the_same(self, other: Passport) -> bool:
        """Whether both say the same."""
        return self.lines() == other.lines()

    def lines(self) -> dict[str, str]:
        """Give all that it says, each with its name: parameters as paths; the texts of files have several lines."""
        out = {name: _words(value) for name, value in self.others.items()}
        out.update({name: _words(value) for name, value in self.settings.items()})
        out.update({path: _words(value) for path, value in _leaves(self.parameters)})
        return out


def read_passports(bags: Bags) -> list[Passport]:
    """Read what the recording says of how it was made; one for each time that it said something else.

    Args:
        bags: Open. None was published before version 0.2.0: then there is none.

    Raises:
        BagError: It does not hold what it should.
    """
    topic = bags.topic_of_type(MESSAGE)
    if topic is None:
        return []
    found: list[Passport] = []
    for _, message in bags.messages(topic):
        passport = _passport(message, topic)
        if not found or not passport.says_the_same(found[-1]):  # split recordings repeat it
            found.append(passport)
    return found


def shortened(texts: Sequence[Optional[str]]) -> list[Optional[str]]:
    """Cut texts down to a line each, which shows where they first differ; None stays None.

    What is left out of a text has a short SHA-256 for it: of more than two, some may differ elsewhere only.
    """
    lines = [[] if text is None else text.split("\n") for text in texts]
    places = range(max(map(len, lines), default=0))
    number = next((k for k in places if len({each[k] if k < len(each) else None for each in lines if each}) > 1), 0)
    there = [each[number] for each in lines if number < len(each)]
    start = 0
    if any(len(line) > LONGEST for line in there):
        alike = next((k for k, each in enumerate(zip(*there)) if len(set(each)) > 1), min(map(len, there)))
        start = max(0, alike - _BEFORE)

    def short(text: str, own: Sequence[str]) -> str:
        if len(own) == 1 and len(text) <= LONGEST:
            return text
        code = f"(SHA-256 {sha256(text.encode()).hexdigest()[:8]})"
        if number >= len(own):
            return f"ends before line {number + 1} {code}"
        line = own[number]
        shown = ("\u2026 " if start else "") + line[start : start + LONGEST]
        shown += " \u2026" if start + LONGEST < len(line) else ""
        return f"line {number + 1}: {shown} {code}" if len(own) > 1 else f"{shown} {code}"

    return [None if text is None else short(text, own) for text, own in zip(texts, lines)]


def _passport(message: Any, topic: str) -> Passport:
    try:
        parameters = json.loads(message.parameters) or {}
    except ValueError as error:
        msg = f"{topic}: the parameters are no JSON: {error}"
        raise BagError(msg) from None
    # By way of the text: of a float32 the shortest number that is it, 0.1 and not 0.10000000149011612.
    settings = {str(name): float(str(value)) for name, value in zip(message.settings, message.setting_values)}
    others = {
        "package version": str(message.package_version),
        "commit": str(message.commit),
        "aircraft file": str(message.aircraft_file),
        "sha256 of the aircraft file": str(message.aircraft_file_sha256),
        "loaded aircraft": f"{message.aircraft_icao} {message.aircraft_description}".strip(),
        "X-Plane": int(message.xplane_version),
        "refuted assumptions": ", ".join(message.refuted),
        "lock-step": bool(message.lockstep),
    }
    return Passport(parameters, settings, others)


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from _leaves(inner, f"{path}/{key}" if path else str(key))
    else:
        yield path, value


def _words(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "not known" if value != value else _exactly(value)
    return value if isinstance(value, str) else json.dumps(value)


def _exactly(value: float) -> str:
    """Numbers that differ have different texts: by them, flights are compared."""
    short = f"{value:.7g}"
    return short if float(short) == value else repr(value)
