"""Flights in real time on a machine that may be busy: those that it has disturbed are flown again."""

from __future__ import annotations

import subprocess
import warnings
from pathlib import Path
from typing import Callable, NamedTuple, Sequence

import numpy as np

from xplane_bridge.bags import Bags
from xplane_bridge.constants import FlightMode, LinkState

ATTEMPTS = 3
_MODE, _LINK = "/xplane/control/mode", "/xplane/link_state"
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
    return bool(any(late) or failsafe or (links["state"] >= LinkState.STALE).any())


class Flown(NamedTuple):
    """A flight by programs."""

    code: int  #: exit code
    said: str  #: on standard output
    bags: Sequence[Path]  #: recordings
    errors: str = ""  #: on standard error

    @classmethod
    def into(cls, folder: Path, done: subprocess.CompletedProcess[str]) -> Flown:
        """That of run_scenario with this `--output`."""
        return cls(done.returncode, done.stdout, [folder / "flight.bag"], done.stderr)

    @property
    def folder(self) -> Path:
        """Of its recording."""
        return self.bags[0].parent


def until_undisturbed(fly: Callable[[int], Flown]) -> Flown:
    """Flies until a flight succeeds; again only where it was disturbed.

    Args:
        fly: Flies, and is given the number of flights before.

    Returns:
        The flight that has succeeded.
    """
    for number in range(ATTEMPTS):
        flown = fly(number)
        if flown.code == 0 or number == ATTEMPTS - 1 or not any(map(is_disturbed, flown.bags)):
            break
        warnings.warn(f"flight {number} was disturbed, and is flown again:\n{flown.said}", stacklevel=2)
    assert flown.code == 0, flown.said + flown.errors
    return flown
