"""What the programs load: what only one of them needs would cost each of the others memory, and time at start."""

from __future__ import annotations

import subprocess

import pytest

NODES = ("rx_node", "tx_node", "joystick_mapper_node", "xplane_joy_node")


def loaded(world, name):
    """Libraries that the system loads for one of the package's programs."""
    return subprocess.check_output(["ldd", world.program(name)], env=world.env, text=True)


@pytest.mark.parametrize("name", [*NODES, "override_guardian", "lockstep_recorder"])
def test_only_capture_node_loads_opencv(world, name):
    assert "opencv" in loaded(world, "capture_node")
    assert "opencv" not in loaded(world, name)


@pytest.mark.parametrize("name", [*NODES, "override_guardian", "capture_node"])
def test_only_lockstep_recorder_loads_rosbag(world, name):
    assert "rosbag_storage" in loaded(world, "lockstep_recorder")
    assert "rosbag_storage" not in loaded(world, name)


def test_the_guardian_loads_nothing_of_ros(world):
    assert "libros" in loaded(world, "tx_node")
    assert "libros" not in loaded(world, "override_guardian")
