"""X-Plane's own autopilot: its modes by commands, and the twin flying by its dials."""

from __future__ import annotations

import math

import pytest

from support.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

AP = "sim/cockpit2/autopilot/"
OVERRIDE = "sim/operation/override/override_"
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
    press(emulator, "NAV", "approach")
    assert shown(emulator, "nav_status", "approach_status", "glideslope_armed") == [1.0, 1.0, 1.0]
    press(emulator, "servos_off_any")
    assert shown(emulator, "flight_director_mode", "servos_on", "roll_status") == [1.0, 0.0, 2.0]
    press(emulator, "servos_fdir_off")
    assert shown(emulator, "flight_director_mode", "roll_status", "pitch_status", "nav_status") == [0.0] * 4


def test_vertical_speed_begins_with_what_is_flown(emulator):
    dials(emulator, vvi_dial_fpm=2000.0)
    press(emulator, "vertical_speed")
    assert shown(emulator, "vvi_dial_fpm") == [0.0]


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
    press(emulator, "servos_on")
    emulator.write({"sim/operation/failures/rel_otto": 6.0})
    emulator.step(2)
    assert shown(emulator, "flight_director_mode") == [0.0]


def test_a_new_flight_begins_without_it(emulator):
    press(emulator, "servos_on", "heading")
    press(emulator, "sim/operation/reset_flight")
    assert shown(emulator, "flight_director_mode", "heading_status") == [0.0, 0.0]


def test_other_aircraft_have_none():
    with EmulatorFixture(aircraft="multirotor") as emulator:
        emulator.step()
        press(emulator, "servos_on", "heading", "sim/systems/yaw_damper_on")
        assert shown(emulator, "flight_director_mode", "heading_status") == [0.0, 0.0]
        assert emulator.read("sim/cockpit2/switches/yaw_damper_on") == [0.0]
