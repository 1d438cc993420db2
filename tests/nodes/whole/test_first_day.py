"""What README, tutorial and examples give a new user to type does what they say.

Their blocks run as they stand there, on a machine of their own: a network namespace, where no port is taken. Only
folders, and for most the emulator's frame rate and the size of its window, are the test's. Where this computer permits
no namespaces, the tests say so and are skipped.
"""

from __future__ import annotations

import csv
import json
import re
import sys
import time
from pathlib import Path
from typing import Any, Iterator

import cv2
import pytest

from support.flights.disturbed import Flown, until_undisturbed
from support.markdown import Block, blocks
from support.nodes.network_namespaces import Machine, why_no_machines
from support.nodes.recorded_topics import RecordedTopics
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.display import VirtualDisplay

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "docs" / "examples"
WAIT_S = 90.0
AUTO = 2
_NOT_PERMITTED = why_no_machines()

pytestmark = pytest.mark.skipif(bool(_NOT_PERMITTED), reason=_NOT_PERMITTED)

#: A service call that is refused because a busy machine's frame is late is typed again, until the link is back.
CALLS_AGAIN = """
rosservice() {
  local said attempt
  for attempt in {1..60}; do
    said=$(command rosservice "$@") || { printf '%s\\n' "$said"; return 1; }
    [[ $said != *"X-Plane is not connected"* ]] && break
    sleep 0.5
  done
  printf '%s\\n' "$said"
}
"""


class Shells:
    """A user's shells on a machine of their own.

    Args:
        machine: runs.
        display: of windows.
        home: of the user; /tmp of the documents is in it, too.
    """

    def __init__(self, machine: Machine, display: str, home: Path) -> None:
        self.machine, self.home = machine, home
        self._display = display
        self._shells: dict[str, ManagedProcess] = {}
        self.begin = ""  # what every shell begins with

    def here(self, text: str) -> str:
        """A document's text with its /tmp in this home."""
        return text.replace("/tmp/", f"{self.home}/tmp/")

    def start(self, name: str, command: str) -> ManagedProcess:
        """Types a command that goes on running; the shell becomes it, so that Ctrl-C reaches it."""
        process = self._process(name, f"exec {command}")
        process.start()
        self._shells[name] = process
        return process

    def run(self, name: str, text: str, timeout: float = WAIT_S) -> str:
        """Types commands and waits for their end; gives what they said."""
        code, said = self.type(name, text, timeout)
        assert code == 0, said
        return said

    def type(self, name: str, text: str, timeout: float) -> tuple[int, str]:
        """The same of commands that may fail; gives the exit code, too."""
        with self._process(name, f"{CALLS_AGAIN}\n{text}") as process:
            code = process.wait(timeout)
        return code, process.output()

    def end(self, name: str) -> None:
        """Ctrl-C."""
        self._shells.pop(name).stop()

    def close(self) -> None:
        """Ends what runs, last started first."""
        for name in reversed(list(self._shells)):
            self.end(name)

    def _process(self, name: str, text: str) -> ManagedProcess:
        words = ["env", f"HOME={self.home}", f"DISPLAY={self._display}"]
        script = f"set -e\ncd {ROOT}\n{self.begin}\n{text}"
        return self.machine.process(name, [*words, "bash", "-c", script], self.machine)


@pytest.fixture
def shells(tmp_path: Path) -> Iterator[Shells]:
    (tmp_path / "tmp").mkdir()
    machine = Machine("alone", "127.0.0.1", tmp_path)
    with VirtualDisplay(tmp_path) as display:
        machine.start()
        shells = Shells(machine, display.display, tmp_path)
        yield shells
        shells.close()
        machine.stop()


def watch(shells: Shells) -> RecordedTopics:
    """What flies, and where, from now on."""
    recorded = RecordedTopics(shells.home / "topics.jsonl", WAIT_S, ["flight_state", "control/mode"])
    shells.start("recorder", " ".join(recorded.command))
    recorded.wait_for("flight_state", lambda _: True, "a state")
    return recorded


def section(file: Path, heading: str) -> list[Block]:
    found = [block for block in blocks(file) if block.section == heading]
    assert found, heading
    return found


#: For tests that look at no picture: drawing those of README, encoding and recording them takes most of the processor
#: time of all that runs.
CHEAP_PICTURES = "--fps 20 --window 320x240"


def by_hand(shells: Shells, options: str = CHEAP_PICTURES) -> tuple[RecordedTopics, str]:
    """Emulator, with further options, and bridge as README starts them; what comes third there."""
    emulator, bridge, hold = section(ROOT / "README.md", "By hand, without X-Plane")[0].text.splitlines()
    shells.start("emulator", f"{emulator} {options}").wait_for_line(r"^READY\b", WAIT_S)
    shells.start("bridge", bridge)
    return watch(shells), hold


def settled(recorded: RecordedTopics, name: str, wanted: float, within: float, states: int = 90) -> None:
    """Waits until so many states in a row are near a value."""

    def near() -> bool:
        last = recorded.all("flight_state")[-states:]
        return len(last) == states and all(abs(state[name] - wanted) < within for state in last)

    wait_until(near, WAIT_S, f"{name} near {wanted}")


def test_the_three_lines_of_readme_fly(shells: Shells) -> None:
    recorded, hold = by_hand(shells, options="")
    shells.start("hold", hold)
    recorded.wait_for("control/mode", lambda m: m["mode"] == AUTO and not m["failsafe"], "automatic flight")
    settled(recorded, "heading", 40.0, 3.0)


def test_the_first_subscriber_of_readme_shows_states(shells: Shells) -> None:
    by_hand(shells)
    subscriber = section(ROOT / "README.md", "I want states")[0]
    assert subscriber.language == "python"
    assert len(subscriber.text.splitlines()) <= 10
    (shells.home / "first.py").write_text(subscriber.text, encoding="utf-8")
    process = shells.start("subscriber", f"{sys.executable} -u {shells.home}/first.py")
    process.wait_for_line(r"^ *\d+\.\d{3} s  roll +-?\d+\.\d\d deg  +\d+\.\d m/s$", WAIT_S)


def test_the_first_controller_of_readme_flies(shells: Shells) -> None:
    recorded, _ = by_hand(shells)
    controller = section(ROOT / "README.md", "I want to fly")[0]
    assert controller.language == "python"
    assert len([line for line in controller.text.splitlines() if line and "import" not in line]) <= 10
    (shells.home / "first.py").write_text(controller.text, encoding="utf-8")
    shells.start("controller", f"{sys.executable} {shells.home}/first.py")
    settled(recorded, "roll", 20.0, 3.0)


def flew_on(recorded: RecordedTopics, seconds: float) -> None:
    """Waits until so much simulator time has passed; the aircraft keeps to its height and near level wings."""
    states = recorded.all("flight_state")
    begun, first = states[-1], len(states)
    recorded.wait_for("flight_state", lambda s: s["sim_time"] > begun["sim_time"] + seconds, "a later state", first)
    later = recorded.all("flight_state")[first:]
    assert max(abs(state["altitude"] - begun["altitude"]) for state in later) < 150.0
    assert max(abs(state["roll"]) for state in later) < 45.0


def test_the_first_flight_of_readme_survives_its_end(shells: Shells) -> None:
    """A hold, Ctrl-C, and a stick by hand: after each the failsafe of the shipped aircraft flies on."""
    recorded, _ = by_hand(shells)
    hold, by_hand_line = section(ROOT / "README.md", "I want to fly")[1].text.splitlines()[:2]
    assert "attitude_hold" in hold
    assert "control/auto" in by_hand_line
    shells.start("hold", hold)
    settled(recorded, "heading", 40.0, 3.0)
    shells.end("hold")
    recorded.wait_for("control/mode", lambda m: m["failsafe"], "the failsafe")
    flew_on(recorded, 30.0)
    first = len(recorded.all("flight_state"))
    timeout, stick = by_hand_line.split("  #")[0].split("rostopic", 1)
    assert timeout == "timeout 8 "  # a busy machine's rostopic may not have begun by then: Ctrl-C once it has flown
    shells.start("stick", f"rostopic{stick}")
    recorded.wait_for("flight_state", lambda s: s["roll"] > 5.0, "what the stick does", first)
    before = len(recorded.all("control/mode"))
    shells.end("stick")
    recorded.wait_for("control/mode", lambda m: m["failsafe"], "the failsafe after it", before)
    flew_on(recorded, 30.0)


def test_the_broken_aileron_of_readme_breaks_on_a_fresh_install(shells: Shells) -> None:
    recorded, hold = by_hand(shells)
    shells.start("hold", hold)
    settled(recorded, "heading", 40.0, 3.0)
    fly_it = section(ROOT / "README.md", "I want to break things")[0].text.splitlines()
    assert "aileron1_wing2_left" in fly_it[0]
    for number, line in enumerate(fly_it):
        assert "success: True" in shells.run(f"typed_{number}", line)
        if number == 0:
            said = shells.run("surfaces", "rostopic echo -n 1 /xplane/mission/surfaces/aileron1")
            deflections = [float(number) for number in re.findall(r"-?\d+\.\d+", said)]
            assert deflections[2] == pytest.approx(5.0, abs=0.1), said  # wing 2, left
            settled(recorded, "heading", 40.0, 5.0)  # the others fly on
    assert "names: []" in shells.run("failures", "rostopic echo -n 1 /xplane/failures/state")


def flown(shells: Shells, name: str, text: str, bags: str) -> str:
    """Types commands that fly in real time; again where the machine has disturbed one, recorded in `bags`."""

    def fly(number: int) -> Flown:
        began = time.time()
        code, said = shells.type(f"{name}_{number}", text, 500.0)
        return Flown(code, said, [bag for bag in shells.home.glob(bags) if bag.stat().st_mtime >= began])

    return until_undisturbed(fly).said


def scores(folder: Path) -> dict[str, dict[str, Any]]:
    criteria = json.loads((folder / "scores.json").read_text(encoding="utf-8"))["criteria"]
    return {criterion["name"]: criterion for criterion in criteria}


def test_the_afternoon_of_the_tutorial(shells: Shells) -> None:
    todo = blocks(ROOT / "docs/tutorial.md")
    ready = {"shell 1": r"^READY\b", "shell 2": "started", "shell 3": "started", "shell 4": "started"}
    recorded: RecordedTopics | None = None
    for number, block in enumerate(todo):
        name = f"{number:02d}_{block.section.replace(' ', '_').lower()}"
        text = shells.here(block.text)
        lines = text.splitlines()
        shell = re.fullmatch(r"# (shell \d)", lines[0])
        if block.language == "python":
            (shells.home / f"{name}.py").write_text(text, encoding="utf-8")
            said = shells.run(name, f"python3 {shells.home}/{name}.py")
        elif shell:
            command = "\n".join(lines[1:])
            if shell.group(1) == "shell 1":
                assert "--window" in command
                command += f" {CHEAP_PICTURES}"
            shells.start(shell.group(1), command).wait_for_line(ready[shell.group(1)], WAIT_S)
            if shell.group(1) == "shell 2":
                recorded = watch(shells)
            elif shell.group(1) == "shell 3":
                wait_until((shells.home / "tmp" / "afternoon.bag.active").exists, WAIT_S, "recording")
            elif shell.group(1) == "shell 4":
                assert recorded is not None
                settled(recorded, "heading", 60.0, 3.0)
        elif block.section == "A package of your own" and shells.home.joinpath("catkin_ws").exists():
            shells.begin = text  # of every further shell
        else:
            for line in lines:
                ended = re.fullmatch(r"# end (shell \d)", line)
                if ended:
                    shells.end(ended.group(1))
            flies = "run_scenario" in text
            said = flown(shells, name, text, "tmp/*/flight.bag") if flies else shells.run(name, text, 400.0)
            if "control/mode" in text:
                assert "failsafe: True" in said
                assert "timeout of control/auto" in said
    home = shells.home / "tmp"
    page = (home / "afternoon.html").read_text(encoding="utf-8")
    assert '<span class="bad">failsafe</span></td><td>timeout of control/auto' in page
    with (home / "afternoon" / "afternoon.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["failures"] for row in rows} >= {"", "engine_2:failed"}
    assert {row["failsafe"] for row in rows} >= {"False", "True"}
    assert "doublet:roll" in {row["excitation"] for row in rows}
    assert cv2.imread(str(home / "afternoon" / "roll.png")).std() > 5
    quick, slow = scores(home / "quick"), scores(home / "slow")
    assert all(criterion["passed"] for criterion in quick.values())
    assert not slow["turns"]["passed"]
    assert re.search(r"^quick .*turns \d+\.\d", said, re.MULTILINE)


def test_the_examples_build_and_fly_from_another_workspace(shells: Shells) -> None:
    steps = section(EXAMPLES / "README.md", "Examples to copy")[0].text
    assert "cp -r docs/examples/controller_py" in steps
    both = steps.replace("controller_py ~", "controller_cpp docs/examples/controller_py ~")
    build, _, fly = both.rpartition("(cd build")
    said = shells.run("examples", build, 500.0)
    assert "warning" not in said.lower(), said
    enter = "\n".join(line for line in build.splitlines() if line.startswith(("cd ", "source ")))
    said = flown(shells, "tests", f"{enter}\n(cd build{fly}", "catkin_ws/build/*/flies/flight.bag")
    assert "100% tests passed, 0 tests failed out of 2" in said
