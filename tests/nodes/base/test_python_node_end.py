"""Nodes in Python end on a signal, whatever their main thread is at."""

from __future__ import annotations

import signal
import sys

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.harness.ports import free_tcp_port
from xplane_bridge.resources import program

#: Its main thread is within a call of the master, so to say, until the file in argv[1] is there.
_NODE = """
import os, sys, time, rosgraph
from xplane_bridge.cli.entry import start_node
rospy = start_node("busy_with_the_master")
with rospy.core.xmlrpcapi(rosgraph.get_master_uri())._lock:
    print("holds", flush=True)
    while not os.path.exists(sys.argv[1]):
        time.sleep(0.001)
while not rospy.is_shutdown():
    time.sleep(0.001)
"""


def talks(world) -> bool:
    """Whether the master takes it for a node that is there."""
    import rosgraph

    talking = dict(rosgraph.Master("/tests", world.master.uri).getSystemState()[0])
    return "/busy_with_the_master" in talking["/rosout"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_within_a_call_of_the_master_ends_the_node(world, tmp_path, number):
    answered = tmp_path / "answered"
    with ManagedProcess("busy", [sys.executable, "-c", _NODE, str(answered)], tmp_path, env=world.master.env) as node:
        node.wait_for_line("^holds", WAIT_S)
        assert talks(world)
        node.send_signal(number)
        answered.touch()
        assert node.wait(WAIT_S) == 0, node.output()
    assert not talks(world)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_node_that_waits_for_a_master(world, tmp_path, number):
    nowhere = {**world.master.env, "ROS_MASTER_URI": f"http://127.0.0.1:{free_tcp_port()}"}
    command = [str(program("attitude_hold")), "--heading", "40", "--engage"]
    with ManagedProcess("waiting", command, tmp_path, env=nowhere) as node:
        node.wait_for_line("Unable to register with master", WAIT_S)
        node.send_signal(number)
        assert node.wait(WAIT_S) == 130, node.output()
