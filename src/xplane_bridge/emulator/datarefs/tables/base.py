"""The means by which the tables define datarefs and publish their values."""

from __future__ import annotations

from typing import Callable, List, Sequence, Tuple, Union

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore, Numbers
from xplane_bridge.emulator.flight.frame import Frame

Number = Union[float, int, bool]


class Table:
    """Datarefs with their sources.

    `value` and `array` define datarefs that the simulator computes each frame; `setting` defines those that keep what
    was written last. Types, sizes and access are X-Plane's, and so is whether clients of this version see the name
    (`DatarefStore`).
    """

    def __init__(self, store: DatarefStore) -> None:
        self.store = store
        self._scalars: List[Tuple[int, Callable[[Frame], Number]]] = []
        self._arrays: List[Tuple[np.ndarray, Callable[[Frame], Sequence[Number]]]] = []
        self._always: List[Tuple[int, Callable[[Frame], Number]]] = []
        self._scalar_slots = np.zeros(0, dtype=int)

    def value(self, name: str, source: Callable[[Frame], Number], always: bool = False) -> None:
        """A scalar computed each frame; `always` also before a flight is loaded. A write lasts until the next frame."""
        slot = int(self.store.add(name).slots[0])
        (self._always if always else self._scalars).append((slot, source))

    def array(self, name: str, source: Callable[[Frame], Sequence[Number]], size: int = 0) -> None:
        """An array computed each frame; the source may give fewer elements than the array has, the rest stays 0.

        Args:
            name: Its name.
            source: Gives the elements.
            size: Of an array of the emulator's own.
        """
        self._arrays.append((self.store.add(name, size=size).slots, source))

    def setting(self, name: str, initial: Numbers = 0.0, read_only: bool = False) -> None:
        """A dataref that keeps what was written last, by the simulator or, if X-Plane lets it, by a client."""
        self.store.add(name, initial, read_only)

    def alias(self, name: str, target: str) -> None:
        """A second name of a dataref."""
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
