"""A controller in a process of its own that answers every frame of lock-step: wings level, nose where it is wanted.

    python -m support.flights.lockstep_controller NAMESPACE [AFTER]

Asks for AUTO in its first frame. After so many frames (default: never) it ends without a word.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import rospy
from xplane_bridge.msg import ControlCommand
from xplane_bridge.srv import ClearFailures, InjectExcitation, SetDataref, SetFailure, SetMode

from xplane_bridge.lockstep import Participant


def main() -> None:
    """Runs until ROS ends."""
    namespace, after = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0
    rospy.init_node("controller", argv=[f"__ns:={namespace}"])
    publisher = rospy.Publisher(
        f"{namespace}/control/auto", ControlCommand, queue_size=100, latch=True, tcp_nodelay=True
    )

    def call(service: str, kind: type, /, **request: Any) -> None:
        answer = rospy.ServiceProxy(f"{namespace}/tx_node/{service}", kind)(**request)
        if not answer.success:
            print(f"{service}: {answer.result.message}", flush=True)
            os._exit(2)

    def answer(state: Any) -> Any:
        # Each of these would wait for frames outside lock-step, and the frame waits for this answer.
        if state.frame_count == 1:
            call("set_mode", SetMode, mode=SetMode._request_class.AUTO)
        if state.frame_count == 100:
            call("set_failure", SetFailure, name="engine_1", kind="failed")
            call("set_dataref", SetDataref, name="sim/cockpit/electrical/landing_lights_on", values=[1.0])
        if state.frame_count == 200:
            call("inject_excitation", InjectExcitation, kind="doublet", target="pitch", amplitude=0.1, duration=1.0)
        if state.frame_count == 400:
            call("clear_failures", ClearFailures)
            call("set_mode", SetMode, mode=SetMode._request_class.MANUAL)
        if state.frame_count == 450:
            call("set_mode", SetMode, mode=SetMode._request_class.AUTO)
        if after and state.frame_count > after:
            os._exit(1)
        roll = -0.03 * state.roll_deg - 0.02 * state.angular_velocity.x + 0.2 * (state.frame_count % 120 < 30)
        return ControlCommand(
            fields=ControlCommand.ROLL | ControlCommand.PITCH | ControlCommand.YAW | ControlCommand.THROTTLE,
            sequence=state.frame_count,
            roll=min(max(roll, -1.0), 1.0),
            pitch=min(max(0.03 * (2.0 - state.pitch_deg), -1.0), 1.0),
            throttle=0.6,
        )

    participant = Participant(answer, publisher, namespace)
    print("ready", flush=True)
    rospy.spin()
    del participant


if __name__ == "__main__":
    main()
