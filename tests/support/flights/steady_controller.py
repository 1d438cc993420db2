"""A controller of campaigns by the fields of FlightState that are the same float32 in process and through the nodes."""

from __future__ import annotations

from typing import Any, Dict


class Steady:
    """Rolls to a bank and holds the pitch.

    Args:
        bank: Right + [deg].
    """

    def __init__(self, bank: float) -> None:
        self._bank = bank

    def fly(self, state: Any) -> Dict[str, float]:
        """Fields of ControlCommand for a FlightState."""
        rates = state.angular_velocity
        return {
            "roll": min(max(0.03 * (self._bank - state.roll_deg) - 0.5 * rates.x, -1.0), 1.0),
            "pitch": min(max(0.03 * (2.0 - state.pitch_deg) - 0.5 * rates.y, -1.0), 1.0),
            "throttle": 0.55,
        }


class Counting(Steady):
    """Pitches up with every state since its last restart, so that each frame of that shows."""

    _states = 0

    def restart(self) -> None:
        """Another source flies."""
        self._states = 0

    def fly(self, state: Any) -> Dict[str, float]:
        """Fields of ControlCommand for a FlightState."""
        self._states += 1
        command = super().fly(state)
        return {**command, "pitch": command["pitch"] + 0.002 * min(self._states, 40)}


class Climbs(Steady):
    """Looks at the climb, which rx_node works out."""

    def fly(self, state: Any) -> Dict[str, float]:
        """Fields of ControlCommand for a FlightState."""
        return {**super().fly(state), "pitch": 0.02 * (1.0 - state.vertical_speed)}


def level(state: Any) -> Dict[str, float]:
    """Wings level, as a function."""
    return Steady(0.0).fly(state)


def half_throttle(_state: Any) -> Dict[str, float]:
    """Leaves roll and pitch to themselves."""
    return {"throttle": 0.5, "yaw": 0.0}
