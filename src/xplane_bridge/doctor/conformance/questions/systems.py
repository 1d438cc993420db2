"""Units and meanings of masses, pressures and heights."""

from __future__ import annotations

import time

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged

_KG_PER_LB = 0.45359237
#: Working pressures of hydraulic systems [psi].
_PSI = (300.0, 6000.0)
_MORE_KG = 20.0


def _mass_unit(flight: Flight) -> Answer:
    now = flight.xplane.read(names.EMPTY_MASS, names.PAYLOAD, names.FUEL_MASS, names.TOTAL_MASS)
    rest = now[names.TOTAL_MASS] - now[names.PAYLOAD] - now[names.FUEL_MASS]
    empty = now[names.EMPTY_MASS]
    kg, lb = abs(empty - rest), abs(empty * _KG_PER_LB - rest)
    text = (
        f"acf_m_empty is {empty:.1f}; the mass without payload and fuel is {rest:.1f} kg: {kg:.1f} kg off taken as kg, "
        f"{lb:.1f} kg taken as lb"
    )
    return judged(kg < lb, text, off_as_kg=kg, off_as_lb=lb)


def _hydraulic_unit(flight: Flight) -> Answer:
    pressure = flight.xplane.read(names.HYDRAULIC_PRESSURE)[names.HYDRAULIC_PRESSURE]
    if pressure < 1.0:
        raise NotTestableError("this aircraft shows no hydraulic pressure")
    low, high = _PSI
    return judged(
        low < pressure < high, f"system 1 shows {pressure:.1f}: psi would be {low:.0f} to {high:.0f}", shown=pressure
    )


def _parked_height(flight: Flight) -> Answer:
    if not flight.before[names.ON_GROUND]:
        raise NotTestableError("the aircraft was not on the ground when the card began")
    height = flight.before[names.HEIGHT]
    return judged(abs(height) < 0.5, f"y_agl of the parked aircraft is {height:.2f} m", height_m=height)


def _payload_holds(flight: Flight) -> Answer:
    before = flight.xplane.read(names.PAYLOAD, names.TOTAL_MASS)
    wanted = before[names.PAYLOAD] + _MORE_KG
    with flight.xplane.changed({names.PAYLOAD: wanted}):
        time.sleep(0.7)
        after = flight.xplane.read(names.PAYLOAD, names.TOTAL_MASS)
    payload, total = (after[path] - before[path] for path in (names.PAYLOAD, names.TOTAL_MASS))
    text = f"m_fixed written {_MORE_KG:+.0f} kg shows {payload:+.1f} kg, the total mass {total:+.1f} kg"
    good = abs(payload - _MORE_KG) < 1.0 and abs(total - _MORE_KG) < 5.0
    return judged(good, text, payload_kg=payload, total_kg=total)


QUESTIONS_ON_GROUND = (
    Question("mass-unit", "acf_m_empty and acf_m_max are kg", _mass_unit, flies=False),
    Question("parked-height", "y_agl of a parked aircraft is about 0", _parked_height, flies=False),
)
QUESTIONS = (
    Question("hydraulic-unit", "hydraulic pressure is psi", _hydraulic_unit),
    Question("stations", "a written m_fixed stays and is the payload, stations or not", _payload_holds),
)
