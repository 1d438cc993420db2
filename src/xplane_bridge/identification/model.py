"""A linear model about a trim point: dx/dt = A x + B u, y = C x + D u, all of them differences from the trim point.

Angles are in radians, for A and B then hold numbers that can be compared with a textbook's. Signs are those of the
messages: angles nose up, right wing down and wind from the right +; elevator trailing edge down + (nose down),
aileron (left - right) / 2 trailing edge down + (rolls right), rudder trailing edge left +.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Mapping, Optional, Sequence

import numpy as np

from xplane_bridge.errors import XplaneBridgeError


class IdentificationError(XplaneBridgeError):
    """There is no model to be had; the text is one line with the remedy."""


@dataclass(frozen=True)
class Signal:
    """One state, input or output."""

    name: str
    unit: str


@dataclass(frozen=True)
class Axis:
    """One half of the aircraft's motion: what its model is made of."""

    name: str
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    forces: tuple[Signal, ...]  #: outputs beyond the states


_RAD, _RAD_S, _MPS2 = "rad", "rad/s", "m/s^2"
LONGITUDINAL = Axis(
    "longitudinal",
    (Signal("true_airspeed", "m/s"), Signal("alpha", _RAD), Signal("pitch_rate", _RAD_S), Signal("pitch", _RAD)),
    (Signal("elevator", _RAD),),
    (Signal("specific_force_x", _MPS2), Signal("specific_force_z", _MPS2)),
)
LATERAL = Axis(
    "lateral",
    (Signal("beta", _RAD), Signal("roll_rate", _RAD_S), Signal("yaw_rate", _RAD_S), Signal("roll", _RAD)),
    (Signal("aileron", _RAD), Signal("rudder", _RAD)),
    (Signal("specific_force_y", _MPS2),),
)
AXES = {axis.name: axis for axis in (LONGITUDINAL, LATERAL)}

#: Reduced models: name to the states that are kept. Truncated from four states, never estimated with fewer.
REDUCED: dict[str, dict[str, tuple[str, ...]]] = {
    "longitudinal": {"short_period": ("alpha", "pitch_rate")},
    "lateral": {"roll": ("roll_rate",), "dutch_roll": ("beta", "yaw_rate")},
}


@dataclass(frozen=True)
class Estimate:
    """A number with the half width of its 95 % interval; NaN where there is none."""

    value: float
    unit: str = ""
    interval: float = math.nan

    @property
    def unsure(self) -> bool:
        """Whether the interval is so wide that hardly the sign is known."""
        return self.interval > 0.5 * abs(self.value)


@dataclass(frozen=True)
class Mode:
    """One eigenvalue, or one pair of them."""

    name: str
    eigenvalue: complex  #: of a pair the one with the positive imaginary part [1/s]
    interval_real: float = math.nan  #: half width of the 95 % interval [1/s]
    interval_imag: float = math.nan

    @property
    def frequency(self) -> float:
        """Undamped natural frequency [rad/s]."""
        return abs(self.eigenvalue)

    @property
    def damping(self) -> float:
        """Damping ratio; 1 or -1 where it does not oscillate."""
        return -self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue else 0.0

    @property
    def relative_interval(self) -> float:
        """Half width of the interval, real and imaginary part together, against the eigenvalue's size."""
        return math.hypot(self.interval_real, self.interval_imag) / max(abs(self.eigenvalue), 1e-9)


@dataclass
class AxisModel:
    """The model of one axis."""

    axis: Axis
    inputs: tuple[Signal, ...]  #: those of the axis that the model knows the effect of
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    modes: list[Mode]
    derivatives: dict[str, Estimate] = field(default_factory=dict)
    a_interval: Optional[np.ndarray] = None
    b_interval: Optional[np.ndarray] = None
    facts: dict[str, Any] = field(default_factory=dict)  #: how it was found, plain enough for YAML
    warnings: list[str] = field(default_factory=list)

    @property
    def outputs(self) -> tuple[Signal, ...]:
        """The states, then the specific forces."""
        return (*self.axis.states, *self.axis.forces)

    def mode(self, name: str) -> Mode:
        """Give a mode by its name.

        Raises:
            IdentificationError: There is none of that name; the text lists those there are.
        """
        for mode in self.modes:
            if mode.name == name:
                return mode
        msg = f"the {self.axis.name} model has no mode {name}; it has: {', '.join(m.name for m in self.modes)}"
        raise IdentificationError(msg)

    def reduced(self, name: str) -> tuple[list[str], np.ndarray, np.ndarray]:
        """Truncate to the states of a reduced model of `REDUCED`; gives their names, A and B."""
        kept = REDUCED[self.axis.name][name]
        rows = [[signal.name for signal in self.axis.states].index(state) for state in kept]
        return list(kept), self.a[np.ix_(rows, rows)], self.b[rows]


@dataclass
class LinearModel:
    """What a file of a model holds."""

    aircraft: str
    trim: dict[str, Estimate]
    axes: dict[str, AxisModel]
    source: dict[str, Any]  #: the program, and what it was given

    @property
    def warnings(self) -> list[str]:
        """Of all axes; what holds of several is said once."""
        return list(dict.fromkeys(text for axis in self.axes.values() for text in axis.warnings))


def name_modes(axis: Axis, a: np.ndarray) -> list[Mode]:
    """Give the modes of a system matrix, fastest first, by the names that flight mechanics has for them."""
    found = np.linalg.eigvals(a)
    upper = sorted((complex(value) for value in found if value.imag >= 0.0), key=abs, reverse=True)
    pairs = [value for value in upper if value.imag > 0.0]
    names: dict[complex, str] = {}
    if axis.name == "longitudinal" and len(pairs) == 2 and len(upper) == 2:
        names = {upper[0]: "short_period", upper[1]: "phugoid"}
    elif axis.name == "longitudinal" and len(pairs) == 1:
        names = {pairs[0]: "short_period" if pairs[0] is upper[0] else "phugoid"}
    elif axis.name == "lateral" and len(pairs) == 1 and len(upper) == 3:
        real = [value for value in upper if value.imag == 0.0]
        names = {pairs[0]: "dutch_roll", real[0]: "roll", real[1]: "spiral"}
    return [Mode(names.get(value, f"mode_{k}"), value) for k, value in enumerate(upper, 1)]


def signal_names(signals: Sequence[Signal]) -> list[str]:
    """Give the names alone."""
    return [signal.name for signal in signals]


def trim_estimates(values: Mapping[str, tuple[float, str]]) -> dict[str, Estimate]:
    """Make a trim point of (value, unit) by name; values that are not known (NaN) are left out, rounding is 0."""
    return {name: Estimate(round(float(v), 9) + 0.0, unit) for name, (v, unit) in values.items() if math.isfinite(v)}
