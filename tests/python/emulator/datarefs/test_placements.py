"""Placements in the emulator: flights, loading, aircraft, situations and wind."""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_bench import (
    OVERRIDE,
    POSITION,
    YOKE_PITCH,
    YOKE_ROLL,
    fixture_bench,  # noqa: F401
    row,
)
from xplane_bridge import protocol
from xplane_bridge.emulator.aircraft import model_names
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import aircraft_path

# --- placements ---


def test_prel_starts_a_flight_at_a_place(bench):
    emulator = bench()
    emulator.client().send(
        protocol.Placement(
            6, latitude_deg=47.4, longitude_deg=8.6, elevation_m=1500.0, heading_deg=270.0, speed_mps=60.0
        )
    )
    emulator.step()
    state = emulator.sim.model.state
    assert (state.latitude_deg, state.altitude_m) == (pytest.approx(47.4, abs=1e-3), pytest.approx(1500.0, abs=1.0))
    assert state.true_airspeed_mps == pytest.approx(60.0, abs=1.0)
    assert emulator.sim.frame.true_psi == pytest.approx(270.0, abs=0.1)
    assert emulator.read("sim/time/total_flight_time_sec")[0] < 0.1
    assert emulator.read(POSITION + "lat_ref", POSITION + "lon_ref") == [47.5, 9.0]


def test_prel_gives_a_speed_that_cannot_be_trimmed(bench):
    emulator = bench(aircraft="fixed_wing")
    place = {"latitude_deg": 37.4, "longitude_deg": 127.6, "elevation_m": 1500.0, "heading_deg": 270.0}
    emulator.client().send(protocol.Placement(6, speed_mps=20.0, **place))  # half its stalling speed
    emulator.step()
    state = emulator.sim.model.state
    assert (state.latitude_deg, state.altitude_m) == (pytest.approx(37.4, abs=1e-4), pytest.approx(1500.0, abs=1.0))
    assert (state.v_east_mps, state.v_north_mps) == pytest.approx((-20.0, 0.0), abs=0.5)


def test_prel_gives_a_speed_through_the_air_also_where_it_cannot_be_trimmed(bench):
    emulator = bench(aircraft="fixed_wing", wind=(0.0, 15.0))
    place = {"latitude_deg": 37.4, "longitude_deg": 127.6, "elevation_m": 1500.0, "heading_deg": 0.0}
    emulator.client().send(protocol.Placement(6, speed_mps=29.0, **place))
    emulator.step()
    state = emulator.sim.model.state
    assert (state.true_airspeed_mps, state.v_north_mps) == pytest.approx((29.0, 14.0), abs=0.5)


def test_prel_into_the_ground_is_not_flown(bench):
    emulator = bench(aircraft="fixed_wing")
    before = emulator.sim.model.state.altitude_m
    emulator.client().send(
        protocol.Placement(6, latitude_deg=37.4, longitude_deg=127.6, elevation_m=-400, speed_mps=75.0)
    )
    emulator.step()
    assert emulator.sim.model.state.altitude_m == pytest.approx(before, abs=1.0)


@pytest.mark.parametrize(
    ("version", "name"),
    [
        ("11", "sim/flightmodel/misc/cgz_ref_to_default"),
        ("12.00", "sim/flightmodel/misc/cgz_ref_to_default"),
        ("12.08", "sim/flightmodel/misc/cgz_ref_to_default"),
        ("12.08", "sim/flightmodel2/misc/cg_offset_z"),
    ],
)
def test_balance_is_moved_by_the_payload_and_pitches_the_aircraft(bench, version, name):
    emulator = bench(aircraft="fixed_wing", version=version)
    pitch, mass = "sim/flightmodel/position/Q_dot", "sim/flightmodel/weight/m_total"
    emulator.step(60)
    (before, kilograms) = emulator.read(pitch, mass)
    emulator.write({name: 0.1})
    assert emulator.read(name) == [pytest.approx(0.1, abs=1e-3)]
    assert emulator.read(mass) == [pytest.approx(kilograms, abs=0.1)]
    # 2000 kg of lift act 0.1 m ahead of the centre of gravity: 1962 N m on about 3300 kg m2 are 34 deg/s2
    assert emulator.read(pitch)[0] - before == pytest.approx(34.0, rel=0.3)
    emulator.write({name: 1.0})  # farther than the payload can be moved
    assert emulator.read(name) == [pytest.approx(0.1, abs=1e-3)]


def test_the_balance_without_fuel_stays_where_the_fuel_goes(bench):
    emulator = bench(aircraft="fixed_wing", version="12.08")
    weight = "sim/flightmodel/weight/"
    dry, loaded = "sim/flightmodel/misc/cgz_ref_to_default", "sim/flightmodel2/misc/cg_offset_z"
    emulator.write({dry: 0.05})
    mass, fuel = emulator.read(weight + "m_total", weight + "m_fuel_total")
    # the fuel is at the reference point: all together is less far aft than all but the fuel
    assert emulator.read(dry, loaded) == pytest.approx([0.05, 0.05 * (mass - fuel) / mass], abs=1e-4)
    emulator.write({weight + "m_fuel[0]": 10.0, weight + "m_fuel[1]": 10.0})
    assert emulator.read(dry, loaded) == pytest.approx([0.05, 0.05 * (mass - fuel) / (mass - fuel + 20.0)], abs=1e-4)
    emulator.write({loaded: 0.0})
    assert emulator.read(dry, loaded) == pytest.approx([0.0, 0.0], abs=1e-4)


def test_loading_is_shown_while_the_flight_stands(bench):
    emulator = bench(aircraft="fixed_wing")
    weight = "sim/flightmodel/weight/"
    (before,) = emulator.read(weight + "m_total")
    emulator.client().send(protocol.CommandRequest("sim/operation/pause_toggle"))
    emulator.write({weight + "m_fuel[0]": 60.0, weight + "m_fixed": 300.0})
    shown = emulator.read(weight + "m_fuel[0]", weight + "m_fixed", weight + "m_total")
    assert shown == pytest.approx([60.0, 300.0, before - 40.0 + 90.0], abs=0.1)


@pytest.mark.parametrize("aircraft", model_names())
def test_the_highest_mass_is_that_of_full_tanks_and_all_payload(bench, aircraft):
    emulator = bench(aircraft=aircraft)
    model = emulator.sim.model
    model.set_loading(fuel_kg=model.fuel_capacity_kg, payload_kg=model.max_payload_kg)
    most, mass = emulator.read("sim/aircraft/weight/acf_m_max", "sim/flightmodel/weight/m_total")
    assert most == pytest.approx(mass, rel=1e-4)


def test_a_refused_tank_leaves_the_others_theirs(bench):
    emulator = bench(aircraft="fixed_wing")
    tanks = [f"sim/flightmodel/weight/m_fuel[{tank}]" for tank in (0, 1)]
    emulator.write({tanks[0]: 130.0, tanks[1]: 50.0})  # 125 kg each
    assert emulator.read(*tanks) == pytest.approx([100.0, 50.0], abs=0.01)


def test_payload_goes_by_stations_in_version_12_only(bench):
    emulator = bench(aircraft="fixed_wing", version="12.10")
    weight = "sim/flightmodel/weight/"
    (before,) = emulator.read(weight + "m_total")
    (payload,) = emulator.read(weight + "m_fixed")
    assert emulator.read(weight + "m_stations[0]", weight + "m_stations[8]") == pytest.approx([payload, 0.0])
    emulator.write({weight + "m_stations[0]": 100.0, weight + "m_stations[8]": 25.0})
    shown = emulator.read(weight + "m_stations[0]", weight + "m_stations[8]", weight + "m_fixed", weight + "m_total")
    assert shown == pytest.approx([100.0, 25.0, 125.0, before - payload + 125.0], abs=0.1)
    emulator.write({weight + "m_fixed": 60.0})
    assert emulator.read(weight + "m_stations[0]", weight + "m_stations[8]") == pytest.approx([60.0, 0.0])


def test_a_refused_station_leaves_the_others_theirs(bench):
    emulator = bench(aircraft="fixed_wing", version="12.10")
    stations = [f"sim/flightmodel/weight/m_stations[{station}]" for station in (0, 1)]
    emulator.write({stations[0]: 50.0, stations[1]: 60.0})
    emulator.write({stations[1]: 9000.0})
    assert emulator.read(*stations) == pytest.approx([50.0, 60.0])
    emulator.write({stations[0]: 40.0})
    assert emulator.read(*stations) == pytest.approx([40.0, 60.0])


def test_what_is_written_with_a_loaded_situation_is_of_its_place(bench):
    emulator = bench(aircraft="fixed_wing", initial=InitialState(latitude_deg=37.5, longitude_deg=127.0))
    client = emulator.client()
    emulator.step()
    client.send(protocol.Situation(protocol.Situation.SAVE, "here"))
    emulator.step()
    client.send(protocol.Placement(6, latitude_deg=47.5, longitude_deg=8.0, elevation_m=1500.0, speed_mps=70.0))
    emulator.step()
    client.send(protocol.DrefWrite(POSITION + "local_vx", 50.0))  # of the flight that ends with the load
    client.send(protocol.Situation(protocol.Situation.LOAD, "here"))
    client.send(protocol.DrefWrite(POSITION + "local_vy", 0.0))
    client.send(protocol.DrefWrite(POSITION + "local_vz", -75.0))
    emulator.step()
    assert emulator.sim.frame.velocity == pytest.approx((0.0, 0.0, -75.0), abs=0.5)


def test_prel_on_a_runway_and_again(bench):
    emulator = bench(aircraft="fixed_wing")
    client = emulator.client()
    for _ in range(2):
        client.send(protocol.Placement(11, airport="XEMU"))
        emulator.step()
        state = emulator.sim.model.state
        assert state.on_ground_all
        assert state.latitude_deg == pytest.approx(37.4602, abs=1e-5)
        client.send(protocol.Placement(6, latitude_deg=38.0, longitude_deg=127.0, elevation_m=900.0, speed_mps=70.0))
        emulator.step(60)
        client.send(protocol.Placement(5))
        emulator.step()
        assert emulator.sim.model.state.latitude_deg == pytest.approx(38.0, abs=1e-4)
        assert emulator.read("sim/time/total_flight_time_sec")[0] < 0.1


def test_vehx_stops_the_flight_model_until_an_aircraft_is_loaded(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.VehiclePose("VEHX", 0, 37.5, 127.0, 500.0, 10.0, 5.0, -20.0))
    emulator.step(60)
    state = emulator.sim.model.state
    assert (state.latitude_deg, state.longitude_deg, state.altitude_m) == (37.5, 127.0, 500.0)
    assert emulator.sim.frame.true_phi == pytest.approx(-20.0)
    (time_before,) = emulator.read("sim/time/total_running_time_sec")
    emulator.step(60)
    assert emulator.sim.model.state.latitude_deg == 37.5
    assert emulator.read("sim/time/total_running_time_sec")[0] > time_before + 0.9  # time goes on
    client.send(protocol.AircraftLoad(0, aircraft_path("kinematic")))
    emulator.step(60)
    assert emulator.sim.model.state.latitude_deg != 37.5


@pytest.mark.parametrize(("version", "moves"), [("11", False), ("12", True)])
def test_vehs_is_of_x_plane_12_and_leaves_the_flight_model_on(bench, version, moves):
    emulator = bench(version=version)
    emulator.client().send(protocol.VehiclePose("VEHS", 0, 47.0, 8.0, 2000.0, 10.0, 0.0, 0.0))
    emulator.step(60)
    state = emulator.sim.model.state
    assert (abs(state.latitude_deg - 47.0) < 0.1) is moves
    assert state.latitude_deg != 47.0


@pytest.mark.parametrize("latitude", [89.95, -90.0])
def test_at_the_poles_no_aircraft_is_put(bench, latitude):
    emulator = bench(aircraft="fixed_wing")
    emulator.client().send(protocol.VehiclePose("VEHX", 0, latitude, 0.0, 1000.0, 0.0, 0.0, 0.0))
    emulator.step()
    assert emulator.emulator.server.ignored["value"] == 1
    assert not emulator.sim.frozen
    # 90 N as it lies from the origin at 37.5 N: 52.5 degrees ahead
    radius, angle = 6378145.0, math.radians(52.5)
    pole = {"local_x": 0.0, "local_y": radius * (math.cos(angle) - 1.0), "local_z": -radius * math.sin(angle)}
    emulator.write({POSITION + name: value for name, value in pole.items()})
    emulator.step()
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.46, abs=0.01)
    assert emulator.sim.loads == 1


@pytest.mark.parametrize("name", ["fixed_wing", "kinematic"])
def test_a_move_during_a_pause_leaves_the_levers_where_they_are(bench, name):
    emulator = bench(aircraft=name, version="12")
    used = "sim/flightmodel/engine/ENGN_thro_use[0]"
    emulator.write({"sim/cockpit2/engine/actuators/throttle_ratio_all": 0.9})
    assert emulator.read(used) == [pytest.approx(0.9)]
    client = emulator.client()
    client.send(protocol.CommandRequest("sim/operation/pause_on"))
    client.send(protocol.VehiclePose("VEHS", 0, 37.0, 127.0, 2000.0, 0.0, 0.0, 0.0))
    assert emulator.read(used) == [pytest.approx(0.9)]


def test_attitude_and_velocity_are_set_by_their_datarefs(bench):
    emulator = bench(aircraft="fixed_wing")
    half = math.radians(30.0) / 2
    heading = math.radians(45.0) / 2
    # heading 45 then roll 30: q = qz(45) * qx(30)
    q = (
        math.cos(heading) * math.cos(half),
        math.cos(heading) * math.sin(half),
        math.sin(heading) * math.sin(half),
        math.sin(heading) * math.cos(half),
    )
    emulator.client().send(protocol.CommandRequest("sim/operation/pause_toggle"))
    emulator.write({f"{POSITION}q[{i}]": value for i, value in enumerate(q)})
    emulator.write({POSITION + "local_vx": 42.4264, POSITION + "local_vy": 0.0, POSITION + "local_vz": -42.4264})
    emulator.step()
    names = ("phi", "theta", "psi", "local_vx", "local_vz")
    phi, theta, psi, vx, vz = emulator.read(*(POSITION + name for name in names))
    assert phi == pytest.approx(30.0, abs=0.1)
    assert psi == pytest.approx(45.0, abs=0.1)
    assert (vx, vz) == (pytest.approx(42.4264, abs=0.01), pytest.approx(-42.4264, abs=0.01))
    assert theta == pytest.approx(0.0, abs=0.1)


def test_the_flight_model_turns_by_q_and_its_override_by_the_angles(bench):
    emulator = bench(aircraft="fixed_wing")
    angles = [POSITION + name for name in ("phi", "theta", "psi")]
    before = emulator.read(*angles)
    emulator.write(dict(zip(angles, (40.0, 10.0, 90.0))))
    assert emulator.read(*angles) == pytest.approx(before, abs=0.1)
    emulator.write({OVERRIDE + "planepath[0]": 1.0})
    emulator.write(dict(zip(angles, (40.0, 10.0, 90.0))))
    assert emulator.read(*angles) == pytest.approx([40.0, 10.0, 90.0], abs=1e-3)
    emulator.write({POSITION + "q[0]": 1.0, POSITION + "q[1]": 0.0, POSITION + "q[2]": 0.0, POSITION + "q[3]": 0.0})
    assert emulator.read(*angles) == pytest.approx([40.0, 10.0, 90.0], abs=1e-3)


def test_local_position_is_set_by_its_datarefs_at_once(bench):
    emulator = bench()
    x, y, z = emulator.sim.frame.position
    emulator.write({OVERRIDE + "planepath[0]": 1.0, POSITION + "local_x": x + 1000.0, POSITION + "local_z": z - 500.0})
    got = emulator.read(POSITION + "local_x", POSITION + "local_y", POSITION + "local_z")
    assert got == pytest.approx([x + 1000.0, y, z - 500.0], abs=0.01)


def test_reset_of_x_plane_11_pause_place_attitude_velocity_go(bench):
    emulator = bench(aircraft="fixed_wing")
    client = emulator.client()
    emulator.step(120)
    client.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    client.send(protocol.Placement(6, latitude_deg=37.5, longitude_deg=127.0, elevation_m=1200.0, speed_mps=65.0))
    emulator.step()
    half = math.radians(20.0) / 2
    emulator.write({f"{POSITION}q[{i}]": value for i, value in enumerate((math.cos(half), math.sin(half), 0.0, 0.0))})
    emulator.write({POSITION + "local_vx": 0.0, POSITION + "local_vy": 2.0, POSITION + "local_vz": -65.0})
    emulator.write({POSITION + "Prad": 0.0, POSITION + "Qrad": 0.0, POSITION + "Rrad": 0.05})
    names = ("true_phi", "true_psi", "local_vy", "local_vz", "Rrad", "latitude")
    for _ in range(3):  # it stands there until it goes on
        values = emulator.read(*(POSITION + name for name in names))
        assert values[:5] == pytest.approx([20.0, 0.0, 2.0, -65.0, 0.05], abs=0.01)
        assert values[5] == pytest.approx(37.5, abs=1e-5)
    client.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    emulator.step(60)
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.5 + math.degrees(65.0 / 6379345.0), abs=1e-4)


# --- aircraft and situations ---


def test_acfn_loads_another_aircraft_where_the_present_one_is(bench):
    emulator = bench()
    client = emulator.client()
    client.send(row(8, 0.5))
    emulator.step(5)
    client.send(protocol.AircraftLoad(0, aircraft_path("fixed_wing")))
    emulator.step(2)
    assert emulator.sim.aircraft == "fixed_wing"
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.46, abs=0.01)
    letters = emulator.read(*(f"sim/aircraft/view/acf_ICAO[{i}]" for i in range(4)))
    assert bytes(map(int, letters)).decode() == emulator.sim.model.info.icao[:4]
    assert emulator.read(YOKE_PITCH) == [0.0]  # what a DATA row held is released by loading an aircraft


def test_acfn_of_an_unknown_file_changes_nothing(bench):
    emulator = bench()
    emulator.client().send(protocol.AircraftLoad(0, "Aircraft/Laminar Research/Cessna 172SP/Cessna_172SP.acf"))
    emulator.step()
    assert emulator.sim.aircraft == "kinematic"


def test_simo_saves_and_loads_a_flight(bench):
    emulator = bench()
    client = emulator.client()
    emulator.write({"sim/cockpit2/controls/flap_ratio": 0.5})
    emulator.step(60)
    client.send(protocol.Situation(protocol.Situation.SAVE, "Output/situations/one.sit"))
    emulator.step()
    saved = emulator.sim.model.state.copy()
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 1.0, "sim/cockpit2/controls/flap_ratio": 0.0})
    emulator.step(200)
    emulator.write({OVERRIDE + "joystick": 0.0})
    client.send(protocol.Situation(protocol.Situation.LOAD, "Output/situations/one.sit"))
    emulator.step()
    state = emulator.sim.model.state
    assert state.longitude_deg == pytest.approx(saved.longitude_deg, abs=1e-5)
    assert state.roll_rad == pytest.approx(saved.roll_rad, abs=1e-3)
    assert emulator.read("sim/cockpit2/controls/flap_ratio") == [0.5]


def test_simo_of_an_unknown_situation_changes_nothing(bench):
    emulator = bench()
    emulator.step(10)
    emulator.client().send(protocol.Situation(protocol.Situation.LOAD, "no.sit"))
    before = emulator.sim.model.state.longitude_deg
    emulator.step()
    assert emulator.sim.model.state.longitude_deg == pytest.approx(before, abs=1e-4)


def test_fuel_and_payload_reach_the_model(bench):
    emulator = bench()
    emulator.write({"sim/flightmodel/weight/m_fuel[0]": 30.0, "sim/flightmodel/weight/m_fixed": 50.0})
    fuel, payload, total = emulator.read(
        "sim/flightmodel/weight/m_fuel[0]", "sim/flightmodel/weight/m_fixed", "sim/flightmodel/weight/m_total"
    )
    assert fuel == pytest.approx(30.0, abs=0.1)
    assert payload == pytest.approx(50.0)
    assert total == pytest.approx(1000.0 + 30.0 + 120.0 + 50.0, abs=0.5)


@pytest.mark.parametrize(
    ("version", "direction", "speed", "value", "read"),
    [
        (
            "11",
            "sim/weather/wind_direction_degt[0]",
            "sim/weather/wind_speed_kt[0]",
            19.4384,
            "sim/weather/wind_now_x_msc",
        ),
        (
            "12.00",
            "sim/weather/wind_direction_degt[0]",
            "sim/weather/wind_speed_kt[0]",
            19.4384,
            "sim/weather/wind_now_x_msc",
        ),
        (
            "12",
            "sim/weather/region/wind_direction_degt",
            "sim/weather/region/wind_speed_msc",
            10.0,
            "sim/weather/aircraft/wind_now_x_msc",
        ),
    ],
)
def test_wind_set_by_a_client_blows(bench, version, direction, speed, value, read):
    emulator = bench(version=version)
    emulator.write({direction: 270.0, speed: value})  # from the west: the air moves east, X +
    emulator.step(5)
    assert emulator.read(read)[0] == pytest.approx(10.0, abs=0.1)
