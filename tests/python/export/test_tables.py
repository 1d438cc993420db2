"""Tables on a uniform time base hold nothing that was not flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, stamp_ns

if TYPE_CHECKING:
    from pathlib import Path


def test_a_time_base_does_not_bridge_a_new_origin(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(10):
            place = {"position_epoch": 1, "position_north": 0.0} if k < 5 else {"position_epoch": 2}
            values = {**bag.state(k / 10, k), "position_north": 5000.0, **place}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), values)
    assert export(tmp_path / "flight.bag", "--rate", "50", "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "flight.csv")
    assert table["position_north_m"].tolist() == [0.0] * 21 + [5000.0] * 21
