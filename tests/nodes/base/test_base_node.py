"""BaseNode, by the tiny node of tiny_node.cpp: parameters, callbacks, services, diagnostics, and above all its end."""

from __future__ import annotations

import contextlib
import signal
import threading
import xmlrpc.client

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.harness import ManagedProcess, RosMaster, wait_until
from xplane_bridge.harness.ports import free_tcp_port

STOP_ORDER = ["start", "stop_inputs", "undo", "final_state", "join"]


@pytest.fixture
def tiny(world):
    """Starts the tiny node with further parameters and waits until it runs."""

    def start(wait=True, **params):
        from std_msgs.msg import String

        world.trace = world.folder / "trace"
        node = world.start("tiny_node", {"trace_file": str(world.trace), **params})
        if wait:
            world.last_word = world.watch("last_word", String)
            world.last_word.wait_for(lambda word: word.data == "running")
        return node

    return start


def trace(world):
    """The steps the node went through."""
    return world.trace.read_text(encoding="utf-8").split()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_ends_it_in_order(world, tiny, number):
    node = tiny()
    node.send_signal(number)
    assert node.wait(WAIT_S) == 0
    assert trace(world) == STOP_ORDER
    assert world.last_word.wait_for(lambda word: word.data == "undone")
    assert f"stopping: {number.name}" in node.output()


def test_first_line_comes_at_once_and_reports_what_the_node_was_given(world, tiny):
    """Its output goes into a file here, as roslaunch's does where that is redirected."""
    world.set_param("port", 49010)
    node = tiny(gain=2.5, mode="calm", limits={"upper": 100.0})
    started = node.wait_for_line(r"^.*tiny_node starts with (.*?)(\x1b\[0m)?$", WAIT_S)
    assert started.group(1) == f'port: 49010, ~gain: 2.5, ~trace_file: "{world.trace}"'


def test_master_shutdown_request_ends_it_in_order(world, tiny):
    """What `rosnode kill` does, and the master itself when a node of the same name registers."""
    node = tiny()
    with xmlrpc.client.ServerProxy(world.master.uri) as master:
        uri = master.lookupNode("/tests", f"{world.namespace}/tiny_node")[2]
    with xmlrpc.client.ServerProxy(uri) as slave:
        assert slave.shutdown("/tests", "user request")[0] == 1
    assert node.wait(WAIT_S) == 0
    assert trace(world) == STOP_ORDER
    assert "shutdown request: user request" in node.output()


def test_second_node_of_the_same_name_replaces_the_first_in_order(world, tiny):
    first = tiny()
    world.trace.rename(world.folder / "first")
    second = tiny(wait=False)
    assert first.wait(WAIT_S) == 0
    assert (world.folder / "first").read_text(encoding="utf-8").split() == STOP_ORDER
    wait_until(lambda: world.trace.exists() and "start" in trace(world), WAIT_S, "the second node's start")
    for _ in range(2):
        world.wait_for_diagnostics("tiny")
    assert second.running
    with xmlrpc.client.ServerProxy(world.master.uri) as master:
        code, _, uri = master.lookupNode("/tests", f"{world.namespace}/tiny_node")
    with xmlrpc.client.ServerProxy(uri) as slave:
        assert (code, slave.getPid("/tests")[2]) == (1, second.pid)


def test_ending_needs_no_master(world, tmp_path):
    with RosMaster(tmp_path / "other") as other:
        node = ManagedProcess(
            "tiny", [world.program("tiny_node"), f"_trace_file:={tmp_path / 'trace'}"], tmp_path, env=other.env
        )
        node.start()
        other_trace = tmp_path / "trace"
        wait_until(lambda: other_trace.exists() and "start" in other_trace.read_text(), WAIT_S, "start of the node")
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    assert other_trace.read_text(encoding="utf-8").split() == STOP_ORDER


def test_ctrl_c_while_waiting_for_a_master(world, tmp_path):
    env = {**world.env, "ROS_MASTER_URI": f"http://127.0.0.1:{free_tcp_port()}"}
    with ManagedProcess("tiny", [world.program("tiny_node")], tmp_path, env=env) as node:
        node.wait_for_line("no ROS master at .* waiting", WAIT_S)
        node.send_signal(signal.SIGINT)
        assert node.wait(WAIT_S) == 0


def test_hanging_end_is_cut_off_and_named(tiny):
    node = tiny(mode="hang_in_undo")
    node.send_signal(signal.SIGTERM)
    assert node.wait(WAIT_S) == 3
    assert "hangs in: undo in X-Plane" in node.output()


def test_none_of_its_threads_works_while_it_waits_for_x_plane_in_the_end(world, tiny):
    node = tiny(mode="rest_in_undo")
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    assert trace(world) == [*STOP_ORDER[:3], "rested", *STOP_ORDER[3:]]


def test_failing_start_ends_it_in_order_with_its_own_status(world, tiny):
    node = tiny(wait=False, mode="fail_at_start")
    assert node.wait(WAIT_S) == 1
    assert "port 49003 is in use" in node.output()
    assert trace(world) == STOP_ORDER[1:]


def test_failure_later_has_its_own_status(world, tiny):
    import rospy
    from std_msgs.msg import Float64

    node = tiny(mode="fail_later")
    rospy.Publisher(f"{world.namespace}/ping", Float64, queue_size=1, latch=True).publish(1.0)
    assert node.wait(WAIT_S) == 2
    assert "the test wanted it" in node.output()
    assert trace(world) == STOP_ORDER


@pytest.mark.parametrize(
    ("params", "parts"),
    [
        ({"gian": 2.0}, ["/tiny_node/gian", "did you mean gain?"]),
        ({"gain": 11}, ["/tiny_node/gain is 11", "from 0 to 10"]),
        ({"gain": "much"}, ['gain is "much"', "a number from 0 to 10"]),
        ({"mode": "wild"}, ['mode is "wild"', "one of: calm"]),
        ({"limits": {"uper": 1}}, ["/tiny_node/limits/uper", "did you mean upper?"]),
        ({"trace_file": 3}, ["trace_file is 3", "a text"]),
    ],
)
def test_wrong_parameters_are_refused_in_words(tiny, params, parts):
    node = tiny(wait=False, **params)
    assert node.wait(WAIT_S) == 1
    for part in parts:
        assert part in node.output()


def test_wrong_shared_parameter_is_refused(world, tiny):
    world.set_param("hots", "192.168.1.2")
    node = tiny(wait=False)
    assert node.wait(WAIT_S) == 1
    assert f"{world.namespace}/hots (did you mean host?)" in node.output()


def test_missing_required_parameter_is_named(world):
    node = world.start("tiny_node")
    assert node.wait(WAIT_S) == 1
    assert f"{world.namespace}/tiny_node/trace_file is required" in node.output()


def connected_pong(world):
    """What tiny_node answers, once: it must find this subscriber there."""
    from std_msgs.msg import Float64

    pong = world.watch("pong", Float64)
    wait_until(lambda: pong.connected, WAIT_S, "tiny_node's connection")
    return pong


def test_integer_does_for_a_double_and_callbacks_run(world, tiny):
    import rospy
    from std_msgs.msg import Float64

    tiny(gain=3)
    pong = connected_pong(world)
    ping = rospy.Publisher(f"{world.namespace}/ping", Float64, queue_size=1, latch=True)
    ping.publish(2.0)
    assert pong.wait_for().data == 6.0


def test_a_subscription_that_is_served_where_it_is_read_does_not_wait_for_another(world, tiny):
    import rospy
    from std_msgs.msg import Float64, String

    tiny(mode="await_nudge")
    pong = connected_pong(world)
    rospy.Publisher(f"{world.namespace}/ping", Float64, queue_size=1, latch=True).publish(2.0)
    wait_until(lambda: "waits" in trace(world), WAIT_S, "the callback of ping")
    rospy.Publisher(f"{world.namespace}/nudge", String, queue_size=1, latch=True).publish("")
    assert pong.wait_for().data == 2.0


def test_diagnostics_tick_at_one_hertz(world, tiny):
    tiny(gain=3)
    status = world.wait_for_diagnostics("tiny")
    assert status.message == "alive"
    assert float(world.values_of(status)["Gain (-)"]) == 3.0
    world.wait_for_diagnostics("tiny")


def test_with_use_sim_time_its_time_is_that_of_the_clock(world, tiny):
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray
    from rosgraph_msgs.msg import Clock

    publisher = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
    diagnostics = world.watch("/diagnostics", DiagnosticArray)
    world.master.set_param("/use_sim_time", True)
    try:
        tiny()
        for time_s in (1234, 1300):
            publisher.publish(Clock(clock=rospy.Time(time_s)))
            diagnostics.wait_for(lambda message, now=time_s: message.header.stamp.to_sec() == now)
    finally:
        world.master.set_param("/use_sim_time", False)
        publisher.unregister()


def test_waiting_service_does_not_delay_callbacks_nor_the_end(world, tiny):
    import rospy
    from std_msgs.msg import Float64
    from xplane_bridge.srv import GetDataref

    node = tiny()
    rospy.wait_for_service(f"{world.namespace}/endless_echo", WAIT_S)
    call = rospy.ServiceProxy(f"{world.namespace}/endless_echo", GetDataref)

    def wait_for_the_end():
        with contextlib.suppress(rospy.ServiceException):
            call("x", 0.0)

    waiting = threading.Thread(target=wait_for_the_end)
    waiting.start()
    wait_until(lambda: "echoing" in trace(world), WAIT_S, "the service")
    pong = connected_pong(world)
    ping = rospy.Publisher(f"{world.namespace}/ping", Float64, queue_size=1, latch=True)
    ping.publish(2.0)
    pong.wait_for()
    node.send_signal(signal.SIGINT)
    assert node.wait(WAIT_S) == 0
    assert trace(world) == ["start", "echoing", *STOP_ORDER[1:], "echoed"]
    waiting.join(WAIT_S)
    assert not waiting.is_alive()
