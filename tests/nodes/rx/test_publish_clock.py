"""Stamps of simulator time without lock-step, and stepping a simulator that does not wait."""

from __future__ import annotations

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import complete_rows
from support.nodes.tx_fixtures import tx_params
from xplane_bridge import protocol
from xplane_bridge.emulator.view.renderer import read_strip
from xplane_bridge.harness.processes import wait_until

START = 5e8
FPS, DISPLAY_DELAY_S = 20, 0.1
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
    # A busy machine's subscriber may miss some.
    assert len({state.header.stamp for state in recent} - shown) < 0.1 * len(recent)
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


@pytest.mark.usefixtures("screen")
def test_pictures_are_stamped_with_the_simulator_time_at_which_they_are_shown(world, display):
    from sensor_msgs.msg import CameraInfo, Image
    from xplane_bridge.msg import FrameState

    emulator = world.emulator("--window", "320x240", "--fps", FPS, "--pipeline-delay", f"{DISPLAY_DELAY_S}s")
    wire = world.wire(emulator.port)
    world.set_param("publish_clock", True)
    world.set_param("lockstep", {"start_time": START})
    world.set_param("display_delay", DISPLAY_DELAY_S)
    world.start("rx_node")
    world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    images, infos = world.watch("camera/image_raw", Image), world.watch("camera/camera_info", CameraInfo)
    states = world.watch("camera/frame_state", FrameState)
    wait_until(lambda: sum(state.quality == 0 for state in states.messages) >= 40, WAIT_S, "paired pictures")

    by_stamp = {state.header.stamp: state for state in list(states.messages)}
    late = []
    for image in list(images.messages):
        state = by_stamp.get(image.header.stamp)
        if state is None or state.quality:
            continue
        assert state.display_time == image.header.stamp
        assert state.state.header.stamp.to_sec() == pytest.approx(START + state.state.sim_time_unwrapped, abs=1e-6)
        shown = read_strip(np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3))
        late.append(image.header.stamp.to_sec() - START - shown.sim_time - DISPLAY_DELAY_S)
    assert len(late) >= 30
    assert abs(np.median(late)) < 0.3 / FPS

    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wire.wait_until_reads(PAUSED, 1.0)
    before = len(images.messages)
    wait_until(lambda: len(images.messages) >= before + 3, WAIT_S, "pictures of a simulator that stands")
    stamps = [image.header.stamp for image in list(images.messages)]
    assert all(later > earlier for earlier, later in zip(stamps, stamps[1:])), "each picture has a stamp of its own"
    assert (stamps[-1] - stamps[-3]).to_sec() < 1e-6, "simulator time stands"
    infos.wait_for(lambda info: info.header.stamp == stamps[-1])
    states.wait_for(lambda state: state.header.stamp == stamps[-1])


def test_a_simulator_that_does_not_wait_is_stepped_by_its_pause(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.srv import LockstepStep

    truth = world.folder / "truth.csv"
    emulator = world.emulator("--fps", 60, "--truth", truth)
    wire = world.wire(emulator.port)
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
    assert world.call("lockstep/run", Trigger).success
    assert wire.read(PAUSED) == 0.0
    emulator.stop()
    flown = {np.float32(row["sim_time"]) for row in complete_rows(truth)}
    assert answer.flown == sum(before < time <= after for time in flown), "of whatever length"
