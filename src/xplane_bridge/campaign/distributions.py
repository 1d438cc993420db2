"""What a parameter is drawn from, and the points of a campaign: functions of its seed and the flight's number alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from xplane_bridge.errors import XplaneBridgeError, is_number

Value = Union[float, str]
SAMPLINGS = ("random", "latin_hypercube", "sobol")

#: Streams of the generator: points, permutations of the hypercube and the scrambling must not share numbers.
_POINTS, _PERMUTATIONS, _JITTER, _SCRAMBLING, _SEEDS = range(5)


class CampaignError(XplaneBridgeError, ValueError):
    """A campaign that cannot be flown: says where (key path), what was given and what is expected."""


@dataclass(frozen=True)
class Parameter:
    """A quantity that differs from flight to flight.

    Attributes:
        name: By which the scenario refers to it as `$name`.
        kind: Of its distribution.
        values: Of the distribution: two numbers, three (triangular), or the choices.
        unit: For tables and figures.
        clip: Bounds to which a draw is cut.
    """

    name: str
    kind: str
    values: Tuple[Value, ...]
    unit: str = ""
    clip: Optional[Tuple[float, float]] = None

    @property
    def numeric(self) -> bool:
        """Whether all its values are numbers."""
        return not any(isinstance(value, str) for value in self.values)

    def at(self, share: float) -> Value:
        """The value below which `share` (0..1) of all draws lie; choices in their order."""
        value: Value = _INVERSES[self.kind](share, self.values)
        if self.clip is None or isinstance(value, str):
            return value
        return min(max(value, self.clip[0]), self.clip[1])


def _choice(share: float, values: Sequence[Value]) -> Value:
    return values[min(int(share * len(values)), len(values) - 1)]


def _triangular(share: float, values: Sequence[float]) -> float:
    low, peak, high = values
    rising = (peak - low) / (high - low)
    if share < rising:
        return low + math.sqrt(share * (high - low) * (peak - low))
    return high - math.sqrt((1.0 - share) * (high - low) * (high - peak))


def _normal(share: float, values: Sequence[float]) -> float:
    # Not the two ends, which lie at infinity.
    return values[0] + values[1] * NormalDist().inv_cdf(min(max(share, 1e-12), 1.0 - 1e-12))


_INVERSES: Dict[str, Callable[..., Any]] = {
    "uniform": lambda u, v: v[0] + u * (v[1] - v[0]),
    "log_uniform": lambda u, v: v[0] * (v[1] / v[0]) ** u,
    "normal": _normal,
    "triangular": _triangular,
    "choice": _choice,
}
_NUMBERS = {"uniform": "[low, high]", "log_uniform": "[low, high], both above 0", "normal": "[mean, deviation]"}
_NUMBERS["triangular"] = "[low, most likely, high]"


def parse_parameter(name: str, item: Any, where: str = "parameters.") -> Parameter:
    """Checks a parameter of a campaign file, or another distribution whose name in messages begins with `where`.

    Raises:
        CampaignError: It is none.
    """
    path = where + name
    if not str(name).isidentifier():
        raise CampaignError(f"{path}: expected a name of letters, digits and _, by which the scenario says ${name}")
    kinds = [key for key in item if key in _INVERSES] if isinstance(item, Mapping) else []
    if len(kinds) != 1:
        raise CampaignError(f"{path}: {item!r}; expected one of {', '.join(_INVERSES)}, and unit, clip")
    surplus = [str(key) for key in item if key not in (*kinds, "unit", "clip")]
    if surplus:
        raise CampaignError(f"{path}.{surplus[0]}: unknown key; expected {kinds[0]}, unit, clip")
    kind, values = kinds[0], item[kinds[0]]
    if kind == "choice":
        types = (
            {isinstance(v, str) for v in values if isinstance(v, str) or is_number(v)}
            if isinstance(values, list)
            else set()
        )
        if len(types) != 1 or not all(isinstance(v, str) or is_number(v) for v in values):
            raise CampaignError(f"{path}.choice: {values!r}; expected a list of numbers, or of texts")
    else:
        _check_numbers(kind, values, f"{path}.{kind}")
    # Whole numbers stay whole, for what takes no others, as the seed of a test signal.
    whole = kind == "choice" and all(isinstance(v, int) for v in values)
    numbers = tuple(v if whole or isinstance(v, str) else float(v) for v in values)
    clip = item.get("clip")
    if clip is not None:
        if not (isinstance(clip, list) and len(clip) == 2 and all(map(is_number, clip)) and clip[0] <= clip[1]):
            raise CampaignError(f"{path}.clip: {clip!r}; expected [low, high]")
        clip = tuple(bound if whole else float(bound) for bound in clip)
    return Parameter(str(name), kind, numbers, str(item.get("unit", "")), clip)


def _check_numbers(kind: str, values: Any, path: str) -> None:
    count = 3 if kind == "triangular" else 2
    good = isinstance(values, list) and len(values) == count and all(map(is_number, values))
    if good and kind == "normal":
        good = values[1] >= 0.0
    elif good and kind == "triangular":
        good = values[0] <= values[1] <= values[2] and values[0] < values[2]
    elif good:
        good = values[0] <= values[1] and (kind != "log_uniform" or values[0] > 0.0)
    if not good:
        raise CampaignError(f"{path}: {values!r}; expected {_NUMBERS[kind]}")


def _generator(seed: int, stream: int, number: int) -> np.random.Generator:
    """Numbers that belong to this seed, stream and number, whatever else has been drawn."""
    return np.random.Generator(np.random.Philox(key=seed, counter=[0, 0, number, stream]))


class Design:
    """The points of a campaign.

    Args:
        parameters: What to draw.
        sampling: One of `SAMPLINGS`.
        flights: How many; a hypercube is another one for another number.
        seed: Of the campaign.
    """

    def __init__(self, parameters: Sequence[Parameter], sampling: str, flights: int, seed: int) -> None:
        self._parameters = tuple(parameters)
        self._sampling, self._flights, self._seed = sampling, flights, seed

    def values(self, flight: int) -> Dict[str, Value]:
        """The parameters of a flight."""
        return {p.name: p.at(share) for p, share in zip(self._parameters, self.shares(flight))}

    def turbulence_seed(self, flight: int) -> int:
        """Another one for each flight: flights that share their gusts are no independent draws."""
        return int(_generator(self._seed, _SEEDS, flight).integers(0, 2**31))

    def shares(self, flight: int) -> List[float]:
        """Where the flight lies in the unit cube, one number a parameter."""
        count = len(self._parameters)
        if self._sampling == "random":
            return [float(x) for x in _generator(self._seed, _POINTS, flight).random(count)]
        points = _hypercube if self._sampling == "latin_hypercube" else _sobol
        return [float(x) for x in points(self._flights, count, self._seed)[flight]]


@lru_cache(maxsize=1)  # of all flights: a worker is given ten at a time
def _hypercube(flights: int, dimensions: int, seed: int) -> np.ndarray:
    """Every parameter has exactly one flight in each of as many equal parts as there are flights."""
    columns = [
        (_generator(seed, _PERMUTATIONS, i).permutation(flights) + _generator(seed, _JITTER, i).random(flights))
        / flights
        for i in range(dimensions)
    ]
    return np.array(columns).T.reshape(flights, dimensions)


@lru_cache(maxsize=1)
def _sobol(flights: int, dimensions: int, seed: int) -> np.ndarray:
    """Sobol's sequence, shifted by a random vector modulo 1 (Cranley and Patterson), which keeps its evenness."""
    shift = _generator(seed, _SCRAMBLING, 0).random(dimensions)
    return (sobol_points(flights, dimensions) + shift) % 1.0


#: Primitive polynomials and first direction numbers of Joe and Kuo (new-joe-kuo-6.21201): degree, coefficients, m_i.
_JOE_KUO = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
)
MOST_SOBOL = len(_JOE_KUO) + 1
_BITS = 32


def sobol_points(count: int, dimensions: int) -> np.ndarray:
    """The first points of Sobol's sequence, shape (count, dimensions), in Gray code order, from the origin on."""
    points = np.zeros((count, dimensions))
    for dimension in range(dimensions):
        directions = _directions(dimension)
        x = 0
        for i in range(1, count):
            zeros = (i & -i).bit_length() - 1
            x ^= directions[zeros]
            points[i, dimension] = x / 2.0**_BITS
    return points


def _directions(dimension: int) -> List[int]:
    if dimension == 0:
        return [1 << (_BITS - 1 - i) for i in range(_BITS)]
    degree, coefficients, start = _JOE_KUO[dimension - 1]
    m = list(start)
    for i in range(degree, _BITS):
        new = m[i - degree] ^ (m[i - degree] << degree)
        for k in range(1, degree):
            if (coefficients >> (degree - 1 - k)) & 1:
                new ^= m[i - k] << k
        m.append(new)
    return [m[i] << (_BITS - 1 - i) for i in range(_BITS)]
