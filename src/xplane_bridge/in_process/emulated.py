"""The emulator beginning a flight as a flight in process does: loaded and trimmed in its wind and air."""

from __future__ import annotations

import dataclasses

from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.in_process.aircraft import Conditions, initial_state


class ConditionedEmulator(Emulator):
    """Begins with conditions, which replace what the options say of them.

    Args:
        options: All else.
        conditions: How the flight begins and what it flies in.
        shows_start: Whether the aircraft stands in the first frame, at simulated time 0: its state is the start, which
            clients see and answer, as a flight in process does.
    """

    def __init__(self, options: Options, conditions: Conditions, shows_start: bool = False) -> None:
        self._conditions = conditions
        self._shows_start = shows_start
        weather = conditions.weather
        super().__init__(
            dataclasses.replace(
                options,
                aircraft=conditions.aircraft,
                initial=initial_state(conditions.start),
                fps=conditions.frame_rate,
                seed=conditions.seed,
                wind=(weather.get("wind_from", 0.0), weather.get("wind_speed", 0.0)),
                turbulence=weather.get("turbulence", 0.0),
            )
        )

    def run_frame(self, period: float, now: float, host_time: float = float("nan")) -> None:
        """One rendered frame."""
        stands, self._shows_start = self._shows_start, False
        if stands:
            self.sim.frozen = True
            self.sim.clocks.running = -period
        super().run_frame(period, now, host_time)
        if stands:
            self.sim.frozen = False

    def _make_model(self, name: str) -> FlightModel:
        conditions = self._conditions
        return conditions.model() if name == conditions.aircraft else super()._make_model(name)

    def _new_simulator(self) -> Simulator:
        simulator = super()._new_simulator()
        self._conditions.disturb(simulator.model)
        simulator.settings.show_air(*self._conditions.air)
        return simulator
