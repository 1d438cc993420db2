"""The emulator of the tests of controls and placements."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

OVERRIDE = "sim/operation/override/override_"
YOKE_ROLL, YOKE_PITCH = "sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_pitch_ratio"
POSITION = "sim/flightmodel/position/"
UNTOUCHED = (-999.0,) * 8


@pytest.fixture(name="bench")
def fixture_bench():
    benches = []

    def make(**options):
        options.setdefault("initial", InitialState(latitude_deg=37.4602, longitude_deg=126.4407, heading_deg=90.0))
        benches.append(EmulatorFixture(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def row(index, *slots):
    """A DATA packet with one row; slots not given are -999."""
    return protocol.DataPacket(((index, (*slots, *UNTOUCHED)[:8]),))
