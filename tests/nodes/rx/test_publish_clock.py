"""Stamps of simulator time without lock-step, and stepping a simulator that does not wait."""

from __future__ import annotations

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import ShownFrames, complete_rows, joined
from support.nodes.tx_fixtures import tx_params
from support.stretches import last_stretch
from xplane_bridge import protocol
from xplane_bridge.harness.processes import wait_until

START = 5e8
FPS, DISPLAY_DELAY_S = 20, 0.1
IN_A_ROW = 60
RUNNING_TIME, PAUSED = "sim/time/total_running_time_sec", "sim/time/paused"


def whole_run(states, clocks):
    """IN_A_ROW states one after the other of which nearly all have their time on /clock, or None."""
    shown = {clock.clock for clock in clocks}
    run = last_stretch((state.header.stamp in shown for state in states), IN_A_ROW)
    return states[run] if run else None


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
    wait_until(lambda: states.messages and clocks.messages, WAIT_S, "frames before the first command")

    def applied_now():
        stick.publish(ControlCommand(fields=ControlCommand.ROLL, roll=0.1))
        return len(applied.messages) >= 20

    wait_until(applied_now, WAIT_S, "commands applied")
    surfaces.wait_for_count(20)
    recent = wait_until(lambda: whole_run(states.messages[:], clocks.messages[:]), WAIT_S, "states with their time")
    commanded = applied.messages[-10:]
    newest = max(message.header.stamp for message in recent + commanded)
    clocks.wait_for(lambda clock: clock.clock >= newest)
    states.wait_for(lambda state: state.header.stamp >= newest)
    for state in states.messages:
        assert state.header.stamp.to_sec() == pytest.approx(START + state.sim_time_unwrapped, abs=1e-6)
        assert state.stamp_uncertainty == 0.0
    times = {state.header.stamp for state in states.messages}  # none of a queue of 100 is lost
    shown = [clock.clock for clock in clocks.messages if min(times) <= clock.clock <= newest]
    assert set(shown) <= times, "a time of no frame"
    assert all(later >= earlier for earlier, later in zip(shown, shown[1:]))
    # The frame's own time, not that of the frame it was published in.
    for message in surfaces.messages[-20:]:
        assert message.header.stamp.to_sec() == pytest.approx(START + message.sim_time, abs=1e-3)
    # tx_node knows the time from /clock: that of the frame before.
    for message in commanded:
        assert message.header.stamp in times or message.header.stamp.to_sec() == START
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
def test_pictures_are_stamped_with_the_simulator_time_at_which_they_are_shown(world, display, tmp_path):
    from sensor_msgs.msg import CameraInfo, Image
    from xplane_bridge.msg import FrameState

    swaps = tmp_path / "swaps.csv"
    options = ("--window", "320x240", "--fps", FPS, "--pipeline-delay", f"{DISPLAY_DELAY_S}s", "--swap-log", swaps)
    emulator = world.emulator(*options)
    wire = world.wire(emulator.port)
    world.set_param("publish_clock", True)
    world.set_param("lockstep", {"start_time": START})
    world.set_param("display_delay", DISPLAY_DELAY_S)
    world.start("rx_node")
    world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    images, infos = world.watch("camera/image_raw", Image), world.watch("camera/camera_info", CameraInfo)
    states = world.watch("camera/frame_state", FrameState)
    frames = ShownFrames(images.messages)

    def punctual():
        """A busy machine draws many too late."""
        pairs = frames.judged(states.messages, swaps, DISPLAY_DELAY_S, FPS)
        return pairs if len(pairs) >= 30 else None

    pairs = wait_until(punctual, 2 * WAIT_S, "paired pictures that appeared when they were due")
    for state in joined(states, images):
        if state.quality == 0:
            assert state.display_time == state.header.stamp
            assert state.state.header.stamp.to_sec() == pytest.approx(START + state.state.sim_time_unwrapped, abs=1e-6)
    late = [state.header.stamp.to_sec() - START - shown.sim_time - DISPLAY_DELAY_S for state, shown in pairs]
    assert abs(np.median(late)) < 0.3 / FPS

    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wire.wait_until_reads(PAUSED, 1.0)
    flying = pairs[-1][0].header.stamp

    def standing():
        """The first of three pictures at one time; those before may have been on their way."""
        stamps = [image.header.stamp for image in images.messages[:] if image.header.stamp > flying]
        return next((a for a, b in zip(stamps, stamps[2:]) if (b - a).to_sec() < 1e-6), None)

    stands = wait_until(standing, WAIT_S, "pictures of a simulator that stands")
    images.wait_for_count(3)
    stamps = [image.header.stamp for image in list(images.messages)]
    assert all(later > earlier for earlier, later in zip(stamps, stamps[1:])), "each picture has a stamp of its own"
    assert (stamps[-1] - stands).to_sec() < 1e-6, "simulator time stands"
    # Of its own stamp: a busy machine loses some of a queue of two.
    wait_until(
        lambda: any(image.header.stamp >= stands for image in joined(images, infos, states)),
        WAIT_S,
        "info and state of one of them",
    )


def test_a_simulator_that_does_not_wait_is_stepped_by_its_pause(world):
    from std_srvs.srv import Trigger
    from xplane_bridge.srv import LockstepStep

    truth = world.folder / "truth.csv"
    emulator = world.emulator("--fps", 60, "--truth", truth)
    wire = world.wire(emulator.port)
    world.set_param("stale_after", 5.0)  # late frames are no lost link
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
