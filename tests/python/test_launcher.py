"""scripts/launcher.py: whose messages a program of a clone takes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.room_table import ROOT

INIT = "from os import path as os_path\n__extended_path = '{}'.split(';')\n"


def devel_space(folder: Path, clone: Path) -> str:
    """The Python packages of a catkin workspace that has built the messages of a clone."""
    packages = folder / "devel" / "lib" / "python3" / "dist-packages"
    (packages / "xplane_bridge" / "msg").mkdir(parents=True)
    (packages / "xplane_bridge" / "__init__.py").write_text(INIT.format(clone / "src"), encoding="utf-8")
    return str(packages)


def searched(clone: Path, inherited: str) -> list[str]:
    """The import path of a program of the clone."""
    words = (
        "import sys; sys.path.insert(0, 'scripts'); import launcher; launcher._use_clone(); print('\\n'.join(sys.path))"
    )
    env = {**os.environ, "PYTHONPATH": inherited}
    run = subprocess.run([sys.executable, "-c", words], cwd=clone, env=env, capture_output=True, text=True, check=True)
    return run.stdout.split("\n")


@pytest.mark.parametrize("linked", [False, True])
def test_the_messages_are_those_of_a_sourced_workspace_that_has_this_clone(tmp_path: Path, linked: bool) -> None:
    clone, workspace = tmp_path / "clone", tmp_path / "workspace"
    (clone / "scripts").mkdir(parents=True)
    (clone / "scripts" / "launcher.py").write_bytes((ROOT / "scripts" / "launcher.py").read_bytes())
    (clone / "src").mkdir()
    own = devel_space(clone / ".workspace", clone)
    in_workspace = workspace / "src" / "clone"
    in_workspace.parent.mkdir(parents=True)
    in_workspace.symlink_to(clone)
    sourced = devel_space(workspace, in_workspace if linked else clone)
    of_another = devel_space(tmp_path / "other", tmp_path / "other_clone")

    assert own not in searched(clone, os.pathsep.join(["", sourced]))
    path = searched(clone, of_another)
    assert path.index(own) < path.index(of_another), "a clone does not run the programs of another one"
    assert own in searched(clone, "")
