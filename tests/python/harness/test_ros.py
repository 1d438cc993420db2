"""The environment of ROS's programs: what it takes over of the user's shell."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Dict

import pytest

from xplane_bridge.harness.ros import MasterInUse, RosMaster, ros_environment


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dict[str, str]:
    """The environment of a shell with a ROS workspace and a namespace; this process's own is like it meanwhile."""
    for name in ("roslaunch", "rospack"):
        (tmp_path / name).write_text("#!/bin/sh\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    variables = {"PATH": f"{tmp_path}:/usr/bin:/bin", "ROS_NAMESPACE": "/lab", "KEPT": "yes"}
    monkeypatch.setattr(os, "environ", dict(variables))
    monkeypatch.setattr(sys, "path", list(sys.path))
    return variables


def test_a_namespace_of_the_shell_does_not_move_what_the_harness_looks_for(
    shell: Dict[str, str], tmp_path: Path
) -> None:
    master = RosMaster(tmp_path)
    for env in (ros_environment(), ros_environment(shell), MasterInUse().env, master.env):
        assert "ROS_NAMESPACE" not in env
        assert env["KEPT"] == "yes"
    assert shell["ROS_NAMESPACE"] == "/lab"
    master.use_here()
    assert "ROS_NAMESPACE" not in os.environ
    assert os.environ["ROS_HOME"] == str(master.ros_home)
