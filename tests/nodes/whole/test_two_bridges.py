"""Two X-Planes in one graph, by two_bridges.launch: each bridge has its own flight, frames, journal and window.

The emulators fly on meridians of their own, by which every message shows whose it is.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import Any, Iterator

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import ROLL, CommandSource, WatchedDatarefs
from xplane_bridge.harness import ManagedProcess, roslaunch, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.resources import program

LONGITUDES = {"first": 20.0, "second": 40.0}
STICK = "sim/joystick/yoke_roll_ratio"
OVERRIDE = "sim/operation/override/override_joystick_roll"


class Side:
    """One of both X-Planes, with its bridge."""

    def __init__(self, world: Any, name: str) -> None:
        self.name, self._world, self.folder = name, world, world.folder / name
        self.namespace = f"{world.namespace}/{name}"
        self.port = free_udp_port()
        self.display = VirtualDisplay(self.folder)
        self.display.start()
        self.xplane = self._emulator()
        self.watched = WatchedDatarefs(self.port, OVERRIDE, STICK)
        self.stick: Any = None

    def _emulator(self) -> ManagedProcess:
        where = ["--bind", "127.0.0.1", "--port", str(self.port), "--no-beacon"]
        flight = ["--lon", str(LONGITUDES[self.name]), "--window", "--fps", "30"]
        words = ["env", f"DISPLAY={self.display.display}", sys.executable, program("xplane_emulator"), *where, *flight]
        process = ManagedProcess(f"xplane_emulator_{self.name}", words, self.folder)
        process.start()
        process.wait_for_line(r"^READY\b", WAIT_S)
        return process

    def watch(self, topic: str, kind: type) -> Any:
        """Keeps what comes on a topic of this side's bridge."""
        return self._world.watch(f"{self.namespace}/{topic}", kind)

    def fly(self, roll: float) -> None:
        """Holds the stick of this side."""
        self.stick = self.stick or CommandSource(self, "control/manual")
        self.stick.fly(fields=ROLL, roll=roll)

    def pid_of(self, node: str) -> int:
        """The process of a node of this side."""
        import rosgraph
        from rospy.core import xmlrpcapi

        uri = rosgraph.Master("/tests").lookupNode(f"{self.namespace}/{node}")
        return int(xmlrpcapi(uri).getPid("/tests")[2])

    def journal(self) -> list[str]:
        """What is to be undone in this side's X-Plane."""
        file = self._world.folder / "ros_home" / "xplane_bridge" / f"127.0.0.1_{self.port}.json"
        try:
            return [entry["id"] for entry in json.loads(file.read_text("utf-8"))["entries"]]
        except FileNotFoundError:  # nothing is to be undone
            return []

    def close(self) -> None:
        """Ends it."""
        if self.stick:
            self.stick.stop()
        self.watched.close()
        self.xplane.stop()
        self.display.stop()


@pytest.fixture
def sides(world) -> Iterator[tuple[Side, Side]]:
    both = (Side(world, "first"), Side(world, "second"))
    arguments: dict[str, Any] = {"listen_for_beacon": False, "publish_tf": True, "image_rate": 0}
    for side in both:
        arguments.update({side.name: side.namespace.lstrip("/"), f"{side.name}_host": "127.0.0.1"})
        arguments.update({f"{side.name}_port": side.port, f"{side.name}_x_display": side.display.display})
    launcher = roslaunch(world, world.folder, "two_bridges.launch", **arguments)
    with launcher:
        yield both
        for side in both:
            side.close()


def test_each_bridge_has_its_own_x_plane(sides, world):
    from nav_msgs.msg import Odometry
    from tf2_msgs.msg import TFMessage
    from xplane_bridge.msg import ControlMode, FlightState, FrameState, LinkState

    first, second = sides
    moving = world.watch("/tf", TFMessage)
    states = {side: side.watch("flight_state", FlightState) for side in sides}
    for side in sides:
        name = side.namespace.lstrip("/")
        state = states[side].wait_for(timeout=WAIT_S, what="a state")
        assert state.longitude == pytest.approx(LONGITUDES[side.name], abs=0.5)
        odometry = side.watch("odom", Odometry).wait_for(timeout=WAIT_S)
        assert (odometry.header.frame_id, odometry.child_frame_id) == (f"{name}/map", f"{name}/base_link")
        picture = side.watch("camera/frame_state", FrameState).wait_for(
            lambda f: not f.quality & FrameState.QUALITY_STATE_MISSING, WAIT_S, "a picture with its state"
        )
        assert picture.state.longitude == pytest.approx(LONGITUDES[side.name], abs=0.5)
        assert picture.header.frame_id.startswith(f"{name}/camera_")
        moving.wait_for(
            lambda m, name=name: any(
                (t.header.frame_id, t.child_frame_id) == (f"{name}/map", f"{name}/base_link") for t in m.transforms
            ),
            WAIT_S,
            f"the transform of {name}",
        )
        link = side.watch("link_state", LinkState).wait_for(lambda s: s.state == s.CONNECTED, WAIT_S)
        assert link.port == side.port
        side.watch("control/mode", ControlMode).wait_for(timeout=WAIT_S)

    # Commands and journals.
    first.fly(0.5)
    first.watched.wait(STICK, 0.5, WAIT_S, 0.01)
    assert f"override:{OVERRIDE}" in first.journal()
    assert (second.journal(), second.watched.value(OVERRIDE)) == ([], 0.0)
    second.fly(-0.25)
    second.watched.wait(STICK, -0.25, WAIT_S, 0.01)
    first.watched.wait(STICK, 0.5, WAIT_S, 0.01)


def test_one_goes_and_the_other_flies_on(sides):
    from xplane_bridge.msg import ControlMode, FlightState, LinkState

    first, second = sides
    states = {side: side.watch("flight_state", FlightState) for side in sides}
    links = {side: side.watch("link_state", LinkState) for side in sides}
    for side, roll in ((first, 0.5), (second, -0.25)):
        states[side].wait_for(timeout=WAIT_S, what="a state")
        side.watch("control/mode", ControlMode).wait_for(timeout=WAIT_S)
        side.fly(roll)
        side.watched.wait(STICK, roll, WAIT_S, 0.01)

    # A node of one: its guardian gives back what it had, in its own X-Plane alone.
    os.kill(first.pid_of("tx_node"), signal.SIGKILL)
    first.watched.wait(OVERRIDE, 0.0, WAIT_S)
    wait_until(lambda: not first.journal(), WAIT_S, "an empty journal")
    assert f"override:{OVERRIDE}" in second.journal()
    second.watched.wait(STICK, -0.25, WAIT_S, 0.01)
    assert second.watched.value(OVERRIDE) == 1.0

    # The other's rx_node: the first one's states go on.
    os.kill(second.pid_of("rx_node"), signal.SIGKILL)
    states[first].wait_for_next(timeout=WAIT_S, what="a state of the first after the second's rx_node is gone")
    second.watched.wait(STICK, -0.25, WAIT_S, 0.01)

    # The X-Plane of the first: its link says so, the second flies on.
    first.xplane.kill()
    links[first].wait_for(lambda s: s.state in (s.STALE, s.LOST), WAIT_S, "silence")
    second.fly(0.25)
    second.watched.wait(STICK, 0.25, WAIT_S, 0.01)
    second.xplane.kill()
