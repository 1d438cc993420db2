"""The X-Plane emulator's command line; docs/experiments/emulator.md describes it."""

from __future__ import annotations

import contextlib
import gc
import json
import logging
import signal
import sys
from typing import TYPE_CHECKING, Callable, Optional, Sequence

from xplane_bridge.cli.entry import with_values_below_zero
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.emulator.options import Options, parse
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.scenario import ScenarioError

if TYPE_CHECKING:
    from xplane_bridge.emulator.view.cockpit_view import CockpitView


def main(arguments: Optional[Sequence[str]] = None, make: Callable[[Options], Emulator] = Emulator) -> int:
    """Runs an emulator until a signal, the end of `--duration`, or (stepped) the end of stdin.

    Args:
        arguments: Of the command line.
        make: Makes the emulator.

    Returns:
        0, or 1 when it could not start.
    """
    options = parse(with_values_below_zero(sys.argv[1:] if arguments is None else arguments))
    logging.basicConfig(level=logging.DEBUG if options.verbose else logging.WARNING, format="%(levelname)s %(message)s")
    try:
        emulator = make(options)
        view = _open_view(options, emulator)
    except (OSError, FlightModelError, ScenarioError, XplaneBridgeError) as error:
        text = error.strerror if isinstance(error, OSError) and error.strerror else error
        print(f"xplane_emulator: {text}", file=sys.stderr)
        return 1

    def stop(_signal: int, _frame: object) -> None:
        emulator.stopping = True
        if options.stepped == "lines":
            raise KeyboardInterrupt  # reading a line is not interrupted otherwise

    def request_status(_signal: int, _frame: object) -> None:
        emulator.wants_status = True

    failed = 0
    try:
        signal.signal(signal.SIGUSR1, request_status)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, stop)
        print("READY " + json.dumps(emulator.describe()), flush=True)
        gc.freeze()  # what there is now stays: looking through it again would take milliseconds of a frame
        emulator.run()
    except KeyboardInterrupt:
        pass
    except OSError as error:  # the port was taken while a restart was played, or the window is gone
        print(f"xplane_emulator: {error.strerror or error}", file=sys.stderr)
        failed = 1
    emulator.close()
    if view is not None:
        view.close()
    with contextlib.suppress(BrokenPipeError):  # the program that started it does not read any more
        print("STOPPED " + json.dumps(emulator.statistics()), flush=True)
    return failed


def _open_view(options: Options, emulator: Emulator) -> Optional[CockpitView]:
    """Opens the cockpit view's window, if one is wanted."""
    if not options.window:
        return None
    from xplane_bridge.emulator.view.cockpit_view import CockpitView  # late: without a window, OpenCV is not needed

    view = CockpitView(emulator.options)  # where the flight starts is also the scenario's to say
    emulator.view = view
    return view
