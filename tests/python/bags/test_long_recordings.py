"""Recordings with pictures are copied in pieces: memory follows the number of messages, not their size."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from support.long_recording import write_long_recording

if TYPE_CHECKING:
    from pathlib import Path

MEGABYTES = 500.0  #: that an hour may take
EXPORT = "from xplane_bridge.cli.bag_export import main; import sys; main(sys.argv[1:]) and sys.exit(1)\n"
# Of the process itself: what wait4() shows of a child begins with the size of its parent.
PEAK = 'print("PEAK", next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))'


def peak_mb(program: str, *args: object) -> float:
    """Runs a program of Python; the largest memory [MB] that it had at once."""
    command = [sys.executable, "-c", program + PEAK, *map(str, args)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    return int(done.stdout.split("PEAK")[-1]) / 1024


@pytest.mark.nightly
@pytest.mark.parametrize("form", ["mcap", "ros2"])
def test_an_hour_of_all_topics_and_pictures_is_copied_within_its_memory(tmp_path: Path, form: str) -> None:
    """What a minute more takes, times the minutes of an hour."""
    peaks = []
    for minutes in (1.0, 4.0):
        bag = tmp_path / f"{minutes:g}.bag"
        assert write_long_recording(bag, 60.0 * minutes) > 60e6 * minutes
        peaks.append(peak_mb(EXPORT, bag, "-o", tmp_path / "out", "--format", form, "--jobs", 1))
        bag.unlink()
    assert peaks[0] + 59.0 * (peaks[1] - peaks[0]) / 3.0 < MEGABYTES
