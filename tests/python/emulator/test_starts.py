"""How the emulator's flights begin: in their wind, again, and not at all where there is no such flight."""

from __future__ import annotations

import pytest

from support.simulator.emulator_bench import fixture_bench  # noqa: F401
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

RESET = protocol.CommandRequest("sim/operation/reset_flight")
PLACE = {"latitude_deg": 38.0, "longitude_deg": 127.0, "heading_deg": 0.0}
WIND = "sim/weather/wind_speed_kt[0]"


def flown(emulator):
    state = emulator.sim.model.state
    return state.latitude_deg, state.longitude_deg, state.altitude_m, state.true_airspeed_mps


def steady(emulator):
    """Whether it flies a second on at its usual airspeed and height, as felt by who sits in it."""
    for _ in range(60):
        emulator.step()
        state = emulator.sim.model.state
        assert state.specific_force_z_mps2 == pytest.approx(-9.80665, abs=0.1)
    return (state.true_airspeed_mps, state.altitude_m) == pytest.approx((75.0, 1000.0), abs=0.2)


def test_the_first_flight_begins_trimmed_in_its_wind(bench):
    emulator = bench(aircraft="fixed_wing", wind=(90.0, 20.0))  # along its heading
    assert steady(emulator)
    assert emulator.sim.model.state.v_east_mps == pytest.approx(55.0, abs=0.2)
    emulator.emulator.leave()
    emulator.emulator.come_back()
    assert steady(emulator)
    assert emulator.sim.loads == 1


def test_the_flight_is_reset_to_its_most_recent_start(bench):
    emulator = bench(aircraft="fixed_wing")
    client = emulator.client()
    client.send(protocol.Placement(6, elevation_m=2000.0, speed_mps=70.0, **PLACE))
    emulator.step(60)
    client.send(RESET)
    emulator.step()
    assert flown(emulator) == pytest.approx((38.0, 127.0, 2000.0, 70.0), abs=0.1)
    client.send(protocol.Placement(6, elevation_m=1500.0, speed_mps=20.0, **PLACE))  # half its stalling speed
    emulator.step(60)
    client.send(RESET)
    emulator.step()
    assert flown(emulator) == pytest.approx((38.0, 127.0, 1500.0, 20.0), abs=0.3)


def test_a_reset_starts_on_the_ground_where_the_wind_lets_nothing_fly(bench):
    emulator = bench(aircraft="multirotor")
    emulator.write({WIND: 60.0})
    emulator.client().send(RESET)
    emulator.step(2)
    assert emulator.sim.model.state.on_ground_any
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.4602, abs=1e-3)
    emulator.write({WIND: 0.0})
    emulator.client().send(RESET)
    emulator.step()
    assert emulator.sim.model.state.altitude_m == pytest.approx(1000.0, abs=1.0)


def test_a_refused_prel_leaves_the_flight_and_its_start_as_they_are(bench):
    emulator, other = bench(aircraft="fixed_wing"), bench(aircraft="fixed_wing")
    for each in (emulator, other):
        each.step(60)
    client = emulator.client()
    client.send(protocol.Placement(6, elevation_m=25000.0, speed_mps=70.0, **PLACE))  # no air to fly in
    for each in (emulator, other):
        each.step(60)
    assert emulator.emulator.server.ignored["value"] == 1
    assert flown(emulator) == pytest.approx(flown(other), abs=1e-3)
    assert emulator.sim.clocks.flight == other.sim.clocks.flight
    assert emulator.sim.loads == 1
    client.send(protocol.Placement(5))
    emulator.step()
    assert flown(emulator) == pytest.approx((37.4602, 126.4407, 1000.0, 75.0), abs=1e-3)


def test_a_placement_before_the_first_flight_is_over_the_terrain(bench):
    start = InitialState(altitude_m=1500.0, terrain_elevation_m=500.0)
    emulator = bench(aircraft="fixed_wing", initial=start, load_time=5.0)
    emulator.client().send(protocol.Placement(6, elevation_m=1500.0, speed_mps=75.0, **PLACE))
    emulator.step(2)
    assert emulator.sim.model.state.terrain_elevation_m == 500.0
    assert emulator.sim.frame.height == pytest.approx(1000.0, abs=5.0)


def test_a_start_that_cannot_be_flown_in_its_wind_is_said(bench):
    with pytest.raises(
        ValueError, match="in this wind: no steady flight found; choose another speed, height or weight"
    ):
        bench(aircraft="multirotor", wind=(0.0, 31.0), initial=InitialState())
