"""What node tests share: a ROS master of their own, real nodes under it, and an eye on topics."""

from __future__ import annotations

import contextlib
import itertools
import socket
from pathlib import Path
from typing import Any, Callable, Generator, Iterator

import pytest

from support.deadlines import WAIT_S
from support.interrupts import heed_ctrl_c
from support.nodes.connections import is_connected
from support.nodes.consoles import ends_of_consoles
from support.nodes.forked_emulator import ForkedEmulator
from support.scheduling import long_ones_first, rank
from support.worker_ports import keep_to_own_ports
from xplane_bridge import protocol
from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess, RosMaster, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.resources import node_program

_numbers = itertools.count(1)
#: Of emulators in real time that are not asked for another: half of xplane_emulator's own takes half the processor.
FRAMES_PER_SECOND = 30
#: Tests that take half a minute and more, none of which shares what its file has made with others; and files that take
#: a minute and a half.
LONG = (
    "whole/test_first_day.py::",
    "flights/test_flights.py::",
    "lockstep/test_lockstep_scenario.py::test_runs_with",
    "flights/test_demo.py::test_the_demo_flies",
    "whole/test_bench.py::",
    "capture/test_labelled_approach.py",
    "capture/test_sender.py::",
    "rx/test_rx_node.py",
    "rx/test_rx_link.py",
    "tx/test_traffic.py",
    "capture/test_capture_node.py",
    "tx/test_tx_node.py",
    "whole/test_doctor.py",
)

#: Of tests that keep a processor busy for a fifth of their time and more: they build, draw, run many programs or fly as
#: fast as they can. The others wait for simulated time.
BUSY = (
    "whole/",
    "flights/",
    "wire_log/",
    "capture/",
    "lockstep/test_lockstep_scenario.py",
    "lockstep/test_lockstep_pictures.py",
    "base/test_bad_inputs.py",
    "base/test_launch_files.py",
    "joystick/test_joystick_launch.py",
)

heed_ctrl_c()


def pytest_configure(config: pytest.Config) -> None:
    """Before any test draws a port."""
    keep_to_own_ports(config, 0)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Replaces pytest-xdist's own order of tests."""
    return long_ones_first(config, log, LONG, BUSY)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts long tests first."""
    items.sort(key=lambda item: rank(item.nodeid, LONG))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds what the programs of a failed test wrote."""
    report = yield
    folder = getattr(item, "funcargs", {}).get("tmp_path")
    if report.failed and folder is not None:
        report.sections += [(f"end of {name}", text) for name, text in ends_of_consoles(folder)]
    return report


@pytest.fixture(scope="session")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RosMaster]:
    """A ROS master for the whole run; this process is a node under it.

    To its end: after `rospy.signal_shutdown` a thread of rospy looks for calls on the socket that it has closed, again
    and again, and takes a processor from the tests of other processes.
    """
    with RosMaster(tmp_path_factory.mktemp("master")) as running:
        running.use_here()
        import rospy

        rospy.init_node("tests", anonymous=True, disable_signals=True)
        yield running


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Name of an X display for the tests of a file."""
    with VirtualDisplay(tmp_path_factory.mktemp("display")) as server:
        yield server.display


@pytest.fixture
def screen(display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Has the programs of a test show their windows there."""
    monkeypatch.setenv("DISPLAY", display)


class TopicLog:
    """Keeps what a topic brought."""

    def __init__(self, topic: str, message_type: type, queue_size: int = 1000) -> None:
        import rospy

        self.topic = topic
        self.messages: list[Any] = []
        self._after_found = self._event_number = 0
        self._subscriber = rospy.Subscriber(
            topic, message_type, self.messages.append, queue_size=queue_size, tcp_nodelay=True
        )

    @property
    def connected(self) -> bool:
        """Whether there is a publisher whose messages come from now on."""
        return is_connected(self._subscriber)

    @property
    def last(self) -> Any:
        """The newest message; None before the first."""
        return self.messages[-1] if self.messages else None

    def wait_for(
        self, condition: Callable[[Any], bool] = lambda _: True, timeout: float = WAIT_S, what: str = ""
    ) -> Any:
        """Waits for a message, from the first one on, that fulfils `condition`, and returns it."""
        return self._find(0, condition, timeout, what)

    def wait_for_next(
        self, condition: Callable[[Any], bool] = lambda _: True, timeout: float = WAIT_S, what: str = ""
    ) -> Any:
        """The same, among the messages that come from now on: for topics that stream."""
        return self._find(len(self.messages), condition, timeout, what)

    def then_wait_for(
        self, condition: Callable[[Any], bool] = lambda _: True, timeout: float = WAIT_S, what: str = ""
    ) -> Any:
        """The same, among the messages after the one found last (or the ones before skip_to_now()).

        For topics that report changes: the change may be published before the test asks for it.
        """
        return self._find(self._after_found, condition, timeout, what)

    def skip_to_now(self) -> None:
        """What has come until now is not what then_wait_for() and then_wait_for_event() look for."""
        self._after_found = len(self.messages)
        self._event_number = max((event.number for event in getattr(self.last, "events", ())), default=0)

    def then_wait_for_event(
        self, condition: Callable[[Any], bool] = lambda _: True, timeout: float = WAIT_S, what: str = ""
    ) -> Any:
        """Of an EventList, whose messages may bring several events: one after that found last, or skip_to_now()."""

        def newer(message: Any) -> list[Any]:
            return [event for event in message.events if event.number > self._event_number and condition(event)]

        event = newer(self._find(0, lambda message: bool(newer(message)), timeout, what))[0]
        self._event_number = event.number
        return event

    def wait_for_count(self, count: int, timeout: float = WAIT_S) -> list[Any]:
        """Waits until `count` more messages have come, and returns those."""
        first = len(self.messages)
        wait_until(lambda: len(self.messages) >= first + count, timeout, f"{count} messages on {self.topic}")
        return self.messages[first : first + count]

    def _find(self, first: int, condition: Callable[[Any], bool], timeout: float, what: str) -> Any:
        position = itertools.count(first)
        index = next(position)
        found: list[Any] = []

        def look() -> bool:
            nonlocal index
            while index < len(self.messages):
                message = self.messages[index]
                index = next(position)
                if condition(message):
                    found.append(message)
                    self._after_found = index
                    return True
            return False

        try:
            wait_until(look, timeout, f"{what or 'fitting message'} on {self.topic}")
        except HarnessError as error:
            msg = f"{error}; {len(self.messages)} came, the last:\n{self.last}"
            raise HarnessError(msg) from error
        return found[0]

    def close(self) -> None:
        """Ends the subscription."""
        self._subscriber.unregister()


class Wire:
    """Another client of X-Plane, as any program beside the bridge: writes and reads on its own socket.

    Args:
        port: X-Plane's, on this machine.
    """

    def __init__(self, port: int) -> None:
        self._to = ("127.0.0.1", port)
        self._index = itertools.count(1)

    def send(self, *messages: Any) -> None:
        """Sends messages of xplane_bridge.protocol."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for message in messages:
                sender.sendto(message.encode(), self._to)

    def read(self, path: str) -> float:
        """The value of a dataref."""
        index = next(self._index)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
            asker.settimeout(0.5)
            for _ in range(20):
                asker.sendto(protocol.RrefRequest(20, index, path).encode(), self._to)
                with contextlib.suppress(socket.timeout):
                    values = dict(protocol.decode_rref_response(asker.recv(65536)))
                    # One that was under way to the last socket with this port has another index.
                    if index in values:
                        asker.sendto(protocol.RrefRequest(0, index, path).encode(), self._to)
                        return values[index]
        pytest.fail(f"{path} does not answer")

    def wait_until_reads(self, path: str, value: float) -> None:
        """Waits until a dataref has a value."""
        wait_until(lambda: self.read(path) == value, WAIT_S, f"{path} = {value:g}")


class World:
    """One test's namespace under the master, with the nodes and the emulators started in it.

    Args:
        master: the running master.
        folder: of logs and files of this test.
    """

    def __init__(self, master: RosMaster, folder: Path) -> None:
        self.master = master
        self.folder = folder
        self.namespace = f"/test{next(_numbers)}"
        self._processes: list[ManagedProcess] = []
        self._logs: list[TopicLog] = []

    @property
    def env(self) -> dict[str, str]:
        """The environment of nodes: their journal is this test's own."""
        return {**self.master.env, "ROS_HOME": str(self.folder / "ros_home")}

    def set_param(self, key: str, value: object) -> None:
        """Sets a parameter below this test's namespace."""
        import rospy

        rospy.set_param(f"{self.namespace}/{key}", value)

    def program(self, name: str) -> Path:
        """One of the package's compiled programs."""
        return node_program(name, self.env)

    def start(self, program: str, params: dict[str, object] | None = None, log: str = "") -> ManagedProcess:
        """Starts a node with these private parameters; its name is the program's. Does not wait for it."""
        for key, value in (params or {}).items():
            self.set_param(f"{program}/{key}", value)
        process = ManagedProcess(
            log or f"{program}_{next(_numbers)}",
            [self.program(program), f"__ns:={self.namespace}"],
            self.folder,
            env=self.env,
        )
        process.start()
        self._processes.append(process)
        return process

    def launch(self, file: str, *arguments: str) -> ManagedProcess:
        """Starts a launch file of the package in this namespace. Does not wait for its nodes."""
        words = ["roslaunch", "xplane_bridge", file, f"ns:={self.namespace.lstrip('/')}", *arguments]
        process = ManagedProcess(f"{file}_{next(_numbers)}", words, self.folder, env=self.env)
        process.start()
        self._processes.append(process)
        return process

    def emulator(self, *options: str | Path | int | float, port: int = 0) -> EmulatorProcess:
        """Starts X-Plane's stand-in and makes it the X-Plane of this namespace's nodes (`host` and `port`)."""
        words = [str(option) for option in options]
        if "--stepped" not in words:
            words = ["--fps", str(FRAMES_PER_SECOND), *words]  # of two, the last one holds
        process = ForkedEmulator(self.folder, words, name=f"xplane_emulator_{next(_numbers)}", port=port)
        process.start()
        self._processes.append(process)
        self.point_to(process.port)
        return process

    @staticmethod
    def wire(port: int) -> Wire:
        """Another client of the X-Plane on a port of this machine."""
        return Wire(port)

    def call(self, service: str, service_type: type, *args: Any, **kwargs: Any) -> Any:
        """Calls a service of this namespace once it is there."""
        import rospy

        name = f"{self.namespace}/{service}"
        rospy.wait_for_service(name, WAIT_S)
        return rospy.ServiceProxy(name, service_type)(*args, **kwargs)

    def point_to(self, port: int) -> None:
        """Lets this namespace's nodes look for X-Plane on a port of this machine."""
        self.set_param("host", "127.0.0.1")
        self.set_param("port", port)
        self.set_param("listen_for_beacon", False)

    def watch(self, topic: str, message_type: type) -> TopicLog:
        """Keeps what comes on a topic of this namespace; a name with a leading slash is taken as it is."""
        log = TopicLog(topic if topic.startswith("/") else f"{self.namespace}/{topic}", message_type)
        self._logs.append(log)
        return log

    def wait_for_diagnostics(
        self, name: str, condition: Callable[[Any], bool] = lambda _: True, timeout: float = WAIT_S, heard: Any = None
    ) -> Any:
        """Waits for a status of one of this namespace's nodes whose name ends in `name`; returns it.

        Args:
            name: The end of its name.
            condition: What it has to fulfil.
            timeout: How long to wait [s].
            heard: A log of /diagnostics that listens already, for what a single message says; it stays open.
        """
        from diagnostic_msgs.msg import DiagnosticArray

        log = heard or self.watch("/diagnostics", DiagnosticArray)
        prefix = self.namespace.lstrip("/") + "/"
        found: list[Any] = []

        def fits(array: Any) -> bool:
            for status in array.status:
                ours = status.name.lstrip("/").startswith(prefix)
                if ours and status.name.endswith(name) and condition(status):
                    found.append(status)
            return bool(found)

        log.wait_for(fits, timeout, f"status {name!r}")
        if not heard:
            log.close()
        return found[0]

    @staticmethod
    def values_of(status: Any) -> dict[str, str]:
        """The key-value pairs of a diagnostic status."""
        return {pair.key: pair.value for pair in status.values}

    def close(self) -> None:
        """Ends everything, last started first."""
        for log in self._logs:
            log.close()
        for process in reversed(self._processes):
            process.stop()


@pytest.fixture(scope="session")
def new_world(master: RosMaster) -> Callable[[Path], World]:
    """Makes a World in a folder, for tests that share one; who makes it closes it."""
    return lambda folder: World(master, folder)


@pytest.fixture
def world(master: RosMaster, tmp_path: Path) -> Iterator[World]:
    """A namespace, a folder and processes of this test's own."""
    own = World(master, tmp_path)
    yield own
    own.close()
