"""What the rows of Data Output hold, beside the datarefs of the same frame."""

from __future__ import annotations

import math
import time
from typing import Callable, Dict, List, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.link import Row, Sample
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.vectors import median
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged
from xplane_bridge.units import FOOT_M

_FT_PER_M = 1.0 / FOOT_M
_RPM = 30.0 / math.pi
_WATCH_S = 0.8

Found = Sequence[Tuple[Dict[int, Row], Sample]]


def _off(found: Found, row: int, slot: int, wanted: Callable[[Sample], float]) -> float:
    """Median of how far a slot is from what it should be."""
    return median([abs(rows[row][slot] - wanted(sample)) for rows, sample in found])


def _row20(flight: Flight) -> Answer:
    paths = (
        names.LATITUDE,
        names.LONGITUDE,
        names.ELEVATION,
        names.HEIGHT,
        names.ALTIMETER,
        names.LATITUDE_OF_ORIGIN,
        names.LONGITUDE_OF_ORIGIN,
    )
    found = flight.xplane.rows_with((20,), paths, _WATCH_S)
    # What each slot should be, and how far off it may be: some frames of flight, the steps of float32.
    slots: List[Tuple[str, int, Callable[[Sample], float], float]] = [
        ("latitude", 0, lambda s: s[names.LATITUDE], 2e-4),
        ("longitude", 1, lambda s: s[names.LONGITUDE], 2e-4),
        ("ft MSL", 2, lambda s: s[names.ELEVATION] * _FT_PER_M, 20.0),
        ("ft AGL", 3, lambda s: s[names.HEIGHT] * _FT_PER_M, 20.0),
        ("indicated ft", 5, lambda s: s[names.ALTIMETER], 20.0),
        ("latitude of the origin", 6, lambda s: s[names.LATITUDE_OF_ORIGIN], 1e-3),
        ("longitude of the origin", 7, lambda s: s[names.LONGITUDE_OF_ORIGIN], 1e-3),
    ]
    offs = {name: _off(found, 20, slot, wanted) for name, slot, wanted, _ in slots}
    wrong = [f"slot {slot} ({name}) is {offs[name]:.6g} off" for name, slot, _, most in slots if offs[name] > most]
    last = ", ".join(f"{value:.6g}" for value in found[-1][0][20])
    text = f"{'; '.join(wrong) or 'every slot is as assumed'}; row 20 is {last}"
    return judged(not wrong, text, off=offs)


def _row1_clock(flight: Flight) -> Answer:
    found = flight.xplane.rows_with((1,), (names.RUNNING_TIME, names.FLIGHT_TIME), _WATCH_S)
    off = _off(found, 1, 1, lambda s: s[names.RUNNING_TIME])
    last = found[-1][1]
    if abs(last[names.RUNNING_TIME] - last[names.FLIGHT_TIME]) < 1.0:
        raise NotTestableError("the flight began with X-Plane: its time and the running time are the same")
    text = (
        f"slot 1 of row 1 is {off:.3f} s off total_running_time_sec ({last[names.RUNNING_TIME]:.1f} s; flight time "
        f"{last[names.FLIGHT_TIME]:.1f} s)"
    )
    return judged(off < 0.2, text, off_s=off)


def _row1_hours(flight: Flight) -> Answer:
    found = flight.xplane.rows_with((1,), (names.ZULU,), _WATCH_S)
    hours = _off(found, 1, 5, lambda s: s[names.ZULU] / 3600.0) * 3600.0
    seconds = _off(found, 1, 5, lambda s: s[names.ZULU])
    text = f"zulu time in row 1 is {hours:.1f} s off taken as hours, {seconds:.1f} s taken as seconds"
    return judged(hours < seconds, text, off_as_hours_s=hours, off_as_seconds_s=seconds)


def _row28_unit(flight: Flight) -> Answer:
    found = flight.xplane.rows_with((28,), (names.PROPELLER,), _WATCH_S)
    command = median([sample[names.PROPELLER] for _, sample in found])
    if command < 1.0:
        raise NotTestableError("this aircraft has no propeller governor: ENGN_prop is 0")
    shown = median([rows[28][0] for rows, _ in found])
    text = f"row 28 is {shown:.2f} where ENGN_prop is {command:.1f} rad/s, that is {command * _RPM:.0f} rpm"
    return judged(abs(shown - command * _RPM) < 0.02 * command * _RPM, text, row=shown, rad_s=command)


def _row115_bits(flight: Flight) -> Answer:
    engines = round(flight.xplane.read(names.ENGINES)[names.ENGINES])
    if engines < 2:
        raise NotTestableError("one engine: a bit for each and one for all are the same")
    last = engines - 1
    state = f"{names.GENERATORS_OFF}[{last}]"
    with flight.xplane.changed({f"{names.GENERATORS}[{last}]": 0.0}):
        time.sleep(0.5)
        found = flight.xplane.rows_with((115,), (state,), _WATCH_S)
    if not found[-1][1][state]:
        raise NotTestableError("generator_off does not show a generator that is switched off")
    bits = round(found[-1][0][115][4])
    text = f"slot 4 of row 115 is {bits} while the generator of engine {engines} is off; its bit is {1 << last}"
    return judged(bits == 1 << last, text, bits=bits, expected=1 << last)


def _row116_modes(flight: Flight) -> Answer:
    xplane = flight.xplane
    before = xplane.read(names.ALTITUDE_HOLD)[names.ALTITUDE_HOLD]
    if not before:
        xplane.send(protocol.CommandRequest(names.HOLD_ALTITUDE))
        time.sleep(0.5)
    try:
        found = xplane.rows_with((116,), (names.ALTITUDE_HOLD,), _WATCH_S)
    finally:
        if not before and xplane.read(names.ALTITUDE_HOLD)[names.ALTITUDE_HOLD]:
            xplane.send(protocol.CommandRequest(names.HOLD_ALTITUDE))
    status, shown = found[-1][1][names.ALTITUDE_HOLD], found[-1][0][116][1]
    if not status:
        raise NotTestableError("this aircraft's autopilot does not take altitude_hold")
    text = f"slot 1 of row 116 is {shown:g} where altitude_hold_status is {status:g}"
    return judged(shown == status, text, row=shown, status=status)


QUESTIONS = (
    Question("row20", "row 20 is latitude, longitude, ft MSL, ft AGL, -, indicated ft, origin's place", _row20),
    Question("row1-clock", "`total` of row 1 is total_running_time_sec", _row1_clock),
    Question("row1-hours", "zulu and local time of row 1 are decimal hours", _row1_hours),
    Question("row28-unit", "row 28 is rpm", _row28_unit),
    Question("row115-bits", "row 115 has a bit for each engine", _row115_bits),
    Question("row116-modes", "rows 116 and 117 code modes as the datarefs do", _row116_modes),
)
