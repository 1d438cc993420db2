"""X-Plane's axes, origin, units and rows as the emulator has them, against numbers worked out here or captured."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.flight.frame import indicated_altitude_m, magnetic_declination

POSITION = "sim/flightmodel/position/"
R = 6378145.0


@pytest.fixture(name="bench")
def fixture_bench():
    benches = []

    def make(**options):
        benches.append(EmulatorFixture(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def f32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def sphere(x, y, z, lat0, lon0):
    """Latitude, longitude, height of a local position, by the protocol description's formulas."""
    a, b = math.radians(lat0), math.radians(lon0)
    east = np.array([-math.sin(b), math.cos(b), 0.0])
    north = np.array([-math.sin(a) * math.cos(b), -math.sin(a) * math.sin(b), math.cos(a)])
    up = np.array([math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a)])
    p = (R + y) * up + x * east - z * north
    r = float(np.linalg.norm(p))
    return math.degrees(math.asin(p[2] / r)), math.degrees(math.atan2(p[1], p[0])), r - R


# --- earth ---


@pytest.mark.parametrize(
    ("place", "origin"),  # those of captured packets
    [
        ((43.29, -8.39), (43.5, -8.0)),
        ((44.83, 20.29), (44.5, 20.0)),
        ((-23.21, -46.96), (-23.5, -47.0)),
        ((-22.92, -43.16), (-22.5, -43.0)),
        ((47.43, -122.31), (47.5, -122.0)),
        ((0.1, 179.7), (0.5, -180.0)),
    ],
)
def test_origin_of_a_place(place, origin):
    assert earth.nominal_origin(*place) == origin


def test_local_frame_both_ways():
    frame = earth.LocalFrame(37.46, 126.44)
    assert (frame.lat_ref, frame.lon_ref) == (37.5, 126.0)
    for place in ((37.46, 126.44, 1000.0), (37.01, 125.51, 0.0), (37.99, 126.49, 12000.0)):
        local = frame.to_local(*place)
        assert sphere(*local, 37.5, 126.0) == pytest.approx(place, abs=1e-9)
        assert frame.to_geodetic(*local) == pytest.approx(place, abs=1e-9)
    assert frame.to_local(37.5, 126.0, 100.0) == pytest.approx((0.0, 100.0, 0.0), abs=1e-6)
    x, y, z = frame.to_local(37.6, 126.0, 0.0)
    assert (x, z) == (pytest.approx(0.0, abs=1e-6), pytest.approx(-R * math.sin(math.radians(0.1)), abs=1e-6))
    assert y == pytest.approx(-R * (1 - math.cos(math.radians(0.1))), abs=1e-6)  # the ground falls away: -9.7 m


def test_axes_tilt_away_from_the_origin():
    frame = earth.LocalFrame(37.5, 126.0)
    turn = frame.from_level(37.5, 126.49)
    # level flight due east, 0.49 degrees east of the origin: the path points down in the origin's axes
    north, east, down = turn @ np.array([0.0, 100.0, 0.0])
    tilt = math.radians(0.49)
    assert down == pytest.approx(100.0 * math.sin(tilt) * math.cos(math.radians(37.5)), abs=1e-6)
    assert east == pytest.approx(100.0 * math.cos(tilt), abs=1e-6)
    # a parallel of the northern hemisphere bends north of the straight line
    assert north == pytest.approx(100.0 * math.sin(tilt) * math.sin(math.radians(37.5)), abs=1e-6)


@pytest.mark.parametrize("angles", [(0, 0, 0), (30, 10, 45), (-170, -80, 359), (90, 0, 180), (179, 5, 181), (0, 89, 0)])
def test_quaternion_and_angles_of_a_rotation(angles):
    rotation = earth.body_to_level(*angles)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert earth.rotation_from_quaternion(*earth.quaternion(rotation)) == pytest.approx(rotation, abs=1e-12)
    assert earth.euler_degrees(rotation) == pytest.approx(angles, abs=1e-9)


def test_body_axes_by_hand():
    # nose east and 30 degrees up: forward = cos 30 east - sin 30 down
    forward = earth.body_to_level(0.0, 30.0, 90.0) @ np.array([1.0, 0.0, 0.0])
    assert forward == pytest.approx([0.0, math.cos(math.radians(30)), -0.5], abs=1e-12)
    # rolled right 90 degrees, heading north: the right wing points down
    assert earth.body_to_level(90.0, 0.0, 0.0) @ np.array([0.0, 1.0, 0.0]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_altimeter_and_declination():
    assert indicated_altitude_m(101325.0, 101325.0) == pytest.approx(0.0, abs=1e-9)
    assert indicated_altitude_m(89874.6, 101325.0) == pytest.approx(1000.0, abs=1.0)  # standard pressure at 1000 m
    assert indicated_altitude_m(101325.0, 101325.0 + 3386.389) == pytest.approx(280.0, abs=5.0)
    assert magnetic_declination(47.4, 8.5) == pytest.approx(3.0, abs=20.0)
    assert magnetic_declination(47.6, -122.3) > 5.0  # east in Seattle
    assert magnetic_declination(40.6, -73.8) == pytest.approx(0.0, abs=15.0)


# --- one frame ---


def test_local_position_gives_millimetres_where_latitude_gives_decimetres(bench):
    emulator = bench(initial=InitialState(latitude_deg=37.4602, longitude_deg=128.4407, heading_deg=70.0))
    names = ("local_x", "local_y", "local_z", "lat_ref", "lon_ref", "latitude", "longitude")
    x, y, z, lat0, lon0, latitude, longitude = emulator.read(*(POSITION + name for name in names))
    state = emulator.sim.model.state
    got = sphere(x, y, z, lat0, lon0)
    metres = math.radians(1.0) * R
    assert abs(got[0] - state.latitude_deg) * metres < 0.003
    assert abs(got[1] - state.longitude_deg) * metres < 0.003
    assert abs(got[2] - state.altitude_m) < 0.003
    assert (latitude, longitude) == (f32(state.latitude_deg), f32(state.longitude_deg))
    assert abs(longitude - state.longitude_deg) * metres > 0.003


def test_angles_in_the_origin_axes_differ_from_the_true_ones(bench):
    emulator = bench(initial=InitialState(latitude_deg=37.5, longitude_deg=126.49, heading_deg=90.0))
    theta, true_theta, psi, true_psi = emulator.read(
        *(POSITION + n for n in ("theta", "true_theta", "psi", "true_psi"))
    )
    tilt = 0.49 * math.cos(math.radians(37.5))  # nose down by the earth's curve, seen from the origin
    assert theta - true_theta == pytest.approx(-tilt, abs=0.005)
    assert psi - true_psi == pytest.approx(-0.49 * math.sin(math.radians(37.5)), abs=0.01)  # meridians converge


def test_velocity_is_the_derivative_of_the_local_position(bench):
    emulator = bench(
        aircraft="fixed_wing", initial=InitialState(latitude_deg=37.9, longitude_deg=126.4, heading_deg=40.0)
    )
    frame = emulator.sim.frame
    emulator.step(30)
    before = np.array(frame.position)
    velocity = np.array(frame.velocity)
    emulator.step(1)
    measured = (np.array(frame.position) - before) * 60.0
    assert measured == pytest.approx((velocity + np.array(frame.velocity)) / 2, abs=0.02)


def test_acceleration_is_the_derivative_of_the_local_velocity(bench):
    emulator = bench(
        aircraft="fixed_wing", initial=InitialState(latitude_deg=37.9, longitude_deg=126.4, heading_deg=40.0)
    )
    emulator.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_pitch_ratio": 0.3})
    emulator.write({"sim/joystick/yoke_roll_ratio": 0.3})
    emulator.step(60)
    frame = emulator.sim.frame
    before, acceleration = np.array(frame.velocity), np.array(frame.acceleration)
    emulator.step(1)
    measured = (np.array(frame.velocity) - before) * 60.0
    assert float(np.linalg.norm(measured)) > 2.0
    assert measured == pytest.approx((acceleration + np.array(frame.acceleration)) / 2, abs=0.15)


def test_origin_jumps_at_the_whole_degree_and_the_place_does_not(bench):
    emulator = bench(initial=InitialState(latitude_deg=37.998, longitude_deg=126.2, heading_deg=0.0), fps=60.0)
    client = emulator.client()
    names = ("local_x", "local_z", "lat_ref", "lon_ref", "latitude")
    client.subscribe([POSITION + name for name in names])
    emulator.step(60 * 6)  # 420 m north: 0.0038 degrees
    rows = [dict(protocol.decode_rref_response(packet)) for packet in client.received()]
    assert {row[2] for row in rows} == {37.5, 38.5}
    assert {row[3] for row in rows} == {126.0}
    jump = next(i for i, row in enumerate(rows) if row[2] == 38.5)
    assert rows[jump][1] - rows[jump - 1][1] == pytest.approx(R * math.radians(1.0), rel=1e-3)
    steps = [b[4] - a[4] for a, b in zip(rows, rows[1:])]
    assert max(steps) < 3e-5  # 1.17 m a frame; float32 latitude has steps of 3.8e-6


def test_specific_force_and_load_factors_on_the_ground(bench):
    emulator = bench(aircraft="fixed_wing", initial=InitialState(on_ground=True, engines_running=False))
    emulator.step(120)
    normal, axial, side, theta = emulator.read(
        *("sim/flightmodel/forces/" + name for name in ("g_nrml", "g_axil", "g_side")), POSITION + "true_theta"
    )
    assert normal == pytest.approx(math.cos(math.radians(theta)), abs=0.01)
    assert -axial == pytest.approx(
        math.sin(math.radians(theta)), abs=0.005
    )  # f_x = -g_axil g0 = +g0 sin(theta) at rest
    assert side == pytest.approx(0.0, abs=0.005)


def test_wind_from_the_west_is_felt_and_shown(bench):
    emulator = bench(aircraft="fixed_wing", wind=(270.0, 10.0), initial=InitialState(heading_deg=0.0))
    emulator.step(60)
    x, z, direction, speed, beta, true = emulator.read(
        "sim/weather/wind_now_x_msc",
        "sim/weather/wind_now_z_msc",
        "sim/weather/wind_direction_degt",
        "sim/weather/wind_speed_kt",
        POSITION + "beta",
        POSITION + "true_airspeed",
    )
    assert (x, z) == (pytest.approx(10.0, abs=0.05), pytest.approx(0.0, abs=0.1))
    assert direction == pytest.approx(270.0, abs=0.5)
    assert speed == pytest.approx(10.0, abs=0.05)  # metres a second in spite of its name
    state = emulator.sim.model.state
    air = np.array([state.v_north_mps - 0.0, state.v_east_mps - 10.0, state.v_down_mps])
    assert true == pytest.approx(float(np.linalg.norm(air)), abs=0.05)
    assert beta == pytest.approx(-math.degrees(state.beta_rad), abs=1e-4)  # Laminar's sign: nose right of the path +


def test_height_above_ground_of_a_parked_aircraft_is_a_quarter_of_a_foot(bench):
    emulator = bench(aircraft="fixed_wing", initial=InitialState(on_ground=True, terrain_elevation_m=300.0))
    emulator.step(60)
    agl, msl = emulator.read(POSITION + "y_agl", POSITION + "elevation")
    assert agl == pytest.approx(0.25 * 0.3048, abs=0.02)
    assert msl == pytest.approx(301.1, abs=0.1)


def test_hpath_is_noise_when_parked(bench):
    emulator = bench(initial=InitialState(on_ground=True, heading_deg=200.0))
    values = {round(emulator.read(POSITION + "hpath")[0]) for _ in range(5)}
    assert len(values) == 5
    emulator.sim.pause(True)
    assert emulator.read(POSITION + "hpath") == emulator.read(POSITION + "hpath")


def test_the_path_of_a_vertical_climb_is_vertical(bench):
    emulator = bench(aircraft="multirotor", initial=InitialState(altitude_m=100.0))
    emulator.write({f"sim/cockpit2/engine/actuators/throttle_ratio[{motor}]": 0.8 for motor in range(4)})
    emulator.step(60)
    vertical, over_ground, path = emulator.read(POSITION + "vh_ind", POSITION + "groundspeed", POSITION + "vpath")
    assert (vertical > 1.0, over_ground < 0.1) == (True, True)
    assert path == pytest.approx(90.0, abs=1.0)


# --- DATA rows ---


def test_rows_of_turbulence_servos_and_forces(bench):
    emulator = bench(version="12", aircraft="fixed_wing")
    emulator.write({"sim/weather/region/turbulence[0]": 10.0})
    servos = [f"sim/joystick/servo_{axis}_ratio" for axis in ("pitch", "roll", "heading")]
    for command in ("servos_on", "heading"):
        emulator.client().send(protocol.CommandRequest(f"sim/autopilot/{command}"))
    emulator.write({"sim/cockpit2/autopilot/heading_dial_deg_mag_pilot": 90.0})
    emulator.step(30)
    shown = emulator.read(*servos)
    rows = emulator.sim.rows.values()
    assert rows[5][5] == 1.0
    assert list(rows[138]) == pytest.approx([*shown, *[-999.0] * 5], abs=1e-6)
    assert shown[1] != 0.0
    assert list(rows[65]) == [0.0] * 3 + [-999.0] * 5
    assert list(rows[137]) == [0.0] * 6 + [-999.0] * 2


def data(emulator, rows, frames=1):
    """Selects rows, flies, and gives the newest DATA packet's rows."""
    client = emulator.client()
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", tuple(rows)))
    emulator.write({"sim/network/dataout/network_data_rate": 99.0})
    emulator.step(frames)
    packets = client.received()
    assert packets[-1][:5] == b"DATA*"
    return protocol.decode_data(packets[-1]).as_dict()


def test_all_139_rows_make_one_datagram_in_ascending_order(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", tuple(reversed(range(139)))))
    emulator.step()
    (packet,) = client.received()
    assert len(packet) == 5009
    assert [index for index, _ in protocol.decode_data(packet).rows] == list(range(139))


def test_rows_20_and_21_belong_together(bench):
    emulator = bench(initial=InitialState(latitude_deg=37.4602, longitude_deg=126.4407, heading_deg=70.0))
    rows = data(emulator, [20, 21])
    x, y, z = rows[21][:3]
    latitude, longitude, height = sphere(x, y, z, rows[20][6], rows[20][7])
    assert f32(latitude) == pytest.approx(rows[20][0], abs=4e-6)
    assert f32(longitude) == pytest.approx(rows[20][1], abs=8e-6)
    assert height == pytest.approx(rows[20][2] * 0.3048, abs=0.002)
    # measured from the wheels: 1.2 m below the centre of gravity, and 3 inches when parked
    assert rows[20][3] == pytest.approx((emulator.sim.model.state.agl_m - 1.2 + 0.076) / 0.3048, rel=1e-5)


@pytest.mark.parametrize("version", ["11", "12"])
def test_row_16_changes_order_and_unit_with_the_version(bench, version):
    emulator = bench(version=version)
    emulator.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_roll_ratio": 0.5})
    emulator.write({"sim/joystick/yoke_pitch_ratio": 0.3})
    rows = data(emulator, [16], frames=40)
    state = emulator.sim.model.state
    if version == "11":
        expected = (state.q_rad_s, state.p_rad_s, state.r_rad_s)
    else:
        expected = tuple(math.degrees(rate) for rate in (state.p_rad_s, state.q_rad_s, state.r_rad_s))
    assert abs(expected[0] - expected[1]) > 1e-3
    assert rows[16][:3] == pytest.approx(expected, rel=1e-6)
    assert rows[16][3:] == (-999.0,) * 5


def test_rows_3_4_17_18_19_in_their_units(bench):
    emulator = bench(aircraft="fixed_wing", initial=InitialState(heading_deg=300.0))
    emulator.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_roll_ratio": 0.2})
    rows = data(emulator, [3, 4, 17, 18, 19], frames=60)
    state, frame = emulator.sim.model.state, emulator.sim.frame
    knot, mile = 1852 / 3600, 1609.344 / 3600
    assert rows[3][2] == pytest.approx(state.true_airspeed_mps / knot, rel=1e-5)
    assert rows[3][6] == pytest.approx(state.true_airspeed_mps / mile, rel=1e-5)
    assert rows[3][3] == pytest.approx(math.hypot(state.v_north_mps, state.v_east_mps) / knot, rel=1e-5)
    assert rows[3][4] == -999.0
    assert rows[4][2] == pytest.approx(-state.v_down_mps / 0.3048 * 60, rel=1e-4)
    assert rows[4][4] == pytest.approx(-state.specific_force_z_mps2 / 9.80665, rel=1e-5)
    assert rows[4][5] == pytest.approx(state.specific_force_x_mps2 / 9.80665, rel=1e-5)  # not the dataref's sign
    assert rows[4][6] == pytest.approx(state.specific_force_y_mps2 / 9.80665, rel=1e-4, abs=1e-6)
    assert rows[17][:3] == pytest.approx(
        (math.degrees(state.pitch_rad), math.degrees(state.roll_rad), math.degrees(state.heading_rad)), rel=1e-5
    )
    assert rows[18][0] == pytest.approx(math.degrees(state.alpha_rad), rel=1e-5)
    assert rows[18][4:7] == (-999.0,) * 3
    # magnetic = true + variation
    assert (rows[17][3] - rows[17][2] - rows[19][1] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-3)
    assert rows[19][0] == rows[17][3]
    assert frame.true_phi > 1.0


def test_angles_of_row_17_can_be_those_of_the_origin(bench):
    start = InitialState(latitude_deg=37.5, longitude_deg=126.49, heading_deg=90.0)
    level = data(bench(initial=start), [17])
    origin = data(bench(initial=start, otherwise=frozenset({"row17-axes"})), [17])
    assert origin[17][0] - level[17][0] == pytest.approx(-0.49 * math.cos(math.radians(37.5)), abs=0.005)


def test_engine_rows_have_zeros_for_engines_that_are_not_there(bench):
    engines = (25, 26, 27, 32, 34, 37, 45, 55, 58, 61)
    rows = data(bench(aircraft="fixed_wing"), [*engines, 57], frames=30)
    assert rows[57] == (1.0,) + (0.0,) * 7  # batteries
    for index in engines:
        assert all(value > 0.0 for value in rows[index][:2]), index
        assert rows[index][2:] == (0.0,) * 6
    assert 1000.0 < rows[37][0] < 2800.0
    assert 20.0 < rows[34][0] < 300.0  # horsepower


def test_data_needs_a_target_and_a_row_and_has_only_one_target(bench):
    emulator = bench()
    first, second = emulator.client(), emulator.client()
    first.send(protocol.RowSelection("DSEL", (17,)))
    emulator.step(10)
    assert first.received() == []
    first.send(protocol.NetworkTarget(64, "127.0.0.1", first.port, True))
    emulator.step(10)
    assert len(first.received()) > 0
    second.send(protocol.NetworkTarget(64, "127.0.0.1", second.port, True))
    second.send(protocol.NetworkTarget(39, "127.0.0.1", first.port, True))  # another target: not ours to follow
    emulator.step(10)
    assert first.received() == []
    assert len(second.received()) > 0
    second.send(protocol.RowSelection("USEL", (17,)))
    emulator.step(10)
    assert second.received() == []
    second.send(protocol.RowSelection("DSEL", (17,)))
    second.send(protocol.NetworkTarget(64, "127.0.0.1", second.port, False))
    emulator.step(10)
    assert second.received() == []


def test_data_rows_are_selected_by_their_dataref_too(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    emulator.write({"sim/network/dataout/data_to_internet[20]": 1.0})
    emulator.step()
    assert [index for index, _ in protocol.decode_data(client.received()[-1]).rows] == [20]
    client.send(protocol.RowSelection("DSEL", (0, 3)))
    assert emulator.read(*(f"sim/network/dataout/data_to_internet[{i}]" for i in (0, 3, 4, 20))) == [1, 1, 0, 1]
    some = np.array((1, 3))
    np.testing.assert_array_equal(emulator.sim.rows.of(some), emulator.sim.rows.values()[some])


@pytest.mark.parametrize(("rate", "packets"), [(20, 20), (99, 60), (0, 0)])
def test_data_rate(bench, rate, packets):
    emulator = bench(fps=60.0, rate=rate)
    client = emulator.client()
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", (1,)))
    emulator.step(60)
    assert len(client.received()) == packets


def test_below_20_frames_a_second_simulated_time_slows(bench):
    emulator = bench(fps=10.0)
    rows = data(emulator, [0, 1], frames=20)
    assert rows[0][0] == pytest.approx(10.0, rel=1e-6)
    assert rows[0][1] == pytest.approx(19.9, rel=1e-6)
    assert rows[1][1] == pytest.approx(20 / 19.9, rel=1e-5)
    assert rows[0][3] == pytest.approx(1 / 19.9, rel=1e-6)


def test_the_day_after_the_last_one_is_new_year(bench):
    emulator = bench()
    emulator.write({"sim/time/local_date_days": 364.0, "sim/time/zulu_time_sec": 86399.5})
    assert emulator.read("sim/time/local_date_days") == [364.0]
    emulator.step(60)
    assert emulator.read("sim/time/local_date_days") == [0.0]


def test_the_actual_speed_is_that_of_simulated_time(bench):
    actual, flown = "sim/time/sim_speed_actual", "sim/time/total_flight_time_sec"
    emulator = bench(fps=10.0)
    assert emulator.read(actual) == pytest.approx([10.0 / 19.9])
    emulator.write({"sim/time/sim_speed": 4.0})
    (before,) = emulator.read(flown)
    emulator.step(18)
    ratio, after = emulator.read(actual, flown)
    assert ratio == pytest.approx(4.0 * 10.0 / 19.9) == pytest.approx((after - before) / 1.9)


def test_times_of_row_1_are_in_decimal_hours(bench):
    emulator = bench(sim_time_start=100.0)
    emulator.write({"sim/time/zulu_time_sec": 45000.0})
    rows = data(emulator, [1], frames=60)
    assert rows[1][5] == pytest.approx((45000.0 + 1.0) / 3600.0, abs=1e-4)
    assert rows[1][1] == pytest.approx(101.0, abs=1e-4)
    assert rows[1][7] == pytest.approx(rows[1][2] / 3600.0)
    hobbs, flown = emulator.read("sim/time/hobbs_time", "sim/time/total_flight_time_sec")
    assert hobbs == flown  # in seconds
