"""Which datarefs the emulator has, and where their values come from: one line a dataref, by subject."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xplane_bridge.emulator.datarefs.tables import controls, engines, failures, flight, systems
from xplane_bridge.emulator.datarefs.tables.base import Table

if TYPE_CHECKING:
    from xplane_bridge.emulator.simulator import Simulator

__all__ = ["Table", "build"]


def build(sim: Simulator) -> Table:
    """Defines every dataref of the simulator's version in its store and returns what publishes them."""
    table = Table(sim.store, sim.version)
    for part in (flight, controls, engines, systems, failures):
        part.define(table, sim)
    return table
