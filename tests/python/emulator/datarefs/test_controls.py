"""Who moves what in the emulator: overrides, DATA rows, failures, placements, aircraft and situations."""

from __future__ import annotations

import math

import pytest

from support.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import aircraft_path

OVERRIDE = "sim/operation/override/override_"
YOKE_ROLL, YOKE_PITCH = "sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_pitch_ratio"
THROTTLE = "sim/cockpit2/engine/actuators/throttle_ratio"
THRO_USE = "sim/flightmodel/engine/ENGN_thro_use"
LEFT_AILERON = "sim/flightmodel/controls/wing2l_ail1def"
RIGHT_AILERON = "sim/flightmodel/controls/wing2r_ail1def"
ELEVATOR = "sim/flightmodel/controls/hstab1_elv1def"
FAILURES = "sim/operation/failures/"
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


# --- the stick ---


@pytest.mark.parametrize("name", [YOKE_ROLL, "sim/cockpit2/controls/yoke_roll_ratio"])
def test_stick_obeys_the_yoke_datarefs_only_under_the_override(bench, name):
    emulator = bench()
    emulator.write({name: 0.5})
    emulator.step(30)
    assert emulator.sim.model.state.roll_rad == pytest.approx(0.0, abs=1e-9)
    assert emulator.read(YOKE_ROLL) == [0.0]
    emulator.write({OVERRIDE + "joystick": 1.0, name: 0.5})
    emulator.step(60)
    assert emulator.read(YOKE_ROLL, "sim/cockpit2/controls/yoke_roll_ratio") == [0.5, 0.5]
    assert math.degrees(emulator.sim.model.state.roll_rad) > 10.0


def test_stick_override_by_axis(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick_roll": 1.0, YOKE_ROLL: 0.5, YOKE_PITCH: 0.5})
    assert emulator.read(YOKE_ROLL, YOKE_PITCH) == [0.5, 0.0]


def test_without_a_joystick_the_stick_takes_writes_under_no_override(bench):
    centred, free = bench(), bench(joystick="none")
    for emulator in (centred, free):
        emulator.write({YOKE_ROLL: 0.5, "sim/cockpit2/controls/yoke_pitch_ratio": 0.25})
        emulator.step(30)
    assert centred.read(YOKE_ROLL, YOKE_PITCH) == [0.0, 0.0]
    assert free.read(YOKE_ROLL, YOKE_PITCH) == [0.5, 0.25]
    assert math.degrees(free.sim.model.state.roll_rad) > 5.0


@pytest.mark.parametrize(
    ("override", "stays"),
    [("", False), ("joystick", True), ("joystick_heading", True), ("joystick_roll", False)],
)
def test_overrides_stop_pedals_and_auto_coordination(bench, override, stays):
    emulator = bench(auto_coordination=True)
    emulator.sim.model.state.beta_rad = math.radians(3.0)
    emulator.write({OVERRIDE + "planepath": 1.0})  # the sideslip stands
    if override:
        emulator.write({OVERRIDE + override: 1.0})
    emulator.step(2)
    # nose to the wind: to the right when it comes from there
    assert emulator.read("sim/joystick/yoke_heading_ratio") == [pytest.approx(0.0 if stays else 0.3)]


def test_overrides_and_the_last_stick_outlive_the_client(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.3})  # this client's socket is closed again
    emulator.step(300)
    assert emulator.read(OVERRIDE + "joystick", YOKE_ROLL) == [1.0, pytest.approx(0.3)]


@pytest.mark.parametrize("index", [8, 11])
def test_data_row_holds_the_stick_until_999(bench, index):
    emulator = bench()
    client = emulator.client()
    client.send(row(index, 0.1, -0.4))  # elevator, aileron; rudder untouched
    emulator.step(20)
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [pytest.approx(0.1), pytest.approx(-0.4)]
    client.send(row(index, -999.0, -0.2))
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [0.0, pytest.approx(-0.2)]
    client.send(row(index))
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [0.0, 0.0]


def test_data_rows_of_state_are_not_honoured(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.DataPacket(tuple((index, (1.0,) * 8) for index in (16, 17, 18, 20, 21, 500, -3))))
    emulator.step()
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.46, abs=0.01)


def test_data_row_25_moves_the_levers_and_comes_back_as_its_own_echo(bench):
    emulator = bench()
    client = emulator.client()
    client.send(row(25, 0.2, 0.8))
    assert emulator.read(THROTTLE + "[0]", THROTTLE + "[1]") == [pytest.approx(0.2), pytest.approx(0.8)]
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", (25, 26)))
    emulator.step(3)
    rows = protocol.decode_data(client.received()[-1]).as_dict()
    assert rows[25][:3] == (pytest.approx(0.2), pytest.approx(0.8), 0.0)
    assert rows[26][:2] == (pytest.approx(0.2), pytest.approx(0.8))


def test_data_rows_13_and_14_move_trims_flaps_gear_and_brakes(bench):
    emulator = bench()
    client = emulator.client()
    client.send(row(13, 0.1, -0.2, 0.3, 0.5, -999.0, -999.0, -0.5))
    client.send(row(14, 0.0, 0.6))
    controls = "sim/cockpit2/controls/"
    names = (
        "elevator_trim",
        "aileron_trim",
        "rudder_trim",
        "flap_ratio",
        "speedbrake_ratio",
        "gear_handle_down",
        "parking_brake_ratio",
    )
    values = emulator.read(*(controls + name for name in names))
    assert values == pytest.approx([0.1, -0.2, 0.3, 0.5, -0.5, 0.0, 0.6])


def test_toe_brakes_need_their_override(bench):
    emulator = bench(initial=InitialState(on_ground=True))
    brake = "sim/cockpit2/controls/left_brake_ratio"
    emulator.write({brake: 1.0})
    assert emulator.read(brake) == [0.0]
    emulator.write({OVERRIDE + "toe_brakes": 1.0, brake: 1.0})
    emulator.step(3)
    assert emulator.read(brake) == [1.0]


# --- surfaces and engines directly ---


def test_surface_override_freezes_every_surface(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.5, YOKE_PITCH: 0.25})
    emulator.step(30)
    before = emulator.read(LEFT_AILERON, RIGHT_AILERON, ELEVATOR)
    assert before == pytest.approx([10.0, -10.0, -5.0])
    emulator.write({OVERRIDE + "control_surfaces": 1.0, YOKE_ROLL: -1.0, YOKE_PITCH: -1.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON, RIGHT_AILERON, ELEVATOR) == before


@pytest.mark.parametrize(
    "name",
    [
        LEFT_AILERON,
        "sim/flightmodel/controls/lail1def",
        "sim/flightmodel2/wing/aileron1_deg[2]",
        "sim/flightmodel/controls/ail1_def[10]",
    ],
)
def test_one_surface_moves_alone_under_the_override_by_any_of_its_names(bench, name):
    emulator = bench()
    emulator.write({OVERRIDE + "control_surfaces": 1.0, name: 7.0})
    emulator.step(2)
    assert emulator.read(name, LEFT_AILERON, RIGHT_AILERON) == pytest.approx([7.0, 7.0, 0.0])
    emulator.step(60)
    assert emulator.read(LEFT_AILERON) == pytest.approx([7.0])
    assert math.degrees(emulator.sim.model.state.roll_rad) > 5.0
    emulator.write({OVERRIDE + "control_surfaces": 0.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON) == pytest.approx([0.0])


def test_snapshot_written_in_the_frame_of_the_override_counts(bench):
    emulator = bench()
    emulator.write({LEFT_AILERON: 3.0, RIGHT_AILERON: -2.0, OVERRIDE + "control_surfaces": 1.0})
    emulator.step()
    assert emulator.read(LEFT_AILERON, RIGHT_AILERON) == pytest.approx([3.0, -2.0])


def test_surface_writes_without_the_override_are_gone_in_the_next_frame(bench):
    emulator = bench()
    emulator.write({LEFT_AILERON: 9.0})
    assert emulator.read(LEFT_AILERON) == [0.0]
    emulator.write({OVERRIDE + "control_surfaces": 1.0})
    emulator.step(2)
    assert emulator.read(LEFT_AILERON) == [0.0]


def test_engines_obey_thro_use_only_under_the_override(bench):
    emulator = bench()
    emulator.write({THRO_USE + "[0]": 0.9})
    emulator.step(2)
    lever = emulator.sim.controls.throttle[0]
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]
    emulator.write({OVERRIDE + "throttles": 1.0, THRO_USE + "[0]": 0.9})
    emulator.step(5)
    assert emulator.read(THRO_USE + "[0]", THRO_USE + "[1]") == [pytest.approx(0.9), pytest.approx(lever)]
    emulator.write({OVERRIDE + "throttles": 0.0})
    emulator.step(2)
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]
    emulator.write(
        {OVERRIDE + "throttles": 1.0}
    )  # a new override starts from what the engines have, not from the old one
    emulator.step(2)
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]


def test_throttle_override_of_all_engines_is_released_by_minus_two(bench):
    emulator = bench()
    name = "sim/flightmodel/engine/ENGN_thro_override"
    emulator.write({name: 0.1})
    emulator.step(2)
    assert emulator.read(THRO_USE + "[0]", THRO_USE + "[1]") == [pytest.approx(0.1)] * 2
    emulator.write({name: -2.0})
    emulator.step(2)
    assert emulator.read(THRO_USE + "[1]") == [pytest.approx(emulator.sim.controls.throttle[1])]


# --- failures ---


def test_engine_failure_and_repair(bench):
    emulator = bench()
    running = "sim/flightmodel/engine/ENGN_running"
    emulator.write({FAILURES + "rel_engfai1": 6.0})
    emulator.step(2)
    assert emulator.read(running + "[0]", running + "[1]") == [1.0, 0.0]
    emulator.write({FAILURES + "rel_engfai1": 0.0})
    emulator.step(2)
    assert emulator.read(running + "[1]") == [1.0]


def test_a_failure_that_is_armed_for_later_does_nothing_yet(bench):
    emulator = bench()
    emulator.write({FAILURES + "rel_engfai0": 2.0})
    emulator.step(2)
    assert emulator.read(FAILURES + "rel_engfai0", "sim/flightmodel/engine/ENGN_running") == [2.0, 1.0]


def test_rese_repairs_everything(bench):
    emulator = bench()
    emulator.write({FAILURES + "rel_engfai0": 6.0, FAILURES + "rel_pitot": 6.0})
    emulator.step(2)
    emulator.client().send(protocol.RecoverAll())
    emulator.step(2)
    assert emulator.read(FAILURES + "rel_engfai0", FAILURES + "rel_pitot") == [0.0, 0.0]
    assert emulator.read("sim/flightmodel/engine/ENGN_running") == [1.0]


def test_surface_lock_exists_only_in_x_plane_12_and_keeps_the_present_position(bench):
    name = FAILURES + "rel_fcon_ailn_1_lft_lock"
    eleven = bench(version="11")
    client = eleven.client()
    client.subscribe([name])
    eleven.step()
    assert client.values() == {}
    twelve = bench(version="12")
    twelve.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.5})
    twelve.step(30)
    twelve.write({name: 6.0, YOKE_ROLL: -0.5})
    twelve.step(30)
    assert twelve.read(LEFT_AILERON, RIGHT_AILERON) == pytest.approx([10.0, 10.0])


def test_roll_authority_to_the_left_is_lost(bench):
    emulator = bench(version="11")
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: -0.5, FAILURES + "rel_fc_ail_L": 6.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON) == [0.0]


def test_blocked_pitot_keeps_the_airspeed_of_its_moment(bench):
    emulator = bench()
    name = POSITION + "indicated_airspeed"
    emulator.step(5)
    emulator.write(
        {FAILURES + "rel_pitot": 6.0, OVERRIDE + "throttles": 1.0, THRO_USE + "[0]": 0.0, THRO_USE + "[1]": 0.0}
    )
    (before,) = emulator.read(name)
    emulator.step(300)
    (after,) = emulator.read(name)
    true = emulator.sim.model.state.calibrated_airspeed_mps * 3600 / 1852
    assert after == pytest.approx(before, abs=0.5)
    assert true < before - 5.0


def test_generators_and_batteries_feed_the_bus(bench):
    emulator = bench()
    bus = "sim/cockpit2/electrical/bus_volts"
    emulator.step(2)
    assert emulator.read(bus) == [28.0]
    emulator.write({FAILURES + "rel_genera0": 6.0, FAILURES + "rel_genera1": 6.0})
    emulator.step(2)
    (volts,) = emulator.read(bus)
    assert 20.0 < volts < 25.0
    emulator.write({"sim/cockpit2/electrical/battery_on[0]": 0.0})
    emulator.step(2)
    assert emulator.read(bus) == [0.0]


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


def test_loading_is_shown_while_the_flight_stands(bench):
    emulator = bench(aircraft="fixed_wing")
    weight = "sim/flightmodel/weight/"
    (before,) = emulator.read(weight + "m_total")
    emulator.client().send(protocol.CommandRequest("sim/operation/pause_toggle"))
    emulator.write({weight + "m_fuel[0]": 60.0, weight + "m_fixed": 300.0})
    shown = emulator.read(weight + "m_fuel[0]", weight + "m_fixed", weight + "m_total")
    assert shown == pytest.approx([60.0, 300.0, before - 40.0 + 90.0], abs=0.1)


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
    emulator.write({OVERRIDE + "planepath[0]": 1.0})
    emulator.write({f"{POSITION}q[{i}]": value for i, value in enumerate(q)})
    emulator.write({POSITION + "local_vx": 42.4264, POSITION + "local_vy": 0.0, POSITION + "local_vz": -42.4264})
    emulator.step()
    names = ("phi", "theta", "psi", "local_vx", "local_vz")
    phi, theta, psi, vx, vz = emulator.read(*(POSITION + name for name in names))
    assert phi == pytest.approx(30.0, abs=0.1)
    assert psi == pytest.approx(45.0, abs=0.1)
    assert (vx, vz) == (pytest.approx(42.4264, abs=0.01), pytest.approx(-42.4264, abs=0.01))
    assert theta == pytest.approx(0.0, abs=0.1)


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


# --- what only a live X-Plane can settle ---


@pytest.mark.parametrize(("mode", "angle"), [("act", -20.0), ("ignored", 0.0)])
def test_failures_of_single_surfaces_act_or_are_ignored(bench, mode, angle):
    emulator = bench(version="12", surface_failures=mode)
    emulator.write({FAILURES + "rel_fcon_ailn_1_lft_mxup": 6.0})
    emulator.step(120)
    left, right, failure = emulator.read(LEFT_AILERON, RIGHT_AILERON, FAILURES + "rel_fcon_ailn_1_lft_mxup")
    assert (left, right, failure) == (pytest.approx(angle), 0.0, 6.0)


@pytest.mark.parametrize(("mode", "moved"), [("move", 0.25), ("frozen", 0.0)])
def test_total_stick_under_the_surface_override(bench, mode, moved):
    emulator = bench(aircraft="fixed_wing", overridden_totals=mode)
    total = "sim/cockpit2/controls/total_roll_ratio"
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.25})
    (before,) = emulator.read(total)
    emulator.write({OVERRIDE + "control_surfaces": 1.0, YOKE_ROLL: 0.5})
    after, stick = emulator.read(total, YOKE_ROLL)
    assert (after - before, stick) == (pytest.approx(moved, abs=1e-6), 0.5)
    emulator.write({OVERRIDE + "control_surfaces": 0.0})
    assert emulator.read(total)[0] - before == pytest.approx(0.25, abs=1e-6)
