"""The emulator's light twin: trim, authority, failures, stall, engines, ground."""

import math

import pytest

from xplane_bridge import compiled
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import EngineFault, InitialState, SurfaceFault, SurfaceFaultKind

KNOT = 1852 / 3600
FRAME = 1 / 60


@pytest.fixture(name="twin")
def fixture_twin():
    return create_model("fixed_wing")


def fly(model, controls, seconds, pilot=None):
    """Flies on; ``pilot(state, controls)`` moves the stick before each frame. Returns the state."""
    for _ in range(round(seconds / FRAME)):
        if pilot:
            pilot(model.state, controls)
        model.step(FRAME, controls)
    return model.state


def level_wings(state, controls):
    """A pilot that holds wings level with the stick alone."""
    level_wings.sum += state.roll_rad * FRAME
    stick = -3.0 * state.roll_rad - 0.8 * state.p_rad_s - 0.5 * level_wings.sum
    controls.roll = min(max(stick, -1.0), 1.0)


@pytest.mark.parametrize(("speed", "altitude", "fuel"), [(75.0, 1000.0, (100, 100)), (55.0, 3000.0, (120, 60))])
def test_trims_and_stays_hands_off(twin, speed, altitude, fuel):
    """90 s within 5 m and 2 kt; with 60 kg more fuel on the left as well."""
    twin.set_loading(fuel_kg=fuel)
    controls = twin.reset(InitialState(altitude_m=altitude, airspeed_mps=speed, heading_deg=250.0))
    assert twin.state.true_airspeed_mps == pytest.approx(speed, abs=1e-3)
    highest = fastest = 0.0
    for _ in range(90 * 60):
        state = twin.step(FRAME, controls)
        highest = max(highest, abs(state.altitude_m - altitude))
        fastest = max(fastest, abs(state.true_airspeed_mps - speed))
    assert highest < 5.0
    assert fastest < 2.0 * KNOT
    assert abs(math.degrees(state.roll_rad)) < 3.0


def test_trims_in_wind_without_drifting_off(twin):
    twin.set_wind(-8.0, 5.0)
    controls = twin.reset(InitialState(heading_deg=90.0))
    state = fly(twin, controls, 20.0)
    assert state.altitude_m == pytest.approx(1000.0, abs=2.0)
    assert state.true_airspeed_mps == pytest.approx(75.0, abs=0.5)
    assert state.v_east_mps == pytest.approx(80.0, abs=0.6)
    assert state.v_north_mps == pytest.approx(-8.0, abs=1.0)


def test_left_aileron_stuck_at_5_rolls_to_30_in_about_5_s(twin):
    controls = twin.reset(InitialState())
    controls.surface_faults = {"wing2l_ail1": SurfaceFault(SurfaceFaultKind.STUCK, 5.0)}
    while twin.state.roll_rad < math.radians(30.0):
        twin.step(FRAME, controls)
        assert twin.state.sim_time_s < 10.0
    assert 4.0 < twin.state.sim_time_s < 6.0
    assert twin.state.surfaces_deg["wing2l_ail1"] == pytest.approx(5.0)
    assert twin.state.surfaces_deg["wing2r_ail1"] == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(("angle", "holds"), [(5.0, True), (10.0, True), (20.0, False), (-10.0, True)])
def test_stick_holds_wings_level_against_a_stuck_aileron(twin, angle, holds):
    controls = twin.reset(InitialState())
    controls.surface_faults = {"wing2l_ail1": SurfaceFault(SurfaceFaultKind.STUCK, angle)}
    level_wings.sum = 0.0
    state = fly(twin, controls, 20.0, level_wings)
    assert (abs(math.degrees(state.roll_rad)) < 3.0) is holds
    if not holds:
        assert abs(math.degrees(state.roll_rad)) > 45.0


def test_stall_drops_wing_and_nose_and_recovers(twin):
    controls = twin.reset(InitialState(airspeed_mps=50.0, altitude_m=1500.0))
    controls.throttle[0] = controls.throttle[1] = 0.0

    def slow_down(state, controls):
        climb = -state.v_down_mps / max(state.true_airspeed_mps, 1.0)
        controls.pitch = min(controls.pitch - 0.04 * climb - 0.02 * state.q_rad_s + 0.0015, 1.0)

    warned_at = None
    while math.degrees(twin.state.alpha_rad) < 15.8:
        fly(twin, controls, FRAME, slow_down)
        if warned_at is None and twin.state.stall_warning:
            warned_at = twin.state.calibrated_airspeed_mps
        assert twin.state.sim_time_s < 40.0
    at_break = twin.state.copy()
    assert at_break.calibrated_airspeed_mps == pytest.approx(twin.info.stall_mps, rel=0.05)
    assert warned_at > at_break.calibrated_airspeed_mps + 1.0
    lift_at_break = at_break.lift_n

    worst_roll, lowest_pitch, least_lift = 0.0, at_break.pitch_rad, lift_at_break
    for _ in range(round(4.0 / FRAME)):  # stick held: the aircraft goes by itself
        state = twin.step(FRAME, controls)
        worst_roll = max(worst_roll, abs(state.roll_rad))
        lowest_pitch = min(lowest_pitch, state.pitch_rad)
        least_lift = min(least_lift, state.lift_n)
    assert math.degrees(worst_roll) > 20.0
    assert math.degrees(at_break.pitch_rad - lowest_pitch) > 5.0
    assert least_lift < 0.95 * lift_at_break

    def recover(state, controls):
        controls.pitch, controls.roll, controls.yaw = -0.1, 0.0, max(min(-2.0 * state.r_rad_s, 1.0), -1.0)

    fly(twin, controls, 2.0, recover)

    def pull_out(state, controls):
        controls.throttle[0] = controls.throttle[1] = 0.7
        controls.pitch = 0.6 * (0.05 - state.pitch_rad) - 0.3 * state.q_rad_s
        controls.roll = max(min(-2.0 * state.roll_rad - 0.5 * state.p_rad_s, 1.0), -1.0)
        controls.yaw = 0.0

    state = fly(twin, controls, 12.0, pull_out)
    assert not state.stall_warning
    assert abs(math.degrees(state.roll_rad)) < 5.0
    assert state.v_down_mps < 0.5
    assert 20.0 < at_break.altitude_m - state.altitude_m < 250.0


def test_stick_and_pedals_have_the_right_signs(twin):
    for name, axis, sign in (("roll", "p_rad_s", 1), ("pitch", "q_rad_s", 1), ("yaw", "r_rad_s", 1)):
        controls = twin.reset(InitialState())
        setattr(controls, name, 0.3)
        state = fly(twin, controls, 0.4)
        assert sign * getattr(state, axis) > 0.02
        surfaces = state.surfaces_deg
        if name == "roll":  # left down, right up, by their different stops: 0.3 of 15 and of 25
            assert (surfaces["wing2l_ail1"], surfaces["wing2r_ail1"]) == pytest.approx((4.5, -7.5), abs=0.01)
        elif name == "pitch":  # 0.3 of 18, trailing edge up
            assert surfaces["hstab1_elv1"] == surfaces["hstab2_elv1"] == pytest.approx(-5.4, abs=0.1)
        else:
            assert surfaces["vstab1_rud1"] == pytest.approx(8.1, abs=0.01)


def test_every_surface_is_driven_alone_under_override(twin):
    controls = twin.reset(InitialState())
    twin.step(FRAME, controls)
    before = dict(twin.state.surfaces_deg)
    controls.override_surfaces = True
    controls.roll = 1.0  # must do nothing now
    for spec in twin.surfaces:
        controls.surface_deg = {spec.name: 3.25}
        after = twin.step(FRAME, controls).surfaces_deg
        assert after[spec.name] == 3.25
        before[spec.name] = 3.25
        assert after == before  # the others stay where they were
    controls.override_surfaces = False
    after = twin.step(FRAME, controls).surfaces_deg
    assert after["wing2l_ail1"] > 3.25


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (SurfaceFault(SurfaceFaultKind.STUCK), 4.5),  # where it was when it broke
        (SurfaceFault(SurfaceFaultKind.CENTRED), 0.0),
        (SurfaceFault(SurfaceFaultKind.HARD_OVER_UP), -25.0),
        (SurfaceFault(SurfaceFaultKind.HARD_OVER_DOWN), 15.0),
        (SurfaceFault(SurfaceFaultKind.GONE), 0.0),
        (SurfaceFault(SurfaceFaultKind.REDUCED, 0.5), -12.5),  # moves as commanded
        (SurfaceFault(SurfaceFaultKind.SLOW, 0.1), 1.0),  # 4.5 deg less 7 deg/s for half a second
    ],
)
def test_surface_faults_as_seen_and_felt(twin, fault, expected):
    controls = twin.reset(InitialState())
    controls.roll = 0.3
    fly(twin, controls, 0.5)
    controls.surface_faults = {"wing2l_ail1": fault}
    controls.roll = -0.5
    state = fly(twin, controls, 0.5)
    assert state.surfaces_deg["wing2l_ail1"] == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (SurfaceFaultKind.HARD_OVER_UP, 60.0),  # open
        (SurfaceFaultKind.HARD_OVER_DOWN, 0.0),
    ],
)
@pytest.mark.parametrize("in_cpp", [True, False])
def test_the_upper_end_of_a_speed_brake_is_where_it_is_open(monkeypatch, in_cpp, kind, expected):
    if not in_cpp:
        monkeypatch.setattr(compiled, "core", None)
    model = create_model("fixed_wing")
    controls = model.reset(InitialState())
    controls.speedbrake = 0.5
    controls.surface_faults = {"wing1l_spo1": SurfaceFault(kind)}
    surfaces = fly(model, controls, 1.5).surfaces_deg
    assert surfaces["wing1l_spo1"] == pytest.approx(expected)
    assert surfaces["wing1r_spo1"] == pytest.approx(30.0)


def test_a_floating_speed_brake_is_lifted_by_the_angle_of_attack(twin):
    controls = twin.reset(InitialState(airspeed_mps=60.0))
    controls.surface_faults = {"wing1l_spo1": SurfaceFault(SurfaceFaultKind.FLOATING)}
    state = fly(twin, controls, 0.5)
    assert state.surfaces_deg["wing1l_spo1"] == pytest.approx(math.degrees(state.alpha_rad) / 2, abs=0.1)
    assert state.alpha_rad > 0.0


def test_reduced_and_lost_effect_are_felt(twin):
    def roll_rate(fault):
        controls = twin.reset(InitialState())
        controls.roll = 0.5
        if fault:
            controls.surface_faults = {"wing2r_ail1": fault}
        return fly(twin, controls, 1.0).p_rad_s

    whole, half, none = (
        roll_rate(fault)
        for fault in (None, SurfaceFault(SurfaceFaultKind.REDUCED, 0.5), SurfaceFault(SurfaceFaultKind.GONE))
    )
    # 0.5 of stick: left 7.5 down, right 12.5 up: (7.5 + 12.5), (7.5 + 6.25), 7.5
    assert half / whole == pytest.approx(13.75 / 20.0, rel=0.05)
    assert none / whole == pytest.approx(7.5 / 20.0, rel=0.07)


def test_engine_failure_yaws_and_rolls_towards_it(twin):
    controls = twin.reset(InitialState())
    controls.engine_faults[0] = EngineFault.STOPPED
    state = fly(twin, controls, 4.0)
    assert not state.engines[0].running
    assert state.engines[0].thrust_n < 0.0 < state.engines[1].thrust_n
    assert state.engines[0].fuel_flow_kg_s == 0.0
    assert state.beta_rad > math.radians(1.0)
    assert state.roll_rad < math.radians(-5.0)
    controls.engine_faults[1] = EngineFault.SEIZED
    state = fly(twin, controls, 1.0)
    assert state.engines[1].rpm == 0.0


def test_a_repaired_engine_that_windmills_fires_again(twin):
    controls = twin.reset(InitialState())
    thrust = twin.state.engines[0].thrust_n
    controls.engine_faults[0] = EngineFault.STOPPED
    assert not fly(twin, controls, 2.0).engines[0].running
    controls.engine_faults[0] = EngineFault.NONE
    state = fly(twin, controls, 5.0)
    assert state.engines[0].running
    assert state.engines[0].thrust_n == pytest.approx(thrust, rel=0.2)


def test_an_engine_that_is_switched_off_only_windmills(twin):
    controls = twin.reset(InitialState())
    twin.set_engine_running(1, False)
    state = fly(twin, controls, 2.0)
    assert state.engines[1].rpm > 500.0
    assert [engine.running for engine in state.engines] == [True, False]


def test_a_repaired_engine_that_stands_still_stays_off(twin):
    controls = twin.reset(InitialState(on_ground=True))
    controls.engine_faults[0] = EngineFault.SEIZED
    assert fly(twin, controls, 1.0).engines[0].rpm == 0.0
    controls.engine_faults[0] = EngineFault.NONE
    state = fly(twin, controls, 2.0)
    assert [engine.running for engine in state.engines] == [False, True]


def test_propeller_governor_holds_speed(twin):
    controls = twin.reset(InitialState())
    for lever, rpm in ((0.75, 2375.0), (1.0, 2700.0), (0.6, 2180.0)):
        controls.propeller[0] = controls.propeller[1] = lever
        assert fly(twin, controls, 8.0).engines[0].rpm == pytest.approx(rpm, abs=5.0)
    assert 0.35 < twin.state.engines[0].power_w / 134.2e3 < 0.75


def test_fuel_burns_and_lightens(twin):
    controls = twin.reset(InitialState())
    before = twin.state.copy()
    state = fly(twin, controls, 60.0)
    burnt = sum(before.fuel_kg) - sum(state.fuel_kg)
    assert burnt == pytest.approx(60.0 * 2 * before.engines[0].fuel_flow_kg_s, rel=0.02)
    assert before.mass_kg - state.mass_kg == pytest.approx(burnt, abs=0.02)
    # 0.274 kg/kWh of shaft power, and what friction (a tenth to a fifth of the power) and a rich mixture take more
    per_kwh = before.engines[0].fuel_flow_kg_s * 3600 / (before.engines[0].power_w / 1000)
    assert 0.27 < per_kwh < 0.40


def test_takes_off_and_gear_retracts(twin):
    controls = twin.reset(InitialState(on_ground=True, heading_deg=180.0))
    controls.parking_brake = 0.0
    controls.throttle[0] = controls.throttle[1] = 1.0

    def pilot(state, controls):
        error = math.remainder(math.pi - state.heading_rad, 2 * math.pi)
        controls.yaw = max(min(4.0 * error - 2.0 * state.r_rad_s, 1.0), -1.0)
        wanted = 0.14 if state.calibrated_airspeed_mps > 40.0 else 0.0
        controls.pitch = max(min(2.0 * (wanted - state.pitch_rad) - 1.0 * state.q_rad_s + 0.1, 1.0), -1.0)
        controls.roll = max(min(-2.0 * state.roll_rad, 1.0), -1.0)
        controls.gear_down = state.agl_m < 15.0

    rolled_off = None
    for _ in range(60 * 60):
        state = fly(twin, controls, FRAME, pilot)
        if rolled_off is None and not state.on_ground_any:
            rolled_off = state.sim_time_s
    assert 8.0 < rolled_off < 30.0
    assert state.agl_m > 80.0
    assert [gear.extended for gear in state.gear] == [0.0, 0.0, 0.0]
    assert not state.crashed


def test_brakes_hold_one_wheel_and_a_dive_into_the_ground_is_a_crash(twin):
    controls = twin.reset(InitialState(on_ground=True, heading_deg=0.0))
    controls.parking_brake = 0.0
    controls.throttle[0] = controls.throttle[1] = 0.35
    fly(twin, controls, 6.0)
    controls.throttle[0] = controls.throttle[1] = 0.0
    controls.brake_left = 0.5
    state = fly(twin, controls, 2.0)
    assert 180.0 < math.degrees(state.heading_rad) < 359.0  # turned left
    controls = twin.reset(InitialState(altitude_m=120.0))
    controls.pitch = -0.4
    assert fly(twin, controls, 10.0).crashed


def test_flaps_and_speed_brake_move_at_their_pace(twin):
    controls = twin.reset(InitialState(airspeed_mps=50.0))
    controls.flap_request, controls.speedbrake = 1.0, 1.0
    state = fly(twin, controls, 3.0)
    assert state.flap_ratio == pytest.approx(0.5, abs=0.01)  # 7 deg/s of 42 deg
    assert state.speed_brake_ratio == pytest.approx(1.0)
    assert state.drag_n > 1800.0
    controls.speedbrake = -0.5  # armed: stowed
    assert fly(twin, controls, 2.0).speed_brake_ratio == 0.0
