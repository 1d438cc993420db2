"""Flights that PREL begins at the emulator's aerodrome: distances and bearings from its middle, by hand."""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

#: On the equator every degree is as long: 6378145 m * pi / 180.
METERS_PER_DEG = 111319.6
RUNWAY_MIDDLE = InitialState(latitude_deg=0.0, longitude_deg=10.0, heading_deg=90.0, terrain_elevation_m=100.0)


@pytest.fixture(name="emulator")
def fixture_emulator():
    emulator = EmulatorFixture(aircraft="fixed_wing", initial=RUNWAY_MIDDLE)
    yield emulator
    emulator.close()


def begin(emulator, start_type, **fields):
    """Asks for a flight; its state, with metres east and north of the runway's middle."""
    emulator.client().send(protocol.Placement(start_type, **fields))
    emulator.step()
    state = emulator.sim.model.state
    return (state.longitude_deg - 10.0) * METERS_PER_DEG, state.latitude_deg * METERS_PER_DEG, state


@pytest.mark.parametrize(
    ("start_type", "fields", "east", "north", "heading"),
    [
        (11, {}, -840.0, 0.0, 90.0),
        (11, {"runway_direction": 1}, 840.0, 0.0, 270.0),
        (10, {}, 0.0, -150.0, 0.0),
        (14, {}, 0.0, 0.0, 90.0),
    ],
)
def test_standing_starts(emulator, start_type, fields, east, north, heading):
    x, y, state = begin(emulator, start_type, airport="XEMU", **fields)
    assert (x, y) == (pytest.approx(east, abs=1.0), pytest.approx(north, abs=1.0))
    assert state.on_ground_all
    turn = emulator.sim.frame.true_psi - heading
    assert math.remainder(turn, 360.0) == pytest.approx(0.0, abs=0.5)
    assert emulator.read("sim/time/total_flight_time_sec")[0] < 0.1


@pytest.mark.parametrize(("start_type", "miles"), [(12, 3.0), (13, 10.0)])
@pytest.mark.parametrize(("end", "sign"), [(0, -1.0), (1, 1.0)])
def test_approaches(emulator, start_type, miles, end, sign):
    x, y, state = begin(emulator, start_type, airport="XEMU", runway_direction=end)
    away = miles * 1852.0
    assert x == pytest.approx(sign * (900.0 + away), abs=5.0)
    assert y == pytest.approx(0.0, abs=1.0)
    # The glide path of 3 deg meets the runway 300 m behind its threshold, 100 m above the sea.
    assert state.altitude_m == pytest.approx(100.0 + (away + 300.0) * 0.0524078, abs=2.0)
    assert not state.on_ground_any


@pytest.mark.parametrize(
    "fields",
    [
        {"airport": "RKSI"},
        {"airport": "XEMU", "runway": 1},
        {"airport": "XEMU", "runway_direction": 2},
        {"airport": "XEMU", "runway": -1},
    ],
)
@pytest.mark.parametrize("start_type", [10, 11, 12, 14])
def test_what_it_does_not_have_begins_no_flight(emulator, start_type, fields):
    emulator.step(60)
    before = emulator.sim.model.state
    begin(emulator, start_type, **fields)
    assert emulator.sim.model.state.longitude_deg == pytest.approx(before.longitude_deg, abs=1e-3)
    assert not emulator.sim.model.state.on_ground_any
    assert emulator.read("sim/time/total_flight_time_sec")[0] > 0.9


def test_without_a_code_the_own_aerodrome_is_meant(emulator):
    x, _, state = begin(emulator, 11)
    assert x == pytest.approx(-840.0, abs=1.0)
    assert state.on_ground_all


def test_the_aerodrome_is_where_its_runway_is_drawn():
    elsewhere = InitialState(latitude_deg=0.2, longitude_deg=10.1, heading_deg=30.0, terrain_elevation_m=100.0)
    with EmulatorFixture(aircraft="fixed_wing", initial=elsewhere, aerodrome=(0.0, 10.0, 90.0)) as emulator:
        x, y, _ = begin(emulator, 11, airport="XEMU")
        assert (x, y) == (pytest.approx(-840.0, abs=1.0), pytest.approx(0.0, abs=1.0))
        assert math.remainder(emulator.sim.frame.true_psi - 90.0, 360.0) == pytest.approx(0.0, abs=0.5)
        emulator.client().send(protocol.Placement(0))  # as the emulator began
        emulator.step()
        assert emulator.sim.model.state.latitude_deg == pytest.approx(0.2, abs=1e-3)
