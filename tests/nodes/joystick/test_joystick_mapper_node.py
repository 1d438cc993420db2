"""joystick_mapper_node: joy in, control/manual and control/mode_request out, with the shipped device files."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import RepeatedJoy
from xplane_bridge.harness import ManagedProcess, wait_until

JOYSTICKS = Path(__file__).resolve().parents[3] / "config" / "joysticks"
ROLL, PITCH, YAW, THROTTLE = 1, 2, 4, 8
DROPPED = "Messages of other nodes dropped (-)"


@pytest.fixture
def mapper(world):
    """Starts the node with a device file; returns the stick, the commands and the requests."""
    from xplane_bridge.msg import ControlCommand, ModeRequest

    sticks = []

    def start(device, axes=8, buttons=13, **params):
        options = yaml.safe_load((JOYSTICKS / f"{device}.yaml").read_text(encoding="utf-8"))
        options.update(params)
        world.commands = world.watch("control/manual", ControlCommand)
        world.requests = world.watch("control/mode_request", ModeRequest)
        world.node = world.start("joystick_mapper_node", options)
        stick = RepeatedJoy(world, axes, buttons)
        sticks.append(stick)
        stick.plug_in()
        return stick

    yield start
    for stick in sticks:
        stick.pull_out()


def commanded(field):
    return lambda command: bool(command.fields & field)


@pytest.mark.parametrize("device", sorted(path.stem for path in JOYSTICKS.glob("*.yaml")))
@pytest.mark.parametrize("stick_mode", [1, 2])
def test_every_shipped_device_loads_and_commands_the_stick(world, mapper, device, stick_mode):
    mapper(device, stick_mode=stick_mode)
    command = world.commands.wait_for(commanded(ROLL))
    assert command.fields == ROLL | PITCH | YAW, "nothing else before it is touched"
    assert (command.roll, command.pitch, command.yaw) == (0.0, 0.0, 0.0)


def test_stick_right_and_back_is_roll_right_and_nose_up(world, mapper):
    stick = mapper("logitech_extreme_3d_pro", axes=6, buttons=12)
    stick.axes = [-1.0, -1.0, 1.0, -0.5, 0.0, 0.0]  # right, back, twisted left, knob a quarter up
    command = world.commands.wait_for(lambda c: c.fields & THROTTLE and c.roll == 1.0)
    assert command.pitch == 1.0
    assert command.yaw == -1.0
    assert command.throttle == pytest.approx(0.25)
    assert command.header.stamp.to_sec() > 0


def test_mode_1_pitches_with_the_left_stick(world, mapper):
    stick = mapper("xbox", stick_mode=1)
    stick.axes[1] = -1.0
    assert world.commands.wait_for(lambda c: c.pitch != 0.0).pitch == 1.0
    stick.axes[1] = 0.0
    stick.axes[4] = 1.0
    throttle = world.commands.wait_for(lambda c: c.fields & THROTTLE and c.throttle > 0.05)
    assert throttle.pitch == 0.0


def test_trigger_asks_for_the_other_mode_once_a_press(world, mapper):
    import rospy
    from xplane_bridge.msg import ControlMode

    stick = mapper("logitech_extreme_3d_pro", axes=6, buttons=12)
    world.commands.wait_for()
    wait_until(lambda: world.requests.connected, WAIT_S, "the topic of requests")
    stick.buttons[0] = 1
    request = world.requests.wait_for()
    assert request.mode == 2
    assert request.requester == f"{world.namespace}/joystick_mapper_node"
    assert request.sequence > 0
    world.commands.wait_for_count(20)  # held: no further request
    assert len(world.requests.messages) == 1

    # Another node went back to MANUAL: the next press asks for AUTO again.
    publisher = rospy.Publisher(f"{world.namespace}/control/mode", ControlMode, queue_size=1, latch=True)
    publisher.publish(ControlMode(mode=1))
    wait_until(lambda: publisher.get_num_connections() > 0, WAIT_S, "the mapper's subscription")
    stick.buttons[0] = 0
    world.commands.wait_for_count(20)
    stick.buttons[0] = 1
    second = world.requests.wait_for(lambda r: r.sequence > request.sequence)
    assert second.mode == 2


def test_silent_device_ends_the_commands_and_is_said(world, mapper):
    stick = mapper("logitech_extreme_3d_pro", axes=6, buttons=12, joy_timeout=0.2)
    world.commands.wait_for()
    stick.pull_out()
    world.wait_for_diagnostics("joystick", lambda status: status.level == 1 and "silent" in status.message)
    count = len(world.commands.messages)
    world.wait_for_diagnostics("joystick", lambda status: status.level == 1)
    assert len(world.commands.messages) == count
    stick.plug_in()
    world.commands.wait_for_next()


def test_of_two_nodes_on_the_stick_one_counts_and_both_are_named(world, mapper):
    import rospy

    # longer than this process may be kept from moving the stick
    stick = mapper("logitech_extreme_3d_pro", axes=6, buttons=12, joy_timeout=10.0)
    stick.axes[0] = -1.0  # right
    world.commands.wait_for(lambda c: c.roll == 1.0)
    before = len(world.commands.messages)
    left = f"{{axes: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], buttons: {[0] * 12}}}"
    command = ["rostopic", "pub", "-r", "50", f"{world.namespace}/joy", "sensor_msgs/Joy", left]
    other = ManagedProcess("other_hand", command, world.folder, env=world.env)
    other.start()
    try:
        status = world.wait_for_diagnostics("joystick", lambda s: int(world.values_of(s)[DROPPED]) > 50)
        assert status.level == 2
        assert f"{rospy.get_name()} is on the stick, the messages of /rostopic_" in status.message
        assert {c.roll for c in world.commands.messages[before:]} == {1.0}
        assert world.node.output().count("two nodes publish joy") == 1
        stick.pull_out()
        world.commands.wait_for_next(lambda c: c.roll == -1.0, WAIT_S)
    finally:
        other.stop()


def test_device_with_too_few_axes_is_named(world, mapper):
    mapper("xbox", axes=2, buttons=11)
    status = world.wait_for_diagnostics("joystick", lambda s: s.level == 2)
    assert "Xbox-type gamepad: axis 3 (direct.roll.axis) does not exist" in status.message
    assert not world.commands.wait_for().fields & ROLL


def test_wrong_key_stops_the_node_in_words(world):
    node = world.start("joystick_mapper_node", {"device": "x", "direct": {"roll": {"axis": 0, "dead_zon": 0.1}}})
    assert node.wait(WAIT_S) == 1
    assert "direct/roll/dead_zon" in node.output()


def test_slats_are_refused_in_words(world):
    node = world.start("joystick_mapper_node", {"device": "x", "direct": {"slats": {"axis": 0}}})
    assert node.wait(WAIT_S) == 1
    assert "X-Plane has no handle for slats, they follow that of the flaps" in node.output()


def test_wrong_target_stops_the_node_in_words(world):
    node = world.start("joystick_mapper_node", {"device": "x", "direct": {"ailerons": {"axis": 0}}})
    assert node.wait(WAIT_S) == 1
    assert "trim_pitch" in node.output()
