"""Flies an environment's episodes over the nodes of the bridge, in lock-step with the emulator in this process."""

from __future__ import annotations

import threading
from typing import Any, Mapping

from xplane_bridge.emulator.flight.flight_model import Controls, ModelState
from xplane_bridge.emulator.options import Options
from xplane_bridge.gym.episodes import Episode
from xplane_bridge.gym.errors import GymError
from xplane_bridge.gym.flights import CRASHED, GAVE_UP
from xplane_bridge.harness.lockstep_bridge import LockstepBridge
from xplane_bridge.in_process.emulated import ConditionedEmulator


class RosFlight:
    """An emulator in a thread, rx_node and tx_node beside it, all of them anew for each episode."""

    _emulator: ConditionedEmulator
    _thread: threading.Thread
    _state: Any

    def __init__(self) -> None:
        self._bridge = LockstepBridge()
        self._runs = False

    def begin(self, episode: Episode) -> None:
        """Starts an episode.

        Raises:
            FlightModelError: The aircraft cannot fly like this.
            GymError: Something is to break.
            HarnessError: The nodes do not come up.
        """
        if episode.failures:
            raise GymError("failures: over the bridge, tx_node breaks things (service set_failure); expected none here")
        self._end()
        options = Options(bind="127.0.0.1", port=0, beacon=False, realtime=False, stepped="lockstep")
        self._emulator = ConditionedEmulator(options, episode.conditions)
        self._thread = threading.Thread(target=self._emulator.run, name="emulator", daemon=True)
        self._thread.start()
        self._runs = True
        self._state = self._bridge.begin(self._emulator.port, episode.conditions.aircraft)

    def state(self) -> Any:
        """The newest FlightState."""
        return self._state

    def fly(self, command: Mapping[str, Any]) -> str:
        """Flies a frame on.

        Raises:
            HarnessError: The nodes have ended.
        """
        self._state = self._bridge.answer(command)
        # The simulator stands until this state is answered: its thread changes nothing now.
        if self._emulator.sim.loads > 1:  # it has begun anew by itself
            return GAVE_UP
        return CRASHED if self.truth.crashed else ""

    @property
    def truth(self) -> ModelState:
        """What the flight model really does."""
        return self._emulator.sim.model.state

    @property
    def trim(self) -> Controls:
        """What holds the aircraft as the episode began."""
        return self._emulator.sim.model.trim_controls

    @property
    def now(self) -> float:
        """[s] since the start."""
        return self._emulator.sim.clocks.running

    def close(self) -> None:
        """Ends emulator and nodes."""
        self._end()
        self._bridge.close()

    def _end(self) -> None:
        self._bridge.end()
        if self._runs:
            self._runs = False
            self._emulator.stopping = True
            self._thread.join()
