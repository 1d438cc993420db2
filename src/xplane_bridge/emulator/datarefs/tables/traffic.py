"""Other aircraft: their poses, and what TCAS reports of them."""

from __future__ import annotations

from functools import partial
from typing import Callable, List

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.datarefs.traffic import GEODETIC, MOST, PLANE, WRITTEN
from xplane_bridge.emulator.flight.frame import Frame

_TARGETS = "sim/cockpit2/tcas/targets/"
_INDICATORS = "sim/cockpit2/tcas/indicators/relative_"
#: Of aircraft 0, from which the others count.
_MODE_S, _SQUAWK = 0x710000, 0o2000


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs. Element 0 of TCAS is the user's aircraft, of which TCAS reports nothing."""
    for number in range(1, MOST + 1):
        for leaf in (*WRITTEN, *GEODETIC):
            t.setting(PLANE.format(number) + leaf)
    for place, leaf in enumerate(("distance_mtrs", "bearing_degs", "altitude_mtrs")):
        t.array(_INDICATORS + leaf, partial(_relative, sim, place))
    t.array(_TARGETS + "modeS_id", lambda _: _codes(sim, lambda number: _MODE_S + number))
    t.array(_TARGETS + "modeC_code", lambda _: _codes(sim, lambda number: int(f"{_SQUAWK + number:o}")))


def _relative(sim: Sources, place: int, frame: Frame) -> List[float]:
    out = [0.0] * (MOST + 1)
    for number, values in sim.traffic.relative(frame).items():
        out[number] = values[place]
    return out


def _codes(sim: Sources, of: Callable[[int], int]) -> List[float]:
    return [float(of(number)) if number in sim.traffic.aircraft else 0.0 for number in range(MOST + 1)]
