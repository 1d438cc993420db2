"""What the benchmarks of nodes share: CPU and memory of processes while another program measures, and its report."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path
from typing import Dict, Iterator, List, Sequence

from xplane_bridge.harness import HarnessError, ManagedProcess

_TICKS = os.sysconf("SC_CLK_TCK")


class Use:
    """CPU time and memory of a process group since this was made, from /proc.

    Args:
        pid: its leader, such as a ManagedProcess.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._began = self._cpu_s()

    def _cpu_s(self) -> float:
        total = 0.0
        for entry in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):  # it has ended
                fields = entry.read_text(encoding="ascii", errors="replace").rsplit(")", 1)[1].split()
                if int(fields[2]) == self._pid:
                    total += (int(fields[11]) + int(fields[12])) / _TICKS
        return total

    def cpu_s(self) -> float:
        """[s] of all its threads; at least the clock's tick, as less is not seen."""
        return max(self._cpu_s() - self._began, 1.0 / _TICKS)

    def cpu_percent(self, elapsed_s: float) -> float:
        """Of one core."""
        return 100.0 * self.cpu_s() / elapsed_s

    def memory_mb(self) -> float:
        """Resident, of the leader."""
        for line in Path(f"/proc/{self._pid}/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024.0
        raise HarnessError(f"process {self._pid} has ended")


def report_of(meter: ManagedProcess, timeout_s: float) -> Dict[str, object]:
    """Waits for the end of a measuring program, whose last line is JSON."""
    if meter.wait(timeout_s) != 0:
        raise HarnessError(meter.describe("failed"))
    return json.loads(meter.output().strip().splitlines()[-1])


@contextlib.contextmanager
def measuring(meter: ManagedProcess, processes: Sequence[ManagedProcess]) -> Iterator[List[Use]]:
    """Usage counters of processes over the measurement; the block runs at its end."""
    meter.wait_for_line(r"^MEASURING", 90.0)
    uses = [Use(process.pid) for process in processes]
    meter.wait_for_line(r"^MEASURED", 600.0)
    yield uses
