"""Truth bench of the pairing: is each picture paired with the very frame it shows?"""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional

import numpy as np
from pairing_run import COLUMNS
from registry import Context, Measure, benchmark

from xplane_bridge.harness import HarnessError

#: Of the emulator: from a frame to its display; longer than any drawing takes.
_PIPELINE_DELAY_S = 0.05
#: Delays of the display [s], and of frames at random, at most [s], of `pairing_delays`.
_DELAYS_S = (0.0, 0.025, 0.06, 0.2)
_JITTERS_S = {"regular": 0.0, "irregular": 0.015}
#: Each flight is this many measurements long: the minute that the budget is for, by default.
_LENGTHS = 3.0
#: The same of a flight for its display times alone, which drawing makes later than the delay.
_REHEARSAL = 0.25
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
    cpu_percent: float  #: of a core, of all cameras


def read_run(folder: Path, delay: Optional[float], camera: str = "") -> Run:
    """Puts together what `pairing_run.py` and the emulator have written.

    Args:
        folder: Where.
        delay: The emulator's [s]; None: the median of what it has shown.
        camera: "" or, of a second window, "_2".
    """
    with np.load(folder / f"pictures{camera}.npz") as arrays:
        columns: Dict[str, np.ndarray] = {name: arrays[name] for name in COLUMNS}
        cpu_percent = float(arrays["cpu_percent"])
    pictures = len(columns["shown_frame"])
    readable = columns["shown_frame"] >= 0
    columns = {name: values[readable] for name, values in columns.items()}
    with (folder / "truth.csv").open() as file:
        frame_at = {np.float32(row["sim_time"]): int(row["frame"]) for row in csv.DictReader(file)}
    to_host = time.time_ns() - time.monotonic_ns()
    with (folder / f"swaps{camera}.csv").open() as file:
        swaps = {
            int(row["frame"]): (int(row["frame_monotonic_ns"]) + to_host, int(row["swap_end_ns"]))
            for row in csv.DictReader(file)
        }
    frame = columns["shown_frame"]
    began, swapped = np.array([swaps[number] for number in frame]).T
    shown_after = 1e-9 * (swapped - began)
    paired = np.array([frame_at.get(np.float32(sim_time), np.nan) for sim_time in columns["state_sim_time"]])
    return Run(
        pictures,
        int((~readable).sum()),
        frame,
        columns["state_sim_time"] - columns["shown_sim_time"],
        paired - frame,
        shown_after - (float(np.median(shown_after)) if delay is None else delay),
        1e-9 * (columns["display_ns"] - swapped),
        1e-9 * (columns["grab_ns"] - columns["display_ns"]),
        columns["quality"],
        int(frame[-1] - frame[0]) + 1,
        cpu_percent,
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


def _flown(
    context: Context, fps: float, delay: float, *options: object, name: str = "", lengths: float = _LENGTHS
) -> Path:
    """Flies once, so many measurements long, in a process of its own; returns the folder of what it has written."""
    folder = context.folder / f"{name}{fps:g}"
    command = [sys.executable, Path(__file__).with_name("pairing_run.py"), folder, "--fps", fps]
    command += ["--seconds", lengths * context.seconds, "--pipeline-delay", delay, *options]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise HarnessError(f"the flight at {fps:g} frames/s failed:\n{done.stderr.strip()}")
    return folder


def _sure(run: Run, name: str, fps: float) -> List[Measure]:
    """What is wanted of pictures without a flag.

    Those that the emulator itself has shown late are left out: no pairing can know that.
    """
    on_time = np.abs(run.display_late) <= _OFF_TIME / fps
    sure = on_time & (run.quality == 0) & np.isfinite(run.error)
    right = 100.0 * float(np.mean(run.error[sure] == 0.0)) if sure.any() else 0.0
    worst = float(np.abs(run.frame_error[sure]).max(initial=0.0))
    return [
        Measure(name + "shown on time", 100.0 * float(np.mean(on_time)), "%"),
        Measure(name + "shown on time and unflagged", 100.0 * float(np.mean(sure)), "%"),
        Measure(name + "unflagged with the very frame", right, "%", 99.0, at_least=True),
        Measure(name + "unflagged, largest error", worst, "frames", 1.0),
    ]


@benchmark
def pairing(context: Context) -> List[Measure]:
    """Images paired with the very frame they show, at 30 and 60 frames/s, by the strip drawn into them."""
    result: List[Measure] = []
    for fps in (30.0, 60.0):
        folder = _flown(context, fps, _PIPELINE_DELAY_S)
        result += measures(read_run(folder, _PIPELINE_DELAY_S), fps, _LENGTHS * context.seconds)
    return result


@benchmark
def pairing_sender(context: Context) -> List[Measure]:
    """The same for images that xplane_eye sends, and judged by what it says: those without a flag must be right."""
    result: List[Measure] = []
    for fps in (30.0, 60.0):
        run = read_run(_flown(context, fps, _PIPELINE_DELAY_S, "--sender"), _PIPELINE_DELAY_S)
        name = f"{fps:g} frames/s: "
        result += [
            Measure(name + "pictures", run.pictures / (_LENGTHS * context.seconds), "/s"),
            *_sure(run, name, fps),
            Measure(name + "all with the very frame", 100.0 * float(np.mean(run.error == 0.0)), "%"),
            Measure(name + "images without a readable strip", run.unreadable, "-", 0.0),
        ]
    return result


@benchmark
def pairing_windows(context: Context) -> List[Measure]:
    """Two windows of one emulator, forward and down, 640x480 at 30 frames/s: pictures, and those of one frame."""
    fps = 30.0
    folder = _flown(context, fps, _PIPELINE_DELAY_S, "--windows", 2)
    runs = [read_run(folder, _PIPELINE_DELAY_S, camera) for camera in ("", "_2")]
    result: List[Measure] = []
    for name, run in zip(("forward: ", "down: "), runs):
        result.append(Measure(name + "pictures", run.pictures / (_LENGTHS * context.seconds), "/s"))
        result += _sure(run, name, fps)
    limit = _OFF_TIME / fps
    frames = [{f: e for f, e, late in zip(r.frame, r.error, r.display_late) if abs(late) <= limit} for r in runs]
    both = sorted(set(frames[0]) & set(frames[1]))
    joined = [frames[0][frame] == 0.0 and frames[1][frame] == 0.0 for frame in both]
    return [
        *result,
        Measure(
            "frames of which both have a picture", 100.0 * len(both) / max(len(set(frames[0]) | set(frames[1])), 1), "%"
        ),
        Measure(
            "of these with the same, right key", 100.0 * sum(joined) / max(len(joined), 1), "%", 99.0, at_least=True
        ),
        Measure("both capture_nodes", runs[0].cpu_percent, "% of a core", 50.0),
    ]


def _shown_after(folder: Path) -> List[float]:
    """From a frame to its picture in each of two windows [s], median."""
    result = []
    for camera in ("", "_2"):
        with (folder / f"swaps{camera}.csv").open() as file:
            rows = list(csv.DictReader(file))
        to_host = time.time_ns() - time.monotonic_ns()
        shown = [int(row["swap_end_ns"]) - int(row["frame_monotonic_ns"]) - to_host for row in rows]
        result.append(1e-9 * float(np.median(shown)))
    return result


@benchmark
def pairing_delays(context: Context) -> List[Measure]:
    """Window, sender and two windows at 30 frames/s, at four delays of the display, frames regular and irregular.

    capture_node and sender measure the delay; those of two windows, of which none can be measured where a window has a
    field of view of its own, are given from a short flight before.
    """
    fps = 30.0
    result: List[Measure] = []
    for source, options in (("x11", ("--calibrate",)), ("sender", ("--sender",)), ("two windows", ("--windows", 2))):
        for delay in _DELAYS_S:
            for frames, jitter in _JITTERS_S.items():
                name = f"{source}, {1e3 * delay:g} ms, {frames}: "
                place = f"{source}_{delay:g}_{frames}_".replace(" ", "_")
                flown = partial(_flown, context, fps, delay, "--frame-jitter", jitter, *options)
                if source == "two windows":
                    delays = _shown_after(flown(name=f"rehearsal_{place}", lengths=_REHEARSAL))
                    folder = flown("--display-delays", *delays, name=place)
                    result += _sure(read_run(folder, None, "_2"), name + "second: ", fps)
                else:
                    folder = flown(name=place)
                result += _sure(read_run(folder, None), name, fps)
    return result
