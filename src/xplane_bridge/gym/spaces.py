"""Observations are fields of FlightState, actions are axes of ControlCommand: names, units, bounds."""

from __future__ import annotations

import math
from operator import attrgetter, itemgetter
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from gymnasium import spaces

from xplane_bridge.constants import COMMAND_FIELDS
from xplane_bridge.emulator.command_channels import ATTRIBUTES
from xplane_bridge.emulator.flight.flight_model import Controls, ModelInfo
from xplane_bridge.gym.errors import GymError
from xplane_bridge.in_process.view import FlightView, place_of


class Field(NamedTuple):
    """One number of FlightState as an observation; what lies beyond the bounds is cut to them."""

    unit: str
    low: float
    high: float
    turns: bool = False  #: an angle of a full turn: observed as its sine and cosine


def _vector(name: str, unit: str, bound: float) -> Dict[str, Field]:
    return {f"{name}.{axis}": Field(unit, -bound, bound) for axis in "xyz"}


#: What can be observed, by its name in FlightState.msg.
FIELDS: Dict[str, Field] = {
    "latitude": Field("deg", -90.0, 90.0),
    "longitude": Field("deg", -180.0, 180.0),
    "altitude_msl": Field("m", -1000.0, 20000.0),
    "altitude_agl": Field("m", -1000.0, 20000.0),
    "roll_deg": Field("deg", -180.0, 180.0),
    "pitch_deg": Field("deg", -90.0, 90.0),
    "heading_true_deg": Field("deg", -1.0, 1.0, turns=True),
    **_vector("angular_velocity", "rad/s", 20.0),
    **_vector("angular_acceleration", "rad/s^2", 500.0),
    **_vector("velocity_ned", "m/s", 400.0),
    **_vector("velocity_body", "m/s", 400.0),
    "ground_speed": Field("m/s", 0.0, 400.0),
    "track_deg": Field("deg", -1.0, 1.0, turns=True),
    "flight_path_angle_deg": Field("deg", -90.0, 90.0),
    "vertical_speed": Field("m/s", -400.0, 400.0),
    "alpha_deg": Field("deg", -180.0, 180.0),
    "beta_deg": Field("deg", -90.0, 90.0),
    "calibrated_airspeed": Field("m/s", 0.0, 400.0),
    "equivalent_airspeed": Field("m/s", 0.0, 400.0),
    "true_airspeed": Field("m/s", 0.0, 400.0),
    "mach": Field("-", 0.0, 1.5),
    "dynamic_pressure": Field("Pa", 0.0, 100000.0),
    "air_density": Field("kg/m^3", 0.0, 2.0),
    "load_factor_normal": Field("g", -20.0, 20.0),
    "load_factor_axial": Field("g", -20.0, 20.0),
    "load_factor_side": Field("g", -20.0, 20.0),
    **_vector("specific_force", "m/s^2", 200.0),
    **_vector("wind_ned", "m/s", 150.0),
    "wind_speed": Field("m/s", 0.0, 200.0),
    "wind_from_deg": Field("deg", -1.0, 1.0, turns=True),
    "control_roll": Field("-1..1", -1.0, 1.0),
    "control_pitch": Field("-1..1", -1.0, 1.0),
    "control_yaw": Field("-1..1", -1.0, 1.0),
    "control_throttle": Field("-1..1", -1.0, 1.0),
}
#: Observed where nothing else is asked for.
DEFAULT_FIELDS = (
    "roll_deg", "pitch_deg", "heading_true_deg", "angular_velocity.x", "angular_velocity.y", "angular_velocity.z",
    "alpha_deg", "beta_deg", "true_airspeed", "vertical_speed", "altitude_agl", "load_factor_normal",
    "control_throttle",
)  # fmt: skip
#: Commanded where nothing else is asked for.
DEFAULT_AXES = {
    "fixed_wing": ("roll", "pitch", "yaw", "throttle"),
    "multirotor": ("roll", "pitch", "yaw", "throttle"),
    "tiltrotor": ("roll", "pitch", "yaw", "throttle", "thrust_vector"),
}
#: Axes with one number for each engine.
_BY_ENGINE = ("engine_throttles", "motors")
_THROTTLES = ("throttle", *_BY_ENGINE)


class Observer:
    """Observations of one list of fields.

    Args:
        fields: Names of `FIELDS`.

    Raises:
        GymError: There is no such field.
    """

    def __init__(self, fields: Sequence[str]) -> None:
        unknown = [name for name in fields if name not in FIELDS]
        if unknown or not fields or len(set(fields)) < len(fields):
            raise GymError(f"fields: {unknown or list(fields)}; expected some of {', '.join(FIELDS)}, each once")
        low: List[float] = []
        high: List[float] = []
        names: List[str] = []
        for name in fields:
            field = FIELDS[name]
            parts = (f"sin {name}", f"cos {name}") if field.turns else (name,)
            names += parts
            low += [field.low] * len(parts)
            high += [field.high] * len(parts)
        self.names: Tuple[str, ...] = tuple(names)  #: of the elements of an observation
        self.space = spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
        # The last first, so that what is put in moves nothing that is still to come.
        self._turning = [i for i, name in enumerate(fields) if FIELDS[name].turns][::-1]
        self._get = _several(attrgetter, fields)
        self._get_in_process = _several(itemgetter, [place_of(name) for name in fields])

    def observe(self, state: Any) -> np.ndarray:
        """A new observation of a FlightState."""
        values = list((self._get_in_process if type(state) is FlightView else self._get)(state))
        for i in self._turning:
            angle = math.radians(values[i])
            values[i : i + 1] = math.sin(angle), math.cos(angle)
        out = np.array(values, np.float32)
        np.maximum(out, self.space.low, out=out)
        np.minimum(out, self.space.high, out=out)
        return out


def _several(getter: Callable[..., Callable[[Any], Any]], which: Sequence[Any]) -> Callable[[Any], Sequence[float]]:
    """What an attrgetter or itemgetter gets, as a sequence also where it is one number."""
    get = getter(*which)
    return get if len(which) > 1 else lambda state: (get(state),)


class Commander:
    """Commands of one list of axes, each from -1 to 1 over the axis's own range.

    Args:
        axes: Fields of ControlCommand: those of one number; `engine_throttles` and `motors`, one for each engine.
        info: Of the aircraft.

    Raises:
        GymError: There is no such axis, or they exclude each other.
    """

    def __init__(self, axes: Sequence[str], info: ModelInfo) -> None:
        unknown = [name for name in axes if name not in COMMAND_FIELDS and name not in _BY_ENGINE]
        if unknown or not axes or len(set(axes)) < len(axes):
            known = ", ".join((*COMMAND_FIELDS, *_BY_ENGINE))
            raise GymError(f"axes: {unknown or list(axes)}; expected some of {known}, each once")
        if len(set(axes) & set(_THROTTLES)) > 1:
            raise GymError(f"axes: {', '.join(axes)}; expected one of {', '.join(_THROTTLES)} at most")
        self._names: List[str] = []
        self._ranges: List[Tuple[float, float]] = []
        self._groups: Dict[str, slice] = {}
        for name in axes:
            count = info.engine_count if name in _BY_ENGINE else 1
            low, high = (info.min_throttle, 1.0) if name in _THROTTLES else COMMAND_FIELDS[name][1:]
            begin = len(self._names)
            if name in _BY_ENGINE:
                self._groups[name] = slice(begin, begin + count)
            self._names += [f"{name}[{i}]" for i in range(count)] if name in _BY_ENGINE else [name]
            self._ranges += [(low, high)] * count
        self.names = tuple(self._names)  #: of the elements of an action
        self.space = spaces.Box(-1.0, 1.0, (len(self._names),), np.float32)

    def command(self, action: Any) -> Dict[str, Any]:
        """Fields of ControlCommand that an action stands for.

        Raises:
            GymError: It is none, or beyond -1..1, where the bridge too would refuse it.
        """
        given = np.asarray(action, np.float32)
        if given.shape != self.space.shape:
            raise GymError(
                f"action of shape {given.shape}; expected {len(self.names)} numbers: {', '.join(self.names)}"
            )
        numbers = given.tolist()
        values: List[float] = []
        for name, number, (low, high) in zip(self._names, numbers, self._ranges):
            if not -1.0 <= number <= 1.0:
                raise GymError(f"action {name} is {number}: expected -1..1 (gymnasium.wrappers.ClipAction cuts it)")
            values.append(number if low == -1.0 else low + 0.5 * (number + 1.0) * (high - low))
        if not self._groups:
            return dict(zip(self._names, values))
        out: Dict[str, Any] = {name: value for name, value in zip(self._names, values) if "[" not in name}
        out.update({name: values[part] for name, part in self._groups.items()})
        return out

    def action_of(self, controls: Controls) -> np.ndarray:
        """The action that leaves controls as they are, such as those that hold a trimmed flight."""
        values = []
        for name, (low, high) in zip(self._names, self._ranges):
            kind, _, engine = name.rstrip("]").partition("[")
            if kind in ATTRIBUTES:
                value = getattr(controls, ATTRIBUTES[kind])
            elif kind == "gear":
                value = float(controls.gear_down)
            else:
                # Without an override, what the levers say is what drives the engines.
                driven = kind == "motors" and controls.override_throttles
                value = (controls.throttle_use if driven else controls.throttle)[int(engine or 0)]
            values.append(2.0 * (value - low) / (high - low) - 1.0)
        return np.clip(np.array(values, np.float32), -1.0, 1.0)
