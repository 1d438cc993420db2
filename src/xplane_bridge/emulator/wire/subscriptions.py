"""RREF and RPOS subscriptions of all clients: who gets what in which frame.

Each sender (address, port) has its own set. Values that are due in the same frame for the same client share datagrams
of up to 183 pairs, or fewer with `split`.
"""

from __future__ import annotations

import itertools
from typing import Callable, Dict, Iterable, Iterator, List, Tuple

import numpy as np

from xplane_bridge.protocol import FIFTH_BYTE, RREF_MAX_PAIRS

Address = Tuple[str, int]
Rates = Tuple[int, ...]

Datagram = Tuple[bytes, Address]
Planner = Callable[[Iterable[int]], Callable[[], None]]

#: A due time may lie this part of a frame ahead and still belong to this frame.
_EARLY = 0.01
#: Of plans that are kept: combinations of rates that are due together.
_MOST_PLANS = 256
_PAIR = np.dtype([("index", "<i4"), ("value", "<f4")])


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
        self._groups: Dict[int, _Group] = {}
        self._rates: Dict[int, int] = {}  # client's index -> rate
        self._gathers: Dict[Rates, Tuple[np.ndarray, np.ndarray]] = {}

    def __len__(self) -> int:
        return len(self._rates)

    def subscribe(self, index: int, rate_hz: int, slot: int) -> None:
        """Adds or replaces the subscription with this index."""
        if index in self._rates and not self._replaces:
            return
        self.unsubscribe(index)
        self._groups.setdefault(rate_hz, _Group(rate_hz)).slots[index] = slot
        self._rates[index] = rate_hz
        self._gathers.clear()

    def unsubscribe(self, index: int) -> None:
        """Ends the subscription with this index."""
        rate = self._rates.pop(index, None)
        if rate is None:
            return
        group = self._groups[rate]
        del group.slots[index]
        if not group.slots:
            del self._groups[rate]
        self._gathers.clear()

    def restart_pacers(self) -> None:
        """Everything is due in the next frame, and from then on at its rate."""
        for group in self._groups.values():
            group.pacer.restart()

    def due(self, now: float, frame_period: float) -> Rates:
        """The rates that are due in this frame; to be asked once a frame."""
        return tuple(rate for rate, group in self._groups.items() if group.pacer.due(now, frame_period))

    def slots(self, due: Rates) -> Iterable[int]:
        """What is sent at these rates."""
        return itertools.chain.from_iterable(self._groups[rate].slots.values() for rate in due)

    def datagrams(self, due: Rates, values: np.ndarray, split: int) -> Iterator[bytes]:
        """What is sent at these rates."""
        gather = self._gathers.get(due)
        if gather is None:
            gather = self._gather(due)
            self._gathers[due] = gather
        slots, pairs = gather
        pairs["value"] = values[slots]
        header = b"RREF" + bytes([FIFTH_BYTE[b"RREF"]])
        for start in range(0, len(pairs), split):
            yield header + pairs[start : start + split].tobytes()

    def _gather(self, rates: Rates) -> Tuple[np.ndarray, np.ndarray]:
        items: List[Tuple[int, int]] = []
        for rate in rates:
            items += self._groups[rate].slots.items()
        pairs = np.zeros(len(items), dtype=_PAIR)
        pairs["index"] = [index for index, _ in items]
        return np.array([slot for _, slot in items]), pairs


class Subscriptions:
    """All clients of RREF and RPOS."""

    def __init__(self, split: int = RREF_MAX_PAIRS, replaces: bool = True) -> None:
        self.split = split
        self._replaces = replaces
        self.rref: Dict[Address, RrefClient] = {}
        self.rpos: Dict[Address, Pacer] = {}
        self._plans: Dict[Tuple[Tuple[Address, Rates], ...], Callable[[], None]] = {}

    def request_rref(self, client: Address, index: int, rate_hz: int, slot: int) -> None:
        """A client subscribes to a slot."""
        self.rref.setdefault(client, RrefClient(self._replaces)).subscribe(index, rate_hz, slot)
        self._plans.clear()

    def stop_rref(self, client: Address, index: int) -> None:
        """A client ends a subscription."""
        subscriptions = self.rref.get(client)
        if subscriptions is not None:
            subscriptions.unsubscribe(index)
            self._plans.clear()
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
        asked = ((client, each.due(now, frame_period)) for client, each in self.rref.items())
        due = tuple((client, rates) for client, rates in asked if rates)
        compute = self._plans.get(due)
        if compute is None:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            slots = itertools.chain.from_iterable(self.rref[client].slots(rates) for client, rates in due)
            compute = self._plans[due] = plan(slots)
        compute()
        with np.errstate(over="ignore"):
            return [
                (packet, client)
                for client, rates in due
                for packet in self.rref[client].datagrams(rates, values, self.split)
            ]

    def restart_pacers(self) -> None:
        """Everything is due in the next frame, and from then on at its rate."""
        for client in self.rref.values():
            client.restart_pacers()
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
        self._plans.clear()
