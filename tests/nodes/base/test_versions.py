"""rx_node and tx_node at each X-Plane of the lists: what they do works, by names that it has."""

from __future__ import annotations

import json

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import PITCH, ROLL, CommandSource, WatchedDatarefs, call, pause, tx_params
from xplane_bridge import protocol, xplane_names
from xplane_bridge.emulator.simulator import aircraft_path
from xplane_bridge.harness import HarnessError, wait_until

ACCEPTED, AIRCRAFT, OK = 1, 3, 0
FAILURES = "sim/operation/failures/"
FLIGHT_TIME = "sim/time/total_flight_time_sec"
PAUSED, STICK = "sim/time/paused", "sim/joystick/yoke_roll_ratio"
PEDALS = "sim/joystick/yoke_heading_ratio"
OVERRIDE = "sim/operation/override/override_joystick"  # of all axes; one of each has its name behind it
OVERRIDES = tuple(OVERRIDE + axis for axis in ("", "_roll", "_pitch", "_heading"))
THERE = {"latitude": 47.2, "longitude": 8.3, "altitude_msl": 1500.0, "heading_true_deg": 250.0, "true_airspeed": 75.0}


def versions():
    """All that have a list; between the oldest and the newest only in full tests."""
    between = xplane_names.VERSIONS[1:-1]
    return [pytest.param(v, marks=[pytest.mark.nightly] if v in between else []) for v in xplane_names.VERSIONS]


@pytest.fixture(scope="module", params=versions())
def flight(request, new_world, tmp_path_factory):
    """One flight of each version; when its tests are over, nothing may have been asked for in vain."""
    from xplane_bridge.msg import EventList, FailureState, FlightState

    world = new_world(tmp_path_factory.mktemp("versions"))
    pilot = world.folder / "pilot.yaml"
    pilot.write_text(
        "name: level\nevents: [{at: 0, hold: {roll: 0, yaw_rate: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8"
    )
    world.version = request.param
    world.xplane = world.emulator("--no-beacon", "--start", "air", "--pilot", pilot, "--version", request.param)
    world.other = world.wire(world.xplane.port)
    world.seen = WatchedDatarefs(world.xplane.port, STICK, PEDALS, *OVERRIDES)
    world.events = world.watch("events", EventList)
    world.failures = world.watch("failures/state", FailureState)
    world.states = world.watch("flight_state", FlightState)
    world.manual = CommandSource(world, "control/manual")
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", 5.0)  # late frames of a busy machine are no lost link
    world.start("rx_node")
    world.start("tx_node", tx_params(setting_timeout=10.0, load_timeout=30.0))
    world.events.wait_for(lambda e: any(event.kind == AIRCRAFT for event in e.events))
    world.states.wait_for()
    yield world
    world.manual.stop()
    world.seen.close()
    world.close()
    ignored = json.loads(world.xplane.wait_for_line(r"^STOPPED (.*)", 1.0).group(1))["ignored"]
    assert {reason: count for reason, count in ignored.items() if reason in ("dataref", "command", "value")} == {}


def done(world, service, kind, **request):
    """Calls a service that accepts, and waits for the event that X-Plane did it."""
    response = call(world, service, kind, **request)
    assert response.result.code == ACCEPTED, response.result.message
    number = response.event_number
    reported = world.events.wait_for(lambda e: any(event.number == number for event in e.events), WAIT_S)
    event = next(event for event in reported.events if event.number == number)
    assert event.success, event.text


def pause_and_read(world, paused):
    pause(world, paused)
    assert world.other.read(PAUSED) == float(paused)


def test_pause_pauses_however_often_it_is_asked_for(flight):
    for paused in (True, True, False, False, True, False):
        pause_and_read(flight, paused)


def test_reset_places_the_flight_and_leaves_it_running_or_paused(flight):
    for paused in (False, True):
        pause_and_read(flight, paused)
        done(flight, "reset_flight", "ResetFlight", **THERE)
        assert flight.other.read("sim/flightmodel/position/latitude") == pytest.approx(47.2, abs=0.01)
        assert flight.other.read(PAUSED) == float(paused)
    pause_and_read(flight, False)


def test_another_aircraft_is_loaded_and_flown(flight):
    for name in ("multirotor", "fixed_wing"):
        # Version 11 shows only that the flight's time begins anew; this one loads in no time.
        wait_until(lambda: flight.other.read(FLIGHT_TIME) > 1.0, WAIT_S, "flight")
        done(flight, "load_aircraft", "LoadAircraft", path=aircraft_path(name))
    flight.manual.fly(fields=ROLL, roll=0.125)
    flight.seen.wait(STICK, 0.125)
    flight.manual.stop()


def test_two_axes_leave_the_pedals_alone(flight):
    flight.manual.fly(fields=ROLL | PITCH, roll=0.125, pitch=0.05)
    for path, value in zip(OVERRIDES, (0.0, 1.0, 1.0, 0.0)):
        flight.seen.wait(path, value)
    flight.seen.wait(STICK, 0.125)
    # The pilot's, who wants no yaw rate; an override would let them stand.
    before = flight.seen.value(PEDALS)
    wait_until(lambda: abs(flight.seen.value(PEDALS) - before) > 1e-3, WAIT_S, "pedals that move")
    flight.manual.stop()


@pytest.mark.parametrize("name", ["rel_invert0", "rel_lites_beac", "rel_mwing36", "rel_bird_strike_eng1"])
def test_a_failure_of_the_simulators_menu_is_labelled_whatever_it_is(flight, name):
    if FAILURES + name not in xplane_names.datarefs(flight.version):
        pytest.skip(f"version {flight.version} does not have it")
    flight.other.send(protocol.DrefWrite(FAILURES + name, 6.0))
    state = flight.failures.wait_for_next(lambda f: name in f.names)
    assert state.set_by[state.names.index(name)] == "simulator"
    flight.other.send(protocol.DrefWrite(FAILURES + name, 0.0))
    flight.failures.wait_for_next(lambda f: name not in f.names)


def test_an_engine_is_failed_and_repaired(flight):
    assert call(flight, "set_failure", "SetFailure", name="engine_1", kind="failed").result.code == OK
    assert flight.other.read(FAILURES + "rel_engfai0") == 6.0
    assert call(flight, "clear_failures", "ClearFailures").result.code == OK
    assert flight.other.read(FAILURES + "rel_engfai0") == 0.0


def test_diagnostics_are_without_a_warning(flight):
    from diagnostic_msgs.msg import DiagnosticArray

    log = flight.watch("/diagnostics", DiagnosticArray)
    prefix = flight.namespace.lstrip("/") + "/"

    def newest():
        found = {}
        for array in log.messages:
            found.update({s.name: s for s in array.status if s.name.lstrip("/").startswith(prefix)})
        return found

    def all_well():
        statuses = newest()
        links = [name for name in statuses if name.endswith("link to X-Plane")]
        return len(links) == 2 and all(status.level == OK for status in statuses.values())

    flight.manual.fly(fields=ROLL, roll=0.0)  # a stick that is silent is a warning of its own
    try:
        wait_until(all_well, WAIT_S, "diagnostics without a warning")
    except HarnessError:
        pytest.fail("\n".join(f"{s.name}: {s.level} {s.message}" for s in newest().values()))
    finally:
        flight.manual.stop()
        log.close()
