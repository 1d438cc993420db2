"""RREF and RPOS subscriptions of all clients: who gets what in which frame.

Each sender (address, port) has its own set. Values that are due in the same frame for the same client share datagrams
of up to 183 pairs, or fewer with `split`.
"""

from __future__ import annotations

import struct
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge import protocol

Address = Tuple[str, int]
Datagram = Tuple[bytes, Address]
Planner = Callable[[Iterable[int]], Callable[[], None]]

#: A due time may lie this part of a frame ahead and still belong to this frame.
_EARLY = 0.01
#: Of plans that are kept: combinations of streams that are due together.
_MOST_PLANS = 256
_INDEX = struct.Struct("<i")
_VALUE = np.dtype("<f4")


class Pacer:
    """Says in which frames a stream of a given rate is due. A rate at or above the frame rate is due in every frame."""

    def __init__(self, rate_hz: float) -> None:
        self.period = 1.0 / rate_hz
        self.restart()

    def restart(self) -> None:
        """Due in the next frame, and from then on at its rate."""
        self._next = float("-inf")

    def due(self, now: float, frame_period: float) -> bool:
        """Whether to send in the frame at `now` [s]; to be asked once a frame."""
        if now < self._next - _EARLY * frame_period:
            return False
        if self._next == float("-inf"):
            self._next = now
        self._next = max(self._next + self.period, now - frame_period + self.period)
        return True


class _Group:
    """Subscriptions of one client with one rate."""

    def __init__(self, rate_hz: int) -> None:
        self.pacer = Pacer(rate_hz)
        self.slots: Dict[int, int] = {}  # client's index -> slot of the store


class RrefClient:
    """One sender's subscriptions.

    Args:
        replaces: Whether a request for an index in use replaces it, whatever its path, as client authors found
            [? same-index]; False keeps the first.
    """

    def __init__(self, replaces: bool = True) -> None:
        self._replaces = replaces
        self.groups: Dict[int, _Group] = {}  #: by rate
        self._rates: Dict[int, int] = {}  # client's index -> rate

    def __len__(self) -> int:
        return len(self._rates)

    def subscribe(self, index: int, rate_hz: int, slot: int) -> None:
        """Adds or replaces the subscription with this index."""
        if index in self._rates and not self._replaces:
            return
        self.unsubscribe(index)
        self.groups.setdefault(rate_hz, _Group(rate_hz)).slots[index] = slot
        self._rates[index] = rate_hz

    def unsubscribe(self, index: int) -> None:
        """Ends the subscription with this index."""
        rate = self._rates.pop(index, None)
        if rate is None:
            return
        group = self.groups[rate]
        del group.slots[index]
        if not group.slots:
            del self.groups[rate]


class _Plan:
    """All datagrams of frames in which the same is due: laid out once, filled in every such frame.

    Args:
        due: Clients and their groups.
        split: Pairs in a datagram at most.
        plan: Gives what computes slots.
    """

    def __init__(self, due: Sequence[Tuple[Address, _Group]], split: int, plan: Planner) -> None:
        items: Dict[Address, List[Tuple[int, int]]] = {}
        for client, group in due:
            items.setdefault(client, []).extend(group.slots.items())
        header = b"RREF" + bytes([protocol.FIFTH_BYTE[b"RREF"]])
        slots: List[int] = []
        floats: List[int] = []  # their places among the floats of the layout
        layout = bytearray()
        self._cuts: List[Tuple[int, int, Address]] = []
        for client, pairs in items.items():
            for first in range(0, len(pairs), split):
                layout += bytes(protocol.RREF_PAIR_SIZE - protocol.HEADER_SIZE)  # pairs lie where floats may lie
                start = len(layout)
                layout += header
                for index, slot in pairs[first : first + split]:
                    layout += _INDEX.pack(index)
                    floats.append(len(layout) // _VALUE.itemsize)
                    slots.append(slot)
                    layout += bytes(_VALUE.itemsize)
                self._cuts.append((start, len(layout), client))
        self._layout = np.frombuffer(layout, dtype=_VALUE)
        self._floats, self._slots = np.array(floats, dtype=int), np.array(slots, dtype=int)
        self._compute = plan(slots)

    def datagrams(self, values: np.ndarray) -> List[Datagram]:
        """Those of a frame; what is too large for float32 is infinite there."""
        self._compute()
        self._layout[self._floats] = values[self._slots]
        filled = self._layout.tobytes()
        return [(filled[start:end], client) for start, end, client in self._cuts]


class Subscriptions:
    """All clients of RREF and RPOS."""

    def __init__(self, split: int = protocol.RREF_MAX_PAIRS, replaces: bool = True) -> None:
        self.split = split
        self._replaces = replaces
        self.rref: Dict[Address, RrefClient] = {}
        self.rpos: Dict[Address, Pacer] = {}
        self._streams: Optional[List[Tuple[Pacer, Address, _Group]]] = None  # of all clients; None: to be listed anew
        self._plans: Dict[Tuple[int, ...], _Plan] = {}  # by which of the streams are due

    def request_rref(self, client: Address, index: int, rate_hz: int, slot: int) -> None:
        """A client subscribes to a slot."""
        self.rref.setdefault(client, RrefClient(self._replaces)).subscribe(index, rate_hz, slot)
        self._streams = None

    def stop_rref(self, client: Address, index: int) -> None:
        """A client ends a subscription."""
        subscriptions = self.rref.get(client)
        if subscriptions is not None:
            subscriptions.unsubscribe(index)
            self._streams = None
            if not len(subscriptions):
                del self.rref[client]

    def request_rpos(self, client: Address, rate_hz: int) -> None:
        """A client asks for the position stream; rate 0 ends it."""
        if rate_hz > 0:
            self.rpos[client] = Pacer(rate_hz)
        else:
            self.rpos.pop(client, None)

    def datagrams(self, now: float, frame_period: float, values: np.ndarray, plan: Planner) -> List[Datagram]:
        """RREF datagrams that are due in this frame; to be asked once a frame.

        Args:
            now: Time of the frame [s].
            frame_period: Time between frames [s].
            values: The store's values.
            plan: Gives what computes slots, where they are not computed in each frame.
        """
        if self._streams is None:
            groups = ((client, group) for client, each in self.rref.items() for group in each.groups.values())
            self._streams = [(group.pacer, client, group) for client, group in groups]
            self._plans.clear()
        due = tuple(i for i, (pacer, _, _) in enumerate(self._streams) if pacer.due(now, frame_period))
        if not due:
            return []
        found = self._plans.get(due)
        if found is None:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            found = self._plans[due] = _Plan([self._streams[i][1:] for i in due], self.split, plan)
        return found.datagrams(values)

    def restart_pacers(self) -> None:
        """Everything is due in the next frame, and from then on at its rate."""
        for client in self.rref.values():
            for group in client.groups.values():
                group.pacer.restart()
        for pacer in self.rpos.values():
            pacer.restart()

    def count_by_client(self) -> Dict[str, int]:
        """How many datarefs, or one position stream, each client is sent; by `address:port`."""
        counts = {f"{host}:{port}": len(client) for (host, port), client in self.rref.items()}
        for host, port in self.rpos:
            counts[f"{host}:{port}"] = counts.get(f"{host}:{port}", 0) + 1
        return counts

    def clear(self) -> None:
        """What a restart of X-Plane does."""
        self.rref.clear()
        self.rpos.clear()
        self._streams = None
