"""What surfaces, levers and failures follow."""

from __future__ import annotations

import contextlib
from typing import Iterator

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, judged

_MOVED = 0.1
_MOVED_DEG = 3.0
_STICK = 0.3


@contextlib.contextmanager
def _stick(flight: Flight, roll: float) -> Iterator[None]:
    flight.pilot.stick = (roll, 0.0)
    try:
        yield
    finally:
        flight.pilot.stick = None


def _totals_move(flight: Flight) -> Answer:
    with _stick(flight, 0.0):
        flight.wait(0.3)
        with flight.xplane.changed({names.SURFACE_OVERRIDE: 1.0}):
            before = flight.xplane.read(names.TOTAL_ROLL)[names.TOTAL_ROLL]
            with _stick(flight, _STICK):
                flight.wait(0.4)
                after = flight.xplane.read(names.TOTAL_ROLL)[names.TOTAL_ROLL]
    text = f"total_roll_ratio goes from {before:.2f} to {after:.2f} with the stick at {_STICK:.1f} under the override"
    return judged(abs(after - before) > _MOVED, text, before=before, after=after)


def _surface_failures(flight: Flight) -> Answer:
    if not flight.xplane.is_12:
        raise NotTestableError("version 11 does not have rel_fcon_*")
    with _stick(flight, 0.0):
        flight.wait(0.3)
        before = flight.xplane.read(*names.AILERONS)
        with flight.xplane.changed({names.AILERON_HARD_OVER: 6.0}, {names.AILERON_HARD_OVER: 0.0}):
            flight.wait(0.6)
            after = flight.xplane.read(*names.AILERONS)
    moved = max((after[path] - before[path] for path in names.AILERONS), key=abs)
    text = f"the left aileron moves by {moved:+.1f} deg when it fails hard over, trailing edge down"
    return judged(moved > _MOVED_DEG, text, moved_deg=moved)


def _reverse_lever(flight: Flight) -> Answer:
    before = flight.xplane.read(names.LEVER)[names.LEVER]
    wanted = 0.6 if before < 0.5 else 0.4
    with flight.xplane.changed({names.REVERSE_LEVER: wanted}, {names.REVERSE_LEVER: before}):
        flight.wait(0.4)
        after = flight.xplane.read(names.LEVER)[names.LEVER]
    text = f"throttle_ratio goes from {before:.2f} to {after:.2f} where throttle_jet_rev_ratio is written {wanted:.1f}"
    return judged(abs(after - wanted) < 0.05, text, before=before, written=wanted, after=after)


QUESTIONS = (
    Question("reverse-lever", "throttle_jet_rev_ratio above 0 is the throttle", _reverse_lever),
    Question("totals-move", "total_*_ratio follow the stick under override_control_surfaces", _totals_move),
    Question("fcon-acts", "rel_fcon_* act on the surfaces", _surface_failures),
)
