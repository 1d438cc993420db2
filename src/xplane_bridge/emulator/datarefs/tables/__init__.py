"""Which datarefs the emulator has, and where their values come from: one line per dataref, by subject."""

from __future__ import annotations

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables import (
    cabin,
    controls,
    engines,
    failures,
    flight,
    instruments,
    navigation,
    systems,
    traffic,
    views,
    weather,
)
from xplane_bridge.emulator.datarefs.tables.base import Table

__all__ = ["Table", "build"]


def build(sim: Sources) -> Table:
    """Defines all datarefs in the simulator's store and returns what publishes them."""
    table = Table(sim.store)
    for part in (flight, instruments, weather, controls, engines, systems, cabin, views, navigation, traffic, failures):
        part.define(table, sim)
    return table
