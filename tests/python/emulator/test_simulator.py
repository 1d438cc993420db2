"""What requests leave of a running emulator: its aircraft, its weather, and a flight that goes on."""

from __future__ import annotations

import pytest

from support.simulator.emulator_bench import OVERRIDE, fixture_bench  # noqa: F401
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import aircraft_path

REGION = "sim/weather/region/"
SAVE, LOAD = protocol.Situation(protocol.Situation.SAVE, "a.sit"), protocol.Situation(protocol.Situation.LOAD, "a.sit")
#: In the emulator's weather of 12: from, speed [m/s], turbulence, temperature [C], pressure [Pa].
WEATHER = {
    REGION + "wind_direction_degt": 270.0,
    REGION + "wind_speed_msc": 10.0,
    REGION + "sealevel_temperature_c": 35.0,
    REGION + "sealevel_pressure_pas": 98000.0,
}


def acfn(name):
    return protocol.AircraftLoad(0, aircraft_path(name))


def air(emulator):
    """The air that the aircraft flies in: wind [m/s], temperature 1000 m up [K], pressure as a share of 98000 Pa."""
    s = emulator.sim.model.state
    return s.wind_east_mps, s.temperature_k + 0.0065 * (s.altitude_m - 1000.0), s.pressure_pa / 98000.0


def test_an_aircraft_that_cannot_fly_there_leaves_the_present_one(bench):
    emulator = bench(aircraft="fixed_wing", version="12")
    client = emulator.client()
    client.send(protocol.VehiclePose("VEHS", 0, 37.0, 127.0, 9000.0, 0.0, 0.0, 0.0))
    emulator.step()
    model = emulator.sim.model
    client.send(acfn("multirotor"))
    emulator.step(60)
    assert emulator.emulator.server.ignored["aircraft"] == 1
    assert (emulator.sim.model, emulator.sim.aircraft, emulator.sim.frame.info) == (model, "fixed_wing", model.info)
    assert emulator.sim.loads == 1
    letters = emulator.read(*(f"sim/aircraft/view/acf_ICAO[{i}]" for i in range(4)))
    assert bytes(map(int, letters)).decode() == model.info.icao[:4]
    assert model.state.true_airspeed_mps == pytest.approx(75.0, abs=5.0)


def test_an_aircraft_loaded_just_above_the_ground_stands_on_it(bench):
    emulator = bench(aircraft="multirotor", initial=InitialState(altitude_m=2.0))
    emulator.client().send(acfn("fixed_wing"))
    emulator.step(10)
    assert emulator.sim.aircraft == "fixed_wing"
    assert emulator.sim.model.state.on_ground_all


def test_an_aircraft_loaded_before_the_first_flight_begins_it(bench):
    emulator = bench(load_time=0.5, fps=60.0)
    emulator.client().send(acfn("fixed_wing"))
    emulator.step(10)
    assert (emulator.sim.aircraft, emulator.sim.flying) == ("fixed_wing", False)
    emulator.step(30)
    assert emulator.sim.flying
    assert emulator.sim.model.state.altitude_m == pytest.approx(1000.0, abs=1.0)
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.4602, abs=1e-3)


def test_before_the_first_flight_there_is_nothing_to_save_and_to_balance(bench):
    emulator = bench(aircraft="fixed_wing", version="12.08", load_time=1.0)
    assert emulator.sim.on_situation(SAVE) == "situation"
    assert emulator.sim.on_dref(protocol.DrefWrite("sim/flightmodel2/misc/cg_offset_z", 0.1)) == "value"


@pytest.mark.parametrize("name", ["fixed_wing", "multirotor", "kinematic"])
def test_the_weather_stays_when_an_aircraft_is_loaded(bench, name):
    emulator = bench(version="12")
    emulator.write(WEATHER)
    emulator.step(2)
    before = air(emulator)
    emulator.client().send(acfn(name))
    emulator.step(2)
    assert emulator.sim.aircraft == name
    assert air(emulator) == pytest.approx(before, rel=1e-2)
    assert emulator.read(REGION + "wind_speed_msc") == [10.0]


def test_turbulence_stays_when_an_aircraft_is_loaded(bench):
    emulator = bench(turbulence=1.0)
    emulator.client().send(acfn("fixed_wing"))
    gusts = set()
    for _ in range(10):
        emulator.step()
        gusts.add(emulator.sim.model.state.wind_down_mps)
    assert len(gusts) == 10


@pytest.mark.parametrize("name", ["fixed_wing", "kinematic"])
def test_a_situation_is_flown_in_the_weather_of_now(bench, name):
    emulator = bench(aircraft=name, version="12")
    client = emulator.client()
    client.send(SAVE)
    emulator.step()
    emulator.write(WEATHER)
    emulator.step(2)
    before = air(emulator)
    client.send(LOAD)
    emulator.step(2)
    assert air(emulator) == pytest.approx(before, rel=3e-3)
    assert emulator.read(*WEATHER) == list(WEATHER.values())


def test_a_situation_of_another_aircraft_needs_no_flight_where_the_present_one_is(bench):
    emulator = bench(aircraft="multirotor", version="12")
    client = emulator.client()
    client.send(SAVE)
    emulator.step(2)
    saved = emulator.sim.model.state.copy()
    client.send(acfn("fixed_wing"))
    emulator.step(2)
    client.send(protocol.VehiclePose("VEHS", 0, 37.0, 127.0, 9000.0, 0.0, 0.0, 0.0))  # higher than it can hover
    emulator.step()
    client.send(LOAD)
    emulator.step(2)
    assert emulator.sim.aircraft == "multirotor"
    state = emulator.sim.model.state
    assert (state.latitude_deg, state.altitude_m) == pytest.approx((saved.latitude_deg, saved.altitude_m), abs=1e-2)
    emulator.step(120)
    assert state.altitude_m == pytest.approx(1000.0, abs=1.0)  # its levers came with it


def test_fuel_of_a_loaded_situation_is_that_of_its_resets(bench):
    emulator = bench(aircraft="fixed_wing")
    tanks = [f"sim/flightmodel/weight/m_fuel[{tank}]" for tank in (0, 1)]
    client = emulator.client()
    emulator.write(dict.fromkeys(tanks, 50.0))
    for request in (SAVE, acfn("multirotor"), LOAD, protocol.CommandRequest("sim/operation/reset_flight")):
        emulator.step()
        client.send(request)
    assert emulator.read(*tanks) == pytest.approx([50.0, 50.0], abs=0.1)


def test_failures_of_a_loaded_situation_hold_what_it_has(bench):
    emulator = bench(aircraft="fixed_wing")
    trim, altimeter = "sim/cockpit2/controls/elevator_trim", "sim/cockpit2/gauges/indicators/altitude_ft_pilot"
    client = emulator.client()
    saved, shown_ft = emulator.read(trim, altimeter)
    client.send(SAVE)
    client.send(protocol.Placement(6, latitude_deg=38.0, longitude_deg=127.0, elevation_m=3000.0, speed_mps=75.0))
    emulator.step(2)
    emulator.write({"sim/operation/failures/rel_elv_trim_run": 6.0, "sim/operation/failures/rel_static": 6.0})
    emulator.step(240)
    client.send(LOAD)
    emulator.step()
    assert emulator.read(trim, altimeter) == [pytest.approx(saved, abs=0.01), pytest.approx(shown_ft, abs=10.0)]


def test_a_situation_brings_its_electrical_switches(bench):
    switches = [f"sim/cockpit2/electrical/{name}_on[0]" for name in ("battery", "generator", "inverter")]
    switches.append("sim/cockpit2/switches/avionics_power_on")
    emulator = bench(aircraft="fixed_wing")
    client = emulator.client()
    emulator.write(dict.fromkeys(switches[:2], 0.0))
    emulator.step()
    client.send(SAVE)
    emulator.step()
    emulator.write({name: float(name in switches[:2]) for name in switches})
    emulator.step()
    client.send(LOAD)
    emulator.step()
    assert emulator.read(*switches) == [0.0, 0.0, 1.0, 1.0]


def test_a_failure_holds_the_levers_of_the_aircraft_that_is_flown(bench):
    emulator = bench(aircraft="fixed_wing")
    emulator.step()
    emulator.write({"sim/operation/failures/rel_fc_thr": 6.0})
    emulator.step()
    emulator.client().send(acfn("multirotor"))
    emulator.step(2)
    hovers = emulator.sim.model.trim_controls.throttle[:4]
    assert emulator.sim.controls.throttle[:4] == pytest.approx(hovers, abs=1e-6)


def test_a_motion_that_explodes_starts_the_flight_again(bench):
    emulator = bench(aircraft="tiltrotor")
    emulator.write({OVERRIDE + "control_surfaces": 1.0, "sim/flightmodel/controls/wing1l_ail1def": 1e10})
    emulator.step(60)
    assert emulator.sim.loads > 1
    emulator.write({OVERRIDE + "control_surfaces": 0.0})
    emulator.step(60)
    assert emulator.sim.model.state.altitude_m == pytest.approx(1000.0, abs=20.0)
