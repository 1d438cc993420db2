"""All aircraft of the emulator: X-Plane's sphere, gravity, wind, placing, saving."""

import json
import math
import random

import pytest

from xplane_bridge.emulator.aircraft import create_model, model_names
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    FlightModelError,
    InitialState,
    SurfaceFault,
    SurfaceFaultKind,
)

RADIUS = 6378145.0
GRAVITY = 9.80665


def lively(step):
    """Stick movements that take an aircraft through all axes without losing it."""
    t = step / 60.0
    return 0.3 * math.sin(1.1 * t), 0.15 * math.sin(0.7 * t + 1.0), 0.2 * math.sin(0.9 * t + 2.0)


@pytest.mark.parametrize("name", model_names())
def test_position_is_the_integral_of_velocity_on_the_sphere(name):
    """Simpson's rule over the reported velocity gives the reported position, to a millimetre over 20 s."""
    model = create_model(name)
    controls = model.reset(InitialState(latitude_deg=37.5, longitude_deg=127.1, heading_deg=60.0))
    model.set_wind(6.0, -3.0)
    state = model.state
    latitude, longitude, altitude = (
        math.radians(state.latitude_deg),
        math.radians(state.longitude_deg),
        state.altitude_m,
    )
    before = (state.v_north_mps, state.v_east_mps, state.v_down_mps)
    frames = 1200
    for i in range(frames):
        controls.roll, controls.pitch, controls.yaw = lively(i)
        middle = model.step(1 / 120, controls).copy()
        state = model.step(1 / 120, controls)
        after = (state.v_north_mps, state.v_east_mps, state.v_down_mps)
        half = (middle.v_north_mps, middle.v_east_mps, middle.v_down_mps)
        mean = [(a + 4 * b + c) / 6 for a, b, c in zip(before, half, after)]
        radius = RADIUS + middle.altitude_m
        longitude += mean[1] / 60 / (radius * math.cos(math.radians(middle.latitude_deg)))
        latitude += mean[0] / 60 / radius
        altitude -= mean[2] / 60
        before = after
    assert state.sim_time_s == pytest.approx(20.0)
    assert math.hypot(state.roll_rad, state.pitch_rad) > 0.005, "the flight was not lively enough to prove anything"
    assert (math.radians(state.latitude_deg) - latitude) * RADIUS == pytest.approx(0.0, abs=2e-3)
    assert (math.radians(state.longitude_deg) - longitude) * RADIUS * math.cos(latitude) == pytest.approx(0.0, abs=2e-3)
    assert state.altitude_m - altitude == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("name", model_names())
def test_accelerations_are_the_derivatives_of_velocity_and_attitude(name):
    model = create_model(name)
    controls = model.reset(InitialState(latitude_deg=60.0, heading_deg=200.0))
    for i in range(300):
        controls.roll, controls.pitch, controls.yaw = lively(i)
        model.step(1 / 60, controls)
    dt = 1 / 480
    first = model.step(dt, controls).copy()
    here = model.step(dt, controls).copy()
    last = model.step(dt, controls).copy()
    for axis in ("north", "east", "down"):
        slope = (getattr(last, f"v_{axis}_mps") - getattr(first, f"v_{axis}_mps")) / (2 * dt)
        assert slope == pytest.approx(getattr(here, f"acceleration_{axis}_mps2"), abs=0.05)
    for axis in "pqr":
        slope = (getattr(last, f"{axis}_rad_s") - getattr(first, f"{axis}_rad_s")) / (2 * dt)
        assert slope == pytest.approx(getattr(here, f"{axis}_dot_rad_s2"), abs=0.05)
    # Euler's kinematics (body rates against attitude), written out independently
    p, q, r = here.p_rad_s, here.q_rad_s, here.r_rad_s
    sine, cosine = math.sin(here.roll_rad), math.cos(here.roll_rad)
    roll_rate = p + math.tan(here.pitch_rad) * (q * sine + r * cosine)
    assert (last.roll_rad - first.roll_rad) / (2 * dt) == pytest.approx(roll_rate, abs=2e-3)
    assert (last.pitch_rad - first.pitch_rad) / (2 * dt) == pytest.approx(q * cosine - r * sine, abs=2e-3)


@pytest.mark.parametrize("height_m", [0.0, 3000.0])
@pytest.mark.parametrize("name", model_names())
def test_parked_aircraft_feels_gravity_alone(name, height_m):
    """Specific force at rest: (g sin theta, -g cos theta sin phi, -g cos theta cos phi), the same g at every height."""
    model = create_model(name)
    controls = model.reset(
        InitialState(on_ground=True, terrain_elevation_m=height_m, heading_deg=123.0, engines_running=False)
    )
    start = model.state.copy()
    assert start.on_ground_all
    assert start.agl_m == pytest.approx(model.info.standing_height_m, abs=5e-3)
    for _ in range(300):
        state = model.step(1 / 60, controls)
    theta, phi = state.pitch_rad, state.roll_rad
    assert state.specific_force_x_mps2 == pytest.approx(GRAVITY * math.sin(theta), abs=2e-3)
    assert state.specific_force_y_mps2 == pytest.approx(-GRAVITY * math.cos(theta) * math.sin(phi), abs=2e-3)
    assert state.specific_force_z_mps2 == pytest.approx(-GRAVITY * math.cos(theta) * math.cos(phi), abs=2e-3)
    assert math.degrees(state.heading_rad) == pytest.approx(123.0, abs=0.02)
    drift_m = math.hypot(
        math.radians(state.latitude_deg - start.latitude_deg) * RADIUS,
        math.radians(state.longitude_deg - start.longitude_deg) * RADIUS * math.cos(math.radians(state.latitude_deg)),
    )
    assert drift_m < 0.01
    assert not state.crashed


@pytest.mark.parametrize("name", model_names())
def test_saved_flight_goes_on_as_it_would_have(name):
    model = create_model(name, seed=3)
    controls = model.reset(InitialState(heading_deg=30.0))
    model.set_turbulence(1.0)
    for i in range(240):
        controls.roll, controls.pitch, controls.yaw = lively(i)
        model.step(1 / 60, controls)
    situation = model.save()

    def go_on(flown):
        for i in range(240, 360):
            controls.roll, controls.pitch, controls.yaw = lively(i)
            flown.step(1 / 60, controls)
        return flown.state.copy()

    first = go_on(model)
    again = create_model(name)
    again.restore(situation)
    assert again.state.sim_time_s == pytest.approx(4.0)
    second = go_on(again)
    assert second.sim_time_s == pytest.approx(first.sim_time_s)
    assert math.radians(second.latitude_deg - first.latitude_deg) * RADIUS == pytest.approx(0.0, abs=0.02)
    assert second.altitude_m == pytest.approx(first.altitude_m, abs=0.02)
    assert second.heading_rad == pytest.approx(first.heading_rad, abs=1e-3)
    assert second.roll_rad == pytest.approx(first.roll_rad, abs=1e-3)
    assert second.engines[0].rpm == pytest.approx(first.engines[0].rpm, rel=1e-3)


def test_situation_of_another_aircraft_is_refused():
    model = create_model("fixed_wing")
    model.reset(InitialState())
    saved = json.loads(model.save().decode())
    saved["model"] = "other"
    with pytest.raises(FlightModelError, match="'other'"):
        model.restore(json.dumps(saved).encode())
    with pytest.raises(FlightModelError, match="not a saved situation"):
        model.restore(b"\x00\x01")


@pytest.mark.parametrize("name", model_names())
def test_same_seed_same_flight(name):
    def fly(seed):
        model = create_model(name, seed=seed)
        controls = model.reset(InitialState())
        model.set_turbulence(1.5)
        for _ in range(120):
            model.step(1 / 60, controls)
        return model.state.altitude_m, model.state.wind_north_mps

    assert fly(1) == fly(1)
    assert fly(1) != fly(2)


@pytest.mark.parametrize("name", model_names())
def test_place_sets_exactly_what_it_is_given(name):
    model = create_model(name)
    model.reset(InitialState())
    before = model.state.copy()
    state = model.place(
        latitude_deg=-33.9, longitude_deg=151.2, roll_rad=0.2, heading_rad=3.0, v_ned_mps=(20.0, 40.0, -1.0)
    )
    assert (state.latitude_deg, state.longitude_deg) == pytest.approx((-33.9, 151.2), abs=1e-12)
    assert state.altitude_m == pytest.approx(before.altitude_m, abs=1e-6)
    assert (state.roll_rad, state.pitch_rad, state.heading_rad) == pytest.approx((0.2, before.pitch_rad, 3.0), abs=1e-9)
    assert (state.v_north_mps, state.v_east_mps, state.v_down_mps) == pytest.approx((20.0, 40.0, -1.0), abs=1e-9)
    with pytest.raises(FlightModelError, match="finite"):
        model.place(altitude_m=math.nan)


@pytest.mark.parametrize("name", model_names())
def test_place_never_puts_it_under_ground(name):
    model = create_model(name)
    controls = model.reset(InitialState(on_ground=True, engines_running=False))
    model.place(altitude_m=-50.0, roll_rad=math.radians(-45.0), pitch_rad=math.radians(80.0), v_ned_mps=(0.0, 0.0, 0.0))
    for _ in range(120):
        state = model.step(1 / 60, controls)
        assert math.hypot(state.v_north_mps, state.v_east_mps, state.v_down_mps) < 25.0
    assert -1.0 < state.agl_m < 10.0


@pytest.mark.parametrize("name", model_names())
def test_starts_with_dead_engines_and_where_the_air_is_thin(name):
    model = create_model(name)
    controls = model.reset(InitialState(altitude_m=1500.0, engines_running=False))
    for _ in range(120):
        state = model.step(1 / 60, controls)
    assert not any(engine.running for engine in state.engines)
    assert state.v_down_mps > 0.5
    model.reset(InitialState(altitude_m=5000.0))
    assert model.state.altitude_m == pytest.approx(5000.0)
    with pytest.raises(FlightModelError, match=r"and 15000 m.*no steady flight"):
        model.reset(InitialState(altitude_m=15000.0, airspeed_mps=75.0 if name != "multirotor" else 15.0))


def test_quaternion_rotates_body_vectors_into_ned():
    model = create_model("fixed_wing")
    model.reset(InitialState())
    state = model.place(roll_rad=math.radians(30), pitch_rad=math.radians(10), heading_rad=math.radians(60))
    w, x, y, z = state.quaternion
    # nose direction: (cos 10 cos 60, cos 10 sin 60, -sin 10)
    nose = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    assert nose == pytest.approx((0.4924039, 0.8528686, -0.1736482), abs=1e-6)
    # body down, third row: (cos30 sin10 cos60 + sin30 sin60, cos30 sin10 sin60 - sin30 cos60, cos30 cos10)
    down = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    assert down == pytest.approx((0.5082048, -0.1197641, 0.8528686), abs=1e-6)


def test_wind_from_the_right_gives_positive_sideslip_and_dryden_has_its_size():
    model = create_model("fixed_wing")
    model.reset(InitialState(heading_deg=0.0))
    model.set_wind(0.0, -5.0)  # air moves west: from the right of an aircraft heading north
    state = model.step(1 / 240, model.trim_controls)
    assert (state.wind_east_mps, state.beta_rad) == (
        pytest.approx(-5.0),
        pytest.approx(math.atan2(5.0, 75.0), abs=2e-3),
    )
    model.set_wind(0.0, 0.0)
    controls = model.reset(InitialState(altitude_m=2000.0))
    model.set_turbulence(2.0, seed=5)
    gusts = []
    for _ in range(90 * 60):
        state = model.step(1 / 60, controls)
        controls.roll, controls.pitch = -state.roll_rad, 0.5 * (0.02 - state.pitch_rad)
        gusts.append(state.wind_down_mps)
    mean = sum(gusts) / len(gusts)
    deviation = math.sqrt(sum((gust - mean) ** 2 for gust in gusts) / len(gusts))
    assert deviation == pytest.approx(2.0, rel=0.35)


@pytest.mark.parametrize("name", model_names())
def test_tumbling_over_the_ground_gains_no_energy(name):
    """Thrown at the ground, above all on its side (where struts would be metres long), nothing flings it off again."""
    model = create_model(name)
    generator = random.Random(7)
    throws = [(85.1, 12.0, (1.9, -11.5, 24.0)), (-86.2, 18.7, (21.8, 0.8, 24.1)), (83.7, -13.1, (16.5, 6.1, 21.9))]
    for _ in range(6):
        velocity = [generator.uniform(-15.0, 15.0), generator.uniform(-15.0, 15.0), generator.uniform(5.0, 20.0)]
        throws.append((generator.uniform(-180.0, 180.0), generator.uniform(-60.0, 60.0), velocity))
    for side in (1.0, -1.0):
        for roll, pitch, velocity in throws:
            controls = model.reset(InitialState(on_ground=True, engines_running=False))
            controls.throttle, controls.parking_brake = [0.0] * 8, 0.0
            start = model.place(
                altitude_m=0.45 * model.info.wing_span_m,
                roll_rad=side * math.radians(roll),
                pitch_rad=math.radians(pitch),
                v_ned_mps=velocity,
            )
            energy = 0.5 * sum(v * v for v in velocity) + GRAVITY * start.agl_m
            for _ in range(120):
                state = model.step(1 / 60, controls)
                speed = math.sqrt(state.v_north_mps**2 + state.v_east_mps**2 + state.v_down_mps**2)
                assert 0.5 * speed**2 + GRAVITY * state.agl_m < 1.3 * energy
            assert state.crashed


def test_bad_calls_say_what_was_wrong():
    with pytest.raises(FlightModelError, match=r"'glider'.*fixed_wing"):
        create_model("glider")
    model = create_model("fixed_wing")
    controls = model.reset(InitialState())
    for dt in (0.0, -0.1, math.nan, 2.0):
        with pytest.raises(FlightModelError, match="expected more than 0"):
            model.step(dt, controls)
    with pytest.raises(FlightModelError, match="per tank"):
        model.set_loading(fuel_kg=[50.0])
    with pytest.raises(FlightModelError, match="payload"):
        model.set_loading(payload_kg=-1.0)
    controls.surface_faults = {"wing9l_ail1": SurfaceFault(SurfaceFaultKind.CENTRED)}
    with pytest.raises(FlightModelError, match="no surface 'wing9l_ail1'"):
        model.step(1 / 60, controls)
    controls.surface_faults = {"wing2l_ail1": SurfaceFault(SurfaceFaultKind.REDUCED, 1.5)}
    with pytest.raises(FlightModelError, match=r"expected 0\.\.1"):
        model.step(1 / 60, controls)
    with pytest.raises(FlightModelError, match="ground is at 500"):
        model.reset(InitialState(altitude_m=100.0, terrain_elevation_m=500.0))
    assert Controls().throttle == [0.0] * 8
