"""Who flies an environment's episodes."""

from __future__ import annotations

from typing import Any, List, Mapping, Protocol

from xplane_bridge.emulator.flight.flight_model import Controls, FlightModelError, ModelState
from xplane_bridge.gym.episodes import Episode, Failure
from xplane_bridge.in_process.aircraft import AUTO, Aircraft

#: How an episode can end without the task's doing.
CRASHED, GAVE_UP = "crashed", "model gave up"


class Flight(Protocol):
    """One episode after the other."""

    def begin(self, episode: Episode) -> None:
        """Starts an episode; its first state is there then, a frame after the start."""

    def state(self) -> Any:
        """The newest FlightState."""

    def fly(self, command: Mapping[str, Any]) -> str:
        """Answers that state with fields of ControlCommand; flies a frame on. Returns how it ended, or ""."""

    @property
    def truth(self) -> ModelState:
        """What the flight model really does; overwritten by the next frame."""

    @property
    def trim(self) -> Controls:
        """What holds the aircraft as the episode began."""

    @property
    def now(self) -> float:
        """[s] since the start."""

    def close(self) -> None:
        """Ends what was started for it."""


class InProcessFlight:
    """Flies in this process, without ROS and UDP.

    Raises:
        NotCompiledError: The compiled module is not there.
    """

    _aircraft: Aircraft

    def __init__(self) -> None:
        self._to_come: List[Failure] = []

    def begin(self, episode: Episode) -> None:
        """Starts an episode.

        Raises:
            FlightModelError: The aircraft cannot fly like this.
        """
        self._aircraft = Aircraft(episode.conditions)
        self._to_come = list(episode.failures)
        # The first state that the bridge can publish is that of the first frame: no command acts in it.
        self._fly()

    def state(self) -> Any:
        """The newest FlightState."""
        return self._aircraft.view()

    def fly(self, command: Mapping[str, Any]) -> str:
        """Flies a frame on."""
        self._aircraft.command(AUTO, command)
        return self._fly()

    def _fly(self) -> str:
        aircraft = self._aircraft
        while self._to_come and self._to_come[0].at <= aircraft.now:
            aircraft.failures.act(self._to_come.pop(0).action)
        try:
            state = aircraft.step()
        except (FlightModelError, ArithmeticError):
            return GAVE_UP
        return CRASHED if state.crashed else ""

    @property
    def truth(self) -> ModelState:
        """What the flight model really does."""
        return self._aircraft.state

    @property
    def trim(self) -> Controls:
        """What holds the aircraft as the episode began."""
        return self._aircraft.model.trim_controls

    @property
    def now(self) -> float:
        """[s] since the start."""
        return self._aircraft.shown_time

    def close(self) -> None:
        """Nothing to end."""
