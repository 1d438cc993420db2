"""xplane_joy_node: the joystick at X-Plane's own computer flies through the bridge.

The emulator's joystick is held by its scripted pilot; raw axes go on while an override has the aircraft.
"""

from __future__ import annotations

import pytest
import yaml

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import THROTTLE, WatchedDatarefs, tx_params
from xplane_bridge import protocol
from xplane_bridge.harness import wait_until
from xplane_bridge.resources import config_file

ROLL_OVERRIDE = "sim/operation/override/override_joystick_roll"
YOKE, ROLL_RATE = "sim/joystick/yoke_roll_ratio", "sim/flightmodel/position/P"
ASSIGNMENTS = "sim/joystick/joystick_axis_assignments"
#: Right for so long, then left; the throttle stays at 0.7.
STICK = """
name: hand
description: a hand that moves X-Plane's own stick
repeat_every: 8
events:
  - {at: 0, stick: {roll: 0.24, throttle: 0.7}}
  - {at: 4, stick: {roll: -0.24}}
"""
#: After the device file's dead zone of 0.05.
SHAPED = 0.2


@pytest.fixture
def stick(world):
    """Starts X-Plane with a hand at its stick, and the node; gives the topic joy."""
    from sensor_msgs.msg import Joy

    def start(*options, **params):
        hand = world.folder / "hand.yaml"
        hand.write_text(STICK, encoding="utf-8")
        world.xplane = world.emulator("--no-beacon", "--start", "air", "--pilot", str(hand), *options)
        joy = world.watch("joy", Joy)
        world.node = world.start("xplane_joy_node", params)
        return joy

    return start


def test_x_planes_own_stick_flies_the_aircraft_through_the_bridge(world, stick):
    from xplane_bridge.msg import ControlCommand

    stick()
    commands = world.watch("control/manual", ControlCommand)
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params())
    file = config_file("joysticks", "xplane.yaml")
    world.start("joystick_mapper_node", yaml.safe_load(file.read_text(encoding="utf-8")))
    wire = WatchedDatarefs(world.xplane.port, ROLL_OVERRIDE, YOKE, ROLL_RATE)
    try:
        for roll in (SHAPED, -SHAPED):
            command = commands.wait_for_next(lambda c, roll=roll: c.roll == pytest.approx(roll, abs=1e-3), WAIT_S)
            assert command.fields & THROTTLE
            assert command.throttle == pytest.approx(0.7, abs=1e-3)
            wire.wait(YOKE, roll, WAIT_S, tolerance=1e-3)  # the bridge's: X-Plane's own would be 0.24
            assert wire.value(ROLL_OVERRIDE) == 1.0
            side = 1.0 if roll > 0.0 else -1.0
            wait_until(lambda side=side: side * wire.value(ROLL_RATE) > 2.0, WAIT_S, "the bank that the stick asks for")
    finally:
        wire.close()


def test_axes_go_by_what_x_planes_settings_assign_them_to(world, stick):
    joy = stick()
    first = joy.wait_for(lambda j: j.axes[0] == pytest.approx(-0.24, abs=1e-3), WAIT_S)
    assert len(first.axes) == 12
    assert first.axes[1:3] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert first.axes[3] == pytest.approx(0.4, abs=1e-3)  # 0.7 of the lever's travel
    assert (first.header.frame_id, list(first.buttons)) == ("X-Plane's joystick", [0] * 32)
    client = world.wire(world.xplane.port)
    for axis, assignment in ((0, 1), (1, 2)):
        client.send(protocol.DrefWrite(f"{ASSIGNMENTS}[{axis}]", assignment))
    joy.wait_for_next(lambda j: j.axes[1] == pytest.approx(0.24, abs=1e-3), WAIT_S)
    for axis in (0, 1):
        client.send(protocol.DrefWrite(f"{ASSIGNMENTS}[{axis}]", 0))
    world.wait_for_diagnostics(
        "device", lambda s: s.level == 1 and "none of X-Plane's first 100 axes" in s.message, WAIT_S
    )
    client.send(protocol.DrefWrite(f"{ASSIGNMENTS}[0]", 2))
    world.wait_for_diagnostics(
        "device", lambda s: s.level == 0 and "roll 0, yaw 2, throttle 3 (reversed)" in s.message, WAIT_S
    )
    joy.wait_for_next(timeout=WAIT_S)


def test_an_x_plane_that_is_gone_is_said(world, stick):
    joy = stick()
    joy.wait_for(timeout=WAIT_S)
    world.wait_for_diagnostics("device", lambda s: s.level == 0 and s.message.startswith("reading"), WAIT_S)
    world.xplane.kill()
    gone = world.wait_for_diagnostics("device", lambda s: s.level == 1 and "nothing heard for" in s.message, WAIT_S)
    assert float(world.values_of(gone)["Silence (s)"]) > 0.0


def test_without_a_joystick_nothing_is_published_and_it_is_said(world, stick):
    joy = stick("--joystick", "none", buttons=4, rate=20)
    world.wait_for_diagnostics("device", lambda s: s.level == 1 and "X-Plane has no joystick" in s.message, WAIT_S)
    assert not joy.messages


@pytest.mark.parametrize(
    ("params", "words"),
    [
        ({"axes": 501}, "axes is 501, but must be an integer from 1 to 500"),
        ({"first_button": 3200}, "first_button"),
        ({"devic": 1}, "devic"),
    ],
)
def test_a_wrong_parameter_stops_the_node_in_words(world, params, words):
    node = world.start("xplane_joy_node", params)
    assert node.wait(WAIT_S) == 1
    assert words in node.output()


def test_lockstep_is_refused(world):
    world.emulator("--no-beacon")
    world.set_param("lockstep", {"enabled": True, "participants": ["xplane_joy_node"]})
    node = world.start("xplane_joy_node")
    assert node.wait(WAIT_S) == 1
    assert "a hand does not wait for frames" in node.output()
