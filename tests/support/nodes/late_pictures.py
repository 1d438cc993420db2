"""Pictures on a busy computer: shown late by the emulator, or seen late by a program that does not come to run."""

from __future__ import annotations

import csv
import random
import signal
import time
from pathlib import Path
from typing import Callable

from xplane_bridge.harness import HarnessError, ManagedProcess


def complete_rows(file: Path) -> list[dict[str, str]]:
    """The complete rows of a CSV file that is still being written, or whose writer was killed."""
    return list(csv.DictReader(file.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()))


def display_delays(swaps: Path) -> dict[int, float]:
    """From each frame of the emulator's swap log to its picture on the screen [s]."""
    offset_ns = time.time_ns() - time.monotonic_ns()  # the log has frame times on the monotonic clock
    return {
        int(row["frame"]): (int(row["swap_end_ns"]) - offset_ns - int(row["frame_monotonic_ns"])) * 1e-9
        for row in complete_rows(swaps)
    }


def punctual_frames(swaps: Path, delay_s: float, frame_rate: float) -> set[int]:
    """Frames of the swap log whose pictures appeared when they were due; late ones say nothing about the pairing.

    Args:
        swaps: the log.
        delay_s: when they are due, after their frame [s].
        frame_rate: a fifth of a frame earlier or later is punctual [Hz].
    """
    return {frame for frame, delay in display_delays(swaps).items() if abs(delay - delay_s) < 0.2 / frame_rate}


def schedule_late(
    process: ManagedProcess, period_s: float, enough: Callable[[], bool], timeout_s: float = 90.0
) -> None:
    """Stops a program again and again for most of a frame, until there is enough.

    Args:
        process: it.
        period_s: of the frames [s].
        enough: whether there is.
        timeout_s: how long there may not be.

    Raises:
        HarnessError: there was not.
    """
    draw, deadline = random.Random(3), time.monotonic() + timeout_s
    while not enough():
        if time.monotonic() > deadline:
            raise HarnessError(f"not enough within {timeout_s:g} s")
        time.sleep(draw.uniform(0.5, 2.0) * period_s)
        process.send_signal(signal.SIGSTOP)
        time.sleep(draw.uniform(0.5, 1.1) * period_s)
        process.send_signal(signal.SIGCONT)
