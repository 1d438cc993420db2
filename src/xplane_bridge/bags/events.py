"""What happened, out of a recording's lists of events: each repeats the newest ones, also of earlier flights."""

from __future__ import annotations

from typing import Callable, NamedTuple

import numpy as np

from xplane_bridge.bags import Table


class RecordedEvent(NamedTuple):
    """One event, once."""

    stamp: int  #: [ns] as the stamps of the other tables
    number: int  #: since tx_node started
    text: str
    requested_by: str


def events_of(lists: Table, moved_by: Callable[[np.ndarray], np.ndarray]) -> list[RecordedEvent]:
    """Give each event of the lists once, by its stamp.

    Args:
        lists: The topic `events`.
        moved_by: `Bags.moved_by`, of the first list with an event: what happened before a restart is repeated after it.
    """
    found: dict[tuple[int, int], RecordedEvent] = {}
    for by, events in zip(moved_by(lists.time).tolist(), lists["events"]):
        for event in events:
            stamp = event.stamp.sec * 1_000_000_000 + event.stamp.nanosec
            new = RecordedEvent(stamp + by, event.number, str(event.text), str(event.requested_by))
            found.setdefault((stamp, event.number), new)
    return sorted(found.values())
