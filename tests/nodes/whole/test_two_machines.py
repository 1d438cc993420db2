"""The bridge on two machines, as in the paper: master, simulator and capture_node on one, all other nodes on the other.

The machines are network namespaces with a cable (veth pair) between them. Whether this computer permits those is found
out by making them; where it does not, the tests say so and are skipped.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Iterator, Sequence

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import complete_rows, punctual_frames
from support.nodes.network_namespaces import Machine, TwoMachines, why_no_machines
from support.nodes.recorded_topics import RecordedTopics
from support.stretches import last_stretch
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.resources import program

#: Simulator frames a second, and the paper's raw images a second.
FPS = 30
#: Longer than any drawing here takes, so that pictures appear when they are due.
PIPELINE_DELAY_S = 0.15
STATE_MISSING = 1
#: In flight, arrivals are judged over so many states: four seconds where the computer is quick enough.
STATES = 4 * FPS
#: So many pictures with nothing to say against are waited for.
PERFECT = 90
#: And so many of them of frames that appeared when they were due.
JUDGED = PERFECT // 6
#: What both machines are given: the namespace's parameters are shared.
_SHARED = f"display_delay:={PIPELINE_DELAY_S}"
_NOT_PERMITTED = why_no_machines()

pytestmark = pytest.mark.skipif(bool(_NOT_PERMITTED), reason=_NOT_PERMITTED)


class Flight:
    """Simulator and bridge, started on the two machines with the very commands of docs/setups/two_machines.md."""

    def __init__(self, machines: TwoMachines, folder: Path, display: str) -> None:
        self.simulator, self.bridge = machines.simulator, machines.bridge
        self.swaps, self.truth = folder / "swaps.csv", folder / "truth.csv"
        self._display = display
        self._processes: list[ManagedProcess] = []

    def run(self, machine: Machine, name: str, *command: str | Path) -> ManagedProcess:
        """Starts a program on a machine."""
        process = machine.process(name, command, self.simulator)
        process.start()
        self._processes.append(process)
        return process

    def start_simulator(self) -> None:
        """Master, simulator and capture_node."""
        self.run(self.simulator, "roscore", "roscore")
        window = ["--window", "--fps", str(FPS), "--pipeline-delay", f"{PIPELINE_DELAY_S}s"]
        logs = ["--swap-log", self.swaps, "--truth", self.truth]
        environment = ["env", f"DISPLAY={self._display}"]
        emulator = [*environment, sys.executable, program("xplane_emulator"), *window, *logs]
        self.run(self.simulator, "xplane_emulator", *emulator).wait_for_line(r"^READY\b", WAIT_S)
        self.launch(self.simulator, "capture.launch", "image_rate:=0", _SHARED, prefix=environment)

    def start_bridge(self) -> None:
        """All other nodes, and a stick held to the right."""
        self.launch(self.bridge, "bridge.launch", "capture:=false", _SHARED)
        self.launch(self.bridge, "joystick.launch")
        right = "{axes: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], buttons: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]}"
        self.run(self.bridge, "stick", "rostopic", "pub", "-r", "50", "/xplane/joy", "sensor_msgs/Joy", right)

    def recorder(self, machine: Machine) -> RecordedTopics:
        """What arrives on a machine, from now on."""
        recorded = RecordedTopics(machine.folder / "topics.jsonl", WAIT_S)
        self.run(machine, "topic_recorder", *recorded.command)
        return recorded

    def launch(self, machine: Machine, file: str, *args: str, prefix: Sequence[str] = ()) -> None:
        """Starts a launch file on a machine."""
        self.run(machine, file, *prefix, "roslaunch", "--wait", "xplane_bridge", file, *args)

    def stop(self) -> None:
        """Ends it, last started first."""
        for process in reversed(self._processes):
            process.stop()


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    with VirtualDisplay(tmp_path) as display, TwoMachines(tmp_path) as machines:
        flight = Flight(machines, tmp_path, display.display)
        flight.start_simulator()
        yield flight
        flight.stop()


def perfect(recorder: RecordedTopics) -> list[dict[str, Any]]:
    """Pictures whose pairing is beyond doubt."""
    return [state for state in recorder.all("camera/frame_state") if not state["quality"]]


def judged(recorder: RecordedTopics, swaps: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Such pictures with what the raw ones show, of frames that appeared when they were due."""
    punctual = punctual_frames(swaps, PIPELINE_DELAY_S, FPS)
    images = {image["stamp"]: image for image in recorder.all("camera/image_raw") if image["frame"] in punctual}
    return [(state, images[state["stamp"]]) for state in perfect(recorder) if state["stamp"] in images]


def whole_second(recorder: RecordedTopics) -> tuple[float, float] | None:
    """Simulator time of the first and the last of FPS frames one after the other of all of which raw pictures came."""
    shown = {np.float32(image["sim_time"]) for image in recorder.all("camera/image_raw") if image["frame"]}
    times = [np.float32(state["sim_time"]) for state in recorder.all("flight_state")]
    came = np.array([time in shown for time in times], float)
    whole = np.flatnonzero(np.convolve(came, np.ones(FPS), "valid") == FPS) if len(came) >= FPS else []
    return (times[whole[0]], times[whole[0] + FPS - 1]) if len(whole) else None


def test_everything_arrives_belongs_together_and_flies(flight: Flight) -> None:
    flight.start_bridge()
    recorder = flight.recorder(flight.bridge)
    link = recorder.wait_for("link_state", lambda link: link["state"] == "CONNECTED", "the link")
    assert link["host"] == flight.simulator.address, "found by its beacon"
    recorder.wait_for("flight_state", lambda _: True, "a state")
    recorder.wait_for("camera/frame_state", lambda _: True, "a picture's state")
    recorder.wait_for("camera/frame_state", lambda s: not s["quality"] & STATE_MISSING, "a paired picture")
    begin = len(recorder.all("flight_state"))

    # The stick of the other machine moves the simulator, and both say so.
    recorder.wait_for("control/applied", lambda a: a["read_back"] and a["roll"] == 1.0, "the stick read back")
    recorder.wait_for("flight_state", lambda s: s["control_roll"] == 1.0, "the stick in the state")
    wait_until(lambda: len(recorder.all("flight_state")) > begin + STATES, WAIT_S, "states")
    wait_until(lambda: len(perfect(recorder)) >= PERFECT, WAIT_S, "perfectly paired pictures")
    # The paper's rate, in simulator time: every frame of a second of 30 came over as a raw picture. A computer
    # that is busy with other work may need some seconds to have one.
    wait_until(lambda: whole_second(recorder), 4 * WAIT_S, "30 raw pictures in a second")

    def paired() -> Iterator[bool]:
        return (not state["quality"] & STATE_MISSING for state in recorder.all("camera/frame_state"))

    wait_until(lambda: last_stretch(paired(), PERFECT), 2 * WAIT_S, "pictures with their state")
    wait_until(lambda: len(judged(recorder, flight.swaps)) >= JUDGED, 2 * WAIT_S, "punctual pictures")
    flight.stop()  # what is still in buffers is written

    # States: every frame that was flown, one after the other.
    times = np.array([state["sim_time"] for state in recorder.all("flight_state")[begin:]], np.float32)
    flown = np.array([row["sim_time"] for row in complete_rows(flight.truth)], np.float32)
    assert np.all(np.diff(times) > 0)
    assert set(times) == {t for t in flown if times[0] <= t <= times[-1]}, "a state was lost on the way"

    # Images: each that arrived has its state; and in a second in which every frame's came, so did all that were
    # published. (A busy computer looks at the window too late for some, and loses some of a queue of two.)
    first, last = times[0], times[-1] - 0.5  # those whose state and place in the log have come, too
    images = {i["stamp"]: i for i in recorder.all("camera/image_raw") if i["frame"] and first <= i["sim_time"] <= last}
    states = {s["stamp"]: s for s in recorder.all("camera/frame_state")}
    newest = max(states)  # of the last image it may have been under way
    assert {stamp for stamp in images if stamp <= newest} <= set(states)
    second = whole_second(recorder)
    assert second is not None
    raw = [image for image in recorder.all("camera/image_raw") if image["frame"] and image["stamp"] in states]
    of_it = [image["stamp"] for image in raw if second[0] <= np.float32(image["sim_time"]) <= second[1]]
    assert len(of_it) >= FPS - 1  # the state of the last may have been under way
    assert np.all(np.diff([states[stamp]["image_count"] for stamp in of_it]) == 1), "an image was lost on the way"

    missing = [bool(state["quality"] & STATE_MISSING) for state in states.values()]
    since = missing[missing.index(False) :]
    assert sum(since) < 0.5 * len(since)

    # Pairing across the machines: the state is that of the very frame. A picture that appeared late because the
    # computer was busy says nothing about that, nor does one whose state came too late.
    sure = judged(recorder, flight.swaps)
    assert len(sure) >= JUDGED
    assert all(state["sim_time"] == image["sim_time"] for state, image in sure)


def test_each_machine_says_that_the_other_is_gone_and_goes_on_when_it_is_back(flight: Flight) -> None:
    flight.start_bridge()
    here, there = flight.recorder(flight.simulator), flight.recorder(flight.bridge)
    here.wait_for("camera/frame_state", lambda s: not s["quality"] & STATE_MISSING, "a paired picture")
    there.wait_for("flight_state", lambda _: True, "a state")

    reported = len(there.all("link_state"))
    flight.bridge.plug(False)
    there.wait_for("link_state", lambda link: link["state"] in ("STALE", "LOST"), "a pulled cable", after=reported)
    reported = len(there.all("link_state"))
    flight.bridge.plug(True)
    there.wait_for("link_state", lambda link: link["state"] == "CONNECTED", "the cable again", after=reported)

    flight.bridge.lose_power()
    pictures = len(here.all("camera/frame_state"))
    here.wait_for("camera/frame_state", lambda s: s["quality"] & STATE_MISSING, "a picture without", after=pictures)
    here.wait_for_status("capture_node: pairing", lambda level, text: level == 1 and "no state" in text, "a warning")

    flight.start_bridge()
    there = flight.recorder(flight.bridge)
    pictures = len(here.all("camera/frame_state"))
    here.wait_for("camera/frame_state", lambda s: not s["quality"] & STATE_MISSING, "a picture with", after=pictures)
    there.wait_for("flight_state", lambda _: True, "a state")

    for node in ("rx_node", "tx_node"):  # who has never had a link does not lose it
        there.wait_for_status(f"{node}: link", lambda level, _: level == 0, f"a link of {node}")
    reported = len(there.all("link_state"))
    flight.simulator.lose_power()
    lost = there.wait_for("link_state", lambda link: link["state"] == "LOST", "the end of X-Plane", after=reported)
    assert "beacon" in lost["reason"], lost
    for node in ("rx_node", "tx_node"):
        there.wait_for_status(node, lambda level, _: level == 2, f"an error of {node}")
