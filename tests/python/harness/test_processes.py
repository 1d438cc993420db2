"""The harness' child processes: readiness, deadlines, and an end that leaves nothing behind."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from support.deadlines import WAIT_S
from support.process_tree import alive
from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until


def python(code, tmp_path, name="child"):
    return ManagedProcess(name, [sys.executable, "-u", "-c", textwrap.dedent(code)], tmp_path)


def test_wait_until_returns_what_the_condition_gave():
    answers = iter([None, 0, "", "there"])
    assert wait_until(lambda: next(answers), 5.0, "answer") == "there"


def test_wait_until_names_what_did_not_come():
    with pytest.raises(HarnessError, match=r"^no answer within 0\.05 s$"):
        wait_until(lambda: False, 0.05, "answer")


def test_a_line_of_the_output_is_waited_for(tmp_path):
    code = "import time; print('starting'); time.sleep(0.2); print('READY port 1234'); time.sleep(60)"
    with python(code, tmp_path) as child:
        assert child.wait_for_line(r"^READY port (\d+)", 20.0).group(1) == "1234"
        assert child.running
    assert child.returncode == -signal.SIGINT or child.returncode == 1  # KeyboardInterrupt


def test_a_process_that_ends_early_is_reported_with_its_log(tmp_path):
    with python("import sys; sys.exit('the port is taken')", tmp_path) as child, pytest.raises(HarnessError) as error:
        child.wait_for_line("^READY", 20.0)
    assert "child ended with status 1 before it was ready" in str(error.value)
    assert "the port is taken" in str(error.value)


def test_a_silent_process_is_not_waited_for_beyond_the_deadline(tmp_path):
    with python("import time; time.sleep(60)", tmp_path) as child, pytest.raises(HarnessError, match=r"within 0\.1 s"):
        child.wait_for_line("^READY", 0.1)


def test_stop_ends_the_grandchildren_too(tmp_path):
    code = """
        import signal, subprocess, sys, time
        deaf = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); time.sleep(600)"
        child = subprocess.Popen([sys.executable, "-c", deaf])
        print("READY", child.pid)
        time.sleep(600)
    """
    with python(code, tmp_path) as child:
        grandchild = int(child.wait_for_line(r"^READY (\d+)", 20.0).group(1))
        assert alive(grandchild)
    wait_until(lambda: not alive(grandchild), WAIT_S, "end of the grandchild")


def test_stop_leaves_a_process_alone_that_has_got_the_number_of_one_that_ended(tmp_path):
    ended = ManagedProcess("ended", ["true"], tmp_path)
    ended.start()
    ended.wait(20.0)
    with python("import time; print('READY'); time.sleep(600)", tmp_path) as other:
        other.wait_for_line("^READY", 20.0)
        ended._process.pid = other.pid  # as the system may give it
        ended.stop()
        other.send_signal(signal.SIGTERM)
        assert other.wait(20.0) == -signal.SIGTERM, "by that signal, not by another before"


def test_a_process_deaf_to_sigint_is_ended_by_the_next_signal(tmp_path):
    code = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('READY'); time.sleep(600)"
    child = python(code, tmp_path)
    child.STOP_SIGNALS = ((signal.SIGINT, 0.2), (signal.SIGTERM, 10.0))
    with child:
        child.wait_for_line("^READY", 20.0)
    assert child.returncode == -signal.SIGTERM


def test_a_missing_program_is_named(tmp_path):
    with pytest.raises(HarnessError, match="child: /no/such/program cannot be started"):
        ManagedProcess("child", ["/no/such/program"], tmp_path).start()


def test_the_process_ends_when_its_starter_is_killed(tmp_path):
    starter = subprocess.Popen(
        [
            sys.executable,
            "-u",
            "-c",
            textwrap.dedent(
                """
                import sys, time
                from pathlib import Path
                from xplane_bridge.harness.processes import ManagedProcess
                command = [sys.executable, "-c", "import time; time.sleep(600)"]
                child = ManagedProcess("child", command, Path(sys.argv[1]))
                child.start()
                print(child.pid)
                time.sleep(600)
                """
            ),
            str(tmp_path),
        ],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    pid = int(starter.stdout.readline())
    assert alive(pid)
    starter.kill()
    starter.wait()
    starter.stdout.close()
    wait_until(lambda: not alive(pid), WAIT_S, "end of what it has started")
