"""Signs and meanings of wind, sideslip and path."""

from __future__ import annotations

import math
from typing import List, Sequence, Tuple

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.link import Sample
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.vectors import body_axes, dot, length, median, rms, turn
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged

_WIND_MPS = 15.0
_SLIP_DEG = 1.0
_BALL_DEG = 0.3
_MEANINGFUL_DEG = 2.0
_MEANINGFUL_MPS = 2.0


def _through_air(flight: Flight, sample: Sample) -> Tuple[float, ...]:
    """Velocity through the air, east, up, south [m/s]."""
    return tuple(sample[v] - sample[w] for v, w in zip(names.LOCAL_VELOCITY, flight.wind_now))


def _sideslips(flight: Flight, samples: Sequence[Sample]) -> List[float]:
    """From velocity, wind and attitude: wind from the right + [deg]."""
    found = []
    for sample in samples:
        air = _through_air(flight, sample)
        found.append(math.degrees(math.asin(dot(body_axes(sample)[1], air) / max(length(air), 1.0))))
    return found


def _slipping(flight: Flight, path: str) -> Tuple[List[float], List[float]]:
    """Sideslips of a second with the rudder to the right, and what a dataref shows meanwhile."""
    flight.pilot.rudder = 0.4
    flight.wait(1.2)
    samples = flight.fly((*names.ORIGIN_ANGLES, *names.LOCAL_VELOCITY, *flight.wind_now, path), 1.0)
    return _sideslips(flight, samples), [sample[path] for sample in samples]


def _beta(flight: Flight) -> Answer:
    own, shown = _slipping(flight, names.BETA)
    size = rms(own)
    if size < _SLIP_DEG:
        raise NotTestableError(f"full rudder makes {size:.1f} deg of sideslip only")
    left = rms([a + b for a, b in zip(shown, own)])
    right = rms([a - b for a, b in zip(shown, own)])
    text = (
        f"beta taken + with wind from the left is {left:.2f} deg off, from the right {right:.2f} deg, of {size:.2f} deg"
    )
    return judged(left < right, text, off_left_deg=left, off_right_deg=right, size_deg=size)


def _slip(flight: Flight) -> Answer:
    own, shown = (median(each) for each in _slipping(flight, names.SLIP))
    if abs(own) < _SLIP_DEG or abs(shown) < _BALL_DEG:
        raise NotTestableError(f"full rudder makes {own:.1f} deg of sideslip and moves the ball {shown:.1f} deg only")
    # A ball goes to the side that the wind comes from: from the left where the nose points right of the path.
    text = f"slip_deg is {shown:+.1f} deg with wind from the {'right' if own > 0.0 else 'left'}, {abs(own):.1f} deg"
    return judged(shown * own < 0.0, text, slip_deg=shown, sideslip_deg=own)


def _across(flight: Flight) -> float:
    """Where a wind from the right comes from [deg]."""
    return (flight.place.heading_deg + 90.0) % 360.0


def _hpath(flight: Flight) -> Answer:
    with flight.wind(_across(flight), _WIND_MPS):
        flight.wait(0.3)
        samples = flight.fly((*names.LOCAL_VELOCITY, *flight.wind_now, names.HPATH, names.TRUE_HEADING), 1.0)
    over_ground, through_air, apart = [], [], []
    for sample in samples:
        track = _direction([sample[path] for path in names.LOCAL_VELOCITY])
        path = _direction(_through_air(flight, sample))
        over_ground.append(turn(sample[names.HPATH], track))
        through_air.append(turn(sample[names.HPATH], path))
        apart.append(turn(track, path))
    if rms(apart) < _MEANINGFUL_DEG:
        raise NotTestableError(f"there is no wind across: both paths are the same, within {rms(apart):.1f} deg")
    ground, air = rms(over_ground), rms(through_air)
    text = f"hpath is {ground:.2f} deg off the path over ground, {air:.2f} deg off that through the air"
    return judged(ground < air, text, off_ground_deg=ground, off_air_deg=air)


def _direction(velocity: Sequence[float]) -> float:
    east, _, south = velocity
    return math.degrees(math.atan2(east, -south)) % 360.0


def _wind_names(flight: Flight) -> Answer:
    asked = _WIND_MPS
    regions = flight.xplane.version >= names.FIRST_WITH_REGIONS
    wanted = (*names.REGION_SPEED, *names.REGION_FROM) if regions else (*names.OLD_WIND_SPEED, *names.OLD_WIND_FROM)
    answered = flight.xplane.try_read(wanted)
    missing = [path for path in wanted if path not in answered]
    if missing:
        return judged(False, f"X-Plane does not answer {len(missing)} of {len(wanted)} names: {', '.join(missing)}")
    with flight.wind(_across(flight), asked) as wind:
        speed = length(wind)
    unit = "m/s" if regions else "knots, in names with brackets"
    text = f"{asked:.1f} m/s written as {unit}: the air moves with {speed:.1f} m/s"
    return judged(abs(speed - asked) < 0.15 * asked, text, asked_mps=asked, shown_mps=speed)


def _wind_direction(flight: Flight) -> Answer:
    with flight.wind(flight.place.heading_deg, _WIND_MPS):
        flight.wait(0.3)
        samples = flight.fly((*names.LOCAL_VELOCITY, *flight.wind_now, names.TRUE_AIRSPEED), 1.0)
    wind = median([length([sample[path] for path in flight.wind_now]) for sample in samples])
    if wind < _MEANINGFUL_MPS:
        raise NotTestableError(f"the wind is {wind:.1f} m/s only")

    def off(sign: float) -> float:
        speeds = [
            length([s[v] - sign * s[w] for v, w in zip(names.LOCAL_VELOCITY, flight.wind_now)]) - s[names.TRUE_AIRSPEED]
            for s in samples
        ]
        return rms(speeds)

    goes, comes = off(1.0), off(-1.0)
    text = (
        f"true airspeed is {goes:.2f} m/s off where wind_now_* is the air's velocity, {comes:.2f} m/s where it is "
        f"the direction it comes from; wind {wind:.1f} m/s"
    )
    return judged(goes < comes, text, off_velocity_mps=goes, off_from_mps=comes, wind_mps=wind)


QUESTIONS = (
    Question("beta-sign", "beta is + with wind from the left: hpath + beta = psi", _beta),
    Question("slip-sign", "slip_deg is + with the ball to the left", _slip),
    Question("wind-names", "the names and units that set_wind writes set the wind", _wind_names),
    Question("wind-direction", "wind_now_* is the velocity of the air, not where it comes from", _wind_direction),
    Question("hpath", "hpath is the path over ground", _hpath),
)
