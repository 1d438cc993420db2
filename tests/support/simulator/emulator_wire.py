"""The emulator of the tests of what it says and hears."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.flight.flight_model import InitialState

POSITION = "sim/flightmodel/position/"
LATITUDE, LONGITUDE, THETA = POSITION + "latitude", POSITION + "longitude", POSITION + "theta"
TIME = "sim/time/total_running_time_sec"
PAUSED = "sim/time/paused"
SEOUL = InitialState(latitude_deg=37.4602, longitude_deg=126.4407, altitude_m=1000.0, heading_deg=90.0)


@pytest.fixture(name="bench")
def fixture_bench():
    benches = []

    def make(**options):
        options.setdefault("initial", SEOUL)
        benches.append(EmulatorFixture(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()
