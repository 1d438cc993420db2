"""The Python packages that scripts/setup installs: which, when, that no test lacks one; and what needs none."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

from support.room_table import ROOT

SETUP = (ROOT / "scripts/setup").read_text(encoding="utf-8")
#: Where the package's name is not what is imported.
PACKAGES = {"distributed": "dask", "mcap_ros1": "mcap-ros1-support", "stable_baselines3": "stable-baselines3"}
FILES = ("requirements.txt", "requirements-dev.txt", "requirements-full.txt")
SETS = {"": "false false", "--test": "true false", "--full": "true true"}


def function(name: str) -> str:
    """The text of a function of scripts/setup."""
    found = re.search(rf"^{name}\(\) (\{{ [^\n]* \}}$|\{{$.*?^\}}$)", SETUP, re.MULTILINE | re.DOTALL)
    assert found
    return found.group(0)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A clone with an environment that was made there and has nothing in it."""
    programs = tmp_path / ".venv/bin"
    programs.mkdir(parents=True)
    (programs / "python").symlink_to(sys.executable)
    (programs / "activate").write_text(str(tmp_path / ".venv"), encoding="utf-8")
    for file in FILES:
        (tmp_path / file).write_text(f"of-{file}\n", encoding="utf-8")
    return tmp_path


def installed(root: Path, option: str) -> List[str]:
    """The files whose packages make_venv has pip install, given an option."""
    with_tests, with_full = SETS[option].split()
    script = f"""set -euo pipefail
root='{root}' venv='{root}/.venv' python='{sys.executable}' as_owner=() with_tests={with_tests} with_full={with_full}
need_disk() {{ :; }}
step() {{ [ "$1" = pip ] && printf '%s\\n' "$@"; }}
{function("venv_state")}
{function("make_venv")}
make_venv"""
    done = subprocess.run(["bash", "-c", script], stdout=subprocess.PIPE, text=True, check=True)
    words = done.stdout.splitlines()
    return [Path(words[i + 1]).name for i, word in enumerate(words) if word == "-r"]


def test_each_set_of_packages_holds_the_smaller_ones(root: Path) -> None:
    for count, option in enumerate(SETS, start=1):
        assert installed(root, option) == list(FILES[:count])
    for option in SETS:
        assert installed(root, option) == [], option  # all there after --full
    (root / FILES[2]).write_text("of-another\n", encoding="utf-8")
    assert installed(root, "--test") == []
    assert installed(root, "--full") == list(FILES)


def test_no_test_is_always_left_out_for_want_of_a_package() -> None:
    wanted = set()
    for path in (ROOT / "tests").rglob("*.py"):
        wanted.update(re.findall(r'\bimportorskip\(\s*"(\w+)', path.read_text(encoding="utf-8")))
    listed = set()
    for file in FILES:
        lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
        listed.update(re.match(r"[\w-]+", line).group(0) for line in lines if not line.startswith("#"))
    assert "python3-tk" in SETUP  # tkinter
    assert {PACKAGES.get(name, name) for name in wanted - {"tkinter"}} - listed == set()


@pytest.mark.parametrize("name", ["demo", "bench"])
@pytest.mark.parametrize("arguments", [["--help"], ["--fps", "30", "-h"]])
def test_asked_for_help_a_new_clone_is_not_set_up(tmp_path: Path, name: str, arguments: List[str]) -> None:
    (tmp_path / "scripts").mkdir()
    shutil.copy(ROOT / "scripts" / name, tmp_path / "scripts")
    setup = tmp_path / "scripts/setup"
    setup.write_text("#!/bin/sh\necho set up; exit 3\n", encoding="utf-8")
    setup.chmod(0o755)
    run = [str(tmp_path / "scripts" / name)]
    helped = subprocess.run([*run, *arguments], stdout=subprocess.PIPE, text=True, check=True)
    assert helped.stdout.startswith(f"{name}: ")
    assert "set up" not in helped.stdout
    started = subprocess.run([*run, "--helpless"], stdout=subprocess.PIPE, text=True, check=False)
    assert (started.returncode, started.stdout) == (3, "set up\n")
