"""Programs are nodes below the namespace of their bridge: one for another bridge does not end them."""

from __future__ import annotations

from typing import Any

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.resources import program

PROGRAMS = [
    ("attitude_hold", []),
    ("fly_controller", ["xplane_bridge.controllers.twin:Hold"]),
    ("scenario_player", ["left_aileron_stuck"]),
    ("virtual_joystick", ["demo_flight"]),
    ("joy_reader", []),
    ("mavros_relay", []),
]


def running(world: Any) -> set[str]:
    """The nodes there are: all write to /rosout."""
    import rosgraph

    return set(dict(rosgraph.Master("/tests", world.master.uri).getSystemState()[0])["/rosout"])


def started(world: Any, log: str, name: str, *arguments: str, **more_env: str) -> ManagedProcess:
    command = [program(name), *arguments]
    return ManagedProcess(log, command, world.folder, env={**world.env, **more_env})


@pytest.mark.parametrize(("name", "arguments"), PROGRAMS)
def test_each_of_two_bridges_has_the_program(world, name, arguments):
    places = [f"{world.namespace}/{side}" for side in ("first", "second")]
    nodes = {f"{place}/{name}" for place in places}
    first, second = (
        started(world, f"{name}_{number}", name, *arguments, "--namespace", place)
        for number, place in enumerate(places, 1)
    )
    with first, second:
        wait_until(lambda: nodes <= running(world) or not (first.running and second.running), WAIT_S, "both nodes")
        assert nodes <= running(world), first.output() + second.output()


@pytest.mark.parametrize(("given", "node"), [("__name:=pilot", "/group/pilot"), ("__ns:={}/own", "/own/attitude_hold")])
def test_what_roslaunch_or_the_command_line_says_goes_before(world, given, node):
    here = world.namespace
    words = ["--namespace", f"{here}/first", given.format(here)]
    with started(world, "attitude_hold", "attitude_hold", *words, ROS_NAMESPACE=f"{here}/group") as hold:
        wait_until(lambda: f"{here}{node}" in running(world) or not hold.running, WAIT_S, f"{here}{node}")
        assert hold.running, hold.output()


def test_the_shells_namespace_is_not_the_bridges(world):
    here = world.namespace
    node = f"{here}/first/attitude_hold"
    words = ["--namespace", f"{here}/first"]
    with started(world, "attitude_hold", "attitude_hold", *words, ROS_NAMESPACE="/lab") as hold:
        wait_until(lambda: node in running(world) or not hold.running, WAIT_S, node)
        assert hold.running, hold.output()
