"""The checks of scripts/test: one list for it, pre-commit and the pages that name them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import yaml

from support.room_table import ROOT
from xplane_bridge.harness.processes import wait_until

TEST = (ROOT / "scripts/test").read_text(encoding="utf-8")


def names(variable: str) -> list[str]:
    """The words of a list of scripts/test; a list that it starts with is written out."""
    words = re.search(rf"^{variable}=\((.*)\)$", TEST, re.MULTILINE).group(1)
    first, _, rest = words.partition('"${static_checks[@]}"')
    return first.split() if first else [*names("static_checks"), *rest.split()]


def function(name: str) -> str:
    """A function of scripts/test."""
    return re.search(rf"^{name}\(\) {{$.*?^}}$", TEST, re.MULTILINE | re.DOTALL).group(0)


def test_pre_commit_runs_the_checks_that_need_no_build_and_no_others():
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    hooks = [hook for repo in config["repos"] if repo["repo"] == "local" for hook in repo["hooks"]]
    assert [hook["entry"] for hook in hooks] == [f"scripts/test --only {name}" for name in names("static_checks")]
    assert [hook["id"] for hook in hooks] == names("static_checks")
    assert not any(hook["pass_filenames"] for hook in hooks)


def test_every_check_is_a_function_and_in_the_help():
    shown = subprocess.run([ROOT / "scripts/test", "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
    full = (ROOT / "tests/full/checks.bash").read_text(encoding="utf-8")
    for name in (*names("all_checks"), *names("full_checks")):
        text = full if name in names("full_checks") else TEST
        assert re.search(rf"^check_{name}\(\) {{", text, re.MULTILINE), name
        assert re.search(rf"^  (.*  )?{name} {{2,}}\S", shown, re.MULTILINE), name


def test_a_check_that_is_none_is_refused_with_the_list():
    done = subprocess.run(
        [ROOT / "scripts/test", "--only", "format,typos"], stderr=subprocess.PIPE, text=True, check=False
    )
    assert done.returncode == 2
    known = " ".join((*names("all_checks"), *names("full_checks")))
    assert done.stderr == f"test: there is no check typos; there are: {known}\n"


def test_the_workflow_runs_the_command_of_the_readme_on_both_systems():
    workflow = yaml.safe_load((ROOT / ".github/workflows/checks.yaml").read_text(encoding="utf-8"))
    assert set(workflow["jobs"]) == {"debian_12", "ubuntu_20_04"}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.search(r"^scripts/test +# all checks but those of a night \(--full\)$", readme, re.MULTILINE)
    for name, job in workflow["jobs"].items():
        commands = [step["run"] for step in job["steps"] if "run" in step]
        assert commands[-1] == "scripts/test ${{ matrix.arguments }}", name
        assert job["runs-on"] == "ubuntu-latest", f"{name}: a public runner"


def test_a_night_of_the_workflow_runs_every_check_part_by_part():
    workflow = yaml.safe_load((ROOT / ".github/workflows/checks.yaml").read_text(encoding="utf-8"))
    for name, job in workflow["jobs"].items():
        chosen = re.fullmatch(
            r"\$\{\{ fromJSON\(github.event_name == 'schedule' && '(.*)' \|\| '(.*)'\) \}\}",
            job["strategy"]["matrix"]["arguments"],
        )
        assert chosen, name
        ordinary, *of_a_night = json.loads(chosen.group(1))
        assert ordinary == "--full --only " + ",".join(names("all_checks")), name
        assert of_a_night == [f"--only {check}" for check in names("full_checks")], name
        assert json.loads(chosen.group(2)) == [""], name


def test_without_options_all_checks_run_but_those_of_a_night():
    """As README and CONTRIBUTING say."""
    assert re.search(r'^checks=\("\$\{all_checks\[@\]\}"\)$', TEST, re.MULTILINE)
    assert re.search(r'^leave_out=\(-m "not nightly"\)$', TEST, re.MULTILINE)
    assert not set(names("all_checks")) & set(names("full_checks"))
    assert "\nscripts/test           # all checks but those of a night" in (ROOT / "CONTRIBUTING.md").read_text()


def test_a_test_that_hangs_is_shown_and_fails_and_the_others_run(tmp_path):
    (tmp_path / "test_of_two.py").write_text(
        "import time\n\ndef test_hangs():\n    time.sleep(600)\n\ndef test_other():\n    pass\n", encoding="utf-8"
    )
    (tmp_path / "pytest.ini").touch()
    assert re.search(r"^stuck_s=\d+", TEST, re.MULTILINE)
    script = f"""set -uo pipefail
results={tmp_path} leave_out=(-m "not nightly") expression= stuck_s=16
{function("pytest_run")}
cd {tmp_path}
pytest_run . two 1"""
    env = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, env=env, timeout=300, check=False)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "test_of_two.py::test_hangs - Failed: Timeout" in done.stdout
    assert re.search(r"1 failed, 1 passed in", done.stdout), done.stdout
    shown = done.stderr.partition("(most recent call first):")[2]
    assert 'test_of_two.py", line 4 in test_hangs' in shown, done.stderr


def test_what_runs_side_by_side_is_shown_in_order_and_a_failure_among_it_counts():
    script = f"""set -uo pipefail
root=here results= programs= expression=
roslaunch_check() {{ :; }}
{function("side_by_side")}
say() {{ [ "$1" != a/slow ] || sleep 0.3; echo "$1 of $root"; [ "$1" != a/bad ]; }}
end() {{ kill -ABRT "$BASHPID"; }}
side_by_side say a/slow "a/with space" a/3 && echo good
side_by_side say a/slow a/bad a/3 || echo failed
side_by_side end a/1 a/2 || echo failed"""
    done = subprocess.run(["bash", "-c", script], stdout=subprocess.PIPE, text=True, check=True)
    said = ["a/slow of here", "a/with space of here", "a/3 of here", "good"]
    assert done.stdout.splitlines() == [*said, "a/slow of here", "a/bad of here", "a/3 of here", "failed", "failed"]


def beside_nodes(tmp_path, checks: str) -> subprocess.Popen:
    """The node tests with the checks `python` and `tidy` beside them."""
    script = f"""set -uo pipefail
results={tmp_path}
{function("run_checks")}
{function("run_beside_nodes")}
{checks}
trap 'exit 130' INT
run_beside_nodes python tidy"""
    return subprocess.Popen(["bash", "-c", script], stdout=subprocess.PIPE, text=True, start_new_session=True)


def test_what_runs_beside_the_node_tests_is_shown_after_them_and_counts(tmp_path):
    done = beside_nodes(
        tmp_path,
        """check_nodes() { for i in {1..6000}; do [ ! -f "$results/seen" ] || break; sleep 0.01; done; echo flown; }
check_python() { touch "$results/seen"; echo "nice by $(nice)"; return 1; }
check_tidy() { echo tidy; }""",
    )
    said = done.communicate(timeout=60)[0].split("\n")
    niceness = min(int(subprocess.check_output(["nice"])) + 5, 19)
    assert said == ["", "=== nodes", "flown", "", "=== python", f"nice by {niceness}", "", "=== tidy", "tidy", ""]
    outcomes = {name: (tmp_path / f"{name}.outcome").read_text().split()[0] for name in ("nodes", "python", "tidy")}
    assert outcomes == {"nodes": "passed", "python": "FAILED", "tidy": "passed"}


def test_ctrl_c_ends_what_runs_beside_the_node_tests(tmp_path):
    endless = tmp_path / "endless"  # ends well on Ctrl-C, as pytest does: no shell stops for that
    endless.write_text(
        f"""#!/usr/bin/env bash
trap 'touch "{tmp_path}/ended"; exit 2' INT
touch "{tmp_path}/python"
for i in {{1..6000}}; do sleep 0.01; done"""
    )
    endless.chmod(0o755)
    running = beside_nodes(
        tmp_path,
        """check_nodes() { touch "$results/nodes"; for i in {1..10000}; do sleep 0.01; done; }
check_python() { "$results/endless"; }
check_tidy() { touch "$results/tidy"; }""",
    )
    for name in ("nodes", "python"):
        wait_until((tmp_path / name).exists, 60.0, f"the check {name}")
    os.killpg(running.pid, signal.SIGINT)
    assert running.wait(60) == 130
    assert (tmp_path / "ended").exists()
    assert not (tmp_path / "tidy").exists()
