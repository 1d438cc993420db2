"""X-Plane's own autopilot: its modes by commands, and the twin flying by its dials."""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.flight.flight_model import InitialState

AP = "sim/cockpit2/autopilot/"
OVERRIDE = "sim/operation/override/override_"
RADIOS = "sim/cockpit2/radios/"
RATE = 60


@pytest.fixture(name="emulator")
def fixture_emulator():
    start = InitialState(heading_deg=40.0, altitude_m=1000.0)
    with EmulatorFixture(aircraft="fixed_wing", version="11.40", initial=start) as emulator:
        emulator.step()
        yield emulator


def press(emulator, *commands):
    client = emulator.client()
    for name in commands:
        client.send(protocol.CommandRequest(name if "/" in name else "sim/autopilot/" + name))
    emulator.step()


def dials(emulator, **values):
    emulator.write({AP + name: value for name, value in values.items()})
    emulator.step()


def shown(emulator, *names):
    return emulator.read(*(AP + name for name in names))


def fly(emulator, seconds):
    emulator.step(int(seconds * RATE))


def heading(emulator):
    return emulator.sim.frame.mag_psi


def test_heading_altitude_and_speed_are_captured(emulator):
    dials(emulator, heading_dial_deg_mag_pilot=90.0, altitude_dial_ft=3600.0, airspeed_dial_kts_mach=125.0)
    press(emulator, "servos_on", "heading", "vertical_speed", "altitude_arm", "autothrottle_on")
    dials(emulator, vvi_dial_fpm=600.0)
    assert shown(emulator, "heading_status", "vvi_status", "altitude_hold_armed") == [2.0, 2.0, 1.0]
    fly(emulator, 15)
    assert emulator.sim.frame.m.v_down_mps == pytest.approx(-3.05, abs=0.5), "600 ft/min"
    fly(emulator, 85)
    assert shown(emulator, "vvi_status", "altitude_hold_status", "altitude_hold_armed") == [0.0, 2.0, 0.0]
    assert heading(emulator) == pytest.approx(90.0, abs=0.5)
    assert emulator.sim.instruments.altitude_ft == pytest.approx(3600.0, abs=20.0)
    assert emulator.sim.instruments.airspeed_kt == pytest.approx(125.0, abs=3.0)
    assert abs(emulator.read("sim/joystick/servo_pitch_ratio")[0]) > 1e-3
    assert emulator.read("sim/joystick/yoke_pitch_ratio") == [0.0]


def test_speed_is_held_by_pitch(emulator):
    press(emulator, "servos_on", "level_change")
    dials(emulator, airspeed_dial_kts_mach=120.0)
    throttle = emulator.sim.controls.throttle[0]
    fly(emulator, 60)
    assert emulator.sim.instruments.airspeed_kt == pytest.approx(120.0, abs=3.0)
    assert emulator.sim.controls.throttle[0] == throttle


def test_modes_are_toggled_and_begin_with_level_wings(emulator):
    assert shown(emulator, "roll_status", "pitch_status", "servos_on") == [0.0, 0.0, 0.0]
    press(emulator, "servos_on")
    assert shown(emulator, "roll_status", "pitch_status", "servos_on") == [2.0, 2.0, 1.0]
    press(emulator, "heading")
    assert shown(emulator, "roll_status", "heading_status") == [0.0, 2.0]
    press(emulator, "heading")
    assert shown(emulator, "roll_status", "heading_status") == [2.0, 0.0]
    emulator.write({RADIOS + "actuators/nav1_obs_deg_mag_pilot": 90.0})  # the VOR's line is far away
    press(emulator, "NAV", "approach")
    assert shown(emulator, "nav_status", "approach_status", "glideslope_armed") == [1.0, 1.0, 1.0]
    press(emulator, "servos_off_any")
    assert shown(emulator, "flight_director_mode", "servos_on", "roll_status") == [1.0, 0.0, 2.0]
    press(emulator, "servos_fdir_off")
    assert shown(emulator, "flight_director_mode", "roll_status", "pitch_status", "nav_status") == [0.0] * 4


def tune(emulator, frequency_khz, course_true_deg):
    """Receiver 1, its course selector set to a true course. The receivers' alive a frame later."""
    course = (course_true_deg - emulator.sim.frame.declination) % 360.0
    emulator.write(
        {
            RADIOS + "actuators/nav1_frequency_hz": frequency_khz // 10,
            RADIOS + "actuators/nav1_obs_deg_mag_pilot": course,
        }
    )
    emulator.step()
    return course


def seconds_until(emulator, condition, most):
    for second in range(most):
        if condition():
            return second
        fly(emulator, 1)
    pytest.fail(f"not within {most} s of flight")


def needle(emulator, name="hdef"):
    return emulator.read(f"{RADIOS}indicators/nav1_{name}_dots_pilot")[0]


def test_an_ils_is_captured_and_flown_down(emulator):
    # 10 nautical miles before the runway of heading 40, then 1200 m to the left of its line, 30 degrees towards it.
    emulator.client().send(protocol.Placement(13, airport="XEMU"))
    emulator.step()
    state = emulator.sim.model.state
    per_metre = 180.0 / (math.pi * 6378145.0)
    course = math.radians(40.0)
    emulator.sim.model.place(
        latitude_deg=state.latitude_deg + 1200.0 * math.sin(course) * per_metre,
        longitude_deg=state.longitude_deg
        - 1200.0 * math.cos(course) * per_metre / math.cos(math.radians(state.latitude_deg)),
        altitude_m=state.altitude_m - 150.0,
    )
    tune(emulator, 111300, 40.0)
    altitude = emulator.sim.instruments.altitude_ft
    dials(
        emulator,
        heading_dial_deg_mag_pilot=(70.0 - emulator.sim.frame.declination) % 360.0,
        altitude_dial_ft=altitude,
        airspeed_dial_kts_mach=120.0,
    )
    press(emulator, "servos_on", "heading", "altitude_hold", "autothrottle_on", "approach")
    modes = ("heading_status", "approach_status", "altitude_hold_status", "glideslope_armed", "glideslope_status")
    assert needle(emulator) > 2.4
    assert shown(emulator, *modes) == [2.0, 1.0, 2.0, 1.0, 0.0]
    seconds_until(emulator, lambda: shown(emulator, "approach_status") == [2.0], 60)
    assert shown(emulator, *modes)[:3] == [0.0, 2.0, 2.0]
    seconds_until(emulator, lambda: shown(emulator, "glideslope_status") == [2.0], 120)
    assert shown(emulator, *modes) == [0.0, 2.0, 0.0, 0.0, 2.0]
    assert abs(emulator.sim.instruments.altitude_ft - altitude) < 60.0, "level until the path came"
    fly(emulator, 60)
    for _ in range(60):
        fly(emulator, 1)
        assert abs(needle(emulator)) < 0.2
        assert abs(needle(emulator, "vdef")) < 0.4
    m = emulator.sim.frame.m
    assert m.v_down_mps == pytest.approx(0.0524 * math.hypot(m.v_north_mps, m.v_east_mps), abs=0.6)


def test_a_radial_of_the_vor_is_captured_in_a_cross_wind(emulator):
    emulator.sim.settings.set_weather(Weather(270.0, 10.0))
    course = tune(emulator, 110300, 20.0)
    assert abs(needle(emulator)) == 2.5
    dials(emulator, heading_dial_deg_mag_pilot=(heading(emulator) - 60.0) % 360.0, airspeed_dial_kts_mach=130.0)
    press(emulator, "servos_on", "heading", "altitude_hold", "autothrottle_on", "NAV")
    assert shown(emulator, "heading_status", "nav_status") == [2.0, 1.0]
    seconds_until(emulator, lambda: shown(emulator, "nav_status") == [2.0], 240)
    assert shown(emulator, "heading_status") == [0.0]
    fly(emulator, 110)
    assert abs(needle(emulator)) < 0.03
    # Across the course of 20 degrees the wind from 270 has 9.4 m/s, for 70 m/s of airspeed: 7.7 degrees into it.
    assert math.remainder(heading(emulator) - course, 360.0) == pytest.approx(-7.7, abs=0.7)
    press(emulator, "heading")
    assert shown(emulator, "heading_status", "nav_status") == [2.0, 0.0]


def test_what_is_not_heard_any_more_is_let_go(emulator):
    tune(emulator, 110300, 0.0)
    press(emulator, "servos_on", "NAV")
    emulator.step()
    assert shown(emulator, "nav_status", "roll_status") == [2.0, 0.0]
    emulator.write({RADIOS + "actuators/nav1_frequency_hz": 10800.0})
    emulator.step(3)
    assert shown(emulator, "nav_status", "roll_status") == [0.0, 2.0]


def test_vertical_speed_begins_with_what_is_flown(emulator):
    dials(emulator, vvi_dial_fpm=2000.0)
    press(emulator, "vertical_speed")
    assert shown(emulator, "vvi_dial_fpm") == [0.0]


def test_a_mode_after_a_placement_takes_what_the_new_flight_has(emulator):
    fly(emulator, 1)
    emulator.sim.pause(True)
    emulator.client().send(protocol.Placement(6, latitude_deg=47.5, elevation_m=2500.0, speed_mps=80.0))
    press(emulator, "servos_on", "altitude_hold")
    (held,) = shown(emulator, "altitude_hold_ft")
    assert held == pytest.approx(2500.0 / 0.3048, abs=20.0)
    press(emulator, "level_change")
    assert shown(emulator, "airspeed_dial_kts_mach") == [round(emulator.sim.instruments.airspeed_kt)]


def test_captured_modes_have_x_planes_numbers(emulator):
    assert shown(emulator, "heading_mode", "altitude_mode") == [0.0, 0.0]
    press(emulator, "servos_on")
    assert shown(emulator, "heading_mode", "altitude_mode") == [0.0, 3.0]
    for command, number in (("vertical_speed", 4.0), ("level_change", 5.0), ("altitude_hold", 6.0)):
        press(emulator, command)
        assert shown(emulator, "altitude_mode") == [number]
    press(emulator, "heading", "approach")
    assert shown(emulator, "heading_mode", "altitude_mode") == [1.0, 6.0], "an armed line is not flown yet"
    tune(emulator, 110300, 0.0)
    press(emulator, "approach", "NAV")
    emulator.step()
    assert shown(emulator, "nav_status", "heading_mode") == [2.0, 2.0]


def test_it_moves_nothing_without_servos_and_where_a_client_has_the_axis(emulator):
    dials(emulator, heading_dial_deg_mag_pilot=(heading(emulator) + 90.0) % 360.0)
    press(emulator, "fdir_on", "heading")
    fly(emulator, 2)
    assert emulator.read("sim/joystick/servo_roll_ratio") == [0.0]
    emulator.write({OVERRIDE + "joystick_roll": 1.0})
    press(emulator, "servos_on")
    fly(emulator, 2)
    assert emulator.read("sim/joystick/servo_roll_ratio") == [0.0]
    assert abs(emulator.sim.frame.true_phi) < 2.0
    emulator.write({OVERRIDE + "joystick_roll": 0.0})
    fly(emulator, 2)
    assert emulator.sim.frame.true_phi > 5.0, "to the right"


def test_yaw_damper_takes_the_swing_out_of_a_kick(emulator):
    def swing():
        emulator.sim.model.place(pqr_rad_s=(0.0, 0.0, math.radians(6.0)))
        yaw = []
        for _ in range(4 * RATE):
            emulator.step()
            yaw.append(abs(emulator.sim.model.state.r_rad_s))
        return math.degrees(sum(yaw) / RATE)

    press(emulator, "servos_on")
    loose = swing()
    fly(emulator, 10)
    press(emulator, "sim/systems/yaw_damper_on")
    assert swing() < 0.8 * loose


def test_a_failed_autopilot_lets_go(emulator):
    dials(emulator, airspeed_dial_kts_mach=180.0)
    press(emulator, "servos_on", "heading", "autothrottle_on", "altitude_arm")
    emulator.write({"sim/operation/failures/rel_otto": 6.0})
    emulator.step(2)
    modes = ("flight_director_mode", "heading_status", "pitch_status", "altitude_hold_armed", "autothrottle_enabled")
    assert shown(emulator, *modes) == [0.0] * 5
    levers = list(emulator.sim.controls.throttle)
    press(emulator, "servos_on", "autothrottle_on")
    fly(emulator, 1)
    assert shown(emulator, *modes) == [0.0] * 5
    assert emulator.sim.controls.throttle == levers


def test_a_new_flight_begins_without_it(emulator):
    press(emulator, "servos_on", "heading")
    press(emulator, "sim/operation/reset_flight")
    assert shown(emulator, "flight_director_mode", "heading_status") == [0.0, 0.0]


def test_a_new_flight_begins_without_autothrottle(emulator):
    lever = "sim/cockpit2/engine/actuators/throttle_ratio"
    (trimmed,) = emulator.read(lever)
    dials(emulator, airspeed_dial_kts_mach=180.0)
    press(emulator, "autothrottle_on")
    fly(emulator, 20)
    assert emulator.read(lever)[0] > trimmed + 0.1
    press(emulator, "sim/operation/reset_flight")
    fly(emulator, 1)
    assert shown(emulator, "autothrottle_enabled") == [0.0]
    assert emulator.read(lever) == [trimmed]
    dials(emulator, airspeed_dial_kts_mach=emulator.sim.instruments.airspeed_kt)
    press(emulator, "autothrottle_on")
    fly(emulator, 1)
    assert emulator.read(lever) == pytest.approx([trimmed], abs=0.01)  # nothing of what it had integrated


def test_other_aircraft_have_none():
    with EmulatorFixture(aircraft="multirotor") as emulator:
        emulator.step()
        press(emulator, "servos_on", "heading", "sim/systems/yaw_damper_on")
        assert shown(emulator, "flight_director_mode", "heading_status") == [0.0, 0.0]
        assert emulator.read("sim/cockpit2/switches/yaw_damper_on") == [0.0]
