"""What estimate_latency finds in real flights, against what the emulator really did."""

from __future__ import annotations

import csv
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
from xplane_bridge.emulator.view.renderer import StripError, read_strip
from xplane_bridge.harness import HarnessError
from xplane_bridge.resources import program

#: Pipeline delays of the emulator [s]; 0: shown as soon as drawn.
_DELAYS_S = (0.0, 0.05, 0.1, 0.2)
#: Each flight is this many measurements long: a minute, by default.
_LENGTHS = 3.0
#: Shorter, a flight ends before the first signal of the scenario does [s].
_SHORTEST_S = 25.0
_BUDGET_S = 0.005
#: From sending a command until the emulator can read it [s].
_ON_THE_WIRE_S = 0.0002


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


def followed_delay(bags: Bags, truth: Path) -> float:
    """Mean age of the roll command that the ailerons show in a frame, since it was first sent [s].

    Weighted by how much they moved; the stamp of a frame is that of its flight state. Valid while the ailerons are fast
    enough for the command, which they nearly always are.
    """
    commands = bags.read(bags.topic_of_type("xplane_bridge/AppliedCommand"))
    states = bags.read(bags.topic_of_type("xplane_bridge/FlightState"))
    order = np.unique(commands.stamp, return_index=True)[1]
    sent, roll = 1e-9 * commands.stamp[order], commands["roll"][order]
    with truth.open() as file:
        rows = list(csv.DictReader(file))
    stamp_of = dict(zip(states["sim_time"].tolist(), (1e-9 * states.stamp).tolist()))
    began = np.array([float(row["host_time"]) for row in rows])
    stamp = np.array([stamp_of.get(float(np.float32(row["sim_time"])), np.nan) for row in rows])
    left, right = (np.array([float(row[f"surface_wing2{side}_ail1_deg"]) for row in rows]) for side in "lr")
    new = np.append(True, np.diff(roll) != 0.0)
    first_sent = sent[np.maximum.accumulate(np.where(new, np.arange(len(new)), 0))]
    in_effect = np.searchsorted(sent, began - _ON_THE_WIRE_S) - 1
    known = (in_effect >= 0) & np.isfinite(stamp)
    age = stamp - first_sent[np.maximum(in_effect, 0)]
    moved = np.gradient(left - right) ** 2
    return float(np.average(age[known], weights=moved[known]))


@benchmark
def latency(context: Context) -> List[Measure]:
    """Display delay and command response by estimate_latency in multisine flights, against the emulator's truth."""
    result: List[Measure] = []
    for delay in _DELAYS_S:
        bag = fly(context.folder / f"{1e3 * delay:g}ms", delay, max(_LENGTHS * context.seconds, _SHORTEST_S))
        name = f"{1e3 * delay:g} ms: "
        with Bags(bag) as bags:
            truth = shown_delay(bags)
            found = display_delay(bags)
            followed = followed_delay(bags, bag.with_name("truth.csv"))
            response = command_responses(bags)["roll command"]
        try:
            require_usable(found, "pictures")
        except LatencyError as error:
            raise HarnessError(f"{name}{error}") from None
        result += [
            Measure(name + "frame to display, by the strips", 1e3 * truth, "ms"),
            Measure(name + "frame to display, estimated", 1e3 * found.delay, "ms"),
            Measure(name + "error", 1e3 * abs(found.delay - truth), "ms", 1e3 * _BUDGET_S),
            Measure(name + "95 % interval, half width", 5e2 * (found.high - found.low), "ms"),
            Measure(name + "roll command to aileron, by the truth file", 1e3 * followed, "ms"),
            Measure(name + "roll command to aileron, estimated", 1e3 * response.delay, "ms"),
            Measure(name + "its error", 1e3 * abs(response.delay - followed), "ms", 1e3 * _BUDGET_S),
            Measure(name + "its 95 % interval, half width", 5e2 * (response.high - response.low), "ms"),
        ]
    return result
