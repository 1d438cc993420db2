"""What runs during a recorded flight."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, Optional

from xplane_bridge.harness.emulator import EmulatorProcess
from xplane_bridge.harness.processes import ManagedProcess
from xplane_bridge.harness.ros import RosMaster


@dataclass
class RunningFlight:
    """What a flight's observer may look at, and shake."""

    emulator: EmulatorProcess
    master: RosMaster
    bridge: ManagedProcess
    elapsed: float = 0.0  #: [s] of the simulator's time recorded so far
    states: int = 0  #: flight states received so far; in lock-step those of mission/sim
    programs: Dict[str, ManagedProcess] = field(default_factory=dict)
    last: Any = None  #: the newest of them
    _counted: Optional[float] = field(default=None, repr=False)  #: [s] the simulator's time when it was counted

    def count_time(self) -> None:
        """Adds to `elapsed` what the simulator's time has gone on since the last call; a restart takes nothing away.

        That may be less than the clock has gone on: X-Plane's time passes slowly where frames take long.
        """
        if self.last is None:
            return
        now = float(self.last.sim_time)
        if self._counted is not None:
            self.elapsed += max(0.0, now - self._counted)
        self._counted = now
