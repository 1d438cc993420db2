"""tx_node flies by DATA rows (`transport: data`), and gives them back."""

from __future__ import annotations

import signal

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    FLAPS,
    MANUAL,
    PITCH,
    ROLL,
    THROTTLE,
    YAW,
    CommandSource,
    WatchedDatarefs,
    call,
    journal_entries,
    tx_params,
)
from xplane_bridge.harness import wait_until

ROLL_STICK, PITCH_STICK = "sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_pitch_ratio"
LEVER = "sim/cockpit2/engine/actuators/throttle_ratio[1]"
FLAP_HANDLE = "sim/cockpit2/controls/flap_ratio"
BANK = "sim/flightmodel/position/true_phi"
OVERRIDE = "sim/operation/override/override_joystick_roll"
ROWS = {"override:DATA row 8", "override:DATA row 11", "override:DATA row 13", "override:DATA row 25"}


@pytest.fixture
def rows(world):
    """The twin with its own pilot, and tx_node."""
    from xplane_bridge.msg import AppliedCommand, EventList

    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    world.xplane = world.emulator("--no-beacon", "--start", "air", "--pilot", pilot)
    world.wire = WatchedDatarefs(world.xplane.port, ROLL_STICK, PITCH_STICK, LEVER, FLAP_HANDLE, BANK, OVERRIDE)
    world.applied = world.watch("control/applied", AppliedCommand)
    events = world.watch("events", EventList)
    world.set_param("aircraft", "fixed_wing")
    world.node = world.start("tx_node", tx_params(transport="data"))
    events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events))
    world.manual, world.auto = CommandSource(world, "control/manual"), CommandSource(world, "control/auto")
    yield world
    world.manual.stop()
    world.auto.stop()
    world.wire.close()


def fly(world):
    """A quarter to the right, with flaps and power."""
    world.manual.fly(fields=ROLL | PITCH | YAW | THROTTLE | FLAPS, roll=0.25, pitch=0.05, throttle=0.7, flaps=0.5)
    for path, value in ((ROLL_STICK, 0.25), (PITCH_STICK, 0.05), (LEVER, 0.7), (FLAP_HANDLE, 0.5)):
        world.wire.wait(path, value)


def test_it_flies_by_the_same_arbiter(rows):
    fly(rows)
    assert rows.applied.wait_for(lambda a: a.read_back and a.roll == 0.25).read_back_frames > 0
    wait_until(lambda: rows.wire.value(BANK) > 10.0, WAIT_S, "a bank to the right")
    rows.auto.fly(fields=ROLL, roll=-0.25)
    assert call(rows, "set_mode", "SetMode", mode=AUTO).success
    rows.wire.wait(ROLL_STICK, -0.25)
    assert call(rows, "set_mode", "SetMode", mode=MANUAL).success
    rows.wire.wait(ROLL_STICK, 0.25)
    rows.manual.stop()
    rows.wire.wait(ROLL_STICK, 0.0)  # the failsafe


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_what_rows_hold_is_given_back(rows, end):
    """After a crash by the guardian: the pilot has stick and levers again."""
    fly(rows)
    assert set(journal_entries(rows)) >= ROWS
    rows.node.send_signal(end)
    rows.wire.wait(OVERRIDE, 0.0)
    wait_until(lambda: abs(rows.wire.value(LEVER) - 0.7) > 0.01, WAIT_S, "the pilot's throttle")
    wait_until(lambda: abs(rows.wire.value(ROLL_STICK) - 0.25) > 0.02, WAIT_S, "the pilot's stick")
    wait_until(lambda: not journal_entries(rows), WAIT_S, "an empty journal")
