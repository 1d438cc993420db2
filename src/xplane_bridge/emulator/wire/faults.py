"""Faults on request: what a network and an X-Plane in trouble do to a client.

`--fault` takes a comma-separated list:

    drop=P          each datagram X-Plane sends is lost with probability P
    indrop=P        the same for datagrams that come in
    delay=T         each datagram is held back by T (`20ms`, `0.02s`)
    jitter=T        and by a random time of up to T more
    dup=P           each datagram is sent twice with probability P (`dup` alone: 0.1)
    reorder=P       a datagram changes places with the next one (`reorder` alone: 0.1)
    truncate=P      a datagram is cut at a random length (`truncate` alone: 0.05)
    freeze=T@S      at S seconds after the start nothing happens for T (a scenery load); `freeze=T` alone: at 5 s
    restart=T@S     at S X-Plane goes away for T and comes back reset; `restart=T` alone: at 5 s

Times of freeze and restart are wall times from the start (frames, in stepped mode). All chances come from the seed.
"""

from __future__ import annotations

import heapq
import random
import re
from dataclasses import dataclass
from typing import Any, Dict, Generic, List, Optional, Tuple, TypeVar

#: Where a datagram goes to; of no concern here.
Target = TypeVar("Target")

_DEFAULT_START_S = 5.0
_TIME = re.compile(r"(\d+(?:\.\d*)?|\.\d+)(ms|s)?")


class FaultSyntaxError(ValueError):
    """A `--fault` that cannot be read."""


@dataclass(frozen=True)
class Outage:
    """Something that begins at `start_s` and lasts `duration_s`."""

    start_s: float
    duration_s: float

    def covers(self, time_s: float) -> bool:
        """Whether this time is within the outage."""
        return self.start_s <= time_s < self.start_s + self.duration_s


@dataclass(frozen=True)
class FaultPlan:
    """What `--fault` asked for. Probabilities 0..1, times in seconds."""

    drop: float = 0.0
    incoming_drop: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    truncate: float = 0.0
    freeze: Optional[Outage] = None
    restart: Optional[Outage] = None


def parse_faults(text: str) -> FaultPlan:
    """Reads a `--fault` list.

    Raises:
        FaultSyntaxError: Says which item, what was expected.
    """
    values: Dict[str, Any] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, given, value = item.partition("=")
        if name in _PROBABILITIES:
            field, default = _PROBABILITIES[name]
            if not given and default is None:
                raise FaultSyntaxError(f"fault '{item}': expected {name}=P with P from 0 to 1")
            values[field] = _probability(item, value) if given else default
        elif name in ("delay", "jitter"):
            values[name + "_s"] = _seconds(item, value)
        elif name in ("freeze", "restart"):
            duration, at, start = value.partition("@")
            values[name] = Outage(_seconds(item, start) if at else _DEFAULT_START_S, _seconds(item, duration))
        else:
            known = ", ".join([*_PROBABILITIES, "delay", "jitter", "freeze", "restart"])
            raise FaultSyntaxError(f"unknown fault '{item}': expected a comma-separated list of {known}")
    return FaultPlan(**values)


_PROBABILITIES = {
    "drop": ("drop", None),
    "indrop": ("incoming_drop", None),
    "dup": ("duplicate", 0.1),
    "reorder": ("reorder", 0.1),
    "truncate": ("truncate", 0.05),
}


def _probability(item: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise FaultSyntaxError(f"fault '{item}': expected a probability from 0 to 1, got '{text}'")
    return value


def _seconds(item: str, text: str) -> float:
    match = _TIME.fullmatch(text.strip())
    if match is None:
        raise FaultSyntaxError(f"fault '{item}': expected a time such as 20ms or 1.5s, got '{text}'")
    return float(match.group(1)) * (0.001 if match.group(2) == "ms" else 1.0)


class FaultyChannel(Generic[Target]):
    """Applies the plan to outgoing datagrams; hands them out when their time has come."""

    def __init__(self, plan: FaultPlan, seed: int) -> None:
        self.plan = plan
        self._random = random.Random(seed)
        self._queue: List[Tuple[float, int, bytes, Target]] = []
        self._count = 0
        self._held: Optional[Tuple[bytes, Target]] = None
        self.active = any((plan.drop, plan.delay_s, plan.jitter_s, plan.duplicate, plan.reorder, plan.truncate))

    def loses_incoming(self) -> bool:
        """Whether the datagram that has just come is lost."""
        return self.plan.incoming_drop > 0.0 and self._random.random() < self.plan.incoming_drop

    def put(self, now: float, datagram: bytes, target: Target) -> None:
        """Takes a datagram that X-Plane sends at `now` [s]."""
        chance, plan = self._random.random, self.plan
        if chance() < plan.drop:
            return
        if chance() < plan.truncate:
            datagram = datagram[: self._random.randrange(len(datagram))]
        items = [(datagram, target)]
        if self._held is not None:
            items.append(self._held)
            self._held = None
        elif chance() < plan.reorder:
            self._held = items.pop()
        for item in items:
            for _ in range(2 if chance() < plan.duplicate else 1):
                due = now + plan.delay_s + chance() * plan.jitter_s
                heapq.heappush(self._queue, (due, self._count, *item))
                self._count += 1

    def ready(self, now: float) -> List[Tuple[bytes, Target]]:
        """Datagrams to send by now, in the order of their time."""
        out = []
        while self._queue and self._queue[0][0] <= now:
            _, _, datagram, target = heapq.heappop(self._queue)
            out.append((datagram, target))
        return out

    def next_due(self) -> float:
        """When the next datagram is to be sent [s]; infinity if there is none."""
        return self._queue[0][0] if self._queue else float("inf")
