"""Flights in real time on a machine that may be busy: those that it has disturbed are flown again."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Callable

import numpy as np

from xplane_bridge.bags import Bags
from xplane_bridge.constants import FlightMode

ATTEMPTS = 3
_STALE = 3  # of LinkState
_LATE_S = 0.25  # between states, or between commands of a controller that sends them at 20 Hz or more


def is_disturbed(bag: Path) -> bool:
    """Whether a flight's recording shows what only a program that did not come to run does: late states or commands, a
    controller that was taken as failed, a link that was taken as lost.
    """
    if not bag.is_file():
        return False
    with Bags(bag) as bags:
        modes, links = bags.read("/xplane/control/mode"), bags.read("/xplane/link_state")
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
    assert done.returncode == 0, done.stdout + done.stderr
    return out
