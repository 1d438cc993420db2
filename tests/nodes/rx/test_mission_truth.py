"""Navigation, instruments and environment as topics, against what the flight's state says of the same frame."""

from __future__ import annotations

import math

import pytest

from support.deadlines import WAIT_S
from xplane_bridge import protocol

EARTH_RADIUS_M = 6378145.0
START = ("--lat", 47.0, "--lon", 8.0)
#: The emulator's VOR stands a tenth of a degree to the north of where flights start.
VOR_DEG = (47.1, 8.0)


def slant_range_m(state):
    """From the aircraft to the VOR/DME on the ground."""
    lat, lon, vor_lat, vor_lon = (math.radians(x) for x in (state.latitude, state.longitude, *VOR_DEG))
    half = math.sin((vor_lat - lat) / 2) ** 2 + math.cos(lat) * math.cos(vor_lat) * math.sin((vor_lon - lon) / 2) ** 2
    return math.hypot(2 * EARTH_RADIUS_M * math.asin(math.sqrt(half)), state.altitude_msl)


def state_of(states, message):
    """The flight state of a mission message's frame."""
    return states.wait_for(lambda s: s.sim_time == message.sim_time, WAIT_S, f"the state of {message.sim_time}")


@pytest.fixture(name="logs")
def fixture_logs(world):
    from xplane_bridge.msg import EnvironmentState, FlightState, InstrumentState, NavigationState

    types = {"navigation": NavigationState, "instruments": InstrumentState, "environment": EnvironmentState}
    logs = {group: world.watch(f"mission/{group}", kind) for group, kind in types.items()}
    logs["flight"] = world.watch("flight_state", FlightState)
    return logs


@pytest.mark.parametrize("version", ["11.40", "12.10"])
def test_needles_gauges_and_air_agree_with_the_flight(world, logs, version):
    from xplane_bridge.msg import EnvironmentState, InstrumentState, NavigationState

    world.emulator("--version", version, *START)
    world.start("rx_node", {})
    begins = logs["flight"].wait_for(lambda _: True, WAIT_S, "a flight").sim_time

    def first(group, everything):
        """The first whole message of a frame that has a flight state."""
        return logs[group].wait_for(lambda m: m.valid == everything and m.sim_time > begins, WAIT_S, f"all of {group}")

    navigation = first("navigation", NavigationState.VALID_ALL)
    state = state_of(logs["flight"], navigation)
    assert "".join(chr(int(c)) for c in navigation.nav1_identifier if c > 0) == "EMU"
    assert navigation.nav_frequency == (110300.0, 111300.0)
    assert navigation.nav_dme_distance[0] == pytest.approx(slant_range_m(state), abs=1.0)
    # due north: the bearing is the declination's opposite
    magnetic = state.heading_magnetic_deg - state.heading_true_deg
    assert math.remainder(navigation.nav_bearing_deg[0] - magnetic, 360.0) == pytest.approx(0.0, abs=0.05)

    instruments = first("instruments", InstrumentState.VALID_ALL)
    state = state_of(logs["flight"], instruments)
    assert instruments.airspeed == pytest.approx([state.indicated_airspeed] * 2, abs=0.01)
    assert instruments.roll_vacuum_deg == pytest.approx([state.roll_deg] * 2, abs=0.01)
    assert instruments.altimeter_setting == pytest.approx([101320.8] * 2, abs=1.0)  # 29.92 inHg

    environment = first("environment", EnvironmentState.VALID_ALL)
    state = state_of(logs["flight"], environment)
    assert environment.density == pytest.approx(state.air_density, rel=1e-5)
    # the gas law: what three datarefs of different units say of the same air
    kelvin = environment.temperature + 273.15
    assert environment.pressure == pytest.approx(environment.density * 287.05 * kelvin, rel=1e-3)
    assert environment.terrain_height == pytest.approx(state.altitude_msl - state.altitude_agl, abs=0.1)
    layers = sum(math.isfinite(x) for x in environment.wind_layer_speed)
    assert layers == (13 if version.startswith("12") else 3)
    assert environment.visibility == pytest.approx(40000.0, rel=1e-5)


def test_a_blocked_pitot_is_seen_against_the_truth(world, logs):
    """In a climb a blocked tube shows more and more speed: the trapped pressure stays, the air outside gets thinner."""
    emulator = world.emulator("--model", "kinematic")
    other = world.wire(emulator.port)
    world.start("rx_node", {})
    logs["instruments"].wait_for(lambda m: math.isfinite(m.airspeed[0]), WAIT_S, "an airspeed")
    other.send(protocol.DrefWrite("sim/operation/failures/rel_pitot", 6.0))
    other.send(protocol.DrefWrite("sim/operation/override/override_joystick", 1.0))
    other.send(protocol.DrefWrite("sim/joystick/yoke_pitch_ratio", 0.4))
    seen = logs["instruments"].wait_for(
        lambda m: abs(m.airspeed[0] - m.airspeed[1]) > 3.0, 60.0, "pilots who see different speeds"
    )
    state = state_of(logs["flight"], seen)
    assert seen.airspeed[1] == pytest.approx(state.calibrated_airspeed, abs=0.5)
    assert seen.altitude[0] == pytest.approx(seen.altitude[1], abs=0.1)
