"""Tests side by side: the long ones begin, each by itself or with its file, and the others stay with their file."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.room_table import ROOT

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

def write(*words):
    with pathlib.Path({log!r}).open("a") as file:
        print(*words, file=file)

def pytest_xdist_make_scheduler(config, log):
    scheduler = long_ones_first(config, log, LONG)
    assign = scheduler._assign_work_unit

    def write_and_assign(node):
        write("given", next(iter(scheduler.workqueue)), node.gateway.id)
        assign(node)

    scheduler._assign_work_unit = write_and_assign
    return scheduler

def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: rank(item.nodeid, LONG))

def pytest_runtest_setup(item):
    write("begun", item.nodeid, item.config.workerinput["workerid"])
"""
FILE = """
def test_one(): pass
def test_two(): pass
def test_three(): pass
def test_slow_1(): pass
def test_slow_2(): pass
"""


def test_long_ones_begin_and_the_others_stay_with_their_file(tmp_path):
    folder = tmp_path / "side_by_side"
    folder.mkdir()
    log = tmp_path / "log"
    (folder / "conftest.py").write_text(CONFTEST.format(tests=str(ROOT / "tests"), log=str(log)), encoding="utf-8")
    for name in "abcd":
        text = FILE if name in "ab" else FILE[: FILE.index("def test_slow_1")]
        (folder / f"test_{name}.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "--numprocesses", "2", "--dist", "loadfile", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.split() for line in log.read_text(encoding="utf-8").splitlines()]
    # in the order in which work is given, since which process is the faster one decides what begins first
    given = [(unit.partition("/")[2], process) for what, unit, process in lines if what == "given"]
    long = [f"test_{name}.py::test_slow_{number}" for name in "ba" for number in (1, 2)]
    assert [unit for unit, _ in given] == [*long, "test_d.py", *(f"test_{name}.py" for name in "abc")]
    assert len({process for _, process in given[:2]}) == 2, "both at once"
    begun = [(test, process) for what, test, process in lines if what == "begun"]
    assert len(begun) == 16
    for name in "abcd":
        others = {process for test, process in begun if f"test_{name}.py" in test and "slow" not in test}
        assert len(others) == 1, begun


BUSY_CONFTEST = """
import pathlib, sys
sys.path.insert(0, {tests!r})
from support.scheduling import long_ones_first
BUSY = ("busy/", "test_e.py")

def pytest_xdist_make_scheduler(config, log):
    scheduler = long_ones_first(config, log, ("test_e.py::test_one",), BUSY, at_once=2)
    assign = scheduler._assign_work_unit

    def write_and_assign(node):
        assign(node)
        at_busy = [
            each.gateway.id for each in scheduler.nodes for scope, unit in scheduler.assigned_work[each].items()
            if ("/busy/" in scope or "test_e" in scope) and not all(unit.values())
        ]
        with pathlib.Path({log!r}).open("a") as file:
            print(node.gateway.id, *sorted(set(at_busy)), file=file)

    scheduler._assign_work_unit = write_and_assign
    return scheduler
"""


@pytest.mark.parametrize("waiting", ["abcd", ""])
def test_only_so_many_processes_run_busy_ones(tmp_path: Path, waiting: str) -> None:
    folder, log = tmp_path / "side_by_side", tmp_path / "log"
    (folder / "busy").mkdir(parents=True)
    (folder / "conftest.py").write_text(BUSY_CONFTEST.format(tests=str(ROOT / "tests"), log=str(log)), encoding="utf-8")
    files = [*(f"test_{name}.py" for name in waiting), "test_e.py", *(f"busy/test_{number}.py" for number in range(6))]
    for name in files:
        (folder / name).write_text(FILE, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "--numprocesses", "4", "--dist", "loadfile", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{5 * len(files)} passed" in done.stdout
    lines = [line.split() for line in log.read_text(encoding="utf-8").splitlines()]
    assert max(len(at_busy) for _, *at_busy in lines) == 2
    assert len({process for process, *_ in lines}) == 4
