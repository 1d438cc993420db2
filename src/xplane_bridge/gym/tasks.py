"""What an episode is about: where it begins, what earns how much, when it is over."""

from __future__ import annotations

from typing import Any, ClassVar, Mapping, Sequence


class Task:
    """Nothing in particular: no reward, and no end but the flight's own. Made anew for each environment.

    `state` is a FlightState: fields, units and signs of FlightState.msg. `command` is what is commanded, by field of
    ControlCommand.
    """

    episode: ClassVar[Mapping[str, Any]] = {}  #: how episodes begin, where the environment is not given otherwise
    fields: Sequence[str] = ()  #: what is observed, likewise; none: `spaces.DEFAULT_FIELDS`
    axes: Sequence[str] = ()  #: what is commanded, likewise; none: `spaces.DEFAULT_AXES`

    def begin(self, state: Any) -> None:
        """An episode begins in this state."""

    def reward(self, state: Any, command: Mapping[str, Any]) -> float:  # noqa: ARG002
        """What `command` earned by bringing about `state`."""
        return 0.0

    def ended(self, state: Any) -> str:  # noqa: ARG002
        """Why the episode is over (a word or two), or ""."""
        return ""


class WingsLevel(Task):
    """Level the wings with the ailerons, from any bank up to 40 degrees, in light turbulence."""

    episode: ClassVar[Mapping[str, Any]] = {"roll": {"uniform": [-40.0, 40.0]}, "turbulence": 1.0}
    fields = ("roll_deg", "angular_velocity.x", "angular_velocity.z", "load_factor_side")
    axes = ("roll",)

    def reward(self, state: Any, command: Mapping[str, Any]) -> float:
        """1 with the wings level and the stick centred, 0 from 45 degrees of bank on."""
        return float(1.0 - min(abs(state.roll_deg), 45.0) / 45.0 - 0.05 * command["roll"] ** 2)

    def ended(self, state: Any) -> str:
        """Knife-edge flight is given up."""
        return "upside down" if abs(state.roll_deg) > 90.0 else ""


class Hover(Task):
    """Stand still at the height of the start, for what can hover."""

    episode: ClassVar[Mapping[str, Any]] = {
        "wind_speed": {"uniform": [0.0, 4.0]},
        "wind_from": {"uniform": [0.0, 360.0]},
        "turbulence": 0.5,
    }
    fields = (
        "roll_deg", "pitch_deg", "angular_velocity.x", "angular_velocity.y", "angular_velocity.z", "velocity_body.x",
        "velocity_body.y", "vertical_speed", "altitude_agl",
    )  # fmt: skip
    axes = ("roll", "pitch", "yaw", "throttle")
    _height = 0.0

    def begin(self, state: Any) -> None:
        """Remembers the height."""
        self._height = state.altitude_agl

    def reward(self, state: Any, command: Mapping[str, Any]) -> float:  # noqa: ARG002
        """1 at rest at the height, 0 from 10 m off or 5 m/s on."""
        off = min(abs(state.altitude_agl - self._height) / 10.0, 1.0)
        drift = min(state.ground_speed / 5.0, 1.0)
        return float(1.0 - 0.5 * (off + drift))

    def ended(self, state: Any) -> str:
        """Tumbling, or out of sight."""
        if max(abs(state.roll_deg), abs(state.pitch_deg)) > 80.0:
            return "tumbling"
        return "too far off" if abs(state.altitude_agl - self._height) > 50.0 else ""
