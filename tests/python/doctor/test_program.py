"""The doctor as a program: its report, its exit code, and that nothing it looks at stops it."""

import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from support.absent_modules import WITHOUT_THEM
from support.again import again_until
from support.deadlines import PROGRAM_S, WAIT_S
from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge.cli import xplane_doctor
from xplane_bridge.doctor import examination, names, report
from xplane_bridge.doctor.checks import CHECKS
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Severity, note, ok, problem, warning
from xplane_bridge.doctor.observe import joysticks
from xplane_bridge.doctor.settings import Settings
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.ports import free_udp_port

ROOT = Path(__file__).resolve().parents[3]
DOCTOR = ROOT / "scripts" / "xplane_doctor"
ELSEWHERE = f"""{WITHOUT_THEM}
from xplane_bridge.cli.xplane_doctor import main
sys.argv[0] = "xplane_doctor"
sys.exit(main(sys.argv[1:]))
"""


def run(*arguments, **environment):
    env = {key: value for key, value in os.environ.items() if not key.startswith("ROS_") and key != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, DOCTOR, *map(str, arguments)],
        env={**env, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=PROGRAM_S,
    )
    assert "Traceback" not in done.stderr
    return done


def run_until(says, *arguments, **environment):
    """Runs it; again where a busy machine's programs have taken longer than the seconds of its rounds."""
    return again_until(lambda done: says in done.stdout, lambda: run(*arguments, **environment))


def test_one_line_a_finding_and_a_verdict():
    findings = [ok("a", "fine"), note("b", "by the way"), problem("c", 'window "two\nlines"', "close it")]
    assert report.as_text(findings).splitlines() == [
        "ok:      fine",
        "note:    by the way",
        'problem: window "two lines" -> close it',
        "1 finding",
    ]
    assert report.as_text([ok("a", "fine")]).splitlines()[-1] == "all is well"
    assert report.as_text([warning("a", "b", "c"), warning("a", "b", "c")]).splitlines()[-1] == "2 findings"


def test_the_exit_code_counts_what_there_is_to_do():
    assert report.exit_code([ok("a", "b"), note("a", "b", "c")]) == 0
    assert report.exit_code([ok("a", "b"), warning("a", "b", "c")]) == 1
    assert report.exit_code([problem("a", "b", "c")]) == 1


def test_json_has_all_of_a_finding():
    listed = json.loads(report.as_json([problem("no-answer", "nothing", "start it", port=49000, rows=(3, 20))]))
    assert listed == [
        {
            "id": "no-answer",
            "severity": "problem",
            "text": "nothing",
            "remedy": "start it",
            "facts": {"port": 49000, "rows": [3, 20]},
        }
    ]


def test_a_simulator_that_flies_is_found_well(tmp_path):
    values = {names.VERSION: 115501.0, names.PAUSED: 0.0, names.REPLAY: 0.0, FakeXPlane.TIME: 5.0}
    with FakeXPlane(values) as xplane:
        done = run_until("115501", "--host", "127.0.0.1", "--port", xplane.port, "--json", HOME=str(tmp_path))
    found = {finding["id"]: finding for finding in json.loads(done.stdout)}
    assert found["answer"]["severity"] == "ok"
    assert found["version"]["facts"] == {"version": 115501}
    assert done.returncode == any(finding["severity"] in ("warning", "problem") for finding in found.values())


def test_ctrl_c_ends_it_with_its_subscriptions(tmp_path):
    with FakeXPlane({}) as xplane:
        command = [sys.executable, DOCTOR, "--host", "127.0.0.1", "--port", str(xplane.port)]
        with subprocess.Popen(command, env={**os.environ, "HOME": str(tmp_path)}, stderr=subprocess.PIPE) as doctor:
            wait_until(lambda: any(xplane.subscriptions.values()), WAIT_S, "the first subscription")
            doctor.send_signal(signal.SIGINT)
            assert (doctor.wait(PROGRAM_S), doctor.stderr.read()) == (130, b"")
        wait_until(lambda: not any(xplane.subscriptions.values()), WAIT_S, "end of all subscriptions")


def test_nothing_on_the_port_is_a_finding_in_words(tmp_path):
    free = free_udp_port()
    problem_of_it = f"problem: nothing answers on 127.0.0.1:{free}"
    done = run_until(problem_of_it, "--host", "127.0.0.1", "--port", free, HOME=str(tmp_path))
    assert done.returncode == 1
    assert problem_of_it in done.stdout


@pytest.mark.parametrize("arguments", [["--port", "0"], ["--port", "70000"], ["--port", "x"], ["--colour"], ["more"]])
def test_wrong_arguments_end_it_with_2(arguments):
    done = run(*arguments)
    assert done.returncode == 2
    assert "usage: xplane_doctor" in done.stderr
    assert not done.stdout


def test_help_names_the_options_and_exit_codes(capsys):
    with pytest.raises(SystemExit) as end:
        xplane_doctor.main(["--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert all(word in text for word in ("--host", "--port", "--json", "0 all is well, 1 findings, 2 cannot run"))


def test_it_starts_without_ros_and_without_what_only_linux_has(tmp_path):
    def started(*arguments):
        command = [sys.executable, "-c", ELSEWHERE, "--host", "127.0.0.1", *map(str, arguments)]
        env = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
        env["ROS_HOME"] = str(tmp_path)
        return subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=PROGRAM_S)

    values = {names.VERSION: 115501.0, names.PAUSED: 0.0, names.REPLAY: 0.0, FakeXPlane.TIME: 5.0}
    with FakeXPlane(values) as xplane:
        examined = again_until(lambda done: "(115501)" in done.stdout, lambda: started("--port", xplane.port))
        refused = started("--port", xplane.port, "--conformance", "--yes")
        assert xplane.others == []
    assert "(115501)" in examined.stdout, examined.stderr
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr == (
        "xplane_doctor: changes can be noted on Linux only (No module named 'fcntl'): "
        "fly the card from the nodes' computer, with --host\n"
    )


def test_what_was_not_seen_is_reported_and_not_judged():
    seen = examination.judge(Evidence())
    findings = examination.judge(Evidence(unfinished={"ros": "it took too long"}))
    assert {finding.id for finding in seen} - {finding.id for finding in findings} == {"no-ros"}
    assert [(f.severity, f.text) for f in findings if f.id == "unfinished"] == [
        (Severity.PROBLEM, "the ROS master could not be looked at: it took too long")
    ]


def test_every_check_needs_observations_that_there_are():
    fields = {field.name for field in dataclasses.fields(Evidence)}
    assert [needed for _, needed in CHECKS if not needed <= fields] == []


def test_every_finding_is_explained_in_the_docs():
    text = (ROOT / "docs/setups/doctor.md").read_text(encoding="utf-8").partition("| `id` | when |")[2]
    text = text.partition("\n## ")[0]
    explained = {
        name for row in re.findall(r"^\| (`.*?) \|", text, re.MULTILINE) for name in re.findall(r"`([^`]+)`", row)
    }
    made = set()
    for file in (ROOT / "src" / "xplane_bridge" / "doctor").rglob("*.py"):
        made |= set(re.findall(r'\b(?:ok|note|warning|problem)\(\s*"([a-z0-9-]+)"', file.read_text(encoding="utf-8")))
    assert len(made) > 40
    assert explained == made


def test_what_fails_or_hangs_does_not_take_the_rest_with_it(monkeypatch):
    never = threading.Event()
    rounds = examination._Round({"a": (never.wait,), "b": (int, "no number"), "c": (int, "7")}, limit_s=0.3)
    for name in ("b", "c"):  # these end, on a busy machine later than that
        rounds._threads[name].join(WAIT_S)
    unfinished = {}
    assert rounds.results(unfinished) == {"c": 7}
    never.set()
    assert unfinished["a"] == "it took too long"
    assert unfinished["b"].startswith("ValueError: ")

    def broken(*_):
        raise RuntimeError("out of order")

    class Patient(examination._Round):
        def __init__(self, jobs, limit_s=WAIT_S):
            super().__init__(jobs, max(limit_s, WAIT_S))

    monkeypatch.setattr(examination, "_Round", Patient)
    monkeypatch.setattr(joysticks, "observe", broken)
    evidence = examination.examine(Settings("127.0.0.1", 9, environment={}, listen_s=0.1, answer_s=0.1))
    assert evidence.unfinished == {"joysticks": "RuntimeError: out of order"}
    assert evidence.target.port == 9
