"""The doctor names the cause in ten broken set-ups, and finds nothing where all is well.

Two computers, as network namespaces with a cable between them: the emulator as X-Plane on one, the doctor on the other
as a user runs it. Where this computer does not permit such namespaces, the tests say so and are skipped.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Iterator

import pytest

from support.again import again_until
from support.nodes.network_namespaces import Machine, TwoMachines, why_no_machines
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.resources import program

READY_S = 60.0
_NOT_PERMITTED = why_no_machines()

pytestmark = pytest.mark.skipif(bool(_NOT_PERMITTED), reason=_NOT_PERMITTED)

#: Holds the UDP ports it is given, as any program that listens there.
HOG = """
import signal, socket, sys
held = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in sys.argv[1:]]
for each, port in zip(held, sys.argv[1:]):
    each.bind(("", int(port)))
print("HOLDS", flush=True)
signal.pause()
"""
#: Sends X-Plane the datagrams it is given in hexadecimal digits: host, port, datagram...
SEND = """
import socket, sys
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
    for digits in sys.argv[3:]:
        sender.sendto(bytes.fromhex(digits), (sys.argv[1], int(sys.argv[2])))
"""
#: A window of another program.
WINDOW = """
import tkinter
root = tkinter.Tk(); root.title("X-Plane manual.pdf"); root.update(); print("SHOWN", flush=True); root.mainloop()
"""


class Lab:
    """Programs on the two machines of one test.

    Args:
        machines: that run.
        folder: of logs and of ROS_HOME.
    """

    def __init__(self, machines: TwoMachines, folder: Path) -> None:
        self.simulator, self.bridge = machines.simulator, machines.bridge
        self.folder = folder
        self.ros_home = folder / "ros_home"
        self._numbers = itertools.count(1)
        self._stack = contextlib.ExitStack()

    def run(self, machine: Machine, name: str, ready: str, *command: str | Path, **environment: str) -> None:
        """Starts a program on a machine, and waits for the line that says it is ready."""
        env = {**self.environment(), **environment}
        process = ManagedProcess(f"{name}_{next(self._numbers)}", [*machine.within(), *command], self.folder, env=env)
        process.start()
        self._stack.callback(process.stop)
        process.wait_for_line(ready, READY_S)

    def emulator(self, machine: Machine, *options: str | int, **environment: str) -> None:
        """Starts X-Plane's stand-in on a machine."""
        words = [sys.executable, program("xplane_emulator"), *map(str, options)]
        self.run(machine, "xplane_emulator", r"^READY\b", *words, **environment)

    def send(self, machine: Machine, host: str, *messages: Any) -> None:
        """Sends X-Plane messages from a machine."""
        machine.run(sys.executable, "-c", SEND, host, "49000", *(message.encode().hex() for message in messages))

    def doctor(self, *arguments: str | int, **environment: str) -> Diagnosis:
        """Runs the doctor on the bridge's machine."""
        done = subprocess.run(
            [*self.bridge.within(), sys.executable, program("xplane_doctor"), "--json", *map(str, arguments)],
            env={**self.environment(), **environment},
            capture_output=True,
            check=False,
            timeout=60.0,
        )
        assert done.returncode in (0, 1), done.stderr.decode()
        return Diagnosis(done.returncode, json.loads(done.stdout))

    def finds(self, causes: list[str], *arguments: str | int, **environment: str) -> Diagnosis:
        """Runs the doctor, which must find these causes and no other.

        Again where it has not: on a busy machine a program may be silent for longer than it listens.
        """
        diagnosis = again_until(lambda found: found.causes == causes, lambda: self.doctor(*arguments, **environment))
        assert diagnosis.causes == causes, diagnosis.findings
        assert diagnosis.exit_code == bool(causes)
        return diagnosis

    def finds_only(self, cause: str, *arguments: str | int, **environment: str) -> str:
        """The same of one; gives its text and remedy."""
        return self.finds([cause], *arguments, **environment).text_of(cause)

    def environment(self) -> dict[str, str]:
        """This process's, without what says something about ROS and displays."""
        kept = {key: value for key, value in os.environ.items() if not key.startswith("ROS_") and key != "DISPLAY"}
        return {**kept, "ROS_HOME": str(self.ros_home)}

    def close(self) -> None:
        """Ends all programs, last started first."""
        self._stack.close()


class Diagnosis:
    """What the doctor said."""

    def __init__(self, exit_code: int, findings: list[dict[str, Any]]) -> None:
        self.exit_code = exit_code
        self.findings = findings

    @property
    def causes(self) -> list[str]:
        """Ids of what there is to do something about."""
        return [each["id"] for each in self.findings if each["severity"] in ("warning", "problem")]

    def text_of(self, id_: str) -> str:
        """Text and remedy of a finding."""
        found = next(each for each in self.findings if each["id"] == id_)
        return f"{found['text']} -> {found['remedy']}"


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwoMachines]:
    with TwoMachines(tmp_path_factory.mktemp("machines")) as both:
        yield both


@pytest.fixture
def lab(machines: TwoMachines, tmp_path: Path) -> Iterator[Lab]:
    lab = Lab(machines, tmp_path)
    yield lab
    lab.close()


def test_a_healthy_x_plane_on_another_computer(lab: Lab) -> None:
    lab.emulator(lab.simulator, "--version", 12)
    diagnosis = lab.finds([])
    assert "10.77.0.1" in diagnosis.text_of("beacon")
    assert "10.77.0.1:49000" in diagnosis.text_of("answer")
    assert "X-Plane is version 12." in diagnosis.text_of("version")


def test_1_x_plane_is_not_started(lab: Lab) -> None:
    text = lab.finds_only("nothing-listens", "--host", "10.77.0.1")
    assert "nothing answers on 10.77.0.1:49000" in text
    assert "start X-Plane" in text


def test_2_a_firewall_drops_what_x_plane_is_asked(lab: Lab) -> None:
    lab.emulator(lab.simulator, "--fault", "indrop=1")  # its beacon still gets out
    text = lab.finds_only("dropped")
    assert "nothing answers on 10.77.0.1:49000, though X-Plane announces itself there" in text
    assert "Accept incoming connections" in text


def test_3_answers_from_another_address_of_the_same_computer(lab: Lab) -> None:
    lab.simulator.run("ip", "address", "add", "10.77.0.3/24", "dev", "veth0")
    try:
        lab.emulator(lab.simulator)
        text = lab.finds_only("other-address", "--host", "10.77.0.3")
    finally:
        lab.simulator.run("ip", "address", "del", "10.77.0.3/24", "dev", "veth0")
    assert "answers come from 10.77.0.1, but 10.77.0.3 is configured" in text
    assert "host:=10.77.0.1" in text


def test_4_several_x_planes_on_the_network(lab: Lab) -> None:
    lab.emulator(lab.simulator)
    lab.emulator(lab.simulator, "--port", 49010)
    text = lab.finds_only("several-simulators")
    assert "port 49000" in text
    assert "port 49010" in text
    lab.finds([], "--host", "10.77.0.1", "--port", 49010)


def test_5_other_programs_sit_on_the_ports_of_data_output(lab: Lab) -> None:
    lab.emulator(lab.simulator)
    script = lab.folder / "telemetry_reader"
    script.write_text(HOG, encoding="utf-8")
    lab.run(lab.bridge, "hog", r"^HOLDS$", sys.executable, script, "49001", "49003")
    diagnosis = lab.finds(["port-49001-taken", "data-port-taken"])
    assert "telemetry_reader (process " in diagnosis.text_of("port-49001-taken")
    assert "telemetry_reader (process " in diagnosis.text_of("data-port-taken")
    assert "UDP port 49003" in diagnosis.text_of("data-port-taken")


def test_5_x_plane_sends_data_output_unasked(lab: Lab) -> None:
    from xplane_bridge.protocol import NetworkTarget, RowSelection

    lab.emulator(lab.simulator)
    lab.send(lab.bridge, "10.77.0.1", RowSelection("DSEL", (3, 20)), NetworkTarget(64, "10.77.0.2", 49001, True))
    text = lab.finds_only("data-to-49001")
    assert "X-Plane at 10.77.0.1 sends Data Output to port 49001" in text
    lab.send(lab.bridge, "10.77.0.1", NetworkTarget(64, "10.77.0.2", 49003, True))
    text = lab.finds_only("unasked-data")
    assert "Data Output rows 3, 20 come from 10.77.0.1 to port 49003" in text


def test_6_a_dead_tx_node_has_left_its_override_on(lab: Lab) -> None:
    from xplane_bridge.protocol import DrefWrite

    path = "sim/operation/override/override_joystick"
    lab.emulator(lab.simulator)
    lab.send(lab.bridge, "10.77.0.1", DrefWrite(path, 1.0))
    with subprocess.Popen(["true"]) as ended:
        pass
    owner = {
        "node": "/xplane/tx_node",
        "pid": ended.pid,
        "start_ticks": 1,
        "boot_id": Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip(),
        "computer": os.uname().nodename,
    }
    undo = [{"op": "dref", "path": path, "value": 0.0}]
    entry = {"id": f"override:{path}", "purpose": "override", "owner": owner, "undo": undo}
    folder = lab.ros_home / "xplane_bridge"
    folder.mkdir(parents=True)
    journal = {"format": "xplane_bridge journal", "version": 1, "entries": [entry]}
    (folder / "10.77.0.1_49000.json").write_text(json.dumps(journal), encoding="utf-8")
    text = lab.finds_only("leftovers")
    assert f"/xplane/tx_node (process {ended.pid}) has ended without undoing" in text
    assert "X-Plane still shows override_joystick" in text
    assert "scripts/release_overrides" in text
    # What the remedy says is what helps.
    release = program("release_overrides")
    released = [*lab.bridge.within(), sys.executable, str(release)]
    subprocess.run(released, env=lab.environment(), check=True, stdout=subprocess.DEVNULL)
    lab.finds([])


def test_7_the_port_is_wrong(lab: Lab) -> None:
    lab.emulator(lab.simulator)
    text = lab.finds_only("wrong-port", "--host", "10.77.0.1", "--port", 49005)
    assert "nothing answers on 10.77.0.1:49005: X-Plane at 10.77.0.1 listens on port 49000" in text
    assert "port:=49000" in text


def test_8_there_is_no_ros_master(lab: Lab) -> None:
    lab.emulator(lab.simulator)
    master = {"ROS_MASTER_URI": "http://10.77.0.1:11311", "ROS_IP": "10.77.0.2"}
    text = lab.finds_only("no-master", **master)
    assert "no ROS master answers at http://10.77.0.1:11311" in text
    assert "start roscore" in text


def test_9_ros_ip_is_no_address_of_this_computer(lab: Lab) -> None:
    lab.emulator(lab.simulator)
    master = {"ROS_MASTER_URI": "http://localhost:11311", "ROS_IP": "10.77.0.77"}
    text = lab.finds_only("ros-name-not-here", **master)
    assert "ROS_IP is 10.77.0.77, which is no address of this computer (10.77.0.2)" in text


def test_10_no_window_has_x_planes_title(lab: Lab) -> None:
    with VirtualDisplay(lab.folder) as display:
        where = {"DISPLAY": display.display}
        lab.run(lab.bridge, "window", r"^SHOWN$", sys.executable, "-c", WINDOW, **where)
        lab.emulator(lab.bridge)
        text = lab.finds_only("no-window", **where)
        assert f'no window titled "X-System" or "X-Plane" on {display.display}' in text
        assert '"X-Plane manual.pdf"' in text


def test_a_healthy_x_plane_with_its_window_on_this_computer(lab: Lab) -> None:
    with VirtualDisplay(lab.folder) as display:
        where = {"DISPLAY": display.display}
        lab.emulator(lab.bridge, "--window", **where)
        diagnosis = lab.finds([], **where)
        assert "640x480" in diagnosis.text_of("window")
