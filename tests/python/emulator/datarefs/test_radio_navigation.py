"""What the receivers show, against numbers worked out by hand on a sphere of 6 378 145 m.

The aerodrome: runway of 1,800 m to the north, its middle at 47 N 8 E at sea level. One arc minute of latitude is
1,855.33 m; 0.1 degree is 11,131.96 m.
"""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.datarefs import radio_navigation as radio
from xplane_bridge.emulator.flight.flight_model import InitialState, ModelState
from xplane_bridge.emulator.flight.frame import Frame, magnetic_declination

FIELD = radio.Aerodrome.at(InitialState(latitude_deg=47.0, longitude_deg=8.0, heading_deg=0.0))
ARC_OF_TENTH_M = 11131.96
STATION_DECLINATION = magnetic_declination(47.1, 8.0)
INDICATORS = "sim/cockpit2/radios/indicators/"
ACTUATORS = "sim/cockpit2/radios/actuators/"
GAUGES = "sim/cockpit2/gauges/indicators/"
FAILURES = "sim/operation/failures/"


def frame_at(north_m=0.0, east_m=0.0, altitude_m=1000.0, heading_deg=0.0, v_north_mps=60.0, v_east_mps=0.0):
    frame = Frame(info=None, declination=2.0)
    metres = 6378145.0 * math.pi / 180.0
    frame.m = ModelState(
        latitude_deg=47.0 + north_m / metres,
        longitude_deg=8.0 + east_m / (metres * math.cos(math.radians(47.0 + north_m / metres))),
        altitude_m=altitude_m,
        v_north_mps=v_north_mps,
        v_east_mps=v_east_mps,
    )
    frame.true_psi = heading_deg
    return frame


def receivers(failed=(), powered=True):
    return radio.Receivers(lambda leaf: leaf in failed, lambda: powered)


def vor(obs_deg, frame, **kwargs):
    return receivers(**kwargs).nav(1, 110300, obs_deg, frame, FIELD)


def ils(frame, **kwargs):
    return receivers(**kwargs).nav(2, 111300, 0.0, frame, FIELD)


def test_the_vor_is_a_tenth_of_a_degree_to_the_north():
    reading = vor(0.0, frame_at())
    assert reading.identifier == "EMU"
    assert reading.bearing_deg == pytest.approx(358.0)  # north by a magnet that points 2 degrees east
    assert reading.distance_m == pytest.approx(math.hypot(ARC_OF_TENTH_M, 1000.0), abs=0.01)
    assert reading.speed_mps == pytest.approx(60.0)
    assert reading.time_s == pytest.approx(reading.distance_m / 60.0)


def test_a_station_abeam_comes_no_nearer():
    reading = vor(0.0, frame_at(v_north_mps=0.0, v_east_mps=60.0))
    assert reading.speed_mps == pytest.approx(0.0, abs=1e-6)
    assert reading.time_s == 0.0


@pytest.mark.parametrize(
    ("course", "to_from", "dots"),
    [
        (0.0, radio.TO, 0.0),
        (4.0, radio.TO, -1.0),  # the line comes in from the left: the needle is left
        (-4.0, radio.TO, 1.0),
        (20.0, radio.TO, -2.5),  # full scale
        (180.0, radio.FROM, 0.0),
        (184.0, radio.FROM, 1.0),  # the line that leads away at 184 runs right of 180, of who flies it
        (176.0, radio.FROM, -1.0),
    ],
)
def test_a_vors_needle_shows_where_the_selected_course_is(course, to_from, dots):
    reading = vor(course - STATION_DECLINATION, frame_at())
    assert reading.to_from == to_from
    assert reading.deviation_dots == pytest.approx(dots, abs=1e-6)


def test_on_the_glide_path_both_needles_are_centred():
    # 10,000 m before the threshold: 10,300 m before the touch-down point, 3 degrees up
    reading = ils(frame_at(north_m=-10900.0, altitude_m=10300.0 * math.tan(math.radians(3.0))))
    assert reading.identifier == "IEMU"
    assert reading.deviation_dots == pytest.approx(0.0, abs=1e-6)
    assert reading.glideslope_dots == pytest.approx(0.0, abs=1e-3)
    assert not reading.glideslope_flag


def test_a_degree_right_of_the_centre_line_is_a_dot_to_the_left():
    # the localizer stands 300 m beyond the runway: 12,100 m ahead
    reading = ils(frame_at(north_m=-10900.0, east_m=12100.0 * math.tan(math.radians(1.0)), altitude_m=540.0))
    assert reading.deviation_dots == pytest.approx(-1.0, abs=5e-3)  # meridians converge by 0.002 degrees there


def test_half_a_degree_above_the_glide_path():
    reading = ils(frame_at(north_m=-10900.0, altitude_m=10300.0 * math.tan(math.radians(3.5))))
    assert reading.glideslope_dots == pytest.approx(0.5 / 0.28, abs=2e-3)


@pytest.mark.parametrize(
    "frame", [frame_at(north_m=5000.0), frame_at(north_m=-60000.0), frame_at(north_m=-3000.0, east_m=9000.0)]
)
def test_behind_too_far_or_aside_there_is_no_glide_path(frame):
    assert ils(frame).glideslope_flag


def test_a_glide_path_is_missed_where_the_station_has_one(bench):
    radios = "sim/cockpit2/radios/"
    shown = [f"{radios}indicators/nav1_flag_glideslope{way}" for way in ("", "_mech")]
    bench.write({radios + "actuators/nav1_frequency_hz": 11030.0})  # the VOR, from anywhere
    bench.step()
    assert bench.read(*shown) == [0.0, 1.0]


def test_out_of_range_another_frequency_a_failure_and_no_current_are_no_signal():
    none = radio.Reading()
    assert vor(0.0, frame_at(north_m=-250000.0)) == none
    assert receivers().nav(1, 113000, 0.0, frame_at(), FIELD) == none
    assert vor(0.0, frame_at(), failed={"rel_nav1"}) == none
    assert vor(0.0, frame_at(), powered=False) == none
    assert vor(0.0, frame_at(), failed={"rel_dme"}).has_dme is False
    assert vor(0.0, frame_at(), failed={"rel_nav2"}).to_from == radio.TO


def test_the_beacon_is_seen_from_the_nose():
    assert receivers().relative_bearing_deg(1, 375, frame_at(north_m=-5000.0, heading_deg=30.0), FIELD) == (
        pytest.approx(-30.0)
    )
    assert receivers().relative_bearing_deg(1, 400, frame_at(), FIELD) == 90.0


def test_the_gps_leads_along_the_runways_line():
    # 1 NM right of the line, 10 NM out: half a dot to the left
    reading = receivers().gps(frame_at(north_m=-18520.0, east_m=1852.0), FIELD)
    assert reading.distance_m == pytest.approx(math.hypot(18520.0, 1852.0), rel=1e-4)
    assert reading.deviation_dots == pytest.approx(-0.5, abs=2e-3)
    assert reading.course_deg == pytest.approx(358.0)
    assert reading.to_from == radio.TO
    assert receivers().gps(frame_at(north_m=100.0), FIELD).to_from == radio.FROM


def test_markers_are_heard_above_them():
    outer = frame_at(north_m=-900.0 - 7200.0, altitude_m=400.0)
    assert [receivers().marker(i, outer, FIELD) for i in range(3)] == [True, False, False]
    beside = frame_at(north_m=-900.0 - 7200.0 - 200.0, altitude_m=400.0)  # 160 m reach
    assert not receivers().marker(0, beside, FIELD)


# --- as a client sees it ---


@pytest.fixture(name="bench")
def fixture_bench():
    with EmulatorFixture(version="11") as emulator:
        emulator.step(2)
        yield emulator


def test_tuning_by_either_name_is_the_same_knob(bench):
    bench.write({ACTUATORS + "com1_frequency_hz_833": 132355.0})
    assert bench.read("sim/cockpit/radios/com1_freq_hz", ACTUATORS + "com1_frequency_hz") == [13235.0, 13235.0]
    bench.write({"sim/cockpit/radios/com1_freq_hz": 12190.0})
    assert bench.read(ACTUATORS + "com1_frequency_hz_833") == [121900.0]


def test_the_first_receiver_starts_on_the_vor_and_can_be_tuned_to_the_ils(bench):
    names = [f"{INDICATORS}nav1_nav_id[{i}]" for i in range(5)]
    assert bench.read(*names) == [69.0, 77.0, 85.0, 0.0, 0.0]  # E, M, U
    bench.write({ACTUATORS + "nav1_frequency_hz": 11130.0})
    bench.step(1)
    assert bench.read(*names) == [73.0, 69.0, 77.0, 85.0, 0.0]


def test_the_hsi_shows_what_is_selected(bench):
    hsi, nav = bench.read(INDICATORS + "hsi_bearing_deg_mag_pilot", INDICATORS + "nav1_bearing_deg_mag")
    assert hsi == nav
    bench.write({ACTUATORS + "HSI_source_select_pilot": 2.0})
    bench.step(1)
    hsi, gps = bench.read(INDICATORS + "hsi_bearing_deg_mag_pilot", INDICATORS + "gps_bearing_deg_mag")
    assert hsi == gps != nav


def test_a_blocked_tube_is_one_pilots_only(bench):
    throttle = "sim/flightmodel/engine/ENGN_thro_use"
    idle = {f"{throttle}[{i}]": 0.0 for i in range(2)}
    bench.write({FAILURES + "rel_pitot": 6.0, "sim/operation/override/override_throttles": 1.0, **idle})
    bench.step(400)
    pilot, copilot = bench.read(GAUGES + "airspeed_kts_pilot", GAUGES + "airspeed_kts_copilot")
    assert abs(pilot - copilot) > 5.0
    assert copilot == pytest.approx(bench.sim.model.state.calibrated_airspeed_mps * 3600 / 1852, abs=0.5)


def test_without_suction_the_gyros_stand_and_the_electric_horizon_does_not(bench):
    suction = GAUGES + "suction_1_ratio"
    assert bench.read(suction) == [1.0]
    bench.write({FAILURES + "rel_vacuum": 6.0})
    bench.step(2)
    standing = bench.read(GAUGES + "roll_vacuum_deg_pilot", GAUGES + "heading_vacuum_deg_mag_pilot")
    bench.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_roll_ratio": 0.5})
    bench.step(90)
    assert bench.read(GAUGES + "roll_vacuum_deg_pilot", GAUGES + "heading_vacuum_deg_mag_pilot") == standing
    electric, copilot = bench.read(GAUGES + "roll_electric_deg_pilot", GAUGES + "roll_vacuum_deg_copilot")
    assert electric == copilot
    assert abs(electric - standing[0]) > 10.0
    assert bench.read(suction) == [0.0]


def test_the_turn_needle_stands_at_its_mark_in_a_standard_turn(bench):
    bench.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_roll_ratio": 0.2})
    bench.step(120)
    (needle,) = bench.read(GAUGES + "turn_rate_heading_deg_pilot")
    m = bench.sim.model.state
    rate = (m.q_rad_s * math.sin(m.roll_rad) + m.r_rad_s * math.cos(m.roll_rad)) / math.cos(m.pitch_rad)
    assert needle == pytest.approx(math.degrees(rate) * 5.0, rel=0.02)  # a frame's turn later


def test_the_cockpits_clock_is_the_simulators(bench):
    zulu = bench.sim.clocks.zulu
    clock = bench.read(*(f"sim/cockpit2/clock_timer/zulu_time_{part}" for part in ("hours", "minutes", "seconds")))
    assert clock == [zulu // 3600, zulu // 60 % 60, float(int(zulu % 60))]
