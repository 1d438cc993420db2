"""Which bags are the parts of one recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.cli.flights.split_recordings import joined

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("step", [0.5, 3.0])
def test_a_clock_set_back_in_a_part_does_not_part_it_from_the_next(tmp_path: Path, step: float) -> None:
    parts = [tmp_path / f"flight_{number}.bag" for number in range(2)]
    for number, path in enumerate(parts):
        with FlightBag(path) as bag:
            for k in range(200 * number, 200 * (number + 1)):
                received, stamp = (stamp_ns(k / 50 - step * (k >= first)) for first in (50, 66))
                state = {**bag.state(k / 50, k), "header": bag.header(stamp, ""), "epoch": 1 + (k >= 66)}
                bag.add("/xplane/flight_state", "xplane_bridge/FlightState", received, state)
    assert joined(parts) == [parts]
