"""Events out of the lists of a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.bags.events import events_of

if TYPE_CHECKING:
    from pathlib import Path


def test_events_of_a_list_without_a_stamp_keep_their_own(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        event = {"number": 1, "stamp": {"sec": stamp_ns(2.0) // 10**9, "nanosec": 5}, "text": "reset"}
        bag.add("/xplane/events", "xplane_bridge/EventList", stamp_ns(9.0), {"events": [event]})
    with Bags(tmp_path / "flight.bag") as bags:
        (found,) = events_of(bags.read("/xplane/events"))
    assert (found.stamp, found.text) == (stamp_ns(2.0) + 5, "reset")
