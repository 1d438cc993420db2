"""What runs during a recorded flight."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict

from xplane_bridge.harness.emulator import EmulatorProcess
from xplane_bridge.harness.processes import ManagedProcess
from xplane_bridge.harness.ros import RosMaster


@dataclass
class RunningFlight:
    """What a flight's observer may look at, and shake."""

    emulator: EmulatorProcess
    master: RosMaster
    bridge: ManagedProcess
    elapsed: float = 0.0  #: [s] of flight recorded so far
    states: int = 0  #: flight states received so far; in lock-step those of mission/sim
    programs: Dict[str, ManagedProcess] = field(default_factory=dict)
    last: Any = None  #: the newest of them
