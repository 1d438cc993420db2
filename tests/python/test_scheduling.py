"""Tests side by side: the long ones begin, each by itself or with its file, and the others stay with their file.

More processes than the machine can always serve begin with the last ones, while it has time.
"""

from __future__ import annotations

import ast
import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support import spare_time
from support.deadlines import WAIT_S
from support.room_table import ROOT
from xplane_bridge.harness import wait_until

FOLDERS = [ROOT / "tests" / name for name in ("nodes", "python")]


def names(folder: Path) -> list[str]:
    """LONG of a folder's conftest, which only a run of its tests can import."""
    text = (folder / "conftest.py").read_text(encoding="utf-8")
    return list(ast.literal_eval(re.search(r"^LONG = (\(.*?^\))", text, re.MULTILINE | re.DOTALL).group(1)))


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_long_test_is_there(folder):
    for name in names(folder):
        file, _, test = name.partition("::")
        assert re.search(rf"^def {test or 'test_'}", (folder / file).read_text(encoding="utf-8"), re.MULTILINE), name


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_no_test_by_itself_shares_what_its_file_makes_for_several(folder):
    for name in (name for name in names(folder) if "::" in name):
        file, _, test = name.partition("::")
        text = (folder / file).read_text(encoding="utf-8")
        made = re.findall(r'^@pytest\.fixture\(scope="module".*\)\ndef (?:fixture_)?(\w+)', text, re.MULTILINE)
        for arguments in re.findall(rf"^def {test or 'test_'}\w*\((.*?)\)", text, re.MULTILINE | re.DOTALL):
            assert not set(made) & set(re.findall(r"\w+", arguments)), name


CONFTEST = """
import pathlib, sys
sys.path.insert(0, {tests!r})
from support.scheduling import long_ones_first, rank
LONG = ("test_b.py::test_slow", "test_a.py::test_slow", "test_d.py")

def pytest_xdist_make_scheduler(config, log):
    return long_ones_first(config, log, LONG)

def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: rank(item.nodeid, LONG))

def pytest_runtest_setup(item):
    with pathlib.Path({log!r}).open("a") as file:
        file.write(f"{{item.nodeid}} {{item.config.workerinput['workerid']}}\\n")
"""
FILE = """
import time

def test_one(): pass
def test_two(): pass
def test_three(): pass
def test_slow_1(): time.sleep(0.3)
def test_slow_2(): time.sleep(0.3)
"""


@pytest.fixture(name="run")
def fixture_run(tmp_path):
    """Runs small tests in so many processes on one processor; returns each test and its process, as they began."""

    def run(processes):
        folder = tmp_path / "side_by_side"
        folder.mkdir()
        log = tmp_path / "log"
        (folder / "conftest.py").write_text(CONFTEST.format(tests=str(ROOT / "tests"), log=str(log)), encoding="utf-8")
        for name in "abcd":
            text = FILE if name in "ab" else FILE[: FILE.index("def test_slow_1")]
            (folder / f"test_{name}.py").write_text(text, encoding="utf-8")
        one = str(min(os.sched_getaffinity(0)))
        command = ["taskset", "-c", one, sys.executable, "-m", "pytest", "-q", "--dist", "loadfile", str(folder)]
        command += ["--numprocesses", str(processes)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
        begun = [line.split() for line in log.read_text(encoding="utf-8").splitlines()]
        assert len(begun) == 16
        return begun

    return run


def test_long_ones_begin_and_the_others_stay_with_their_file(run):
    begun = run(2)
    assert sorted(test for test, _ in begun[:2]) == [f"side_by_side/test_b.py::test_slow_{k}" for k in (1, 2)]
    assert len({process for _, process in begun[:2]}) == 2, "both at once"
    assert max(k for k, (test, _) in enumerate(begun) if "test_d" in test) < len(begun) - 3
    for name in "abcd":
        others = {process for test, process in begun if f"test_{name}.py" in test and "slow" not in test}
        assert len(others) == 1, begun


def test_processes_that_may_have_to_wait_get_the_last_ones(run):
    begun = run(3)
    first = {process: test for test, process in reversed(begun)}
    assert "slow" in first["gw0"]
    assert "slow" in first["gw1"]
    assert first["gw2"] == "side_by_side/test_c.py::test_one"


#: A process with a test that ends when its input does. Arguments: its name, and the share of time that is busy.
PROCESS = """
import sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from support import spare_time
spare_time.TURN, spare_time.PLACES = Path({turn!r}), Path({places!r})
name, busy = sys.argv[1], float(sys.argv[2])

def note(what):
    with Path({log!r}).open("a") as file:
        file.write(f"{{name}} {{what}}\\n")

def look(seconds):
    note("looks")
    spare_time.time.sleep(0.05)
    return busy

spare_time._busy_share = look
with spare_time.running(name):
    note("begins")
    sys.stdin.read()
    note("ends")
"""


class Processes:
    """Such processes on one processor, where two tests always run."""

    def __init__(self, folder):
        self._log = folder / "log"
        for name in ("turn", "places", "log"):
            (folder / name).touch()
        files = {name: str(folder / name) for name in ("turn", "places", "log")}
        self._program = PROCESS.format(tests=str(ROOT / "tests"), **files)
        self._processes = {}

    def start(self, name, busy):
        one = str(min(os.sched_getaffinity(0)))
        command = ["taskset", "-c", one, sys.executable, "-c", self._program, name, str(busy)]
        self._processes[name] = subprocess.Popen(command, stdin=subprocess.PIPE)

    def wait_for(self, line, count=1):
        wait_until(lambda: self.lines().count(line) >= count, WAIT_S, f"{line}, {count} times")

    def lines(self):
        return self._log.read_text(encoding="utf-8").splitlines()

    def end(self, name):
        process = self._processes.pop(name)
        process.stdin.close()
        assert process.wait(WAIT_S) == 0

    def close(self):
        for process in self._processes.values():
            process.kill()
            process.wait()
            process.stdin.close()


@pytest.fixture(name="processes")
def fixture_processes(tmp_path):
    with contextlib.closing(Processes(tmp_path)) as processes:
        yield processes


def test_on_a_busy_machine_a_further_test_waits_for_the_end_of_another(processes):
    for name in ("gw0", "gw1"):
        processes.start(name, busy=1.0)
        processes.wait_for(f"{name} begins")
    processes.start("gw2", busy=1.0)
    processes.wait_for("gw2 looks", count=3)
    assert "gw2 begins" not in processes.lines()
    processes.end("gw1")
    processes.wait_for("gw2 begins")


def test_further_tests_begin_while_the_processors_have_time_to_spare(processes):
    for name in ("gw0", "gw1", "gw2", "gw3"):
        processes.start(name, busy=0.7)
        processes.wait_for(f"{name} begins")


def test_the_first_processes_do_not_wait(processes):
    for name in ("gw7", "gw8", "gw0", "gw1"):
        processes.start(name, busy=1.0)
        processes.wait_for(f"{name} begins")
    processes.start("gw9", busy=1.0)
    processes.wait_for("gw9 looks")
    processes.end("gw0")
    processes.wait_for("gw9 looks", count=5)
    assert "gw9 begins" not in processes.lines(), "three still run"


def test_the_share_is_that_of_this_process_s_processors(monkeypatch, tmp_path):
    file = tmp_path / "stat"
    # In ticks: user, nice, system, idle, waiting for a disk, interrupts twice, stolen, guests twice.
    before = ["cpu 9 9 9 9 9 9 9 9", "cpu0 1000 100 500 8000 200 10 20 30 0 0", "cpu1 1 1 1 1 1 1 1 1", "intr 7"]
    after = ["cpu 9 9 9 9 9 9 9 9", "cpu0 1030 110 515 8030 210 12 23 30 0 0", "cpu1 9 9 9 9 9 9 9 9", "intr 8"]
    file.write_text("\n".join(before), encoding="ascii")
    monkeypatch.setattr(spare_time, "_STATISTICS", file)
    monkeypatch.setattr(spare_time.os, "sched_getaffinity", lambda _: {0})
    monkeypatch.setattr(spare_time.time, "sleep", lambda _: file.write_text("\n".join(after), encoding="ascii"))
    assert spare_time._busy_share(1.0) == pytest.approx(0.6)
