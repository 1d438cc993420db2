"""The emulator's datarefs: one vector of values, with names, types and write access as in X-Plane.

Type, array size and access of a dataref are those of X-Plane's list of the running version (`xplane_names`). A name
that only other versions have can be defined all the same, so that the tables need not distinguish: the emulator can
work with it, but clients do not see it. A name that no list has is refused.

Every element of every dataref is a slot of `DatarefStore.values`; a subscription is an array of slot numbers, so that a
frame's answer to a client is one numpy gather. Reading through RREF is always float32, which the sender does; here
values are doubles, except that integer datarefs hold whole numbers and float datarefs lose nothing before they are
sent.
"""

from __future__ import annotations

import enum
import math
import re
from dataclasses import dataclass
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Set, Tuple, Union

import numpy as np

from xplane_bridge import xplane_names

#: Names that start with this are the emulator's own values (sources of DATA rows); clients cannot see them.
HIDDEN_PREFIX = "_emulator/"

_INDEXED = re.compile(r"(.+)\[(\d{1,4})\]")


class Kind(enum.Enum):
    """X-Plane's dataref types."""

    INT = "int"
    FLOAT = "float"
    DOUBLE = "double"
    BYTE = "byte"


@dataclass(frozen=True)
class Dataref:
    """One dataref.

    Attributes:
        name: Full name without index.
        kind: Type in X-Plane.
        slots: Its elements in `DatarefStore.values`; aliases share them.
        is_array: Whether clients may append `[i]`.
        writable: Whether a DREF of a client changes it.
        visible: Whether clients know it.
    """

    name: str
    kind: Kind
    slots: np.ndarray
    is_array: bool
    writable: bool
    visible: bool


#: Called after a client wrote an element: (element index, value).
WriteHook = Callable[[int, float], None]
Numbers = Union[float, Sequence[float], np.ndarray]


class DatarefStore:
    """All datarefs of one running simulator version.

    Args:
        version: Whose list holds, one of `xplane_names.VERSIONS`.
        brackets: Whether names with brackets (`sim/weather/wind_speed_kt[0]`) are taken as a whole ([? wind-names]:
            else the index is cut off first).
    """

    def __init__(self, version: str, brackets: bool = True) -> None:
        self.values = np.zeros(1024)
        self._used = 0
        self._version = version
        self._brackets = brackets
        self._by_name: Dict[str, Dataref] = {}
        self._first: Dict[str, int] = {}  # slot of the first element by name: what is read most
        self._hooks: Dict[str, List[WriteHook]] = {}
        self._watched: Set[str] = set()  # names that `dataref` has been asked for, or that were written
        self._found: Dict[str, Tuple[Dataref, int]] = {}  # clients' paths
        self._idle: Dict[int, Callable[[], None]] = {}  # slot to what begins to compute it

    # --- definition ---------------------------------------------------------------------------------------------------

    def add(self, name: str, initial: Numbers = 0.0, read_only: bool = False, size: int = 0) -> Dataref:
        """Defines a dataref.

        Args:
            name: A name of X-Plane's lists, or one of the emulator's own (HIDDEN_PREFIX).
            initial: Its value, or one for each element.
            read_only: Clients cannot write it, whatever the list says.
            size: Of an array of the emulator's own; the lists give that of all others.

        Raises:
            ValueError: The name is taken, or is in no list.
        """
        count = size or self.elements(name)
        while self._used + count > len(self.values):
            self.values = np.concatenate((self.values, np.zeros(len(self.values))))
        slots = np.arange(self._used, self._used + count)
        self._used += count
        self.values[slots] = initial
        return self._define(name, slots, read_only)

    def add_alias(self, name: str, target: str) -> Dataref:
        """A second name for the same values, or for the first of them where this name has fewer elements."""
        slots = self._by_name[target].slots
        return self._define(name, slots[: self.elements(name)])

    def add_view(self, name: str, elements: Sequence[str]) -> Dataref:
        """An array whose elements are other datarefs' elements."""
        return self._define(name, np.array([self._require_slot(element) for element in elements]))

    def elements(self, name: str) -> int:
        """How many elements X-Plane gives a name; 1 for a scalar and for the emulator's own."""
        return 1 if name.startswith(HIDDEN_PREFIX) else self._fact(name)[0].size

    def listed(self, prefix: str) -> List[str]:
        """All names of this version's list that begin with `prefix`, whether they are defined or not."""
        return [name for name in xplane_names.datarefs(self._version) if name.startswith(prefix)]

    def on_write(self, name: str, hook: WriteHook) -> None:
        """Calls `hook` after each write of a client to this name (not to its aliases)."""
        self._hooks.setdefault(self._by_name[name].name, []).append(hook)

    # --- the simulator's side -----------------------------------------------------------------------------------------

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def names(self) -> List[str]:
        """All names that clients can see."""
        return [name for name, dataref in self._by_name.items() if dataref.visible]

    def dataref(self, name: str) -> Dataref:
        """The dataref of this name (no index); KeyError if there is none."""
        dataref = self._by_name[name]
        if name not in self._watched:
            self._watched.add(name)
            self.watch(dataref.slots)
        return dataref

    def locate(self, name: str, index: int = 0) -> int:
        """The slot of an element, for who calls `watch` before reading it."""
        return int(self._by_name[name].slots[index])

    def get(self, name: str, index: int = 0) -> float:
        """Present value of an element."""
        slot = self._first[name] if index == 0 else int(self._by_name[name].slots[index])
        if slot in self._idle:
            self._idle[slot]()
        return self.values.item(slot)

    def gather(self, names: Sequence[str]) -> Callable[[], List[float]]:
        """What reads the first elements of all these datarefs at once, again and again."""
        slots = np.array([self.dataref(name).slots[0] for name in names])
        return lambda: self.values[slots].tolist()

    def array(self, name: str) -> np.ndarray:
        """A copy of all elements."""
        elements: np.ndarray = self.values[self.dataref(name).slots]
        return elements

    def defer(self, slots: np.ndarray, begin: Callable[[], None]) -> None:
        """Calls `begin` once, when a client or the emulator asks for one of these slots for the first time."""

        def begin_once() -> None:
            for slot in slots:
                self._idle.pop(int(slot), None)
            begin()

        self._idle.update((int(slot), begin_once) for slot in slots)

    def watch(self, slots: Iterable[int]) -> None:
        """From now on these slots are read: what is computed has its value at once, and in each frame."""
        if not self._idle:
            return
        for slot in slots:
            begin = self._idle.get(int(slot))
            if begin is not None:
                begin()

    def watch_all(self) -> None:
        """Everything is computed from now on."""
        self.watch(list(self._idle))

    def set(self, name: str, value: Numbers) -> None:
        """Sets all elements, as the simulator itself (write access and hooks do not apply)."""
        self.values[self.dataref(name).slots] = value

    def set_text(self, name: str, text: str) -> None:
        """Sets a byte array from text, NUL-padded, cut to its size."""
        slots = self.dataref(name).slots
        raw = text.encode("utf-8")[: len(slots) - 1]
        self.values[slots] = np.frombuffer(raw.ljust(len(slots), b"\0"), dtype=np.uint8)

    # --- the clients' side --------------------------------------------------------------------------------------------

    def slot(self, path: str) -> Optional[int]:
        """The slot behind a client's path (`name` or `name[i]`), computed from now on; see `find`."""
        slot = self.find(path)
        if slot is not None:
            self.watch((slot,))
        return slot

    def find(self, path: str) -> Optional[int]:
        """The slot behind a client's path, for who sees to its computing; None if X-Plane would not know it.

        An array without an index means its first element; the first element of a scalar is the scalar.
        """
        found = self._resolve(path)
        if found is None or not found[0].visible:
            return None
        return int(found[0].slots[found[1]])

    def write(self, path: str, value: float) -> bool:
        """A client's DREF. Non-finite values are dropped (X-Plane's behaviour on them is unknown).

        Returns:
            Whether anything was written.
        """
        found = self._resolve(path)
        if found is None or not math.isfinite(value):
            return False
        dataref, index = found
        # writes to byte[] were ignored in 11.55
        if not dataref.visible or not dataref.writable or dataref.kind is Kind.BYTE:
            return False
        stored = float(int(value)) if dataref.kind is Kind.INT else value
        if dataref.name not in self._watched:  # or who reads it first would find what is computed, not what was written
            self._watched.add(dataref.name)
            self.watch(dataref.slots)
        self.values[dataref.slots[index]] = stored
        for hook in self._hooks.get(dataref.name, ()):
            hook(index, stored)
        return True

    # --- internals ----------------------------------------------------------------------------------------------------

    def _define(self, name: str, slots: np.ndarray, read_only: bool = False) -> Dataref:
        if name in self._by_name:
            raise ValueError(f"dataref {name} is defined twice")
        if name.startswith(HIDDEN_PREFIX):
            dataref = Dataref(name, Kind.FLOAT, slots, len(slots) > 1, writable=False, visible=False)
        else:
            fact, visible = self._fact(name)
            if fact.size != len(slots):
                raise ValueError(f"dataref {name} has {len(slots)} elements, in X-Plane {fact.size}")
            writable = bool(fact.writable) and not read_only
            dataref = Dataref(name, Kind(fact.kind), slots, fact.is_array, writable, visible)
        self._by_name[name], self._first[name] = dataref, int(slots[0])
        self._found.clear()
        return dataref

    def _fact(self, name: str) -> Tuple[xplane_names.Dataref, bool]:
        """What X-Plane's list says of a name, and whether that is the list of this version or another's."""
        for version in (self._version, *reversed(xplane_names.VERSIONS)):
            fact = xplane_names.datarefs(version).get(name)
            if fact is not None:
                return fact, version == self._version
        raise ValueError(f"dataref {name} is in no list of X-Plane's: is it spelt right?")

    def _resolve(self, path: str) -> Optional[Tuple[Dataref, int]]:
        """The dataref that a path means, and the element."""
        found = self._found.get(path)
        if found is None:
            found = self._parse(path)
            if found is not None:
                self._found[path] = found
        return found

    def _parse(self, path: str) -> Optional[Tuple[Dataref, int]]:
        dataref = self._by_name.get(path)
        match = _INDEXED.fullmatch(path)
        if match is None or (dataref is not None and self._brackets):
            return None if dataref is None else (dataref, 0)
        dataref = self._by_name.get(match.group(1))
        index = int(match.group(2))
        return None if dataref is None or index >= len(dataref.slots) else (dataref, index)

    def _require_slot(self, path: str) -> int:
        found = self._resolve(path)
        if found is None:
            raise KeyError(path)
        return int(found[0].slots[found[1]])
