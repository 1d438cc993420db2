"""The emulator of a campaign's flight: `python -m ... CONDITIONS.json OPTIONS`, started by run_campaign."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Sequence

from xplane_bridge.cli import xplane_emulator
from xplane_bridge.in_process.aircraft import Conditions
from xplane_bridge.in_process.emulated import ConditionedEmulator


def main(arguments: Sequence[str]) -> int:
    """Runs it; the first argument is a file with the fields of Conditions, the others are xplane_emulator's."""
    conditions = Conditions(**json.loads(Path(arguments[0]).read_text(encoding="utf-8")))
    return xplane_emulator.main(
        arguments[1:], lambda options: ConditionedEmulator(options, conditions, shows_start=True)
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
