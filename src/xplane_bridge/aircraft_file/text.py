"""The commented YAML of an aircraft, as those in config/aircraft."""

from __future__ import annotations

import json
import re
import textwrap
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import yaml

from xplane_bridge.aircraft_file.observed import Observed

FIXED_WING, MULTIROTOR, TILTROTOR, HELICOPTER = KINDS = ("fixed_wing", "multirotor", "tiltrotor", "helicopter")
FAILSAFES = ("neutral", "hold", "manual")
#: Roll and pitch at which a test signal ends [deg], by kind.
_EXCITATION: Dict[str, Tuple[float, float]] = {
    FIXED_WING: (45.0, 20.0), MULTIROTOR: (30.0, 30.0), TILTROTOR: (30.0, 20.0), HELICOPTER: (20.0, 15.0),
}  # fmt: skip
_WIDTH = 120


@dataclass(frozen=True)
class Facts:
    """What X-Plane does not show, and so the user has to enter.

    Attributes:
        name: Stem of the file, and value of the parameter `aircraft`.
        kind: One of KINDS.
        failsafe: Of stick, throttle, motors and toe brakes, one of FAILSAFES.
        hover_throttle: Lever that carries a multirotor, 0..1; None for others.
        reverse: Whether levers below 0 are reverse.
        conversion: Of a tiltrotor, from hover to cruise [s].
    """

    name: str
    kind: str
    failsafe: str = "neutral"
    hover_throttle: Optional[float] = None
    reverse: bool = False
    conversion: float = 12.0


def likely_kind(seen: Observed) -> str:
    """What kind of aircraft it seems to be."""
    if seen.helicopter:
        return HELICOPTER
    if seen.engines >= 3 and not seen.surfaces:
        return MULTIROTOR
    return TILTROTOR if seen.thrust_vector else FIXED_WING


def likely_name(seen: Observed) -> str:
    """A file name for it."""
    words = re.sub(r"[^a-z0-9]+", "_", (seen.description or seen.icao).lower()).strip("_")
    return words or "my_aircraft"


def likely_failsafe(kind: str) -> str:
    """A helicopter without stabilisation does not keep level with the stick in the middle."""
    return "manual" if kind == HELICOPTER else "neutral"


def yaml_of(seen: Observed, facts: Facts) -> str:
    """The file's text."""
    lines = _comment(seen)
    lines += [f"name: {_scalar(facts.name)}", f"identity: [{_identity(seen)}]{_identity_note(seen)}"]
    lines.append(f"engines: {min(max(seen.engines, 1), 8)}")
    if facts.reverse:
        lines.append("reverse_thrust: true    # levers below 0")
    lines.append(f"failsafe: {facts.failsafe}    # see it fly by it before you rely on it: docs/control/failsafes.md")
    lines += ["", "channels:", *_channels(seen, facts)]
    roll, pitch = _EXCITATION[facts.kind]
    lines += ["", f"excitation: {{max_roll_deg: {roll}, max_pitch_deg: {pitch}}}    # there a test signal ends"]
    if seen.surfaces:
        lines.append("surfaces: {rate_deg_s: 60.0}    # of surfaces driven one by one: docs/control/surfaces.md")
    return "\n".join(lines) + "\n"


def _identity(seen: Observed) -> str:
    text = seen.icao or seen.description
    return _scalar(text) if text else ""


def _scalar(text: str) -> str:
    """A text as it stands in the file: quoted where YAML, as roslaunch reads it, would take it for anything else.

    738 and 747_8 are numbers to it, NO is false; what has other characters than a name might end a list.
    """
    plain = all(c.isalnum() or c in "_-" for c in text) and _is_read_as(text)
    return text if plain else json.dumps(text)


def _is_read_as(text: str) -> bool:
    try:
        return bool(yaml.safe_load(text) == text)
    except (ValueError, yaml.YAMLError):  # a day that there is not, as 2020-13-01
        return False


def _identity_note(seen: Observed) -> str:
    if seen.icao:
        return ""
    return "    # its description: it has no ICAO code" if seen.description else "    # nothing to know it by: any"


def _comment(seen: Observed) -> List[str]:
    facts = [f"{seen.engines} engine{'' if seen.engines == 1 else 's'}"]
    facts.append(", ".join(seen.surfaces) or "no surfaces")
    facts.append("flaps" if seen.flap_detents else "no flaps")
    facts.append("gear that retracts" if seen.retracts else "fixed gear")
    facts += ["thrust vector"] if seen.thrust_vector else []
    facts += ["engines that reverse"] if seen.reverses else []
    named = " ".join(filter(None, [seen.description, f"({seen.icao})" if seen.icao else "(no ICAO code)"]))
    lines = [f"{named}. Keys: config/aircraft/README.md of xplane_bridge."]
    lines += textwrap.wrap(f"Seen by aircraft_config in X-Plane {seen.version}: {'; '.join(facts)}.", _WIDTH)
    return [f"# {line}" for line in [*lines, *([seen.path] if seen.path else [])]]


def _channels(seen: Observed, facts: Facts) -> List[str]:
    rows: List[Tuple[str, str, str]] = []
    if facts.kind == MULTIROTOR:
        rows.append(("throttle", f"{{neutral: {facts.hover_throttle:.2f}, slew: 2.0}}", "the hover"))
        rows.append(("motors", "{failsafe: hold, low: 0.0}", "no motor turns backwards"))
    elif facts.failsafe == "neutral":
        rows.append(("throttle", "{failsafe: hold}", "neutral would be idle"))
    else:
        rows.append(("throttle", f"{{failsafe: {facts.failsafe}}}", "as the stick"))
    if facts.kind == TILTROTOR:
        slew = f"{{slew: {1.0 / facts.conversion:.2g}}}"
        rows.append(("thrust_vector", slew, f"conversion takes {facts.conversion:g} s"))
    if seen.flap_detents:
        rows.append(("flaps", "{slew: 0.5}", "of full travel a second"))
    if "speed brakes" in seen.surfaces:
        rows.append(("speedbrake", "{slew: 1.0}", "of full travel a second"))
    width = max(len(name) for name, _, _ in rows) + 1
    values = max(len(value) for _, value, _ in rows)
    return [f"  {name + ':':{width}} {value:{values}}    # {note}" for name, value, note in rows]
