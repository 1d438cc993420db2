"""What `scripts/bench` starts: a run in which a benchmark fails or that the user ends, and how long benchmarks are."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, Callable, Iterator

import pytest

from support.flights.failsafe_flights import KINDS, SHIPPED, STARTS, Outcome
from support.flights.synthetic_flight import write_states
from support.room_table import ROOT

#: Three benchmarks; the first and the third report what the JSON file says while they run.
BENCHMARKS = """
import json
import os
import signal
import subprocess
from pathlib import Path

from registry import Measure, benchmark

RESULT = Path(__file__).with_name("result.json")


class InterruptedByRos(RuntimeError, KeyboardInterrupt):
    pass


def in_the_file():
    report = json.loads(RESULT.read_text())
    return [Measure(key, len(report[key]), "-") for key in ("results", "failed")]


@benchmark
def first(context):
    return in_the_file()


@benchmark
def second(context):
    {second}


@benchmark
def third(context):
    return in_the_file()
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """A folder with the runner and no benchmarks yet, and the result of an earlier run."""
    for name in ("run.py", "registry.py"):
        shutil.copy(ROOT / "tests" / "bench" / name, tmp_path)
    earlier = {"machine": {}, "failed": ["second"], "results": {"first": [], "third": []}}
    (tmp_path / "result.json").write_text(json.dumps(earlier), encoding="utf-8")
    return tmp_path


def run(folder: Path, second: str) -> tuple[int, str, dict[str, Any]]:
    """Runs the three; gives the exit code, what was printed, and the JSON file."""
    (folder / "bench_three.py").write_text(BENCHMARKS.replace("{second}", second), encoding="utf-8")
    result = folder / "result.json"
    done = subprocess.run(
        [sys.executable, str(folder / "run.py"), "--json", str(result)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
        timeout=100,
    )
    assert not list(folder.glob("*.part"))
    return done.returncode, done.stdout.decode(), json.loads(result.read_text(encoding="utf-8"))


def said(report: dict[str, Any], name: str) -> dict[str, float]:
    return {measure["name"]: measure["value"] for measure in report["results"][name]}


@pytest.mark.parametrize(
    ("second", "last_line"),
    [
        ("assert 1 == 2, 'not so'", "AssertionError: not so"),
        ("subprocess.run(['false'], check=True)", "CalledProcessError: Command '['false']' returned non-zero"),
        ("raise InterruptedByRos('shut down')", "InterruptedByRos: shut down"),
        ("return [Measure('none', None, '-')]", "TypeError: "),
    ],
)  # fmt: skip
def test_a_benchmark_that_fails_ends_neither_the_run_nor_the_file(bench: Path, second: str, last_line: str) -> None:
    code, output, report = run(bench, second)
    assert code == 1, output
    assert "Traceback (most recent call last)" in output
    assert last_line in output
    assert "2 benchmarks run, 1 failed, 0 budgets missed" in output
    assert report["failed"] == ["second"]
    assert list(report["results"]) == ["first", "third"]
    assert said(report, "first") == {"results": 0.0, "failed": 0.0}, "the earlier run's results are gone by then"
    assert said(report, "third") == {"results": 1.0, "failed": 1.0}, "the file is complete after each benchmark"


def test_three_benchmarks_that_measure_make_a_good_run(bench: Path) -> None:
    code, output, report = run(bench, "return [Measure('kept', 1.0, '-', budget=1.0)]")
    assert code == 0, output
    assert report["failed"] == []
    assert report["results"]["second"][0]["passed"] is True


def test_a_missed_budget_is_a_failed_run(bench: Path) -> None:
    code, output, report = run(bench, "return [Measure('missed', 2.0, '-', budget=1.0)]")
    assert code == 1
    assert "3 benchmarks run, 0 failed, 1 budgets missed" in output
    assert report["results"]["second"][0]["passed"] is False


def test_ctrl_c_ends_the_run_at_once_with_what_there_is(bench: Path) -> None:
    code, output, report = run(bench, "os.kill(os.getpid(), signal.SIGINT)")
    assert code == 130, output
    assert "third" not in output
    assert report["failed"] == []
    assert list(report["results"]) == ["first"]


@pytest.mark.parametrize("name", ["/dev/null", "."])
def test_what_cannot_be_replaced_by_a_file_is_refused(bench: Path, name: str) -> None:
    command = [sys.executable, str(bench / "run.py"), "--list", "--json", name]
    done = subprocess.run(command, capture_output=True, check=False, timeout=100)
    assert done.returncode == 2
    assert f"{name} is no regular file; name one" in done.stderr.decode()


def test_a_file_that_cannot_be_written_is_found_before_anything_is_measured(bench: Path) -> None:
    command = [sys.executable, str(bench / "run.py"), "--json", str(bench / "no_folder" / "result.json")]
    done = subprocess.run(command, capture_output=True, check=False, timeout=100)
    assert done.returncode == 2
    assert "name a file that can be written" in done.stderr.decode()


def test_the_help_names_documents_that_are_there(bench: Path) -> None:
    done = subprocess.run([sys.executable, str(bench / "run.py"), "--help"], stdout=subprocess.PIPE, check=True)
    named = re.findall(r"\S+/\S+\.md", done.stdout.decode())
    assert named == ["docs/benchmarks.md"]
    assert all((ROOT / name).is_file() for name in named)


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Any]]:
    """Imports modules of tests/bench, which find each other by their bare names, for one test."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "bench"))
    yield importlib.import_module
    for name in set(sys.modules) - before:
        if name in ("measuring", "registry") or name.startswith("bench_"):
            del sys.modules[name]


def measured(benchmarks: Any, name: str, folder: Path, seconds: float) -> list[Any]:
    registry = sys.modules["registry"]
    return list(getattr(benchmarks, name)(registry.Context(folder / f"{seconds:g}", seconds)))


def test_failsafes_flies_every_moment_by_default_and_less_often_in_less_time(
    module: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    failsafes = module("bench_failsafes")
    flown = []

    def fly(*flight: Any) -> Outcome:
        flown.append(flight)
        return Outcome(*flight, 0.0, 0.0, 0.0, True)

    monkeypatch.setattr(failsafes, "fly", fly)
    assert len(measured(failsafes, "failsafes", tmp_path, 20.0)) == 12
    every = [(s, m, k) for s in STARTS for m in ("steady flight", "rolling right", "throttle low") for k in KINDS]
    assert flown == every
    flown.clear()
    assert len(measured(failsafes, "failsafes", tmp_path, 1.0)) == 4
    assert [flight for flight in flown if flight[2] == SHIPPED] == [(s, "steady flight", SHIPPED) for s in STARTS]


def test_bags_reads_an_hour_by_default_and_less_in_less_time(
    module: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    bags = module("bench_bags")
    written = []

    def write(path: Path, count: int) -> None:
        written.append(count)
        write_states(path, 1.0, 100.0)

    monkeypatch.setattr(bags, "_write", write)
    monkeypatch.setattr(bags, "_rosbag_api", lambda *_: 1.0)
    monkeypatch.setattr(bags, "_require_rosbag", lambda: None)
    for seconds in (20.0, 1.0, 60.0):
        assert measured(bags, "bags", tmp_path, seconds)[0].name.endswith("at 100 Hz to arrays, all columns")
    assert written == [360_000, 36_000, 18_000, 1_800, 360_000, 36_000]


def test_bags_shows_messages_that_were_not_read(
    module: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    bags = module("bench_bags")
    monkeypatch.setattr(bags, "_write", lambda path, count: write_states(path, count / 200.0, 100.0))
    monkeypatch.setattr(bags, "_rosbag_api", lambda *_: 1.0)
    monkeypatch.setattr(bags, "_require_rosbag", lambda: None)
    shares = [m for m in measured(bags, "bags", tmp_path, 0.02) if m.name == "messages read / written"]
    assert [(m.value, m.passed) for m in shares] == [(0.5, False)]


def test_a_process_that_hardly_ran_has_used_a_tick(module: Callable[[str], Any]) -> None:
    """Figures divide by what was used."""
    no_such_process = 2**30
    use = module("measuring").Use(no_such_process)
    assert use.cpu_s() == 1.0 / os.sysconf("SC_CLK_TCK")
