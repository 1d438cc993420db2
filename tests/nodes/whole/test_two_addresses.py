"""X-Plane on a computer with two addresses, seen by rx_node from another computer.

Two computers, as network namespaces with a cable between them; the simulator's has two addresses on it. Where this
computer does not permit such namespaces, the tests say so and are skipped.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Iterator

import pytest

from support.deadlines import WAIT_S
from support.nodes.network_namespaces import TwoMachines, why_no_machines
from support.nodes.recorded_topics import RecordedTopics
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.resources import program

FIRST, SECOND = "10.77.0.1", "10.77.0.3"
_NOT_PERMITTED = why_no_machines()

pytestmark = pytest.mark.skipif(bool(_NOT_PERMITTED), reason=_NOT_PERMITTED)


class Link:
    """Master and X-Plane on one machine, rx_node on the other."""

    def __init__(self, machines: TwoMachines) -> None:
        self._machines = machines
        self._processes: list[ManagedProcess] = []
        machines.simulator.run("ip", "address", "add", f"{SECOND}/24", "dev", "veth0")
        self._run(True, "roscore", "roscore")

    def _run(self, simulator: bool, name: str, *command: str | Path) -> ManagedProcess:
        machine = self._machines.simulator if simulator else self._machines.bridge
        process = machine.process(f"{name}_{len(self._processes)}", command, self._machines.simulator)
        process.start()
        self._processes.append(process)
        return process

    def start_emulator(self, *options: str) -> None:
        """X-Plane, as `options` say."""
        words = [sys.executable, program("xplane_emulator"), *options]
        self._run(True, "xplane_emulator", *words).wait_for_line(r"^READY\b", WAIT_S)

    def start_rx_node(self, *args: str) -> RecordedTopics:
        """The bridge's side with arguments of its launch file; returns what it publishes."""
        recorded = RecordedTopics(self._machines.bridge.folder / "topics.jsonl", WAIT_S)
        self._run(False, "rx", "roslaunch", "--wait", "xplane_bridge", "rx.launch", *args)
        self._run(False, "topic_recorder", *recorded.command)
        return recorded

    def stop(self) -> None:
        """Ends all, last started first."""
        for process in reversed(self._processes):
            process.stop()


@pytest.fixture
def link(tmp_path: Path) -> Iterator[Link]:
    with TwoMachines(tmp_path) as machines:
        link = Link(machines)
        yield link
        link.stop()


def test_answers_from_the_second_address_are_named(link: Link) -> None:
    link.start_emulator("--answer-from", SECOND)
    there = link.start_rx_node()
    reason = f"answers come from {SECOND}, but {FIRST} announced itself"
    found = there.wait_for("link_state", lambda state: reason in state["reason"], "the other address")
    assert found["state"] == "SEARCHING"
    assert f"set the parameter host to {SECOND}" in found["reason"]
    assert not there.all("flight_state"), "what may be another X-Plane's is not published"


def test_the_address_that_answers_is_taken_when_it_is_configured(link: Link) -> None:
    link.start_emulator("--answer-from", SECOND)
    there = link.start_rx_node(f"host:={SECOND}")
    there.wait_for("link_state", lambda state: state["state"] == "CONNECTED" and state["host"] == SECOND, "a link")
    there.wait_for("flight_state", lambda _: True, "a state")


def test_a_computer_heard_under_both_addresses_is_one_x_plane(link: Link) -> None:
    link.start_emulator("--second-beacon", SECOND)
    there = link.start_rx_node()
    there.wait_for("link_state", lambda state: state["state"] == "CONNECTED", "a link")
    there.wait_for("flight_state", lambda _: True, "a state")
    there.wait_for_status("rx_node: link", lambda level, _: level == 0, "a link without a warning")
    assert not any("several X-Planes" in state["reason"] for state in there.all("link_state"))
