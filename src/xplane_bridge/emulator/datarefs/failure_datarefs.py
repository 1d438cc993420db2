"""Which equipment has failed (`rel_*` = 6); what that does to the flight is `flight.failure_effects`.

Electrical and instrument failures act in `aircraft_systems`. Triggers other than "failed now" (2 to 5: at a time,
speed, height or key press) are kept and read back but never fire.
"""

from __future__ import annotations

from typing import Set

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.failures import PREFIX

FAILED_NOW = 6.0


class FailureDatarefs:
    """Reads the failure datarefs."""

    def __init__(self, store: DatarefStore) -> None:
        names = store.listed(PREFIX + "rel_")
        self._leaves = [name[len(PREFIX) :] for name in names]
        self._store = store
        self._slots = np.array([store.dataref(name).slots[0] for name in names])

    def active(self) -> Set[str]:
        """Leaves (`rel_...`) of everything that is failed now."""
        return {self._leaves[i] for i in np.flatnonzero(self._store.values[self._slots] == FAILED_NOW)}

    def repair_all(self) -> None:
        """Repairs everything (RESE)."""
        self._store.values[self._slots] = 0.0
