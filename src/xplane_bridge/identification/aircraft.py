"""Which aircraft was recorded, by the recording's passport: coefficients are worth only what its sizes are."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence

from xplane_bridge.bags.passport import Passport
from xplane_bridge.emulator.aircraft import create_model, model_names
from xplane_bridge.identification.coefficients import Geometry, geometry_names, geometry_of
from xplane_bridge.identification.model import IdentificationError

_REMEDY = "--aircraft NAME or --geometry FILE say whose sizes to take"


class Recorded(NamedTuple):
    """The aircraft of a recording."""

    name: str  #: as config/geometry calls it, else as the simulator does; empty: not known
    geometry: Optional[Geometry]
    why_not: str  #: why its sizes are not known; empty: they are


def recorded_aircraft(passports: Sequence[Passport]) -> Recorded:
    """Find the aircraft that the passports of a recording name, and its sizes in config/geometry."""
    found = list(dict.fromkeys((str(p.others["loaded aircraft"]), str(p.others["aircraft file"])) for p in passports))
    if not found:
        why = "the recording does not say which aircraft was flown (no topic experiment)"
        return Recorded("", None, f"{why}: no coefficients; {_REMEDY}")
    if len(found) > 1:
        names = ", then ".join(dict.fromkeys(loaded or file for loaded, file in found))
        return Recorded("", None, f"the recording is of several aircraft ({names}): no coefficients; {_REMEDY}")
    ((loaded, file),) = found
    name = _emulated(loaded)
    # A file of config/aircraft that an aircraft of the emulator has serves others as well: it says nothing of sizes.
    if not name and file in geometry_names() and file not in model_names():
        name = file
    if name and name in geometry_names():
        return Recorded(name, geometry_of(name), "")
    name = name or loaded or file
    why = f"config/geometry has no sizes of the recorded aircraft, {name or 'which the recording does not name'}"
    return Recorded(name, None, f"{why}: no coefficients; {_REMEDY}")


def named_geometry(aircraft: str) -> Geometry:
    """Give the sizes of an aircraft of config/geometry.

    Raises:
        IdentificationError: It is not there; the text lists what is.
    """
    found = geometry_of(aircraft) if aircraft in geometry_names() else None
    if found is None:
        have = ", ".join(geometry_names())
        msg = f"--aircraft {aircraft}: config/geometry has: {have}; give the sizes of another one with --geometry FILE"
        raise IdentificationError(msg)
    return found


def _emulated(loaded: str) -> str:
    """The emulator's own name of the aircraft; empty where it is none of them. X-Plane's have the same ICAO codes."""
    for name in model_names():
        info = create_model(name).info
        if loaded == f"{info.icao} {info.description}":
            return name
    return ""
