"""The emulator's quadrotor: hover under a position loop, gusts, motors on their own, stabilisation on and off."""

import math

import pytest

from support.flights.position_loop import PositionLoop
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import EngineFault, InitialState

FRAME = 1 / 60


def pilot_of(loop):
    """Lets a position loop move the model's controls."""

    def pilot(state, controls):
        sticks = loop.step(state, FRAME)
        controls.roll, controls.pitch, controls.yaw = sticks.roll, sticks.pitch, sticks.yaw
        controls.throttle = [sticks.throttle] * 8

    return pilot


@pytest.fixture(name="quad")
def fixture_quad():
    return create_model("multirotor", seed=11)


def fly(model, controls, seconds, pilot=None):
    for _ in range(round(seconds / FRAME)):
        if pilot:
            pilot(model.state, controls)
        model.step(FRAME, controls)
    return model.state


@pytest.mark.parametrize("wind", [(0.0, 0.0), (-4.0, 3.0)])
def test_hovers_60_s_within_a_metre(quad, wind):
    quad.set_wind(*wind)
    controls = quad.reset(InitialState(altitude_m=120.0, heading_deg=70.0))
    loop = PositionLoop(quad.state, controls.throttle[0], math.radians(70.0))
    quad.set_turbulence(0.5)
    farthest = 0.0
    for _ in range(60 * 60):
        state = fly(quad, controls, FRAME, pilot_of(loop))
        farthest = max(farthest, loop.distance(state))
    assert farthest < 1.0
    assert math.degrees(state.heading_rad) == pytest.approx(70.0, abs=2.0)


def test_survives_gusts_of_5_m_per_s(quad):
    """Sudden gusts from changing sides, two seconds each: it tilts, gives way by less than 3 m, and comes back."""
    controls = quad.reset(InitialState(altitude_m=120.0))
    loop = PositionLoop(quad.state, controls.throttle[0], 0.0)
    fly(quad, controls, 2.0, pilot_of(loop))
    farthest = steepest = 0.0
    for gust in ((5.0, 0.0), (-5.0, 0.0), (0.0, 5.0), (3.5, -3.5), (0.0, 0.0, 5.0), (0.0, 0.0, -5.0)):
        quad.set_wind(*gust)
        for _ in range(120):
            state = fly(quad, controls, FRAME, pilot_of(loop))
            farthest = max(farthest, loop.distance(state))
            steepest = max(steepest, abs(state.roll_rad), abs(state.pitch_rad))
    quad.set_wind(0.0, 0.0)
    state = fly(quad, controls, 8.0, pilot_of(loop))
    assert farthest < 3.0
    assert math.radians(3.0) < steepest < math.radians(45.0)
    assert loop.distance(state) < 0.3


def test_trimmed_hover_stands_still_hands_off(quad):
    controls = quad.reset(InitialState(altitude_m=50.0))
    start = quad.state.copy()
    state = fly(quad, controls, 10.0)
    assert state.altitude_m == pytest.approx(start.altitude_m, abs=0.05)
    assert math.hypot(state.v_north_mps, state.v_east_mps) < 0.01
    # weight over four rotors
    assert state.engines[0].thrust_n == pytest.approx(0.907 * 9.80665 / 4, rel=1e-3)
    # a rotor of this size hovers with a figure of merit of 0.5 to 0.8
    ideal_w = state.engines[0].thrust_n ** 1.5 / math.sqrt(2 * 1.22 * math.pi * 0.11**2)
    assert 0.5 < ideal_w / state.engines[0].power_w < 0.8


def test_stick_commands_attitude_and_yaw_rate(quad):
    controls = quad.reset(InitialState(altitude_m=100.0))
    controls.roll, controls.pitch = 0.5, -0.25
    state = fly(quad, controls, 1.5)
    assert math.degrees(state.roll_rad) == pytest.approx(15.0, abs=0.5)
    assert math.degrees(state.pitch_rad) == pytest.approx(-7.5, abs=0.5)
    assert state.v_east_mps > 1.0  # heading north, banked right
    assert state.v_north_mps > 0.5  # nose down
    controls = quad.reset(InitialState(altitude_m=100.0))
    controls.yaw = 0.5
    state = fly(quad, controls, 3.0)
    assert math.degrees(state.r_rad_s) == pytest.approx(50.0, abs=3.0)


@pytest.mark.parametrize(
    ("motors", "axis", "sign"),
    [
        ((1, 2), "p_rad_s", 1),  # left ones: rolls right
        ((0, 2), "q_rad_s", 1),  # front ones: nose up
        ((0, 1), "r_rad_s", 1),  # the anticlockwise ones: nose right
    ],
)
def test_motors_obey_direct_commands_alone(quad, motors, axis, sign):
    controls = quad.reset(InitialState(altitude_m=100.0))
    hover = controls.throttle[0]
    controls.override_throttles = True
    controls.throttle_use = [hover] * 8
    controls.roll = 1.0  # must do nothing now
    for motor in motors:
        controls.throttle_use[motor] = hover + 0.03
    state = fly(quad, controls, 0.25)
    rates = {name: getattr(state, name) for name in ("p_rad_s", "q_rad_s", "r_rad_s")}
    assert sign * rates[axis] > 0.1
    assert all(abs(rate) < 0.2 * abs(rates[axis]) for name, rate in rates.items() if name != axis)
    assert [round(engine.throttle, 6) for engine in state.engines] == [
        round(controls.throttle_use[i], 6) for i in range(4)
    ]


def test_rotors_need_time_to_spin_up(quad):
    controls = quad.reset(InitialState(altitude_m=100.0))
    before = quad.state.engines[0].rpm
    controls.override_throttles = True
    controls.throttle_use = [0.5] * 8
    final = 900.0 * math.sqrt(0.5) * 30 / math.pi
    share = (fly(quad, controls, 0.05).engines[0].rpm - before) / (final - before)
    assert share == pytest.approx(1.0 - math.exp(-0.05 / 0.035), abs=0.04)  # a first-order lag of 35 ms
    assert fly(quad, controls, 0.5).engines[0].rpm == pytest.approx(final, rel=0.01)


def test_without_artificial_stability_it_is_as_unstable_as_it_really_is(quad):
    """The classic growing oscillation of hover: the rotors' damping alone does not hold it."""
    for stable in (True, False):
        controls = quad.reset(InitialState(altitude_m=100.0))
        quad.place(roll_rad=math.radians(10.0))
        controls.artificial_stability = stable
        fly(quad, controls, 1.0)
        largest = 0.0
        for _ in range(5 * 60):
            largest = max(largest, abs(math.degrees(fly(quad, controls, FRAME).roll_rad)))
        assert (largest < 0.5) if stable else (largest > 20.0)


def test_a_dead_motor_brings_it_down(quad):
    controls = quad.reset(InitialState(altitude_m=30.0))
    loop = PositionLoop(quad.state, controls.throttle[0], 0.0)
    controls.engine_faults[3] = EngineFault.STOPPED
    state = fly(quad, controls, 6.0, pilot_of(loop))
    assert not state.engines[3].running
    assert state.agl_m < 1.0
    assert state.crashed


def test_stands_lifts_off_and_lands(quad):
    controls = quad.reset(InitialState(on_ground=True))
    assert quad.state.on_ground_all
    loop = PositionLoop(quad.state, 0.394, 0.0)
    loop.climb(2.0)
    state = fly(quad, controls, 8.0, pilot_of(loop))
    assert state.agl_m == pytest.approx(2.05, abs=0.2)
    for _ in range(60 * 10):
        loop.climb(-0.5 * FRAME)
        state = fly(quad, controls, FRAME, pilot_of(loop))
        if state.on_ground_all:
            break
    controls.throttle = [0.0] * 8
    state = fly(quad, controls, 2.0)
    assert state.on_ground_all
    assert not state.crashed
    assert abs(math.degrees(state.roll_rad)) < 1.0
