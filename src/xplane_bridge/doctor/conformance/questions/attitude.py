"""Axes and signs of attitude, rates and load."""

from __future__ import annotations

import math
import time
from typing import Callable, Dict, List, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.link import Sample
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.vectors import body_axes, dot, median, rms, turn
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged
from xplane_bridge.units import GRAVITY_MPS2

#: Both kinds of angles must differ by so much [deg].
_MEANINGFUL_DEG = 0.03
#: Rates and forces below these prove nothing.
_RATE_DEG_S, _AXIAL_G, _SIDE_G = 3.0, 0.03, 0.01


def _which_axes(pairs: Sequence[Tuple[Sequence[float], Sample]]) -> Tuple[float, float, float]:
    """How far angles (pitch, roll, heading) are from the local level's and the origin's, and these apart [deg]."""

    def off(paths: Sequence[str]) -> float:
        return median([rms([turn(a, s[path]) for a, path in zip(angles, paths)]) for angles, s in pairs])

    apart = median([rms([turn(s[a], s[b]) for a, b in zip(names.LEVEL_ANGLES, names.ORIGIN_ANGLES)]) for _, s in pairs])
    return off(names.LEVEL_ANGLES), off(names.ORIGIN_ANGLES), apart


def _judged_axes(pairs: Sequence[Tuple[Sequence[float], Sample]], more: str = "") -> Answer:
    level, origin, apart = _which_axes(pairs)
    if apart < _MEANINGFUL_DEG:
        raise NotTestableError(f"both kinds of angles are the same here, within {apart:.3f} deg")
    text = (
        f"{level:.3f} deg off the angles at the local level, {origin:.3f} deg off those at the scenery's origin{more}"
    )
    return judged(level < origin, text, off_level_deg=level, off_origin_deg=origin)


def _row17(flight: Flight) -> Answer:
    found = flight.xplane.rows_with((17,), (*names.LEVEL_ANGLES, *names.ORIGIN_ANGLES), 1.0)
    return _judged_axes([(rows[17][:3], sample) for rows, sample in found])


def _rpos(flight: Flight) -> Answer:
    paths = (*names.LEVEL_ANGLES, *names.ORIGIN_ANGLES, *names.LOCAL_VELOCITY)
    positions: List[Tuple[float, protocol.RposResponse]] = []
    samples: List[Sample] = []
    values: Dict[str, float] = {}
    with flight.xplane.receiver() as receiver:
        receiver.subscribe(paths, 100)
        receiver.send(protocol.RposRequest(50))
        for when, packet in receiver.datagrams(time.monotonic() + 1.0):
            if packet[:4] == b"RPOS":
                positions.append((when, protocol.decode_rpos_response(packet)))
            else:
                values.update(receiver.values_in(packet))
                if len(values) == len(paths):
                    samples.append(Sample(when, dict(values)))
        receiver.send(protocol.RposRequest(0))
    if not positions or not samples:
        raise NotTestableError(f"{len(positions)} RPOS datagrams and {len(samples)} samples of datarefs came")
    pairs = [(pos, min(samples, key=lambda s: abs(s.time - when))) for when, pos in positions]
    off = median([rms([a - s[path] for a, path in zip((p.vx_mps, p.vy_mps, p.vz_mps), names.LOCAL_VELOCITY)])
                  for p, s in pairs])  # fmt: skip
    more = f"; velocity {off:.3f} m/s off local_v*"
    return _judged_axes([((p.pitch_deg, p.roll_deg, p.heading_deg), s) for p, s in pairs], more)


def _row16(flight: Flight) -> Answer:
    flight.pilot.stick = (0.35, 0.25)
    found = flight.xplane.rows_with((16,), names.RATES_DEG_S, 0.8)
    flight.pilot.level()
    roll = rms([sample[names.RATES_DEG_S[0]] for _, sample in found])
    if roll < _RATE_DEG_S:
        raise NotTestableError(f"it rolls with {roll:.1f} deg/s only")
    layouts = {
        "P, Q, R in deg/s": lambda row: row[:3],
        "Q, P, R in rad/s": lambda row: (math.degrees(row[1]), math.degrees(row[0]), math.degrees(row[2])),
        "P, Q, R in rad/s": lambda row: tuple(map(math.degrees, row[:3])),
        "Q, P, R in deg/s": lambda row: (row[1], row[0], row[2]),
    }

    def off(layout: Callable[[Sequence[float]], Sequence[float]]) -> float:
        return rms([a - sample[path] for rows, sample in found for a, path in zip(layout(rows[16]), names.RATES_DEG_S)])

    offs = {name: off(layout) for name, layout in layouts.items()}
    best = min(offs, key=lambda name: offs[name])
    assumed = "P, Q, R in deg/s" if flight.xplane.is_12 else "Q, P, R in rad/s"
    text = f"row 16 is {best} ({offs[best]:.2f} deg/s off, rolling with {roll:.1f}); assumed {assumed}"
    return judged(best == assumed, text, found=best, assumed=assumed, off_deg_s=offs)


def _declination(flight: Flight) -> Answer:
    now = flight.xplane.read(names.TRUE_HEADING, names.MAGNETIC_HEADING, names.VARIATION)
    variation = now[names.VARIATION]
    if abs(variation) < 1.0:
        raise NotTestableError(f"the variation here is {variation:.1f} deg only")
    to_magnetic = turn(now[names.MAGNETIC_HEADING], now[names.TRUE_HEADING])
    text = f"magnetic_variation {variation:+.2f} deg, magnetic less true heading {to_magnetic:+.2f} deg"
    west = abs(to_magnetic - variation) < abs(to_magnetic + variation)
    return judged(west, text, variation_deg=variation, magnetic_less_true_deg=to_magnetic)


def _forces(flight: Flight, path: str, axis: int, signed: float) -> Tuple[float, float, float]:
    """Holds a load factor to the one that accelerations and attitude give.

    Returns:
        How far off it is with this sign, with the other sign, and the mean size of what they give [g].
    """
    samples = flight.fly((*names.ORIGIN_ANGLES, *names.ACCELERATION, path), 1.2)
    own = []
    for sample in samples:
        east, up, south = (sample[each] for each in names.ACCELERATION)
        own.append(dot(body_axes(sample)[axis], (east, up + GRAVITY_MPS2, south)) / GRAVITY_MPS2)
    shown = [sample[path] for sample in samples]
    return (
        rms([signed * a - b for a, b in zip(shown, own)]),
        rms([-signed * a - b for a, b in zip(shown, own)]),
        rms(own),
    )


def _axial(flight: Flight) -> Answer:
    flight.pilot.pitch_deg = 10.0
    flight.wait(0.8)
    same, other, size = _forces(flight, names.AXIAL, 0, -1.0)
    if size < _AXIAL_G:
        raise NotTestableError(f"the axial load is {size:.3f} g only")
    text = (
        f"g_axil taken aft + is {same:.3f} g off accelerations and attitude, forward + {other:.3f} g, of {size:.3f} g"
    )
    return judged(same < other, text, off_aft_g=same, off_forward_g=other, size_g=size)


def _side(flight: Flight) -> Answer:
    flight.pilot.rudder = 0.4
    flight.wait(1.2)
    same, other, size = _forces(flight, names.SIDE, 1, 1.0)
    if size < _SIDE_G:
        raise NotTestableError(f"the side load is {size:.3f} g only")
    text = f"g_side taken right + is {same:.3f} g off accelerations and attitude, left + {other:.3f} g, of {size:.3f} g"
    return judged(same < other, text, off_right_g=same, off_left_g=other, size_g=size)


QUESTIONS = (
    Question("row17-axes", "row 17 gives angles against the local level", _row17),
    Question("rpos-axes", "RPOS gives angles against the local level", _rpos),
    Question("row16", "row 16 is Q, P, R in rad/s in X-Plane 11 and P, Q, R in deg/s in 12", _row16),
    Question("declination-sign", "magnetic_variation is west +", _declination),
    Question("axial-sign", "g_axil is aft +", _axial),
    Question("side-sign", "g_side is right +", _side),
)
