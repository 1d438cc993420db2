"""How X-Plane puts the aircraft somewhere."""

from __future__ import annotations

import math
import time

from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.vectors import turn
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged

#: So far from the aircraft, so that being moved shows [m].
_MOVE_M = 4000.0
_EXACT_M = 150.0
_M_PER_DEG = 111320.0


def _prel(flight: Flight) -> Answer:
    place = flight.place.north(_MOVE_M)
    seen = flight.begin_at(place)
    if seen is None:
        return judged(False, "no flight begins anew at the place of PREL (start type 6)")
    heading = turn(seen[names.TRUE_HEADING], place.heading_deg)
    speed, elevation = seen[names.TRUE_AIRSPEED], seen[names.ELEVATION] - place.elevation_m
    text = (
        f"elevation {elevation:+.0f} m, heading {heading:+.1f} deg off; true airspeed {speed:.1f} m/s, "
        f"{place.speed_mps:.1f} asked for"
    )
    good = abs(elevation) < _EXACT_M and abs(heading) < 10.0 and abs(speed - place.speed_mps) < 0.15 * place.speed_mps
    return judged(good, text, elevation_off_m=elevation, heading_off_deg=heading, true_airspeed_mps=speed)


def _vehs(flight: Flight) -> Answer:
    if not flight.xplane.is_12:
        raise NotTestableError("version 11 does not have VEHS")
    place = flight.place.north(-_MOVE_M)
    before = flight.xplane.read(names.FLIGHT_TIME)[names.FLIGHT_TIME]
    seen = flight.move_to(place)
    if seen is None:
        return judged(False, f"VEHS, sent twice to a place {_MOVE_M:.0f} m away, moves nothing")
    elevation = seen[names.ELEVATION] - place.elevation_m
    text = (
        f"elevation {elevation:+.0f} m off, flight time goes on from {before:.1f} s to {seen[names.FLIGHT_TIME]:.1f} s"
    )
    return judged(abs(elevation) < _EXACT_M, text, elevation_off_m=elevation)


def _other_aircraft(flight: Flight) -> Answer:
    paths = (names.OTHER_LATITUDE, names.OTHER_LONGITUDE)
    before = flight.xplane.read(*paths)
    if not any(before.values()):
        raise NotTestableError("there is no other aircraft in this flight")
    wanted = flight.place.north(2.0 * _MOVE_M)
    place = (wanted.latitude_deg, wanted.longitude_deg, wanted.elevation_m, wanted.heading_deg, 0.0, 0.0)
    with flight.xplane.changed({names.OTHER_OVERRIDE: 1.0}, {names.OTHER_OVERRIDE: 0.0}):
        flight.xplane.send(protocol.VehiclePose("VEHX", 1, *place))
        time.sleep(0.5)
        after = flight.xplane.read(*paths)
    off = math.hypot(
        after[names.OTHER_LATITUDE] - wanted.latitude_deg,
        (after[names.OTHER_LONGITUDE] - wanted.longitude_deg) * math.cos(math.radians(wanted.latitude_deg)),
    )
    return judged(off < 0.005, f"aircraft 1 is {off:.4f} deg from where VEHX put it", off_deg=off)


def _other_written(flight: Flight) -> Answer:
    paths = (names.OTHER_LATITUDE, *names.OTHER_PLACE)
    before = flight.xplane.read(*paths)
    if not any(before.values()):
        raise NotTestableError("there is no other aircraft in this flight")
    x, y, z = (before[path] for path in names.OTHER_PLACE)
    writes = dict(zip(names.OTHER_PLACE, (x, y, z - _MOVE_M)))  # z is south
    with flight.xplane.changed({names.OTHER_OVERRIDE: 1.0}, {names.OTHER_OVERRIDE: 0.0}):
        for path, value in writes.items():
            flight.xplane.write(path, value)
        time.sleep(0.5)
        after = flight.xplane.read(*paths)
    moved = (after[names.OTHER_LATITUDE] - before[names.OTHER_LATITUDE]) * _M_PER_DEG
    text = f"aircraft 1 goes {moved:.0f} m north where {_MOVE_M:.0f} m are written under override_planepath"
    return judged(abs(moved - _MOVE_M) < _EXACT_M, text, moved_m=moved)


QUESTIONS = (
    Question("prel", "PREL begins a flight at its place with its heading and true airspeed", _prel),
    Question("vehs", "VEHS moves the aircraft that flies", _vehs),
    Question("other-aircraft", "VEHX puts another aircraft where it says", _other_aircraft),
    Question("other-written", "a written position of another aircraft under override_planepath holds", _other_written),
)
