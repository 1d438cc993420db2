"""Looks at the aircraft that is loaded in X-Plane, by UDP; writes nothing there."""

from __future__ import annotations

import math
import socket
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Tuple

from xplane_bridge.doctor.observe.simulator import Questions
from xplane_bridge.errors import XplaneBridgeError

VERSION = "sim/version/xplane_internal_version"
ICAO = "sim/aircraft/view/acf_ICAO"
DESCRIPTION = "sim/aircraft/view/acf_descrip"
#: X-Plane 12 only.
PATH = "sim/aircraft/view/acf_relative_path"
ENGINES = "sim/aircraft/engine/acf_num_engines"
REVERSE = "sim/aircraft/engine/acf_throtmax_REV"
FLAP_DETENTS = "sim/aircraft/controls/acf_flap_detents"
RETRACTS = "sim/aircraft/gear/acf_gear_retract"
THRUST_VECTOR = "sim/aircraft/vtolcontrols/acf_vectEQ"
HELICOPTER = "sim/aircraft2/metadata/is_helicopter"
#: Travel of each kind of surface [deg]; all 0: there is none.
TRAVELS: Dict[str, Tuple[str, ...]] = {
    "ailerons": ("sim/aircraft/controls/acf_ail1_up", "sim/aircraft/controls/acf_ail1_dn"),
    "second ailerons": ("sim/aircraft/controls/acf_ail2_up", "sim/aircraft/controls/acf_ail2_dn"),
    "spoilers": ("sim/aircraft/controls/acf_splr_up",),
    "elevators": ("sim/aircraft/controls/acf_elev_up", "sim/aircraft/controls/acf_elev_dn"),
    "rudder": ("sim/aircraft/controls/acf_rudd_lr", "sim/aircraft/controls/acf_rudd_rr"),
    "speed brakes": ("sim/aircraft/controls/acf_sbrk_up",),
}
HEIGHT = "sim/flightmodel/position/y_agl"
GROUND_SPEED = "sim/flightmodel/position/groundspeed"
CLIMB = "sim/flightmodel/position/vh_ind"
LEVER = "sim/cockpit2/engine/actuators/throttle_ratio[0]"
SCALARS = (
    ENGINES, REVERSE, FLAP_DETENTS, RETRACTS, THRUST_VECTOR, HELICOPTER, HEIGHT, GROUND_SPEED, CLIMB, LEVER,
    *(path for paths in TRAVELS.values() for path in paths),
)  # fmt: skip
#: Characters of each text that are asked for; every one costs a request.
LENGTHS = {ICAO: 8, DESCRIPTION: 64, PATH: 150}
_FIRST_12 = 120000
_PATIENCE_S = 3.0
#: A hover is flown at most so fast [m/s], and so high at least [m].
_STANDS_MPS, _AIRBORNE_M = 0.5, 1.0


class NotSeenError(XplaneBridgeError):
    """X-Plane does not show the aircraft."""


@dataclass(frozen=True)
class Observed:
    """The aircraft that is loaded.

    Attributes:
        version: X-Plane's, as it numbers itself, e.g. 115501.
        icao: Type designator; empty where the aircraft's author gave none.
        description: In the author's words.
        path: Of the .acf file below X-Plane's folder; empty where the version does not show it.
        engines: Number of engines.
        surfaces: Kinds of surfaces that have travel, of `TRAVELS`.
        flap_detents: Number of notches of the flap handle; 0: no flaps.
        retracts: Whether the gear does.
        thrust_vector: Whether the thrust is vectored.
        reverses: Whether engines push backwards.
        helicopter: Whether X-Plane lists it as one.
        hover: Lever that holds it in the hover that is flown right now; None: none is flown.
    """

    version: int = 0
    icao: str = ""
    description: str = ""
    path: str = ""
    engines: int = 1
    surfaces: Tuple[str, ...] = ()
    flap_detents: int = 0
    retracts: bool = False
    thrust_vector: bool = False
    reverses: bool = False
    helicopter: bool = False
    hover: Optional[float] = None


def texts_of(version: int) -> List[str]:
    """The elements of texts that this version has."""
    names = [ICAO, DESCRIPTION, *([PATH] if version >= _FIRST_12 else [])]
    return [f"{name}[{i}]" for name in names for i in range(LENGTHS[name])]


def observe(address: str, port: int, patience_s: float = _PATIENCE_S) -> Observed:
    """Asks an X-Plane.

    Args:
        address: Name or IPv4 address of its computer.
        port: UDP port it listens on.
        patience_s: For which all answers are waited for, twice at most [s].

    Raises:
        NotSeenError: It does not answer, or has no aircraft loaded.
    """
    try:
        resolved = socket.gethostbyname(address)
    except (OSError, UnicodeError) as error:
        raise NotSeenError(f"{address}: {error}; expected the name or address of X-Plane's computer") from None
    with Questions(resolved, port) as questions:
        questions.ask([VERSION], patience_s)
        version = int(questions.answers.values.get(VERSION, 0.0))
        if not version:
            raise NotSeenError(
                f"X-Plane does not answer at {address}:{port}; start it and load the aircraft, give --host and "
                "--port, or see scripts/xplane_doctor"
            )
        questions.ask([*SCALARS, *texts_of(version)], patience_s)
        return taken(version, questions.answers.values)


def taken(version: int, values: Mapping[str, float]) -> Observed:
    """The aircraft that these datarefs show.

    Raises:
        NotSeenError: There is none.
    """
    engines = int(values.get(ENGINES, 0.0))
    icao, description = _text(values, ICAO), _text(values, DESCRIPTION)
    if not engines and not icao and not description:
        raise NotSeenError("X-Plane shows no aircraft; load one, and start a flight")

    def flag(path: str) -> bool:
        return values.get(path, 0.0) > 0.0

    return Observed(
        version=version,
        icao=icao,
        description=description,
        path=_text(values, PATH),
        engines=engines,
        surfaces=tuple(kind for kind, paths in TRAVELS.items() if any(abs(values.get(p, 0.0)) > 0.0 for p in paths)),
        flap_detents=int(values.get(FLAP_DETENTS, 0.0)),
        retracts=flag(RETRACTS),
        thrust_vector=flag(THRUST_VECTOR),
        reverses=flag(REVERSE),
        helicopter=flag(HELICOPTER),
        hover=_hover(values),
    )


def _hover(values: Mapping[str, float]) -> Optional[float]:
    moves = max(abs(values.get(path, math.inf)) for path in (GROUND_SPEED, CLIMB))
    if values.get(HEIGHT, 0.0) < _AIRBORNE_M or moves > _STANDS_MPS:
        return None
    return values.get(LEVER)


def _text(values: Mapping[str, float], name: str) -> str:
    letters = []
    for i in range(LENGTHS[name]):
        code = values.get(f"{name}[{i}]", 0.0)
        if not 1.0 <= code <= 255.0:
            break
        letters.append(chr(int(code)) if 32 <= code < 127 else "?")
    return "".join(letters).rstrip(" ")  # as tx_node reads it
