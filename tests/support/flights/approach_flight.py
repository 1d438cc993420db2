"""The approach scenario flown through the bridge with the emulator's window, and recorded: for benchmark and test."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

from xplane_bridge.harness.display import screen
from xplane_bridge.harness.flight import fly
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import load_scenario

FPS = 30
#: From a frame to its picture [s], set on both sides; longer than any drawing takes.
DELAY_S = 0.1
#: The approach takes so long [s].
LONGEST_S = 150.0


def fly_approach(folder: Path, scenario: Optional[Path] = None, lockstep: bool = False) -> Path:
    """Flies an approach in wind and records it. Returns the bag.

    Args:
        folder: Of everything that is written.
        scenario: Flown instead of the one that is shipped.
        lockstep: With a picture of every frame, however busy the machine is; otherwise in real time, where pictures are
            paired with frames by when they are shown, and dropped where there is no time for them.
    """
    file = scenario or config_file("scenarios", "approach.yaml")
    late = [] if lockstep else ["--pipeline-delay", f"{DELAY_S}s"]
    plan = scenario_plan(
        load_scenario(file),
        str(file),
        folder,
        LONGEST_S,
        emulator_options=["--window", "--fps", str(FPS), *late],
        launch_args={} if lockstep else {"display_delay": DELAY_S},
        lockstep=Lockstep(["capture_node"], fps=FPS) if lockstep else None,
    )
    plan.make_folders()
    with screen(plan.logs, headless=True):
        fly(plan)
    return plan.bag
