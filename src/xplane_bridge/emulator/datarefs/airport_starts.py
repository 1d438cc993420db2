"""Flights that PREL begins at the emulator's aerodrome, as X-Plane does by its code: ramp, runway, approaches."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Optional

from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs.radio_navigation import (
    AERODROME_ID,
    GLIDE_PATH_DEG,
    HALF_RUNWAY_M,
    METERS_PER_NM,
    TOUCHDOWN_M,
    Place,
    offset,
)
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import InitialState

#: PREL's start types: parked; lined up; on the approach, so far before the runway [m] (as X-Plane's menu: 3 and 10 NM).
RAMP, RUNWAY = 10, 11
APPROACHES_M = {12: 3.0 * METERS_PER_NM, 13: 10.0 * METERS_PER_NM}
#: Where an aircraft lines up, behind the threshold [m].
LINE_UP_M = 60.0
#: The one ramp: beside the runway's middle, to its right [m], facing it.
RAMP_ASIDE_M = 150.0
#: Other grounds (grass, dirt, gravel, water, helipad): the runway's middle does for them.
GROUNDS = (14, 15, 16, 17, 18)
TYPES = (RAMP, RUNWAY, *APPROACHES_M, *GROUNDS)


def airport_start(request: protocol.Placement, home: InitialState) -> Optional[InitialState]:
    """The start of a flight at the aerodrome, over whose runway's middle a flight at `home` is.

    It has one ramp (0) and one runway (0), whose end 0 leads along `home`'s heading. A request without a code means
    the aerodrome where the aircraft is.

    Returns:
        None where X-Plane would have no such airport, ramp or runway.
    """
    if request.airport not in ("", AERODROME_ID):
        return None
    if request.runway != 0 or request.runway_direction not in (0, 1):
        return None
    middle = Place(home.latitude_deg, home.longitude_deg)
    heading = home.heading_deg + 180.0 * request.runway_direction
    if request.start_type in GROUNDS:
        return replace(home, on_ground=True)
    if request.start_type == RAMP:
        place = offset(middle, home.heading_deg + 90.0, RAMP_ASIDE_M)
        return _at(home, place, home.heading_deg - 90.0)
    if request.start_type == RUNWAY:
        return _at(home, offset(middle, heading, LINE_UP_M - HALF_RUNWAY_M), heading)
    away = APPROACHES_M[request.start_type]
    height = (away + TOUCHDOWN_M) * math.tan(math.radians(GLIDE_PATH_DEG))
    start = _at(home, offset(middle, heading, -HALF_RUNWAY_M - away), heading)
    return replace(start, on_ground=False, altitude_m=home.terrain_elevation_m + height)


def _at(initial: InitialState, place: Place, heading_deg: float) -> InitialState:
    """Standing there."""
    return replace(
        initial,
        latitude_deg=place.latitude_deg,
        longitude_deg=place.longitude_deg,
        heading_deg=earth.wrap_degrees(heading_deg),
        on_ground=True,
    )
