"""Flights in real time on a machine that may be busy: those that it has disturbed are flown again."""

from __future__ import annotations

import subprocess
import warnings
from pathlib import Path
from typing import Callable

import numpy as np

from xplane_bridge.bags import Bags
from xplane_bridge.constants import FlightMode

ATTEMPTS = 3
_MODE, _LINK = "/xplane/control/mode", "/xplane/link_state"
_STALE = 3  # of LinkState
_LATE_S = 0.25  # between states, or between commands of a controller that sends them at 20 Hz or more


def is_disturbed(bag: Path) -> bool:
    """Whether a flight's recording shows what a program does that has not come to run: late states or commands, a
    controller that was taken as failed, a link that was taken as lost. A defect may show the same, but in all flights.
    """
    if not bag.is_file():
        return False
    with Bags(bag) as bags:
        if not {_MODE, _LINK} <= bags.topics.keys():
            return False
        modes, links = bags.read(_MODE), bags.read(_LINK)
        late = [
            np.diff(bags.times(topic)).max(initial=0) > _LATE_S * 1e9
            for topic in ("/xplane/flight_state", "/xplane/control/auto")
            if topic in bags.topics
        ]
    failsafe = modes["failsafe"][modes["mode"] == FlightMode.AUTO].any()
    return bool(any(late) or failsafe or (links["state"] >= _STALE).any())


def until_undisturbed(fly: Callable[[Path], subprocess.CompletedProcess[str]], folder: Path) -> Path:
    """Flies until a flight succeeds; again only where it was disturbed.

    Args:
        fly: Flies into a folder that is not there yet, with run_scenario.
        folder: Of the flights.

    Returns:
        The folder of the flight that has succeeded.
    """
    for attempt in range(ATTEMPTS):
        out = folder / f"flight_{attempt}"
        done = fly(out)
        if done.returncode == 0 or not is_disturbed(out / "flight.bag"):
            break
        warnings.warn(f"flight {attempt} was disturbed, and is flown again:\n{done.stdout}", stacklevel=2)
    assert done.returncode == 0, done.stdout + done.stderr
    return out
