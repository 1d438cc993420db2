"""`sim/operation/failures/rel_*`: all that X-Plane's list of the version has."""

from __future__ import annotations

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table

PREFIX = "sim/operation/failures/"


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    for name in t.store.listed(PREFIX + "rel_"):
        t.setting(name)
        t.store.on_write(name, lambda _index, _value: sim.failures_changed())
