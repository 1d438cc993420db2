"""Truth bench of the pairing: is each picture paired with the very frame it shows?"""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import numpy as np
from pairing_run import COLUMNS
from registry import Context, Measure, benchmark

from xplane_bridge.harness import HarnessError

#: Of the emulator: from a frame to its display; longer than any drawing takes.
_PIPELINE_DELAY_S = 0.05
#: Each flight is this many measurements long: the minute that the budget is for, by default.
_LENGTHS = 3.0
#: A picture that appeared, or was noticed, this much off its time is a cause of its own [share of a frame].
_OFF_TIME = 0.3


class Run(NamedTuple):
    """One flight; arrays have an element for each picture with a readable strip."""

    pictures: int
    unreadable: int
    frame: np.ndarray  #: shown
    error: np.ndarray  #: [s] simulator time of the state - of the frame shown; nan: no state
    frame_error: np.ndarray  #: the same in frames
    display_late: np.ndarray  #: [s] shown by the emulator after its time
    noticed_late: np.ndarray  #: [s] display time as published - as it was
    grab_age: np.ndarray  #: [s] display to grab
    quality: np.ndarray
    frames_drawn: int  #: of the emulator, from the first picture to the last


def read_run(folder: Path, delay: float) -> Run:
    """Puts together what `pairing_run.py` and the emulator have written."""
    with np.load(folder / "pictures.npz") as arrays:
        columns: Dict[str, np.ndarray] = {name: arrays[name] for name in COLUMNS}
    pictures = len(columns["shown_frame"])
    readable = columns["shown_frame"] >= 0
    columns = {name: values[readable] for name, values in columns.items()}
    with (folder / "truth.csv").open() as file:
        frame_at = {np.float32(row["sim_time"]): int(row["frame"]) for row in csv.DictReader(file)}
    to_host = time.time_ns() - time.monotonic_ns()
    with (folder / "swaps.csv").open() as file:
        swaps = {
            int(row["frame"]): (int(row["frame_monotonic_ns"]) + to_host, int(row["swap_end_ns"]))
            for row in csv.DictReader(file)
        }
    frame = columns["shown_frame"]
    began, swapped = np.array([swaps[number] for number in frame]).T
    paired = np.array([frame_at.get(np.float32(sim_time), np.nan) for sim_time in columns["state_sim_time"]])
    return Run(
        pictures,
        int((~readable).sum()),
        frame,
        columns["state_sim_time"] - columns["shown_sim_time"],
        paired - frame,
        1e-9 * (swapped - began) - delay,
        1e-9 * (columns["display_ns"] - swapped),
        1e-9 * (columns["grab_ns"] - columns["display_ns"]),
        columns["quality"],
        int(frame[-1] - frame[0]) + 1,
    )


def measures(run: Run, fps: float, seconds: float) -> List[Measure]:
    """What is wanted of a flight."""
    known = np.isfinite(run.error)
    error = np.abs(run.error[known])
    wrong = known & (run.error != 0.0)
    late = wrong & (np.abs(run.display_late) > _OFF_TIME / fps)
    unnoticed = wrong & ~late & (np.abs(run.noticed_late) > _OFF_TIME / fps)
    flagged = wrong & (run.quality != 0)
    name = f"{fps:g} frames/s: "
    return [
        Measure(name + "pictures", run.pictures / seconds, "/s"),
        Measure(name + "pictures / frames drawn", 100.0 * run.pictures / run.frames_drawn, "%"),
        Measure(
            name + "paired with the very frame", 100.0 * float(np.mean(run.error == 0.0)), "%", 99.0, at_least=True
        ),
        Measure(name + "largest error", float(np.abs(run.frame_error[known]).max(initial=0.0)), "frames", 1.0),
        Measure(name + "time error, p50", 1e3 * float(np.percentile(error, 50)), "ms"),
        Measure(name + "time error, p95", 1e3 * float(np.percentile(error, 95)), "ms", 2.0),
        Measure(name + "time error, largest", 1e3 * float(error.max()), "ms"),
        Measure(name + "images without a state", int((~known).sum()), "-", 0.0),
        Measure(name + "images without a readable strip", run.unreadable, "-", 0.0),
        Measure(name + "images of a frame seen before", len(run.frame) - len(set(run.frame)), "-", 0.0),
        Measure(name + "change to grab, p95", 1e3 * float(np.percentile(run.grab_age, 95)), "ms", 3.0),
        Measure(name + "wrong, as the emulator showed it late", int(late.sum()), "-"),
        Measure(name + "wrong, as the change was seen late", int(unnoticed.sum()), "-"),
        Measure(name + "wrong by the pairing itself", int((wrong & ~late & ~unnoticed).sum()), "-"),
        Measure(name + "wrong and flagged", int(flagged.sum()), "-"),
    ]


def _flown(context: Context, fps: float, delay: float, sender: bool) -> Run:
    """Flies once in a process of its own."""
    folder = context.folder / f"{fps:g}"
    command = [sys.executable, Path(__file__).with_name("pairing_run.py"), folder, "--fps", fps]
    command += ["--seconds", _LENGTHS * context.seconds, "--pipeline-delay", delay, *(["--sender"] if sender else [])]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise HarnessError(f"the flight at {fps:g} frames/s failed:\n{done.stderr.strip()}")
    return read_run(folder, delay)


@benchmark
def pairing(context: Context) -> List[Measure]:
    """Images paired with the very frame they show, at 30 and 60 frames/s, by the strip drawn into them."""
    result: List[Measure] = []
    for fps in (30.0, 60.0):
        result += measures(_flown(context, fps, _PIPELINE_DELAY_S, sender=False), fps, _LENGTHS * context.seconds)
    return result


@benchmark
def pairing_sender(context: Context) -> List[Measure]:
    """The same for images that xplane_eye sends, and judged by what it says: those without a flag must be right."""
    result: List[Measure] = []
    for fps in (30.0, 60.0):
        run = _flown(context, fps, _PIPELINE_DELAY_S, sender=True)
        sure = (run.quality == 0) & np.isfinite(run.error)
        name = f"{fps:g} frames/s: "
        result += [
            Measure(name + "pictures", run.pictures / (_LENGTHS * context.seconds), "/s"),
            Measure(name + "unflagged", 100.0 * float(np.mean(sure)), "%"),
            Measure(
                name + "unflagged with the very frame",
                100.0 * float(np.mean(run.error[sure] == 0.0)),
                "%",
                99.0,
                at_least=True,
            ),
            Measure(name + "unflagged, largest error", float(np.abs(run.frame_error[sure]).max()), "frames", 1.0),
            Measure(name + "all with the very frame", 100.0 * float(np.mean(run.error == 0.0)), "%"),
            Measure(name + "images without a readable strip", run.unreadable, "-", 0.0),
        ]
    return result
