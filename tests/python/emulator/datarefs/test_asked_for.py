"""Datarefs are computed once a client asks for them; the client sees no difference."""

from __future__ import annotations

import random
from typing import Dict, List

import numpy as np
import pytest

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.protocol import DrefWrite


def simulator(version: str, everything: bool, load_time: float = 0.0) -> Simulator:
    start, weather = InitialState(airspeed_mps=70.0), Weather(200.0, 7.0, 2.0)
    sim = Simulator(
        create_model, "fixed_wing", version, initial=start, load_time=load_time, data_rate=60, weather=weather
    )
    if everything:
        sim.store.watch_all()
    return sim


@pytest.mark.parametrize(("version", "load_time"), [("11.55", 0.0), ("12.10", 0.2)])
def test_clients_see_the_same_as_if_everything_was_computed(version: str, load_time: float) -> None:
    """Names are asked for one after the other, rows are selected and values written, while both fly."""
    lazy, eager = simulator(version, False, load_time), simulator(version, True, load_time)
    chance = random.Random(4)
    names = sorted(lazy.store.names())
    chance.shuffle(names)
    asked: Dict[str, int] = {}
    for frame in range(80):
        for name in names[frame * 6 : frame * 6 + 6]:
            asked[name] = lazy.store.slot(name)
            assert asked[name] == eager.store.slot(name)
            now = [sim.store.values[asked[name]] for sim in (lazy, eager)]
            np.testing.assert_equal(now[0], now[1], err_msg=f"{name} when it is asked for, frame {frame}")
        written = chance.choice(
            names if frame % 2 else ["sim/flightmodel/weight/m_fuel", "sim/flightmodel/engine/ENGN_prop"]
        )
        if frame % 3 == 0:
            for sim in (lazy, eager):
                sim.on_dref(DrefWrite(written, 0.25))
        if frame in (20, 40):
            row = float(frame)
            for sim in (lazy, eager):
                sim.store.values[sim.store.dataref("sim/network/dataout/data_to_internet").slots[int(row)]] = 1.0
        for sim in (lazy, eager):
            sim.step(1 / 60)
        slots: List[int] = list(asked.values())
        for name, mine, other in zip(asked, lazy.store.values[slots], eager.store.values[slots]):
            np.testing.assert_equal(mine, other, err_msg=f"{name}, frame {frame}, {written} written")
        assert lazy.rows.packet(lazy.selected_rows()) == eager.rows.packet(eager.selected_rows())
    assert lazy.model.save() == eager.model.save()
    lazy.store.watch_all()
    np.testing.assert_array_equal(lazy.store.values, eager.store.values)


@pytest.mark.parametrize("version", ["11.55", "12.10"])
def test_what_is_sent_now_and_then_is_as_if_it_was_computed_in_each_frame(version: str) -> None:
    sometimes, eager = simulator(version, False), simulator(version, True)
    chance = random.Random(8)
    names = sorted(sometimes.store.names())
    slots = [sometimes.store.find(name) for name in names]
    groups = [chance.sample(slots, 300) for _ in range(4)]
    plans = [sometimes.table.plan(group) for group in groups]
    for frame in range(60):
        if frame % 7 == 0:
            written = chance.choice(names)
            for sim in (sometimes, eager):
                sim.on_dref(DrefWrite(written, 0.25))
        for sim in (sometimes, eager):
            sim.step(1 / 60)
        for index in chance.sample(range(4), chance.randint(0, 2)):
            plans[index]()
            mine, other = (sim.store.values[groups[index]] for sim in (sometimes, eager))
            np.testing.assert_array_equal(mine, other, err_msg=f"frame {frame}")


def test_a_plan_computes_its_slots_when_it_is_called() -> None:
    sim = simulator("11.55", False)
    calls: List[int] = []
    sim.table.value("_emulator/counted", lambda f: calls.append(f.clocks.frame) or 7.0)
    compute = sim.table.plan([sim.store.locate("_emulator/counted")])
    for _ in range(3):
        sim.step(1 / 60)
    assert calls == []
    compute()
    assert calls == [3]
    assert sim.store.values[sim.store.locate("_emulator/counted")] == 7.0


def test_what_no_client_asks_for_is_not_computed() -> None:
    sim = simulator("11.55", False)
    calls: List[int] = []
    sim.table.value("_emulator/counted", lambda f: calls.append(f.clocks.frame) or 7.0)
    sim.step(1 / 60)
    assert calls == []
    assert sim.store.get("_emulator/counted") == 7.0
    assert calls == [1]
    sim.step(1 / 60)
    assert calls == [1, 2]


def test_a_loading_that_cannot_fly_begins_on_the_ground() -> None:
    """Tanks that are all but empty before the flight begins: there is no steady flight to begin with."""
    sim = simulator("12.10", everything=False, load_time=0.1)
    sim.on_dref(DrefWrite("sim/flightmodel/weight/m_fuel", 0.25))
    for _ in range(12):
        sim.step(1 / 60)
    assert sim.flying
    assert sim.model.state.on_ground_any
    assert sum(sim.model.state.fuel_kg) < 0.25
