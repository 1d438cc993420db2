"""What happened, out of a recording's lists of events: each repeats the newest ones, also of earlier flights."""

from __future__ import annotations

from typing import NamedTuple

from xplane_bridge.bags import Table


class RecordedEvent(NamedTuple):
    """One event, once."""

    stamp: int  #: [ns] as the stamps of the other tables
    number: int  #: since tx_node started
    text: str
    requested_by: str


def events_of(lists: Table) -> list[RecordedEvent]:
    """Give each event of the lists, the topic `events`, once, in the order of their stamps.

    A list's header has the stamp of its newest event. Behind a restart of X-Plane headers are read with later stamps
    than were recorded (`bags.restarts`), and so are the events that are new there: those before are only repeated.
    """
    found: dict[tuple[int, int], RecordedEvent] = {}
    for read, events in zip(lists["header.stamp"].tolist(), lists["events"]):
        stamps = [event.stamp.sec * 1_000_000_000 + event.stamp.nanosec for event in events]
        later_by = read - stamps[-1] if events and read else 0
        for stamp, event in zip(stamps, events):
            new = RecordedEvent(stamp + later_by, event.number, str(event.text), str(event.requested_by))
            found.setdefault((stamp, event.number), new)
    return sorted(found.values())
