"""mavros_relay: what remapping cannot do for nodes that know MAVROS's names; launch/mavros.launch starts it."""

from __future__ import annotations

import argparse
import math
from typing import Any, Optional, Sequence, Tuple

from xplane_bridge.cli.bridge.flown_law import FlownLaw
from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.controllers.set_points import AIRCRAFT, SetPoints
from xplane_bridge.topics import NAMESPACE, absolute

_DEG = 180.0 / math.pi


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="mavros_relay",
        description="Pose, velocity and heading under MAVROS's names, and set-points (docs/setups/mavros.md).",
    )
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    p.add_argument(
        "--mavros", type=absolute, default="/mavros", metavar="NS", help="where MAVROS's names begin (%(default)s)"
    )
    p.add_argument("--set-points", action="store_true", help=f"fly set-points on control/auto ({AIRCRAFT} only)")
    p.add_argument("--engage", action="store_true", help="with --set-points: ask for mode AUTO")
    return p


def rotated(orientation: Any, vector: Any) -> Tuple[float, float, float]:
    """A vector turned by a unit quaternion (x, y, z, w): of the body into the frame its attitude is given in."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    tx = 2.0 * (y * vector.z - z * vector.y)
    ty = 2.0 * (z * vector.x - x * vector.z)
    tz = 2.0 * (x * vector.y - y * vector.x)
    return (
        vector.x + w * tx + y * tz - z * ty,
        vector.y + w * ty + z * tx - x * tz,
        vector.z + w * tz + x * ty - y * tx,
    )


def heading_deg(orientation: Any) -> float:
    """Clockwise from the frame's north (+y) [deg]."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return 90.0 - yaw * _DEG


class Relay:
    """Publishes what MAVROS makes of the same quantities.

    Args:
        namespace: Of the bridge, without a slash at its end.
        mavros: Where MAVROS's names begin, likewise.
    """

    def __init__(self, namespace: str, mavros: str) -> None:
        import rospy
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import Float64

        from xplane_bridge.msg import FlightState

        def out(topic: str, kind: Any) -> Any:
            return rospy.Publisher(f"{mavros}/{topic}", kind, queue_size=1, tcp_nodelay=True)

        self._pose = out("local_position/pose", PoseStamped)
        self._body = out("local_position/velocity_body", TwistStamped)
        self._local = out("local_position/velocity_local", TwistStamped)
        self._height = out("global_position/rel_alt", Float64)
        self._heading = out("global_position/compass_hdg", Float64)
        options = {"queue_size": 1, "tcp_nodelay": True}
        rospy.Subscriber(f"{mavros}/local_position/odom", Odometry, self._on_odometry, **options)
        rospy.Subscriber(f"{namespace}/flight_state", FlightState, self._on_state, **options)

    def _on_odometry(self, odometry: Any) -> None:
        from geometry_msgs.msg import PoseStamped, Twist, TwistStamped, Vector3
        from std_msgs.msg import Header

        header, twist, pose = odometry.header, odometry.twist.twist, odometry.pose.pose
        self._pose.publish(PoseStamped(header, pose))
        self._body.publish(TwistStamped(Header(0, header.stamp, odometry.child_frame_id), twist))
        local = Twist(*(Vector3(*rotated(pose.orientation, vector)) for vector in (twist.linear, twist.angular)))
        self._local.publish(TwistStamped(header, local))
        self._height.publish(pose.position.z)

    def _on_state(self, state: Any) -> None:
        if state.valid & state.VALID_ATTITUDE:
            self._heading.publish(state.heading_true_deg)


def subscribe(set_points: SetPoints, mavros: str) -> None:
    """Hands the set-points that come on MAVROS's names over; those that are not finite are left out."""
    import rospy
    from geometry_msgs.msg import PoseStamped, Twist, TwistStamped

    def finite(*values: float) -> bool:
        good = all(map(math.isfinite, values))
        if not good:
            rospy.logwarn_throttle(5.0, "mavros_relay: a set-point is not finite, expected numbers: it is left out")
        return good

    def on_pose(message: Any) -> None:
        at, way = message.pose.position, message.pose.orientation
        heading = heading_deg(way)
        if finite(at.x, at.y, at.z, heading):
            set_points.position(at.x, at.y, at.z, heading)

    def on_twist(twist: Any) -> None:
        speed, turn = twist.linear, -twist.angular.z * _DEG
        if finite(speed.x, speed.y, speed.z, turn):
            set_points.velocity(speed.x, speed.y, speed.z, turn)

    options = {"queue_size": 1, "tcp_nodelay": True}
    rospy.Subscriber(f"{mavros}/setpoint_position/local", PoseStamped, on_pose, **options)
    rospy.Subscriber(f"{mavros}/setpoint_velocity/cmd_vel_unstamped", Twist, on_twist, **options)
    rospy.Subscriber(
        f"{mavros}/setpoint_velocity/cmd_vel", TwistStamped, lambda message: on_twist(message.twist), **options
    )


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    p = parser()
    args = p.parse_args(ros_arguments(argv))
    if args.engage and not args.set_points:
        p.error(f"--engage needs --set-points, which are flown in mode AUTO; they are for {AIRCRAFT} only")
    namespace, mavros = args.namespace.rstrip("/"), args.mavros.rstrip("/")
    start_node("mavros_relay", namespace)
    import rospy

    relay = Relay(namespace, mavros)
    if args.set_points:
        set_points = SetPoints()
        subscribe(set_points, mavros)
        FlownLaw(set_points, "mavros_relay", namespace, [AIRCRAFT]).run(args.engage)
    else:
        rospy.spin()
    del relay
    return 0
