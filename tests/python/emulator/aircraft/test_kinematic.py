"""The kinematic model keeps its promise: whatever it flies is consistent in itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.emulator.aircraft.kinematic.kinematic import KinematicModel
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import (
    MAX_SUBSTEP_S,
    EngineFault,
    FlightModelError,
    InitialState,
    SurfaceFault,
    SurfaceFaultKind,
)
from xplane_bridge.units import EARTH_RADIUS_M

STEP = MAX_SUBSTEP_S


def attitude(state):
    return earth.body_to_level(*map(math.degrees, (state.roll_rad, state.pitch_rad, state.heading_rad)))


def velocity(state):
    return np.array((state.v_north_mps, state.v_east_mps, state.v_down_mps))


def test_rates_specific_force_and_air_velocity_belong_together():
    model = KinematicModel()
    model.set_wind(5.0, -3.0)
    controls = model.reset(InitialState(heading_deg=50.0))
    controls.roll, controls.pitch = 0.3, 0.2
    model.step(0.5, controls)
    for _ in range(200):
        before = model.state.copy()
        state = model.step(STEP, controls)
        turned = attitude(before).T @ attitude(state)
        angle = np.array((turned[2, 1], turned[0, 2], turned[1, 0])) / STEP
        assert angle == pytest.approx((state.p_rad_s, state.q_rad_s, state.r_rad_s), abs=2e-3)
        acceleration = (velocity(state) - velocity(before)) / STEP
        force = attitude(state).T @ (acceleration - np.array((0.0, 0.0, 9.80665)))
        shown = (state.specific_force_x_mps2, state.specific_force_y_mps2, state.specific_force_z_mps2)
        assert shown == pytest.approx(tuple(force), abs=1e-6)
        air = velocity(state) - np.array((5.0, -3.0, 0.0))
        assert state.true_airspeed_mps == pytest.approx(float(np.linalg.norm(air)), abs=1e-6)
        north = math.radians(state.latitude_deg - before.latitude_deg) * (EARTH_RADIUS_M + state.altitude_m) / STEP
        assert north == pytest.approx(state.v_north_mps, abs=1e-3)
    assert abs(state.p_rad_s) > 0.1
    assert abs(state.q_rad_s) > 0.02


def test_it_takes_off_and_lands():
    model = KinematicModel()
    controls = model.reset(InitialState(on_ground=True, terrain_elevation_m=100.0))
    model.step(2.0, controls)
    assert model.state.true_airspeed_mps == 0.0
    assert model.state.on_ground_all
    assert model.state.specific_force_z_mps2 == pytest.approx(-9.80665)
    controls.parking_brake, controls.throttle[:2] = 0.0, [1.0, 1.0]
    model.step(20.0, controls)
    assert model.state.on_ground_any
    controls.pitch = 0.5
    model.step(5.0, controls)
    assert not model.state.on_ground_any
    assert model.state.agl_m > 5.0
    controls.pitch, controls.throttle[:2] = -0.5, [0.0, 0.0]
    model.step(20.0, controls)
    assert model.state.on_ground_any
    assert model.state.altitude_m == pytest.approx(101.2, abs=0.01)


def test_faults_of_surfaces_and_engines():
    model = KinematicModel()
    controls = model.reset(InitialState())
    controls.surface_faults = {"wing2l_ail1": SurfaceFault(SurfaceFaultKind.STUCK, 5.0)}
    controls.engine_faults[0] = EngineFault.STOPPED
    model.step(2.0, controls)
    assert model.state.surfaces_deg["wing2l_ail1"] == pytest.approx(5.0)
    assert model.state.surfaces_deg["wing2r_ail1"] == 0.0
    assert math.degrees(model.state.roll_rad) > 5.0
    assert [engine.running for engine in model.state.engines] == [False, True]


def test_a_saved_situation_goes_on_exactly():
    model = KinematicModel(seed=2)
    model.set_turbulence(1.0)
    controls = model.reset(InitialState())
    controls.roll = 0.2
    model.step(1.0, controls)
    saved = model.save()
    first = model.step(1.0, controls).copy()
    other = KinematicModel(seed=9)
    other.restore(saved)
    assert other.step(1.0, controls) == first


def test_what_it_cannot_do_is_said():
    model = KinematicModel()
    with pytest.raises(FlightModelError, match="step of 0"):
        model.step(0.0, model.trim_controls)
    with pytest.raises(FlightModelError, match="no saved situation"):
        model.restore(b"something else")
    with pytest.raises(FlightModelError, match="engine 7"):
        model.set_engine_running(7, True)
