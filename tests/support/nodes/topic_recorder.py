"""Writes down what arrives on the bridge's topics on its machine, a JSON object a line: for tests on two machines.

usage: topic_recorder.py FILE [TOPIC...]
"""

from __future__ import annotations

import json
import sys
import threading
from pathlib import Path
from typing import Any, Callable, Dict

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from xplane_bridge.msg import AppliedCommand, ControlMode, FlightState, FrameState, LinkState

from xplane_bridge.emulator.view.renderer import StripError, read_strip

_BUFFER = 2**26  # [bytes] several images, so that none waits in the publisher


def _image(image: Image) -> Dict[str, Any]:
    try:
        frame = read_strip(np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3))
    except StripError:
        return {"stamp": image.header.stamp.to_nsec(), "frame": None}
    return {"stamp": image.header.stamp.to_nsec(), "frame": frame.frame, "sim_time": frame.sim_time}


def _frame_state(message: FrameState) -> Dict[str, Any]:
    state = {"quality": message.quality, "image_count": message.image_count, "sim_time": message.state.sim_time}
    return {"stamp": message.header.stamp.to_nsec(), **state}


def _flight_state(state: FlightState) -> Dict[str, Any]:
    attitude = {"roll": state.roll_deg, "pitch": state.pitch_deg, "heading": state.heading_true_deg}
    return {
        "sim_time": state.sim_time,
        "altitude": state.altitude_msl,
        "control_roll": state.control_roll,
        **attitude,
    }


def _mode(mode: ControlMode) -> Dict[str, Any]:
    return {"mode": mode.mode, "failsafe": mode.failsafe, "reason": mode.reason}


def _link_state(link: LinkState) -> Dict[str, Any]:
    return {"state": link.state_name, "reason": link.reason, "host": link.host}


def _applied(command: AppliedCommand) -> Dict[str, Any]:
    return {"roll": command.roll, "read_back": command.read_back}


def _diagnostics(array: DiagnosticArray) -> Dict[str, Any]:
    return {"status": [[status.name, status.level, status.message] for status in array.status]}


_TOPICS = {
    "/xplane/camera/image_raw": (Image, _image),
    "/xplane/camera/frame_state": (FrameState, _frame_state),
    "/xplane/flight_state": (FlightState, _flight_state),
    "/xplane/link_state": (LinkState, _link_state),
    "/xplane/control/mode": (ControlMode, _mode),
    "/xplane/control/applied": (AppliedCommand, _applied),
    "/diagnostics": (DiagnosticArray, _diagnostics),
}


def main() -> None:
    """Runs until it is stopped."""
    rospy.init_node("topic_recorder", anonymous=True)
    lock = threading.Lock()
    with Path(sys.argv[1]).open("w", encoding="utf-8") as file:

        def write(topic: str, take: Callable[[Any], Dict[str, Any]]) -> Callable[[Any], None]:
            def on_message(message: Any) -> None:
                line = json.dumps({"topic": topic, **take(message)})
                with lock:
                    file.write(line + "\n")
                    file.flush()

            return on_message

        for topic in sys.argv[2:] or _TOPICS:
            message_type, take = _TOPICS[topic]
            rospy.Subscriber(topic, message_type, write(topic, take), queue_size=1000, buff_size=_BUFFER)
        rospy.spin()


if __name__ == "__main__":
    main()
