"""The X-Plane emulator's command line; docs/emulator.md describes it."""

from __future__ import annotations

import json
import logging
import signal
import sys
from typing import Optional, Sequence

from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight_model import FlightModelError
from xplane_bridge.emulator.options import parse
from xplane_bridge.scenario import ScenarioError


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs an emulator until a signal, the end of `--duration`, or (stepped) the end of stdin.

    Returns:
        0, or 1 when it could not start.
    """
    options = parse(sys.argv[1:] if arguments is None else arguments)
    logging.basicConfig(level=logging.DEBUG if options.verbose else logging.WARNING, format="%(levelname)s %(message)s")
    try:
        emulator = Emulator(options)
    except (OSError, FlightModelError, ScenarioError) as error:
        print(f"xplane_emulator: {error.strerror if isinstance(error, OSError) and error.strerror else error}", file=sys.stderr)
        return 1

    def stop(_signal: int, _frame: object) -> None:
        emulator.stopping = True
        if options.stepped == "lines":
            raise KeyboardInterrupt  # reading a line is not interrupted otherwise

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    print("READY " + json.dumps(emulator.describe()), flush=True)
    try:
        emulator.run()
    except KeyboardInterrupt:
        pass
    print("STOPPED " + json.dumps(emulator.statistics()), flush=True)
    return 0
