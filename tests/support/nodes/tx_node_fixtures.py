"""tx_node as its tests start it."""

from __future__ import annotations

import pytest

from support.nodes.tx_fixtures import (
    CommandSource,
    WatchedDatarefs,
    tx_params,
)

STICK = "sim/joystick/yoke_roll_ratio"
OVERRIDE = "sim/operation/override/override_joystick_roll"
THROTTLES = "sim/operation/override/override_throttles"
LEVER = "sim/cockpit2/engine/actuators/throttle_ratio[0]"
FLAP_HANDLE = "sim/cockpit2/controls/flap_ratio"


@pytest.fixture(name="tx")
def fixture_tx(world):
    """Starts emulator and tx_node; gives what a test needs on `world`."""
    from xplane_bridge.msg import AppliedCommand, ControlMode, EventList

    opened = []

    def start(*emulator_options, aircraft="fixed_wing", **params):
        world.xplane = world.emulator("--no-beacon", "--start", "air", *emulator_options)
        world.wire = WatchedDatarefs(world.xplane.port, OVERRIDE, THROTTLES, STICK, LEVER, FLAP_HANDLE)
        opened.append(world.wire)
        world.applied = world.watch("control/applied", AppliedCommand)
        world.mode = world.watch("control/mode", ControlMode)
        world.events = world.watch("events", EventList)
        world.params = tx_params(aircraft, **params)
        world.set_param("aircraft", aircraft)
        world.node = world.start("tx_node", world.params)
        world.mode.wait_for()
        world.events.wait_for(lambda e: has(e, "CONNECTED"))
        return world.node

    world.manual = CommandSource(world, "control/manual")
    world.auto = CommandSource(world, "control/auto")
    yield start
    world.manual.stop()
    world.auto.stop()
    for wire in opened:
        wire.close()


def has(events, text):
    """Whether one of the events says this."""
    return any(text in event.text for event in events.events)


def content_of(path):
    try:
        return path.read_bytes()
    except OSError:
        return b""
