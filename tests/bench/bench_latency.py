"""What estimate_latency finds in real flights, against what the emulator really did."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import List

import numpy as np
from registry import Context, Measure, benchmark

from xplane_bridge.analysis.latency import LatencyError, require_usable
from xplane_bridge.bags import Bags
from xplane_bridge.bags.pictures import grey_pictures, image_topic
from xplane_bridge.cli.estimate_latency import command_responses, display_delay
from xplane_bridge.emulator.renderer import StripError, read_strip
from xplane_bridge.harness import HarnessError
from xplane_bridge.resources import program

#: Pipeline delays of the emulator [s]; 0: shown as soon as drawn.
_DELAYS_S = (0.0, 0.05, 0.1, 0.2)
#: Each flight is this many measurements long: a minute, by default.
_LENGTHS = 3.0
_BUDGET_S = 0.005


def fly(folder: Path, delay: float, seconds: float) -> Path:
    """Flies the multisine scenario with the cockpit view and records it. Returns the bag."""
    command = [sys.executable, program("run_scenario"), "multisine", "--camera", "--headless"]
    command += ["--duration", seconds, "--output", folder, "--emulator", f"--pipeline-delay {delay}s"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    bag = folder / "flight.bag"
    # A criterion may be missed in a flight cut short; the recording is what counts here.
    if not bag.is_file():
        raise HarnessError(f"the flight with {delay} s of delay failed:\n{done.stdout.strip()}\n{done.stderr.strip()}")
    return bag


def shown_delay(bags: Bags) -> float:
    """Mean of picture stamp - stamp of the state of the frame that the strip in the picture names [s]."""
    states = bags.read(bags.topic_of_type("xplane_bridge/FlightState"))
    stamp_of = dict(zip(states["sim_time"].tolist(), states.stamp.tolist()))
    delays = []
    for stamp, picture in grey_pictures(bags, image_topic(bags)):
        try:
            frame_stamp = stamp_of.get(read_strip(picture).sim_time)
        except StripError:
            continue
        if frame_stamp is not None:
            delays.append(1e-9 * (stamp - frame_stamp))
    if not delays:
        raise HarnessError(f"no strip of {bags.paths[0]} names a recorded state")
    return float(np.mean(delays))


@benchmark
def latency(context: Context) -> List[Measure]:
    """Display delay and command response by estimate_latency in multisine flights, against the emulator's truth."""
    result: List[Measure] = []
    for delay in _DELAYS_S:
        bag = fly(context.folder / f"{1e3 * delay:g}ms", delay, _LENGTHS * context.seconds)
        name = f"{1e3 * delay:g} ms: "
        with Bags(bag) as bags:
            truth = shown_delay(bags)
            found = display_delay(bags)
            responses = command_responses(bags)
        try:
            require_usable(found, "pictures")
        except LatencyError as err:
            raise HarnessError(f"{name}{err}") from None
        result += [
            Measure(name + "frame to display, by the strips", 1e3 * truth, "ms"),
            Measure(name + "frame to display, estimated", 1e3 * found.delay, "ms"),
            Measure(name + "error", 1e3 * abs(found.delay - truth), "ms", 1e3 * _BUDGET_S),
            Measure(name + "95 % interval, half width", 5e2 * (found.high - found.low), "ms"),
        ]
        for command, response in responses.items():
            result += [
                Measure(f"{name}{command} to surface, estimated", 1e3 * response.delay, "ms"),
                Measure(f"{name}{command}: 95 % interval, half width", 5e2 * (response.high - response.low), "ms"),
            ]
    return result
