"""joy_reader: a joystick as sensor_msgs/Joy, where ROS's joy_node is not installed."""

from __future__ import annotations

import argparse
import time
from typing import Any, List, Optional, Sequence

from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.errors import is_number
from xplane_bridge.joystick.sdl_reader import REST_S, JoyReader, JoyState, device_names, start_sdl
from xplane_bridge.topics import NAMESPACE, absolute

_DIAGNOSTICS_S = 1.0
#: So much longer than joystick_mapper_node's joy_timeout is the rest of a joystick that was lost [s].
_BEYOND_TIMEOUT_S = 0.5


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="joy_reader",
        description=(
            "Publishes a joystick on NS/joy with the axis and button numbers, signs and ranges of ROS's joy_node. "
            "It is read with SDL (pygame). After it was pulled out and plugged in again it goes on; until one is "
            "there, it is looked for."
        ),
    )
    p.add_argument(
        "--device", default="", metavar="WHICH", help="index (see --list) or a part of its name (default: the first)"
    )
    p.add_argument(
        "--deadzone",
        type=float,
        default=0.0,
        metavar="PART",
        help="of each axis' travel (%(default)g)",
    )
    p.add_argument(
        "--autorepeat-rate", type=float, default=50.0, metavar="HZ", help="while nothing moves; 0: none (%(default)g)"
    )
    p.add_argument(
        "--coalesce-interval", type=float, default=0.005, metavar="S", help="axes within it: one message (%(default)g)"
    )
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    p.add_argument("--list", action="store_true", help="list the joysticks that are plugged in; needs no ROS")
    return p


def rest_s(mapped: Any) -> float:
    """How long nothing is published of a joystick that was lost [s], so that joystick_mapper_node sees it go.

    Args:
        mapped: joy_timeout of the parameter server [s], where it is there; what is no number the mapper refuses itself.
    """
    return max(REST_S, mapped + _BEYOND_TIMEOUT_S) if is_number(mapped) else REST_S


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    args = parser().parse_args(ros_arguments(argv))
    if args.list:
        names = device_names(start_sdl())
        print("\n".join(f"{index}  {name}" for index, name in enumerate(names)) or "no joystick is plugged in")
        return 0
    pygame = start_sdl()
    timeout = args.namespace.rstrip("/") + "/joystick_mapper_node/joy_timeout"
    options = (args.device, args.deadzone, args.autorepeat_rate, args.coalesce_interval)
    reader = JoyReader(pygame, *options, rest_s=lambda: rest_s(_parameter(timeout)))
    _Node(start_node("joy_reader", args.namespace), pygame, reader, args.namespace).run()
    return 0


def _parameter(name: str) -> Any:
    """A parameter of another node; None where it is not there, or the master does not answer."""
    import rospy

    try:
        return rospy.get_param(name, None)
    except (OSError, rospy.ROSException):
        return None


class _Node:
    """The reader's ROS side."""

    def __init__(self, rospy: Any, pygame: Any, reader: JoyReader, namespace: str) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from sensor_msgs.msg import Joy

        self._rospy, self._pygame, self._reader = rospy, pygame, reader
        self._joy = rospy.Publisher(namespace.rstrip("/") + "/joy", Joy, queue_size=10, tcp_nodelay=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
        self._count = 0

    def run(self) -> None:
        """Reads and publishes until ROS ends."""
        said, next_diagnostics = "", 0.0
        while not self._rospy.is_shutdown():
            if self._reader.notice != said:
                said = self._reader.notice
                (self._rospy.loginfo if self._reader.name else self._rospy.logwarn)(said)
                next_diagnostics = 0.0
            now = time.monotonic()
            if now >= next_diagnostics:
                next_diagnostics = now + _DIAGNOSTICS_S
                self._publish_diagnostics()
            for state in self._reader.handle(self._wait(self._reader.patience(now)), time.monotonic()):
                self._publish(state)

    def _wait(self, patience: float) -> List[Any]:
        """All events there are, after at most `patience` [s]."""
        first = self._pygame.event.wait(max(1, int(patience * 1e3)))  # 0 would be for ever
        return [first, *self._pygame.event.get()]

    def _publish(self, state: JoyState) -> None:
        message = self._joy.data_class(axes=state.axes, buttons=state.buttons)
        message.header.stamp = self._rospy.Time.from_sec(time.time())
        message.header.frame_id = self._reader.name
        self._joy.publish(message)
        self._count += 1

    def _publish_diagnostics(self) -> None:
        from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

        message = self._diagnostics.data_class()
        message.header.stamp = self._rospy.Time.from_sec(time.time())
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if self._reader.name else DiagnosticStatus.WARN,
            name=self._rospy.get_name().lstrip("/") + ": device",
            message=self._reader.notice,
            hardware_id=self._reader.name,
            values=[KeyValue("Messages (-)", str(self._count))],
        )
        message.status.append(status)
        self._diagnostics.publish(message)
