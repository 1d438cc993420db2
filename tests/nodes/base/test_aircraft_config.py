"""aircraft_config against the emulator's aircraft: tx_node flies by what it writes, and takes every shipped file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from support.again import again_until
from support.deadlines import PROGRAM_S
from support.nodes.tx_fixtures import ROLL, CommandSource, WatchedDatarefs, tx_params
from xplane_bridge.resources import config_file, program

STICK = "sim/joystick/yoke_roll_ratio"
SHIPPED = sorted(path.stem for path in config_file("aircraft", "README.md").parent.glob("*.yaml"))


def configured(port: int, folder: Path, *options: str) -> subprocess.CompletedProcess:
    """Runs scripts/aircraft_config; again where X-Plane has not answered in the seconds for which that waits."""
    command = [sys.executable, str(program("aircraft_config")), "--port", str(port), *options]
    streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True}
    return again_until(
        lambda done: "does not answer at" not in done.stderr,
        lambda: subprocess.run(command, cwd=folder, timeout=PROGRAM_S, check=False, **streams),
    )


@pytest.mark.parametrize(("aircraft", "version"), [("fixed_wing", "11"), ("multirotor", "12"), ("tiltrotor", "11")])
def test_tx_node_flies_by_the_file_that_it_writes(world, tmp_path, aircraft, version):
    from xplane_bridge.msg import ControlMode

    xplane = world.emulator("--no-beacon", "--aircraft", aircraft, "--version", version)
    done = configured(xplane.port, tmp_path)
    assert done.returncode == 1
    assert "name of the aircraft: X-Plane does not show it; give --name, or --yes" in done.stderr
    done = configured(xplane.port, tmp_path, "--yes", "--name", "loaded")
    assert done.returncode == 0, done.stderr
    assert f"aircraft:=loaded aircraft_file:={tmp_path / 'loaded.yaml'}" in done.stdout
    written = yaml.safe_load((tmp_path / "loaded.yaml").read_text(encoding="utf-8"))
    again = configured(xplane.port, tmp_path, "--yes", "--name", "loaded")
    assert again.returncode == 1
    assert "is there already" in again.stderr

    world.set_param("aircraft", "loaded")
    mode = world.watch("control/mode", ControlMode)
    world.start("tx_node", {**tx_params(), "aircraft": written})
    mode.wait_for()
    wire, stick = WatchedDatarefs(xplane.port, STICK), CommandSource(world, "control/manual")
    try:
        stick.fly(fields=ROLL, roll=0.2)
        wire.wait(STICK, 0.2)
    finally:
        stick.stop()
        wire.close()


@pytest.mark.parametrize("stem", SHIPPED)
def test_tx_node_takes_every_shipped_file(world, stem):
    from xplane_bridge.msg import ControlMode

    world.point_to(9)  # no X-Plane: only the file is looked at
    world.set_param("aircraft", stem)
    mode = world.watch("control/mode", ControlMode)
    node = world.start("tx_node", tx_params(stem))
    mode.wait_for()
    assert node.running
