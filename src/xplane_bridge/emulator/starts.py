"""How flights begin: as configured, as before, or as PREL asks; and what begins where there is no such flight."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Callable, Optional, Protocol

from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs import airport_starts
from xplane_bridge.emulator.datarefs.placement import Placements
from xplane_bridge.emulator.flight.flight_model import FlightModelError, InitialState

_LOG = logging.getLogger(__name__)


class Begin(Protocol):
    """Begins a flight, trimmed or as it is; raises FlightModelError, and changes nothing, where there is none."""

    def __call__(self, initial: InitialState, trimmed: bool = True) -> None:
        """Begins it."""


class Starts:
    """Begins the simulator's flights.

    Args:
        first: The start as configured.
        home: A flight over the middle of the one airport's runway, along it.
        begin: Begins a flight.
        terrain_m: Gives the height of the ground of now.

    Attributes:
        last: The most recent start.
    """

    def __init__(self, first: InitialState, home: InitialState, begin: Begin, terrain_m: Callable[[], float]) -> None:
        self.last = first
        self._first, self._home, self._begin, self._terrain_m = first, home, begin, terrain_m

    def first(self) -> None:
        """The flight as configured; on the ground where there is no steady flight with what clients have loaded."""
        self._begin_or_park(self._first, self._begin)

    def again(self) -> None:
        """The most recent start; on the ground where the air and the loading of now leave no flight there."""
        self._begin_or_park(self.last, self._at)

    def place(self, request: protocol.Placement) -> Optional[str]:
        """PREL: at a place (start type 6), at the one aerodrome, as before, or as configured; why not, or None."""
        if request.start_type == Placements.REPEAT_LAST:
            initial: Optional[InitialState] = self.last
        elif request.start_type == Placements.START_AT_PLACE:
            initial = Placements.initial_state(request, self._terrain_m())
        elif request.start_type in airport_starts.TYPES:
            initial = airport_starts.airport_start(request, self._home)
            if initial is None:
                return "airport"
        else:
            initial = self._first
        if initial is None:
            return "value"
        try:
            self._at(initial)
        except FlightModelError as error:  # no place to fly from
            _LOG.info("PREL: %s", error)
            return "value"
        self.last = initial
        return None

    def _at(self, initial: InitialState) -> None:
        """X-Plane trims nothing: the aircraft is there with the speed asked for, whatever it then does."""
        try:
            self._begin(initial)
        except FlightModelError:
            if initial.airspeed_mps is None:
                raise
            self._begin(initial, trimmed=False)

    def _begin_or_park(self, initial: InitialState, begin: Callable[[InitialState], None]) -> None:
        try:
            begin(initial)
        except FlightModelError as error:
            _LOG.warning("%s: the flight starts on the ground", error)
            self._begin(replace(initial, on_ground=True))
        self.last = initial
