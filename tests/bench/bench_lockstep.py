"""Lock-step: how much faster than real time, and what the nodes take of a frame against a bare chain."""

from __future__ import annotations

import contextlib
import json
import re
import socket
import statistics
import struct
import subprocess
import sys
import time
from typing import Any, Dict, List

from bench_offline import cpp_program
from registry import Context, Measure, benchmark

from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess, RosMaster
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.harness.ros import free_port, roslaunch
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


def _nodes(context: Context) -> Dict[str, Any]:
    """The emulator's statistics of a flight with rx_node, a roscpp controller and tx_node alone."""
    folder = context.folder / "nodes"
    folder.mkdir(parents=True, exist_ok=True)
    lockstep = Lockstep(participants=["controller"], options={"hold": False})
    options = [*lockstep.emulator_options(), "--duration", str(10.0 * context.seconds)]
    with contextlib.ExitStack() as stack:
        emulator = stack.enter_context(EmulatorProcess(folder, options))
        master = stack.enter_context(RosMaster(folder))
        config = stack.enter_context(lockstep.common_config())
        where = {"host": "127.0.0.1", "port": emulator.port, "common_config": config, "capture": False}
        stack.enter_context(roslaunch(master, folder, "bridge.launch", **where))
        command = [cpp_program("lockstep_controller")]
        stack.enter_context(ManagedProcess("controller", command, folder, env=master.env))
        wait_until(lambda: not emulator.running, _PATIENCE_S + 10.0 * context.seconds, "end of the flight in lock-step")
        return json.loads(emulator.wait_for_line(r"^STOPPED (.*)$", 1.0).group(1))


def _bare(context: Context) -> float:
    """Mean time [s] of a datagram through three bare roscpp nodes and back."""
    folder = context.folder / "bare"
    folder.mkdir(parents=True, exist_ok=True)
    hops, into = cpp_program("bench_bare_hops"), free_port(socket.SOCK_DGRAM)
    with contextlib.ExitStack() as stack, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.bind(("127.0.0.1", 0))
        wire.settimeout(0.2)
        env = stack.enter_context(RosMaster(folder)).env
        roles = [
            ["reader", into, "/state"],
            ["law", "/state", "/command"],
            ["sender", "/command", wire.getsockname()[1]],
        ]
        for role in roles:
            stack.enter_context(ManagedProcess(f"bare_{role[0]}", [hops, *map(str, role)], folder, env=env))

        def there_and_back(number: float) -> bool:
            wire.sendto(struct.pack("<f", number), ("127.0.0.1", into))
            with contextlib.suppress(socket.timeout):
                while struct.unpack("<f", wire.recv(4))[0] != number:
                    pass
                return True
            return False

        wait_until(lambda: there_and_back(0.0), _PATIENCE_S, "answer of the bare chain")
        times: List[float] = []
        end = time.monotonic() + context.seconds
        while time.monotonic() < end:
            began = time.perf_counter()
            if there_and_back(float(len(times) % 1000 + 1)):
                times.append(time.perf_counter() - began)
            time.sleep(0.0007)  # as long as the emulator's frame: the nodes go to sleep meanwhile
    return statistics.fmean(times)


@benchmark
def lockstep(context: Context) -> List[Measure]:
    """Lock-step at 60 frames/s: times real time, and the nodes' part of a frame against a bare chain."""
    factor = _whole(context)
    flown = _nodes(context)
    bare = _bare(context)
    waited = flown["waited_s"] / flown["frames"]
    return [
        Measure("rx, tx, mapper, rospy controller, player, record", factor, "x real", budget=10.0, at_least=True),
        Measure("the nodes' part of a frame, mean", 1e6 * waited, "us"),
        Measure("three bare roscpp nodes, mean", 1e6 * bare, "us"),
        Measure("nodes / bare chain", waited / bare, "times", budget=1.25),
    ]
