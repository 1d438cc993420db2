"""The means by which the tables define datarefs and publish their values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple, Union

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore, Numbers
from xplane_bridge.emulator.flight.frame import Frame

Number = Union[float, int, bool]


@dataclass(frozen=True)
class _Computed:
    """A dataref with its source."""

    place: int  #: in the order of definition, in which they are computed
    slots: np.ndarray
    source: Callable[[Frame], Any]


class Table:
    """Datarefs with their sources.

    `value` and `array` define datarefs that the simulator computes each frame; `setting` defines those that keep what
    was written last. Types, sizes and access are X-Plane's, and so is whether clients of this version see the name
    (`DatarefStore`). A dataref is not computed before it is asked for; from then on it is, in the order of
    definition, and has the value of the present frame at once. What is sent to clients now and then is computed when
    it is sent (`plan`): values follow from the frame alone, so a client sees no difference.
    """

    def __init__(self, store: DatarefStore) -> None:
        self.store = store
        self._scalars: List[_Computed] = []
        self._arrays: List[_Computed] = []
        self._always: List[_Computed] = []
        self._scalar_slots: Optional[np.ndarray] = None
        self._array_slots: List[np.ndarray] = []  # also of those that are not computed yet
        self._defined = 0
        self._idle: Dict[int, Tuple[_Computed, List[_Computed]]] = {}  # what is not computed yet, by slot; and its kind
        self._published: Optional[Tuple[Frame, bool]] = None

    def value(self, name: str, source: Callable[[Frame], Number], always: bool = False) -> None:
        """A scalar computed each frame; `always` also before a flight is loaded. A write lasts until the next frame."""
        self._define(self.store.add(name).slots, source, self._always if always else self._scalars)

    def array(self, name: str, source: Callable[[Frame], Union[Sequence[Number], np.ndarray]], size: int = 0) -> None:
        """An array computed each frame; the source may give fewer elements than the array has, the rest stays 0.

        Args:
            name: Its name.
            source: Gives the elements.
            size: Of an array of the emulator's own.
        """
        self._define(self.store.add(name, size=size).slots, source, self._arrays)

    def setting(self, name: str, initial: Numbers = 0.0, read_only: bool = False) -> None:
        """A dataref that keeps what was written last, by the simulator or, if X-Plane lets it, by a client."""
        self.store.add(name, initial, read_only)

    def alias(self, name: str, target: str) -> None:
        """A second name of a dataref."""
        self.store.add_alias(name, target)

    def clear_arrays(self) -> None:
        """Sets all arrays to 0, as another aircraft's sources may give fewer elements."""
        self.store.values[np.concatenate(self._array_slots)] = 0.0

    def publish(self, frame: Frame, flight_loaded: bool) -> None:
        """Computes what is asked for; before a flight is loaded, only what exists without one."""
        self._published = (frame, flight_loaded)
        values = self.store.values
        for computed in tuple(self._always):
            values[computed.slots[0]] = computed.source(frame)
        if not flight_loaded:
            return
        scalars = tuple(self._scalars)
        numbers = [computed.source(frame) for computed in scalars]
        if len(scalars) == len(self._scalars):  # no source has asked for a further one
            if self._scalar_slots is None:
                self._scalar_slots = np.array([computed.slots[0] for computed in scalars], dtype=int)
            values[self._scalar_slots] = numbers
        else:
            values[[computed.slots[0] for computed in scalars]] = numbers
        for computed in tuple(self._arrays):
            self._fill(computed, frame)

    def plan(self, slots: Iterable[int]) -> Callable[[], None]:
        """What brings those of the slots that are not computed in each frame up to the frame published last."""
        idle = (self._idle[slot] for slot in slots if slot in self._idle)
        found = {computed.place: (computed, kind) for computed, kind in idle}
        ordered = [found[place] for place in sorted(found)]
        scalars = [computed for computed, kind in ordered if kind is self._scalars]
        always = [computed for computed, kind in ordered if kind is self._always]
        arrays = [computed for computed, kind in ordered if kind is self._arrays]
        scalar_slots = np.array([computed.slots[0] for computed in scalars], dtype=int)

        def compute() -> None:
            if self._published is None:
                return
            frame, flight_loaded = self._published
            values = self.store.values
            for computed in always:
                values[computed.slots[0]] = computed.source(frame)
            if not flight_loaded:
                return
            if scalars:
                values[scalar_slots] = [computed.source(frame) for computed in scalars]
            for computed in arrays:
                self._fill(computed, frame)

        return compute

    def _define(self, slots: np.ndarray, source: Callable[[Frame], Any], kind: List[_Computed]) -> None:
        computed = _Computed(self._defined, slots, source)
        self._defined += 1
        if kind is self._arrays:
            self._array_slots.append(slots)
        self._idle.update((int(slot), (computed, kind)) for slot in slots)
        self.store.defer(slots, lambda: self._begin(computed, kind))

    def _begin(self, computed: _Computed, kind: List[_Computed]) -> None:
        for slot in computed.slots:
            self._idle.pop(int(slot), None)
        kind.append(computed)
        kind.sort(key=lambda other: other.place)
        if kind is self._scalars:
            self._scalar_slots = None
        if self._published is None:
            return
        frame, flight_loaded = self._published
        if kind is self._arrays:
            if flight_loaded:
                self._fill(computed, frame)
        elif flight_loaded or kind is self._always:
            self.store.values[computed.slots[0]] = computed.source(frame)

    def _fill(self, computed: _Computed, frame: Frame) -> None:
        elements = computed.source(frame)
        count = min(len(elements), len(computed.slots))
        self.store.values[computed.slots[:count]] = elements[:count]
