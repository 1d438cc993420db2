"""The emulator's datarefs: one vector of values, with names, types and write access as in X-Plane.

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
from typing import Callable, Dict, List, Optional, Sequence, Union

import numpy as np

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
    """

    name: str
    kind: Kind
    slots: np.ndarray
    is_array: bool
    writable: bool


#: Called after a client wrote an element: (element index, value).
WriteHook = Callable[[int, float], None]
Numbers = Union[float, Sequence[float], np.ndarray]


class DatarefStore:
    """All datarefs of one running simulator version."""

    def __init__(self) -> None:
        self.values = np.zeros(1024)
        self._used = 0
        self._by_name: Dict[str, Dataref] = {}
        self._hooks: Dict[str, List[WriteHook]] = {}

    # --- definition ---------------------------------------------------------------------------------------------------

    def add(
        self, name: str, kind: Kind = Kind.FLOAT, size: int = 0, writable: bool = False, initial: Numbers = 0.0
    ) -> Dataref:
        """Defines a dataref; `size` 0 is a scalar, more is an array.

        Raises:
            ValueError: The name is taken.
        """
        if name in self._by_name:
            raise ValueError(f"dataref {name} is defined twice")
        count = max(size, 1)
        while self._used + count > len(self.values):
            self.values = np.concatenate((self.values, np.zeros(len(self.values))))
        slots = np.arange(self._used, self._used + count)
        self._used += count
        dataref = Dataref(name, kind, slots, size > 0, writable)
        self._by_name[name] = dataref
        self.values[slots] = initial
        return dataref

    def add_alias(self, name: str, target: str, writable: Optional[bool] = None) -> Dataref:
        """A second name for the same values."""
        source = self._by_name[target]
        return self._add_view(name, source.kind, source.slots, source.is_array, writable, source.writable)

    def add_view(self, name: str, kind: Kind, elements: Sequence[str], writable: bool) -> Dataref:
        """An array whose elements are other datarefs' elements."""
        slots = np.array([self._require_slot(element) for element in elements])
        return self._add_view(name, kind, slots, True, writable, writable)

    def on_write(self, name: str, hook: WriteHook) -> None:
        """Calls `hook` after each write of a client to this name (not to its aliases)."""
        self._hooks.setdefault(self._by_name[name].name, []).append(hook)

    # --- the simulator's side -----------------------------------------------------------------------------------------

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def names(self) -> List[str]:
        """All names that clients can see."""
        return [name for name in self._by_name if not name.startswith(HIDDEN_PREFIX)]

    def dataref(self, name: str) -> Dataref:
        """The dataref of this name (no index); KeyError if there is none."""
        return self._by_name[name]

    def get(self, name: str, index: int = 0) -> float:
        """Present value of an element."""
        return float(self.values[self._by_name[name].slots[index]])

    def array(self, name: str) -> np.ndarray:
        """A copy of all elements."""
        return self.values[self._by_name[name].slots]

    def set(self, name: str, value: Numbers) -> None:
        """Sets all elements, as the simulator itself (write access and hooks do not apply)."""
        self.values[self._by_name[name].slots] = value

    def set_text(self, name: str, text: str) -> None:
        """Sets a byte array from text, NUL-padded, cut to its size."""
        slots = self._by_name[name].slots
        raw = text.encode("utf-8")[: len(slots) - 1]
        self.values[slots] = np.frombuffer(raw.ljust(len(slots), b"\0"), dtype=np.uint8)

    # --- the clients' side --------------------------------------------------------------------------------------------

    def slot(self, path: str) -> Optional[int]:
        """The slot behind a client's path (`name` or `name[i]`); None if X-Plane would not know it.

        An array without an index means its first element.
        """
        if path.startswith(HIDDEN_PREFIX):
            return None
        found = self._resolve(path)
        return None if found is None else int(found[0].slots[found[1]])

    def write(self, path: str, value: float) -> bool:
        """A client's DREF. Non-finite values are dropped (X-Plane's behaviour on them is unknown).

        Returns:
            Whether anything was written.
        """
        found = None if path.startswith(HIDDEN_PREFIX) else self._resolve(path)
        if found is None or not math.isfinite(value):
            return False
        dataref, index = found
        if not dataref.writable or dataref.kind is Kind.BYTE:  # byte[] writes were ignored in 11.55
            return False
        stored = float(int(value)) if dataref.kind is Kind.INT else value
        self.values[dataref.slots[index]] = stored
        for hook in self._hooks.get(dataref.name, ()):
            hook(index, stored)
        return True

    # --- internals ----------------------------------------------------------------------------------------------------

    def _add_view(
        self, name: str, kind: Kind, slots: np.ndarray, is_array: bool, writable: Optional[bool], default: bool
    ) -> Dataref:
        if name in self._by_name:
            raise ValueError(f"dataref {name} is defined twice")
        dataref = Dataref(name, kind, slots, is_array, default if writable is None else writable)
        self._by_name[name] = dataref
        return dataref

    def _resolve(self, path: str) -> Optional[tuple]:
        dataref = self._by_name.get(path)  # a few X-Plane names carry brackets themselves: try the whole path first
        if dataref is not None:
            return dataref, 0
        match = _INDEXED.fullmatch(path)
        if match is None:
            return None
        dataref = self._by_name.get(match.group(1))
        index = int(match.group(2))
        if dataref is None or not dataref.is_array or index >= len(dataref.slots):
            return None
        return dataref, index

    def _require_slot(self, path: str) -> int:
        found = self._resolve(path)
        if found is None:
            raise KeyError(path)
        return int(found[0].slots[found[1]])
