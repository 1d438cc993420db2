"""The means by which the tables define datarefs and publish their values."""

from __future__ import annotations

from typing import Callable, List, Sequence, Tuple, Union

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore, Kind, Numbers
from xplane_bridge.emulator.flight.frame import Frame

INT, FLOAT, DOUBLE, BYTE = Kind.INT, Kind.FLOAT, Kind.DOUBLE, Kind.BYTE
Number = Union[float, int, bool]

X11 = (11,)
X12 = (12,)
BOTH = (11, 12)


class Table:
    """Datarefs with their sources.

    `value` and `array` define datarefs that the simulator computes each frame; `setting` defines those that keep what
    was written last. Definitions for another X-Plane version are left out: the running one would not know the name.
    """

    def __init__(self, store: DatarefStore, version: int) -> None:
        self.store = store
        self.version = version
        #: Engine arrays have 8 elements in X-Plane 11 and 16 in X-Plane 12.
        self.engines = 16 if version == 12 else 8
        self._scalars: List[Tuple[int, Callable[[Frame], Number]]] = []
        self._arrays: List[Tuple[np.ndarray, Callable[[Frame], Sequence[Number]]]] = []
        self._always: List[Tuple[int, Callable[[Frame], Number]]] = []
        self._scalar_slots = np.zeros(0, dtype=int)

    def value(
        self,
        name: str,
        source: Callable[[Frame], Number],
        kind: Kind = FLOAT,
        versions: Sequence[int] = BOTH,
        writable: bool = False,
        always: bool = False,
    ) -> None:
        """A scalar computed each frame; `always` also before a flight is loaded. A write lasts until the next frame."""
        if self.version in versions:
            slot = int(self.store.add(name, kind, writable=writable).slots[0])
            (self._always if always else self._scalars).append((slot, source))

    def array(
        self,
        name: str,
        size: int,
        source: Callable[[Frame], Sequence[Number]],
        kind: Kind = FLOAT,
        versions: Sequence[int] = BOTH,
        writable: bool = False,
    ) -> None:
        """An array computed each frame; the source may give fewer elements than the array has, the rest stays 0."""
        if self.version in versions:
            self._arrays.append((self.store.add(name, kind, size, writable).slots, source))

    def setting(
        self,
        name: str,
        initial: Numbers = 0.0,
        kind: Kind = FLOAT,
        size: int = 0,
        versions: Sequence[int] = BOTH,
        writable: bool = True,
    ) -> None:
        """A dataref that keeps what was written last, by a client or by the simulator."""
        if self.version in versions:
            self.store.add(name, kind, size, writable, initial)

    def alias(self, name: str, target: str, versions: Sequence[int] = BOTH) -> None:
        """A second name of a dataref."""
        if self.version in versions:
            self.store.add_alias(name, target)

    def publish(self, frame: Frame, flight_loaded: bool) -> None:
        """Computes everything for this frame; before a flight is loaded, only what exists without one."""
        values = self.store.values
        for slot, source in self._always:
            values[slot] = source(frame)
        if not flight_loaded:
            return
        if len(self._scalar_slots) != len(self._scalars):
            self._scalar_slots = np.array([slot for slot, _ in self._scalars])
        values[self._scalar_slots] = [source(frame) for _, source in self._scalars]
        for slots, source in self._arrays:
            elements = source(frame)
            count = min(len(elements), len(slots))
            values[slots[:count]] = elements[:count]
