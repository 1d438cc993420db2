"""The emulator of a flight that is also flown in process: the air that it begins in is its weather."""

from __future__ import annotations

from typing import Iterator

import pytest

from xplane_bridge.emulator.datarefs.aircraft_systems import INHG_PA
from xplane_bridge.emulator.options import Options
from xplane_bridge.in_process.aircraft import Conditions
from xplane_bridge.in_process.emulated import ConditionedEmulator

CONDITIONS = Conditions("fixed_wing", weather={"sea_level_pressure": 98000.0, "temperature_offset": 20.0})


@pytest.fixture(name="emulator")
def fixture_emulator() -> Iterator[ConditionedEmulator]:
    options = Options(bind="127.0.0.1", port=0, beacon=False, stepped="lines", version="12.10")
    emulator = ConditionedEmulator(options, CONDITIONS)
    emulator.step_frames(1)
    yield emulator
    emulator.close()


def test_clients_read_the_air_of_the_conditions(emulator: ConditionedEmulator) -> None:
    get = emulator.sim.store.get
    assert get("sim/weather/barometer_sealevel_inhg") * INHG_PA == pytest.approx(98000.0)
    assert get("sim/weather/region/sealevel_pressure_pas") == 98000.0
    assert get("sim/weather/temperature_sealevel_c") == get("sim/weather/region/sealevel_temperature_c") == 35.0


def test_a_client_that_writes_the_temperature_leaves_the_pressure(emulator: ConditionedEmulator) -> None:
    state = emulator.sim.model.state
    pressure_pa, temperature_k = state.pressure_pa, state.temperature_k
    emulator.sim.store.write("sim/weather/temperature_sealevel_c", 36.0)
    emulator.step_frames(1)
    assert state.pressure_pa == pytest.approx(pressure_pa, rel=1e-3)
    assert state.temperature_k == pytest.approx(temperature_k + 1.0, abs=0.05)


def test_another_aircraft_flies_in_the_same_air(emulator: ConditionedEmulator) -> None:
    pressure_pa = emulator.sim.model.state.pressure_pa
    emulator.sim.load_aircraft("tiltrotor")
    emulator.step_frames(1)
    assert emulator.sim.model.state.pressure_pa == pytest.approx(pressure_pa, rel=1e-3)
