"""The emulator's tiltrotor: hover, conversion to cruise and back, and what its controls do in each."""

import math

import pytest

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import (
    EngineFault,
    FlightModelError,
    InitialState,
    SurfaceFault,
    SurfaceFaultKind,
)

RADIUS = 6378145.0
FRAME = 1 / 60
HOVER = 0.9


@pytest.fixture(name="tiltrotor")
def fixture_tiltrotor():
    return create_model("tiltrotor", seed=2)


def fly(model, controls, seconds, pilot=None):
    for _ in range(round(seconds / FRAME)):
        if pilot:
            pilot(model.state, controls)
        model.step(FRAME, controls)
    return model.state


def limited(value, low=-1.0, high=1.0):
    return max(min(value, high), low)


class Pilot:
    """Holds height, heading and speed with stick, throttle and nacelles."""

    def __init__(self, state, throttle, speed_mps):
        self.altitude, self.heading, self.speed = state.altitude_m, state.heading_rad, speed_mps
        self.throttle, self.pitch = throttle, math.degrees(state.pitch_rad)
        self.sum_speed = self.sum_up = 0.0

    def __call__(self, state, controls):
        upright = limited((state.thrust_vector_ratio - 0.2) / 0.5, 0.0, 1.0)
        ahead = state.v_north_mps * math.cos(self.heading) + state.v_east_mps * math.sin(self.heading)
        right = -state.v_north_mps * math.sin(self.heading) + state.v_east_mps * math.cos(self.heading)
        up, climb = self.altitude - state.altitude_m, -state.v_down_mps
        off_speed = self.speed - ahead
        # Nacelles follow the speed that is wanted, but not further than the speed that is there allows.
        wing = limited((min(self.speed, ahead + 18.0) - 12.0) / 50.0, 0.0, 1.0)
        controls.thrust_vector = HOVER * (1.0 - wing * wing)
        self.sum_up = limited(self.sum_up + limited(up, -3, 3) * FRAME, -30, 30)
        self.sum_speed = limited(self.sum_speed + limited(off_speed, -3, 3) * FRAME, -30, 30)
        # Upright: thrust holds height, attitude the speed. On the wing: attitude holds height, thrust the speed.
        thrust = upright * (0.06 * up - 0.06 * climb + 0.015 * self.sum_up)
        thrust += (1.0 - upright) * (0.02 * off_speed + 0.002 * self.sum_speed)
        level = self.throttle * upright + 0.68 * (1.0 - upright)
        controls.throttle = [limited(level + thrust, 0.0, 1.0)] * 8
        pitch = upright * limited(-2.0 * off_speed - 0.15 * self.sum_speed, -8.0, 12.0)
        pitch += (1.0 - upright) * (5.0 + limited(1.2 * up - 2.0 * climb + 0.3 * self.sum_up, -10.0, 10.0))
        controls.pitch = limited((self.pitch + pitch) / 25.0)
        bank = -2.5 * right if upright > 0.5 else 60.0 * math.remainder(self.heading - state.heading_rad, 2 * math.pi)
        controls.roll = limited(bank, -15.0, 15.0) / 45.0
        controls.yaw = (
            limited(2.0 * math.remainder(self.heading - state.heading_rad, 2 * math.pi)) if upright > 0.5 else 0.0
        )
        controls.gear_down = upright > 0.9


def test_hovers_a_minute_over_its_spot(tiltrotor):
    controls = tiltrotor.reset(InitialState(altitude_m=300.0, heading_deg=40.0))
    start = tiltrotor.state.copy()
    assert start.thrust_vector_ratio == pytest.approx(HOVER)
    assert [engine.nacelle_deg for engine in start.engines] == pytest.approx([90.0, 90.0])
    assert 2 * start.engines[0].thrust_n == pytest.approx(1000.0 * 9.80665, rel=0.01)
    pilot = Pilot(start, controls.throttle[0], 0.0)
    tiltrotor.set_turbulence(0.7)
    farthest = 0.0
    for _ in range(60 * 60):
        state = fly(tiltrotor, controls, FRAME, pilot)
        farthest = max(farthest, abs(state.altitude_m - 300.0))
    assert farthest < 2.0
    assert math.hypot(state.v_north_mps, state.v_east_mps) < 2.0
    assert math.degrees(state.heading_rad) == pytest.approx(40.0, abs=3.0)


def test_converts_to_cruise_losing_less_than_30_m_and_back(tiltrotor):
    controls = tiltrotor.reset(InitialState(altitude_m=300.0))
    pilot = Pilot(tiltrotor.state, controls.throttle[0], 0.0)
    fly(tiltrotor, controls, 3.0, pilot)
    lowest = highest = 300.0

    def watch(seconds):
        nonlocal lowest, highest
        for _ in range(round(seconds / FRAME)):
            state = fly(tiltrotor, controls, FRAME, pilot)
            lowest, highest = min(lowest, state.altitude_m), max(highest, state.altitude_m)
            assert abs(math.degrees(state.roll_rad)) < 20.0
        return state

    for _ in range(30 * 60):  # speeds up by 3 m/s a second
        pilot.speed = min(pilot.speed + 3.0 * FRAME, 85.0)
        state = watch(FRAME)
    state = watch(30.0)
    assert state.thrust_vector_ratio == pytest.approx(0.0, abs=1e-9)
    assert state.true_airspeed_mps == pytest.approx(85.0, abs=3.0)
    assert state.lift_n > 0.9 * state.mass_kg * 9.81  # flies on the wing
    assert lowest > 270.0
    assert highest < 340.0
    assert abs(state.altitude_m - 300.0) < 10.0

    for _ in range(50 * 60):  # slows down by 2 m/s a second
        pilot.speed = max(pilot.speed - 2.0 * FRAME, 0.0)
        state = watch(FRAME)
    state = watch(30.0)
    assert state.thrust_vector_ratio == pytest.approx(HOVER, abs=0.01)
    assert math.hypot(state.v_north_mps, state.v_east_mps) < 1.0
    assert lowest > 270.0
    assert highest < 340.0


@pytest.mark.parametrize("speed", [0.0, 10.0, 30.0, 45.0, 60.0, 90.0])
def test_starts_trimmed_at_any_speed(tiltrotor, speed):
    controls = tiltrotor.reset(InitialState(altitude_m=500.0, airspeed_mps=speed, heading_deg=200.0))
    state = fly(tiltrotor, controls, 10.0)
    assert state.altitude_m == pytest.approx(500.0, abs=0.6)
    assert state.true_airspeed_mps == pytest.approx(speed, abs=0.15)
    assert abs(math.degrees(state.roll_rad)) < 0.5


def test_climb_is_damped_upright(tiltrotor):
    """The rotors' own damping: more thrust ends in a steady climb, not in an ever faster one."""
    controls = tiltrotor.reset(InitialState(altitude_m=500.0))
    controls.throttle = [controls.throttle[0] + 0.05] * 8
    early = -fly(tiltrotor, controls, 15.0).v_down_mps
    late = -fly(tiltrotor, controls, 15.0).v_down_mps
    assert 1.0 < early < 8.0
    assert late == pytest.approx(early, rel=0.1)


def test_nacelles_turn_at_their_pace_and_beyond_upright(tiltrotor):
    controls = tiltrotor.reset(InitialState(altitude_m=500.0))
    controls.thrust_vector = 1.0
    state = fly(tiltrotor, controls, 1.0)
    assert state.engines[0].nacelle_deg == pytest.approx(98.0, abs=0.2)  # 8 deg/s
    state = fly(tiltrotor, controls, 3.0)
    assert state.engines[0].nacelle_deg == pytest.approx(100.0)
    assert state.v_north_mps < -1.0  # thrust aft of upright pushes back


@pytest.mark.parametrize("speed", [0.0, 90.0])
def test_stick_and_pedals_have_the_right_signs_upright_and_forward(tiltrotor, speed):
    for name, axis in (("roll", "p_rad_s"), ("pitch", "q_rad_s"), ("yaw", "r_rad_s")):
        for stable in (True, False):
            controls = tiltrotor.reset(InitialState(altitude_m=500.0, airspeed_mps=speed))
            if not stable:
                # without stabilisation the stick is the command: start from what held the trim
                state = tiltrotor.state
                controls.roll, controls.pitch, controls.yaw = state.roll_ratio, state.pitch_ratio, state.yaw_ratio
                controls.artificial_stability = False
            setattr(controls, name, getattr(controls, name) + 0.3)
            assert getattr(fly(tiltrotor, controls, 0.5), axis) > 0.02


def test_one_engine_drives_both_rotors_and_none_lets_them_slow_down(tiltrotor):
    controls = tiltrotor.reset(InitialState(altitude_m=500.0))
    controls.engine_faults[0] = EngineFault.STOPPED
    state = fly(tiltrotor, controls, 3.0)
    assert [engine.running for engine in state.engines] == [False, True]
    assert state.engines[0].rpm == pytest.approx(state.engines[1].rpm)
    assert state.engines[0].rpm > 1350.0  # 215 kW of the 260 kW left
    assert abs(math.degrees(state.roll_rad)) < 1.0
    controls.engine_faults[1] = EngineFault.STOPPED
    state = fly(tiltrotor, controls, 2.0)
    assert state.engines[0].rpm < 1100.0
    assert state.v_down_mps > 3.0


def test_stuck_flaperon_is_carried_by_the_stabilisation(tiltrotor):
    controls = tiltrotor.reset(InitialState(altitude_m=800.0, airspeed_mps=90.0))
    controls.surface_faults = {"wing1l_ail1": SurfaceFault(SurfaceFaultKind.STUCK, 5.0)}
    state = fly(tiltrotor, controls, 10.0)
    assert abs(math.degrees(state.roll_rad)) < 3.0
    assert state.surfaces_deg["wing1r_ail1"] == pytest.approx(5.0, abs=1.0)


def test_stands_lifts_off_and_lands(tiltrotor):
    controls = tiltrotor.reset(InitialState(on_ground=True))
    assert tiltrotor.state.on_ground_all
    assert tiltrotor.state.engines[0].rpm == pytest.approx(1432.0, rel=0.01)
    pilot = Pilot(tiltrotor.state, 0.7, 0.0)
    pilot.altitude += 5.0
    assert fly(tiltrotor, controls, 20.0, pilot).agl_m == pytest.approx(5.9, abs=0.7)
    for _ in range(25 * 60):
        pilot.altitude -= 0.4 * FRAME
        state = fly(tiltrotor, controls, FRAME, pilot)
        if state.on_ground_any:
            break
    controls.throttle = [0.0] * 8
    controls.pitch = controls.roll = controls.yaw = 0.0
    state = fly(tiltrotor, controls, 5.0)
    assert state.on_ground_all
    assert not state.crashed


def test_too_fast_a_start_is_refused(tiltrotor):
    with pytest.raises(FlightModelError, match=r"150\.0? m/s: .*0\.\.120"):
        tiltrotor.reset(InitialState(airspeed_mps=150.0))
