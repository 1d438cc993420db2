"""Stamps of simulator time without lock-step, and stepping a simulator that does not wait."""

from __future__ import annotations

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import tx_params
from xplane_bridge.harness.processes import wait_until

START = 5e8
RUNNING_TIME, PAUSED = "sim/time/total_running_time_sec", "sim/time/paused"


def test_stamps_and_clock_are_simulator_time(world):
    import rospy
    from rosgraph_msgs.msg import Clock
    from xplane_bridge.msg import AppliedCommand, ControlCommand, FlightState, LinkState, SurfaceStates

    world.emulator("--fps", 60)
    world.set_param("publish_clock", True)
    world.set_param("lockstep", {"start_time": START})
    world.start("rx_node")
    world.start("tx_node", tx_params())
    states, clocks = world.watch("flight_state", FlightState), world.watch("/clock", Clock)
    surfaces, applied = world.watch("mission/surfaces", SurfaceStates), world.watch("control/applied", AppliedCommand)
    stick = rospy.Publisher(f"{world.namespace}/control/manual", ControlCommand, queue_size=1)
    wait_until(lambda: stick.get_num_connections() == 1, WAIT_S, "tx_node")

    def applied_now():
        stick.publish(ControlCommand(fields=ControlCommand.ROLL, roll=0.1))
        return len(applied.messages) >= 20

    wait_until(applied_now, WAIT_S, "commands applied")
    surfaces.wait_for_count(20)
    states.wait_for_count(60)
    recent, commanded = states.messages[-60:], applied.messages[-10:]
    clocks.wait_for(lambda clock: clock.clock >= max(m.header.stamp for m in recent + commanded))
    for state in states.messages:
        assert state.header.stamp.to_sec() == pytest.approx(START + state.sim_time_unwrapped, abs=1e-6)
        assert state.stamp_uncertainty == 0.0
    shown = {clock.clock for clock in clocks.messages}
    assert {state.header.stamp for state in recent} <= shown
    # The frame's own time, not that of the frame it was published in.
    for message in surfaces.messages[-20:]:
        assert message.header.stamp.to_sec() == pytest.approx(START + message.sim_time, abs=1e-3)
    # tx_node knows the time from /clock: that of the frame before.
    for message in commanded:
        assert message.header.stamp in shown or message.header.stamp.to_sec() == START
    link = world.watch("link_state", LinkState).wait_for(lambda m: m.state == m.CONNECTED)
    assert START <= link.header.stamp.to_sec() < START + 1e5


def test_it_is_off_by_default(world):
    import rospy
    from xplane_bridge.msg import FlightState

    world.emulator()
    world.start("rx_node")
    state = world.watch("flight_state", FlightState).wait_for()
    assert abs(state.header.stamp.to_sec() - rospy.get_time()) < 3600.0
    nodes = [publishers for topic, publishers in rospy.get_master().getSystemState()[2][0] if topic == "/clock"]
    assert not any(world.namespace + "/rx_node" in publishers for publishers in nodes)


def test_capture_node_says_that_it_cannot(world):
    world.point_to(49000)
    world.set_param("publish_clock", True)
    node = world.start("capture_node")
    wait_until(lambda: not node.running, WAIT_S, "end of capture_node")
    assert node.returncode == 1
    assert "capture:=false" in node.describe("")


def test_a_simulator_that_does_not_wait_is_stepped_by_its_pause(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.srv import LockstepStep

    wire = world.wire(world.emulator("--fps", 60).port)
    world.start("tx_node", tx_params())
    wait_until(lambda: world.call("lockstep/hold", Trigger).success, WAIT_S, "pause")
    assert wire.read(PAUSED) == 1.0
    before = wire.read(RUNNING_TIME)
    answer = world.call("lockstep/step", LockstepStep, frames=30)
    assert answer.success, answer.result.message
    assert wire.read(PAUSED) == 1.0
    after = wire.read(RUNNING_TIME)
    assert answer.flown >= 30
    assert answer.sim_time == pytest.approx(after, abs=1e-4)
    assert answer.flown == pytest.approx(60.0 * (after - before), abs=0.5)
    assert world.call("lockstep/run", Trigger).success
    assert wire.read(PAUSED) == 0.0
