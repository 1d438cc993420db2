"""mavros.launch: a node that knows MAVROS's names and ROS's own messages only flies the quadrotor by set-points."""

from __future__ import annotations

import math
import threading
from typing import Any, Iterator

import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import joined
from xplane_bridge.harness import roslaunch, wait_until

#: So far the quadrotor is to go, from where it was first seen [m]: east, north, up.
AWAY = (6.0, 3.0, 4.0)


class Node:
    """The node: nothing in it is of this package.

    Args:
        world: the test's namespace of nodes.
    """

    def __init__(self, world: Any) -> None:
        import rospy
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import Imu, NavSatFix
        from std_msgs.msg import Float64

        self.name = f"{world.namespace}/mavros"
        kinds = {
            "imu/data": Imu,
            "global_position/global": NavSatFix,
            "local_position/odom": Odometry,
            "local_position/pose": PoseStamped,
            "local_position/velocity_body": TwistStamped,
            "local_position/velocity_local": TwistStamped,
            "global_position/rel_alt": Float64,
            "global_position/compass_hdg": Float64,
        }
        self.heard = {topic: world.watch(f"{self.name}/{topic}", kind) for topic, kind in kinds.items()}
        self.pose = rospy.Publisher(f"{self.name}/setpoint_position/local", PoseStamped, queue_size=1)
        self.velocity = rospy.Publisher(f"{self.name}/setpoint_velocity/cmd_vel", TwistStamped, queue_size=1)
        self._repeated: tuple[Any, Any] | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._repeat, daemon=True)
        self._thread.start()

    def repeat(self, publisher: Any, message: Any) -> None:
        """This set-point is sent 20 times a second from now on."""
        self._repeated = (publisher, message)

    def silent(self) -> None:
        """None is."""
        self._repeated = None

    def _repeat(self) -> None:
        while not self._ended.wait(0.05):
            if self._repeated:
                publisher, message = self._repeated
                publisher.publish(message)

    def close(self) -> None:
        """Ends it."""
        self._ended.set()
        self._thread.join(10)

    def place(self) -> Any:
        """Where the aircraft is [m], ENU."""
        return self.heard["local_position/pose"].last.pose.position


@pytest.fixture
def node(world) -> Iterator[Node]:
    emulator = world.emulator("--aircraft", "multirotor", "--start", "air", "--alt", "100", "--heading", "90")
    name = world.namespace.lstrip("/")
    arguments = {"ns": f"{name}/xplane", "mavros_ns": f"{name}/mavros", "aircraft": "multirotor", "engage": True}
    where = {"host": "127.0.0.1", "port": emulator.port, "listen_for_beacon": False}
    launcher = roslaunch(world, world.folder, "mavros.launch", **arguments, **where)
    with launcher:
        node = Node(world)
        for topic in node.heard.values():
            topic.wait_for(timeout=WAIT_S)
        yield node
        node.close()


def test_what_it_hears_belongs_together(node):
    logs = [node.heard[f"local_position/{leaf}"] for leaf in ("pose", "odom", "velocity_body", "velocity_local")]
    logs[0].wait_for_count(20, WAIT_S)
    # Of queues of one a busy machine loses some, and not the same of all.
    stamp = wait_until(lambda: joined(*logs), WAIT_S, "messages of the same stamp")[-1].header.stamp
    last, same, body, local = (
        next(message for message in list(log.messages) if message.header.stamp == stamp) for log in logs
    )
    assert same.pose.pose == last.pose
    assert (last.header.frame_id, same.child_frame_id) == ("map", "base_link")
    assert (body.header.frame_id, local.header.frame_id) == ("base_link", "map")
    assert body.twist == same.twist.twist

    def length(v: Any) -> float:
        return math.sqrt(v.x**2 + v.y**2 + v.z**2)

    assert length(local.twist.linear) == pytest.approx(length(body.twist.linear), abs=1e-6)
    # Nose to the east: ahead is east, left is north.
    assert local.twist.linear.x == pytest.approx(body.twist.linear.x, abs=0.3)
    assert local.twist.linear.y == pytest.approx(body.twist.linear.y, abs=0.3)
    assert node.heard["global_position/compass_hdg"].last.data == pytest.approx(90.0, abs=5.0)
    assert node.heard["global_position/global"].last.altitude == pytest.approx(100.0, abs=30.0)
    assert node.heard["imu/data"].last.linear_acceleration.z == pytest.approx(9.8, abs=2.0)


def test_it_flies_by_set_points(node):
    from geometry_msgs.msg import PoseStamped, TwistStamped

    begin = node.place()
    there = PoseStamped()
    goal = there.pose.position
    goal.x, goal.y, goal.z = begin.x + AWAY[0], begin.y + AWAY[1], begin.z + AWAY[2]
    there.pose.orientation.w = 1.0  # nose to the east
    node.repeat(node.pose, there)

    def off() -> float:
        here = node.place()
        return max(abs(here.x - goal.x), abs(here.y - goal.y), abs(here.z - goal.z))

    wait_until(lambda: off() < 1.0, 2 * WAIT_S, "the place asked for")
    assert node.heard["global_position/rel_alt"].last.data == pytest.approx(goal.z, abs=2.0)

    north = TwistStamped()
    north.twist.linear.y = 2.0
    north.twist.angular.z = 0.3  # to the left, away from east towards north
    node.repeat(node.velocity, north)
    heading, local = node.heard["global_position/compass_hdg"], node.heard["local_position/velocity_local"]
    local.wait_for_next(
        lambda t: abs(t.twist.linear.y - 2.0) < 0.4 and abs(t.twist.linear.x) < 0.5, WAIT_S, "2 m/s north"
    )
    heading.wait_for_next(lambda h: 10.0 < h.data < 60.0, WAIT_S, "a turn to the left")


def test_without_a_set_point_nothing_is_commanded(node, world):
    from geometry_msgs.msg import PoseStamped
    from xplane_bridge.msg import ControlCommand, ControlMode

    commands = world.watch("xplane/control/auto", ControlCommand)
    mode = world.watch("xplane/control/mode", ControlMode)
    mode.wait_for(lambda m: m.mode == m.AUTO, WAIT_S)
    node.heard["local_position/pose"].wait_for_count(30, WAIT_S)
    assert not commands.messages
    here = PoseStamped()
    here.pose.position, here.pose.orientation.w = node.place(), 1.0
    node.repeat(node.pose, here)
    commands.wait_for(timeout=WAIT_S)
    node.silent()

    def is_silent():
        count = len(commands.messages)
        node.heard["local_position/pose"].wait_for_count(60, WAIT_S)
        return len(commands.messages) == count

    wait_until(is_silent, WAIT_S, "silence after the last set-point")
