"""Benchmarks that need no ROS master: decoding, and how even the emulator's frames are."""

from __future__ import annotations

import json
import struct
import subprocess
import time
from pathlib import Path
from typing import List

from registry import Context, Measure, benchmark

from xplane_bridge.harness import EmulatorProcess, HarnessError
from xplane_bridge.resources import config_file

_PACKET = Path(__file__).parents[1] / "data" / "packets" / "20-data-139-rows.hex"


def cpp_program(name: str) -> Path:
    """A program built from tests/bench/programs/<name>.cpp.

    Raises:
        HarnessError: It has not been built.
    """
    path = Path(__file__).resolve().parents[2] / ".workspace" / "devel" / "lib" / "xplane_bridge" / name
    if not path.is_file():
        msg = f"{path} has not been built; run scripts/setup --test"
        raise HarnessError(msg)
    return path


@benchmark
def decode(_: Context) -> List[Measure]:
    """A DATA packet of 139 rows, wire to SI, against Python's struct that only unpacks it."""
    ours = json.loads(subprocess.run([cpp_program("bench_decode")], stdout=subprocess.PIPE, check=True).stdout)
    packet = bytes.fromhex(_PACKET.read_text(encoding="ascii"))
    row = struct.Struct("<i8f")
    times = []
    for _batch in range(50):
        began = time.perf_counter()
        for _repeat in range(20):
            list(row.iter_unpack(packet[5:]))
        times.append((time.perf_counter() - began) / 20)
    python_us = min(times) * 1e6
    return [
        Measure("wire to SI, all groups", ours["decode_139_rows_us"], "us", budget=2.0),
        Measure("RREF datagram to flight state", ours["rref_to_flight_state_us"], "us"),
        Measure("Python's struct, unpacking only", python_us, "us"),
        Measure("struct / ours", python_us / ours["decode_139_rows_us"], "times"),
    ]


@benchmark
def wire_log(context: Context) -> List[Measure]:
    """What a wire log costs the link's thread for each datagram."""
    context.folder.mkdir(parents=True, exist_ok=True)
    command = [cpp_program("bench_wire_log"), str(context.folder)]
    ours = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return [
        Measure("a datagram, median of batches", ours["median_us"], "us", budget=1.0),
        Measure("a datagram, worst batch", ours["worst_us"], "us"),
        Measure("records left out", ours["lost"], "", budget=0.0),
    ]


@benchmark
def emulator_period(context: Context) -> List[Measure]:
    """Error of the emulator's frame period at 60 fps, flying the demonstration."""
    options = ["--fps", "60", "--pilot", config_file("scenarios", "demo.yaml"), "--duration", f"{context.seconds:g}"]
    emulator = EmulatorProcess(context.folder, options)
    with emulator:
        emulator.wait(context.seconds + 60.0)
    report = emulator.output().strip().splitlines()[-1]
    if not report.startswith("STOPPED "):
        raise HarnessError(emulator.describe("did not report its frames"))
    statistics = json.loads(report[len("STOPPED ") :])
    error = statistics["period_error_ms"]
    return [
        Measure("period error, median", error["p50"], "ms"),
        Measure("period error, p99", error["p99"], "ms", budget=2.0),
        Measure("period error, largest", error["max"], "ms"),
    ]
