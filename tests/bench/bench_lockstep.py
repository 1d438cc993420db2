"""Lock-step: how much faster than real time, and what the nodes take of a frame against a bare chain."""

from __future__ import annotations

import contextlib
import json
import re
import statistics
import subprocess
import sys
from typing import List

from bench_offline import cpp_program
from registry import Context, Measure, benchmark

from xplane_bridge.emulator.lockstep import FENCE
from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess, RosMaster
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.harness.ros import roslaunch
from xplane_bridge.resources import program

_SCENARIO = """
name: lockstep
aircraft: fixed_wing
start: {altitude: 800, speed: 65}
events:
  - {at: 0, hold: {roll: 0, climb: 0, speed: 65}, mode: auto}
  - {at: 100000, end: true}
"""
_PATIENCE_S = 60.0
#: Flights of the nodes and of the bare chain, in turn, so that both see the same machine, of a benchmark so long [s].
_TURNS, _LONG_S = 7, 10.0


def _whole(context: Context) -> float:
    """Times real time with everything: rx, tx, mapper, attitude_hold, player, recording."""
    context.folder.mkdir(parents=True, exist_ok=True)
    scenario = context.folder / "scenario.yaml"
    scenario.write_text(_SCENARIO, encoding="utf-8")
    options = ["--lockstep", "--duration", 10.0 * context.seconds, "--output", context.folder / "whole"]
    options += ["--joystick", "logitech_extreme_3d_pro", "--controller", program("attitude_hold")]
    command = [sys.executable, program("run_scenario"), scenario, *options]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    found = re.search(r"frames, .* s: ([\d.]+) x real time", done.stderr)
    if found is None:
        raise HarnessError(f"the flight failed:\n{done.stdout}\n{done.stderr}")
    return float(found.group(1))


def _flown(emulator: EmulatorProcess, context: Context) -> float:
    """Mean time [s] the emulator has waited for the answer to a frame, once the flight has ended."""
    wait_until(lambda: not emulator.running, _PATIENCE_S + 5.0 * context.seconds, "end of the flight in lock-step")
    flown = json.loads(emulator.wait_for_line(r"^STOPPED (.*)$", 1.0).group(1))
    return float(flown["waited_s"] / flown["frames"])


def _options(context: Context, lockstep: Lockstep) -> List[str]:
    return [*lockstep.emulator_options(), "--duration", str(5.0 * context.seconds)]


def _nodes(context: Context, turn: int) -> float:
    """Mean wait [s] of the emulator for rx_node, a roscpp controller and tx_node alone."""
    folder = context.folder / f"nodes_{turn}"
    folder.mkdir(parents=True, exist_ok=True)
    lockstep = Lockstep(participants=["controller"], options={"hold": False})
    with contextlib.ExitStack() as stack:
        emulator = stack.enter_context(EmulatorProcess(folder, _options(context, lockstep)))
        master = stack.enter_context(RosMaster(folder))
        config = stack.enter_context(lockstep.common_config())
        where = {"host": "127.0.0.1", "port": emulator.port, "common_config": config, "capture": False}
        stack.enter_context(roslaunch(master, folder, "bridge.launch", **where))
        command = [cpp_program("lockstep_controller")]
        stack.enter_context(ManagedProcess("controller", command, folder, env=master.env))
        return _flown(emulator, context)


def _bare(context: Context, turn: int) -> float:
    """Mean wait [s] of the same emulator for three bare roscpp nodes: its frames leave the machine as they do then."""
    folder = context.folder / f"bare_{turn}"
    folder.mkdir(parents=True, exist_ok=True)
    reader, hops = cpp_program("bench_bare_publisher"), cpp_program("bench_bare_hops")
    with contextlib.ExitStack() as stack:
        emulator = stack.enter_context(EmulatorProcess(folder, _options(context, Lockstep())))
        env = stack.enter_context(RosMaster(folder)).env
        nodes = {
            "reader": [reader, "/state", emulator.port, f"{FENCE}[0]"],
            "law": [hops, "law", "/state", "/command"],
            "answerer": [hops, "answerer", "/command", emulator.port],
        }
        for name, command in nodes.items():
            stack.enter_context(ManagedProcess(f"bare_{name}", list(map(str, command)), folder, env=env))
        return _flown(emulator, context)


@benchmark
def lockstep(context: Context) -> List[Measure]:
    """Lock-step at 60 frames/s: times real time, and the nodes' part of a frame against a bare chain."""
    factor = _whole(context)
    turns = _TURNS if context.seconds >= _LONG_S else 1
    nodes, bare = zip(*((_nodes(context, turn), _bare(context, turn)) for turn in range(turns)))
    ratios = [ours / theirs for ours, theirs in zip(nodes, bare)]
    return [
        Measure("rx, tx, mapper, rospy controller, player, record", factor, "x real", budget=10.0, at_least=True),
        Measure("the nodes' part of a frame, mean", 1e6 * statistics.median(nodes), "us"),
        Measure("three bare roscpp nodes, mean", 1e6 * statistics.median(bare), "us"),
        Measure("nodes / bare chain, median of the turns", statistics.median(ratios), "times", budget=1.25),
        Measure("nodes / bare chain, lowest", min(ratios), "times"),
        Measure("nodes / bare chain, highest", max(ratios), "times"),
    ]
