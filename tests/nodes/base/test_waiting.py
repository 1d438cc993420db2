"""Programs beside a bridge: what they say while they wait for it, and which aircraft they refuse to fly."""

from __future__ import annotations

from typing import Any, Iterator

import pytest

from xplane_bridge.harness import ManagedProcess
from xplane_bridge.harness.ros import roslaunch
from xplane_bridge.resources import program

QUAD = ("QUAD", "The quadrotor")


class Bridge:
    """What a bridge says of itself: link_state (latched) and flight_state."""

    def __init__(self, namespace: str) -> None:
        import rospy
        from xplane_bridge.msg import FlightState, LinkState

        self._link = rospy.Publisher(f"{namespace}/link_state", LinkState, queue_size=1, latch=True)
        self._state = rospy.Publisher(f"{namespace}/flight_state", FlightState, queue_size=1, latch=True)
        self._link_state, self._flight_state = LinkState(), FlightState(valid=FlightState.VALID_ALL)

    def link(self, state: int, reason: str, aircraft: tuple[str, str] = ("", "")) -> None:
        names = ("SEARCHING", "CONNECTED", "PAUSED")
        message = self._link_state
        message.state, message.state_name, message.reason = state, names[state], reason
        message.aircraft_icao, message.aircraft_description = aircraft
        self._link.publish(message)

    def fly(self) -> None:
        self._state.publish(self._flight_state)

    def close(self) -> None:
        self._link.unregister()
        self._state.unregister()


@pytest.fixture
def bridge(world) -> Iterator[Bridge]:
    own = Bridge(world.namespace)
    yield own
    own.close()


def start(world: Any, name: str, *arguments: str) -> ManagedProcess:
    command = [program(name), *arguments]
    return ManagedProcess(name, command, world.folder, env=world.env)


ALL = [
    ("attitude_hold", []),
    ("fly_controller", ["xplane_bridge.controllers.twin:Hold"]),
    ("scenario_player", ["left_aileron_stuck"]),
    ("virtual_joystick", ["demo_flight"]),
]
#: What they wait for first.
LINK, STATE = "link_state (xplane_bridge/LinkState)", "flight_state (xplane_bridge/FlightState)"
WAITING = [*((*program, LINK) for program in ALL), ("estimate_latency", ["--live", "5"], STATE)]


@pytest.mark.parametrize(("name", "arguments", "first"), WAITING)
def test_without_a_bridge_they_say_which_bridges_there_are(world, bridge, name, arguments, first):
    bridge.link(0, "no answer yet")
    bridge.fly()
    with start(world, name, *arguments, "--namespace", "/nowhere") as waiting:
        line = waiting.wait_for_line(r"^.*waiting: (.*)$", 60).group(0)
    assert line.startswith(f"{name}: waiting: no node publishes /nowhere/{first}")
    assert f"{world.namespace}/{first.split()[0]}" in line
    assert "--namespace" in line


def test_a_bridge_without_x_plane_gives_its_reason(world, bridge):
    bridge.link(0, "no answer from 192.0.2.1:49000")
    with start(world, "attitude_hold", "--namespace", world.namespace) as waiting:
        waiting.wait_for_line(
            rf"waiting: {world.namespace}/link_state does not say yet which aircraft is loaded; "
            "link to X-Plane: searching, no answer from 192.0.2.1:49000",
            60,
        )
        bridge.link(1, "flight data arrive", ("DA62", "The twin"))
        waiting.wait_for_line(
            rf"waiting: nothing on {world.namespace}/flight_state \(xplane_bridge/FlightState\), though /tests\w+ "
            "would publish it; link to X-Plane: connected, flight data arrive",
            60,
        )


@pytest.mark.parametrize(("name", "arguments"), ALL)
def test_another_aircraft_is_refused_in_words(world, bridge, name, arguments):
    bridge.link(1, "flight data arrive", QUAD)
    bridge.fly()
    with start(world, name, *arguments, "--namespace", world.namespace) as refusing:
        assert refusing.wait(60) == 1
    said = refusing.output()
    assert f"{name}: this is for fixed_wing (DA62, BE58, C172, KINE), but the aircraft loaded is QUAD" in said
    assert "Traceback" not in said


def test_a_virtual_joystick_that_no_mapper_takes_says_so(world, bridge):
    bridge.link(1, "flight data arrive", ("DA62", "The twin"))
    bridge.fly()
    with start(world, "virtual_joystick", "demo_flight", "--namespace", world.namespace) as playing:
        playing.wait_for_line(
            rf"^virtual_joystick: no node takes {world.namespace}/joy: start joystick_mapper_node \(roslaunch "
            r"xplane_bridge bridge.launch joystick:=mapper",
            60,
        )


def test_failure_launch_refuses_too(world, bridge):
    bridge.link(1, "flight data arrive", QUAD)
    bridge.fly()
    launch = roslaunch(world.master, world.folder, "failure.launch", ns=world.namespace.strip("/"), required=True)
    with launch:
        launch.wait_for_line("this is for fixed_wing .* but the aircraft loaded is QUAD", 60)


def test_an_aircraft_that_changes_in_flight_ends_the_controller(world, bridge):
    bridge.link(1, "flight data arrive", ("DA62", "The twin"))
    bridge.fly()
    with start(world, "attitude_hold", "--namespace", world.namespace) as flying:
        flying.wait_for_line("^commanding on", 60)
        bridge.link(1, "flight data arrive", QUAD)
        assert flying.wait(60) == 1
    assert "but the aircraft loaded is QUAD" in flying.output()


def test_any_aircraft_may_be_flown_by_who_insists(world, bridge):
    bridge.link(1, "flight data arrive", QUAD)
    with start(world, "attitude_hold", "--any-aircraft", "--namespace", world.namespace) as waiting:
        waiting.wait_for_line("waiting: nothing on .*/flight_state", 60)
