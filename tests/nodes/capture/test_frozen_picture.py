"""capture_node finds that the picture stands while the aircraft moves; the state that moves is the test's."""

from __future__ import annotations

import contextlib
import sys
import threading
from typing import ContextManager

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.meanwhile import meanwhile
from xplane_bridge.eye.jpeg import encoder
from xplane_bridge.eye.pairing import Decision, Frame
from xplane_bridge.eye.sender import Sender
from xplane_bridge.harness import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ports import free_tcp_port

TITLE = "Still life"
FROZEN = "frozen: the aircraft moves, the picture does not"


def moving(world) -> ContextManager[None]:
    """A flight state that moves, of an X-Plane that does not answer, while capture_node runs."""
    import rospy
    from xplane_bridge.msg import FlightState

    state = rospy.Publisher(f"{world.namespace}/flight_state", FlightState, queue_size=1)
    wait_until(state.get_num_connections, WAIT_S, "capture_node's ear")

    def move(ended: threading.Event) -> None:
        roll = 0.0
        while not ended.wait(0.05):
            roll += 1.0
            state.publish(FlightState(roll_deg=roll % 90.0))

    return meanwhile(move)


def wait_for_said(world, text: str) -> int:
    """Waits until the diagnostics begin with a text; gives their level."""
    return world.wait_for_diagnostics("capture", lambda s: s.message.startswith(text), timeout=WAIT_S).level


@pytest.mark.usefixtures("screen")
def test_a_picture_that_stands_is_an_error_unless_the_aircraft_has_crashed(world, display) -> None:
    """A window in which nothing happens."""
    import rospy
    from sensor_msgs.msg import Image
    from xplane_bridge.msg import WarningState

    program = [sys.executable, "-c", f"import tkinter; root = tkinter.Tk(); root.title({TITLE!r}); root.mainloop()"]
    still = ManagedProcess("still", program, world.folder)
    world.point_to(9)  # nothing answers there
    world.start("capture_node", {"window": {"display": display, "search_period": 0.05, "title": TITLE}})
    images = world.watch("camera/image_raw", Image)
    warnings = rospy.Publisher(f"{world.namespace}/mission/warnings", WarningState, queue_size=1, latch=True)
    wait_until(warnings.get_num_connections, WAIT_S, "capture_node's ear")
    with moving(world), contextlib.ExitStack() as shown:
        shown.enter_context(still)
        images.wait_for(timeout=WAIT_S)
        assert wait_for_said(world, FROZEN) == 2
        warnings.publish(WarningState(crashed=1.0))
        assert wait_for_said(world, "the picture stands still: the aircraft has crashed") == 1
        warnings.publish(WarningState(crashed=0.0))
        assert wait_for_said(world, FROZEN) == 2
        shown.close()
        wait_for_said(world, "no picture: ")
        with pytest.raises(HarnessError):  # twice the time between repetitions of a picture that stands
            images.wait_for_next(timeout=2.0)


def test_a_picture_that_stands_over_the_loss_of_its_sender_is_found_frozen_again(world) -> None:
    from xplane_bridge.msg import FrameState

    world.point_to(9)  # nothing answers there
    address = "127.0.0.1", free_tcp_port()
    listen = "{}:{}".format(*address)
    world.start("capture_node", {"source": "sender", "sender": {"listen": listen}, "width": 64, "height": 48})
    states = world.watch("camera/frame_state", FrameState)

    def sender() -> Sender:
        return Sender(address, 0, "", "here:49000", encoder(90))

    picture = Decision(np.full((48, 64, 4), 128, np.uint8), 1000, Frame(900, 1.0, 1), 0.0, 0.0, 0)
    with moving(world):
        with sender() as eye:
            # One that comes before the subscriber is not published.
            wait_until(lambda: bool(states.messages) or eye.offer(picture), WAIT_S, "a picture")
            assert wait_for_said(world, FROZEN) == 2
        wait_for_said(world, "no picture: ")
        with sender() as eye:  # of a window that stands there is no other picture
            assert wait_for_said(world, FROZEN) == 2
            states.wait_for_next(lambda state: state.quality & FrameState.QUALITY_FROZEN, timeout=WAIT_S)
            eye.report_problem("X-Plane's window is minimised")
            wait_for_said(world, "no picture: the sender says: X-Plane's window is minimised")
