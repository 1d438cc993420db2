"""The example controller's law between flights of its own: it follows while another source flies."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from xplane_bridge.cli.attitude_hold import AttitudeHold


def state(time, **changed):
    values = {
        "epoch": 1,
        "sim_time_unwrapped": time,
        "roll_deg": 0.0,
        "pitch_deg": 4.0,
        "heading_true_deg": 10.0,
        "altitude_msl": 900.0,
        "vertical_speed": 0.0,
        "calibrated_airspeed": 60.0,
        "control_pitch": 0.2,
        "control_throttle": 0.7,
        "angular_velocity": SimpleNamespace(x=0.0, y=0.0, z=0.0),
    }
    return SimpleNamespace(**{**values, **changed})


def test_engaged_after_a_minute_of_another_sources_flight_it_goes_on_from_what_was_flown():
    hold = AttitudeHold({})
    for k in range(600):
        hold.restart()  # not engaged; the aircraft climbs away from where it was
        hold.fly(state(0.1 * k, altitude_msl=500.0 + 2.0 * k, pitch_deg=15.0, control_pitch=-0.1))
    hold.restart()
    hold.fly(state(60.0, altitude_msl=1700.0))
    command = hold.fly(state(60.02, altitude_msl=1700.0))  # engaged; stick and throttle were at 0.2 and 0.7
    assert command["pitch"] == pytest.approx(0.2, abs=1e-9)
    assert command["throttle"] == pytest.approx(0.7, abs=1e-9)
    assert hold.targets["altitude"] == 1700.0
    assert hold.targets["speed"] == 60.0


def test_without_restarts_its_integrators_would_have_run_away():
    hold = AttitudeHold({})
    for k in range(600):
        hold.fly(state(0.1 * k, pitch_deg=15.0))
    assert abs(hold.fly(state(60.0))["pitch"] - 0.2) > 0.3


def test_what_was_wanted_stays_wanted():
    hold = AttitudeHold({"altitude": 1000.0, "speed": None})
    hold.fly(state(0.0))
    hold.restart()
    hold.fly(state(1.0, calibrated_airspeed=66.0))
    assert hold.targets["altitude"] == 1000.0
    assert hold.targets["speed"] == 66.0
