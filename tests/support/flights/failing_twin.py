"""A flight of the twin in which things are broken."""

from __future__ import annotations

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    CommandSource,
    WatchedDatarefs,
    call,
    tx_params,
    write_mixing,
)
from xplane_bridge.harness import wait_until

OK, ACCEPTED, REFUSED, NOT_SUPPORTED, NO_LINK, TIMEOUT = range(6)
CONTROLS = "sim/flightmodel/controls/"
LEFT, RIGHT = CONTROLS + "wing2l_ail1def", CONTROLS + "wing2r_ail1def"
ELEVATOR, RUDDER = CONTROLS + "hstab1_elv1def", CONTROLS + "vstab1_rud1def"
SURFACES = "sim/operation/override/override_control_surfaces"
BANK = "sim/flightmodel/position/true_phi"
ALPHA = "sim/flightmodel/position/alpha"
STICK = "sim/joystick/yoke_roll_ratio"
PEDALS = "sim/joystick/yoke_heading_ratio"
TOTAL = "sim/cockpit2/controls/total_roll_ratio"
TIME = "sim/time/total_running_time_sec"
FAILURES = "sim/operation/failures/"
ELECTRICAL = "sim/cockpit2/electrical/"
#: Where each system's failure shows.
ENGINE, BUS = "sim/flightmodel/engine/ENGN_running[0]", ELECTRICAL + "bus_volts[0]"
GENERATOR, BATTERY = ELECTRICAL + "generator_amps[1]", ELECTRICAL + "battery_voltage_actual_volts[0]"
WATCHED = (
    SURFACES,
    LEFT,
    RIGHT,
    ELEVATOR,
    RUDDER,
    BANK,
    ALPHA,
    STICK,
    PEDALS,
    TOTAL,
    TIME,
    ENGINE,
    BUS,
    GENERATOR,
    BATTERY,
)


def fly(world, *emulator_options, known=True, stale_after=5.0, **params):
    """Starts emulator (its own pilot flies level) and tx_node; with a mixing file by default.

    Late frames are no lost link, and a source may be silent for a moment, as all are on a busy machine.
    """
    from xplane_bridge.msg import AppliedCommand, EventList, FailureState

    if known:
        write_mixing(world)
    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    world.xplane = world.emulator("--no-beacon", "--start", "air", "--pilot", pilot, *emulator_options)
    world.wire = WatchedDatarefs(world.xplane.port, *WATCHED)
    world.state = world.watch("failures/state", FailureState)
    world.events = world.watch("events", EventList)
    world.applied = world.watch("control/applied", AppliedCommand)
    world.params = tx_params(**{"command_timeout": 5.0, **params})
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", stale_after)
    world.node = world.start("tx_node", world.params)
    world.manual = CommandSource(world, "control/manual")
    world.events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events))
    if known:
        wait_ready(world)
    return world


def wait_ready(world):
    """Surfaces have been seen to follow the mixing."""
    world.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message)


def close(world):
    world.manual.stop()
    world.wire.close()
    world.close()


@pytest.fixture(name="twin", scope="module")
def fixture_twin(new_world, tmp_path_factory):
    """One flight that many tests share; each leaves it repaired."""
    world = fly(new_world(tmp_path_factory.mktemp("twin")))
    yield world
    close(world)


@pytest.fixture(name="healthy")
def fixture_healthy(twin):
    """The shared flight, repaired and with X-Plane driving its surfaces, before and after."""
    yield twin
    twin.manual.let_go()
    done = call(twin, "clear_failures", "ClearFailures", include_simulator=True)
    assert done.success, done.result.message
    twin.wire.wait(SURFACES, 0.0)
    wait_until(lambda: not twin.state.last.names, WAIT_S, "an empty failures/state")


def fail(world, name, kind="failed", value=None, **trigger):
    return call(
        world,
        "set_failure",
        "SetFailure",
        name=name,
        kind=kind,
        has_value=value is not None,
        value=value or 0.0,
        **trigger,
    )


def wanted(aileron, total):
    """[deg] where X-Plane's total stick wants an aileron: 15 degrees down, 25 up."""
    down = total if aileron == LEFT else -total
    return 15.0 * down if down > 0.0 else 25.0 * down


def follows(wire, aileron):
    """An aileron is where X-Plane's total stick wants it."""
    return wire.value(aileron) == pytest.approx(wanted(aileron, wire.value(TOTAL)), abs=0.02)


def last_event(world):
    """Number of the newest event."""
    return max(event.number for event in world.events.last.events)


def has_said(world, text, after):
    """Whether an event with this text has come after the one with this number."""
    events = (event for message in world.events.messages for event in message.events)
    return any(event.number > after and text in event.text for event in events)


def said(world, text):
    """An event with this text has come since the node started."""
    return world.events.wait_for(lambda e: any(text in event.text for event in e.events), what=f"event '{text}'")
