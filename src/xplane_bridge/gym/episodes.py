"""How episodes begin and what they are flown in: fixed values and distributions, drawn anew for each."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Set, Tuple, Union

import numpy as np

from xplane_bridge.campaign.distributions import Parameter, parse_parameter
from xplane_bridge.constants import FAILURE_KINDS
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.emulator.scenario_pilot import START
from xplane_bridge.errors import is_number
from xplane_bridge.gym.errors import GymError
from xplane_bridge.in_process.aircraft import AUTO, LOADING, WEATHER, Conditions
from xplane_bridge.in_process.failures import WITH_VALUE, Failures, NotFlownError

ATTITUDE = ("roll", "pitch")
#: What can be given, in the order in which it is drawn.
KEYS = (*START, *ATTITUDE, *WEATHER, *LOADING)
_ACTION_KEYS = ("name", "kind", "value")
_FAILURE_KEYS = (*_ACTION_KEYS, "at")
#: Shares drawn for a failure: of its name, kind, value and time.
_FAILURE_SHARES = len(_FAILURE_KEYS)
_MOST_SEED = 2**31
#: What a steady flight hangs on; where the aircraft stands over the ground also the wind against it.
_TRIMMED = ("on_ground", "altitude", "speed", "temperature_offset", "sea_level_pressure", *LOADING)
_HOVERED = ("heading", "wind_speed", "wind_from")

_Chosen = Union[float, str, Sequence[float], Parameter]


@dataclass(frozen=True)
class Failure:
    """What breaks, and when [s]."""

    at: float
    action: Mapping[str, Any]  #: as a scenario's `failure`


@dataclass(frozen=True)
class Episode:
    """One that was drawn."""

    conditions: Conditions
    failures: Tuple[Failure, ...]  #: by their time
    options: Dict[str, Any]  #: of `reset`, to have this episode again


def _plain(item: Any) -> Any:
    """Python's numbers and lists for NumPy's, which its random generators give."""
    if isinstance(item, (np.generic, np.ndarray)):
        return item.tolist()
    if isinstance(item, (list, tuple)):
        return [_plain(each) for each in item]
    return {key: _plain(value) for key, value in item.items()} if isinstance(item, Mapping) else item


def _chosen(key: str, item: Any, where: str = "episode.") -> _Chosen:
    item = _plain(item)
    if isinstance(item, Mapping):
        parameter = parse_parameter(key, item, where)
        if not parameter.numeric and key not in ("name", "kind"):
            raise GymError(f"{where}{key}.choice: {item['choice']!r}; expected a list of numbers")
        return parameter
    if key == "on_ground" and isinstance(item, bool):
        return float(item)
    if key == "fuel" and isinstance(item, list) and all(map(is_number, item)):
        return [float(kg) for kg in item]
    if not is_number(item):
        tanks = ", a list of one for each tank" if key == "fuel" else ""
        raise GymError(
            f"{where}{key}: {item!r}; expected a number{tanks}, or a distribution such as {{'uniform': [0, 1]}}"
        )
    return float(item)


def _value(chosen: Optional[_Chosen], share: float) -> Any:
    return chosen.at(share) if isinstance(chosen, Parameter) else chosen


def _possible(chosen: Optional[_Chosen]) -> Tuple[Any, ...]:
    """What may be drawn: each choice, or both ends of a distribution."""
    if not isinstance(chosen, Parameter):
        return (chosen,)
    count = len(chosen.values)
    shares = [(i + 0.5) / count for i in range(count)] if chosen.kind == "choice" else [0.0, 1.0]
    return tuple(chosen.at(share) for share in shares)


def _failure(index: int, item: Any) -> Dict[str, Any]:
    where = f"failures[{index}]"
    if not isinstance(item, Mapping) or "name" not in item or set(item) - set(_FAILURE_KEYS):
        raise GymError(f"episode.{where}: {item!r}; expected a mapping with name, and kind, value, at [s]")
    out: Dict[str, Any] = {"kind": "failed", "at": 0.0}
    for key, value in item.items():
        text = key in ("name", "kind") and isinstance(value, str)
        given = text or (key == "value" and value is None)
        out[key] = value if given else _chosen(key, value, f"episode.{where}.")
    if not all(isinstance(name, str) for name in _possible(out["name"])):
        raise GymError(f"episode.{where}.name: {item['name']!r}; expected a text, or a choice of texts")
    unknown = [kind for kind in _possible(out["kind"]) if kind not in FAILURE_KINDS]
    if unknown:
        raise GymError(f"episode.{where}.kind: {unknown[0]!r}; expected one of {', '.join(FAILURE_KINDS)}")
    return out


def _action(item: Mapping[str, Any], name: str, kind: str, value: Optional[float]) -> Dict[str, Any]:
    """A scenario's `failure`; beside a drawn kind, a value is for those that take one."""
    if isinstance(item["kind"], Parameter) and kind not in WITH_VALUE:
        value = None
    return {"name": name, "kind": kind, "value": value, "clear": False}


def _possible_actions(item: Mapping[str, Any]) -> Iterator[Dict[str, Any]]:
    for drawn in product(*(_possible(item.get(key)) for key in _ACTION_KEYS)):
        yield _action(item, *drawn)


class Episodes:
    """What episodes are drawn from.

    Args:
        model: Of the aircraft; it is not flown.
        frame_rate: [Hz]
        given: Keys of `KEYS` to a number or a distribution as in a campaign file (`fuel`: of each tank), `failures` to
            a list of failures with `name`, `kind`, `value`, `at`, and `seed` (of the turbulence).

    Raises:
        GymError, CampaignError: Something in it is none of these, or a failure that may be drawn is none that this
            aircraft can have.
    """

    def __init__(self, model: FlightModel, frame_rate: float, given: Mapping[str, Any]) -> None:
        unknown = sorted(set(given) - {*KEYS, "failures", "seed"})
        if unknown:
            raise GymError(f"episode.{unknown[0]}: unknown key; expected {', '.join(KEYS)}, failures, seed")
        failures = given.get("failures") or ()
        if not isinstance(failures, (list, tuple)):
            raise GymError(f"episode.failures: {failures!r}; expected a list")
        seed = given.get("seed")
        if seed is not None and (isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0):
            raise GymError(f"episode.seed: {seed!r}; expected a whole number, 0 or more")
        self._model, self._info = model, model.info
        self._frame_rate, self._given = frame_rate, dict(given)
        self._seed = seed
        self._chosen = {key: _chosen(key, given[key]) for key in KEYS if given.get(key) is not None}
        self._failures = [_failure(i, item) for i, item in enumerate(failures)]
        self._check_failures()

    def fixed(self, options: Mapping[str, Any]) -> Episodes:
        """These with some of it chosen otherwise."""
        return Episodes(self._model, self._frame_rate, {**self._given, **options}) if options else self

    @property
    def vary(self) -> bool:
        """Whether start, weather or loading are drawn, so that the next may be another."""
        return bool(self._drawn())

    @property
    def trims_vary(self) -> bool:
        """Whether the next may be a steady flight where this one is none."""
        hovers = self._info.hover_thrust_vector is not None or self._info.stall_mps == 0.0
        return not self._drawn().isdisjoint((*_TRIMMED, *_HOVERED) if hovers else _TRIMMED)

    def undrawn(self) -> Conditions:
        """What is given as numbers, without what is drawn and without what has no meaning of its own beside that."""
        out = self._drawn()
        out |= {"altitude", "speed"} if "on_ground" in out else set()
        out |= {"cg_aft"} if "payload" in out else set()
        given = {key: value for key, value in self._given.items() if key in KEYS and key not in out}
        return Episodes(self._model, self._frame_rate, given).draw(np.random.default_rng(0)).conditions

    def _check_failures(self) -> None:
        """Tries all that may be drawn, each alone and beside the others."""
        by_name: List[Dict[str, Dict[str, Any]]] = []
        for index, item in enumerate(self._failures):
            actions = list(_possible_actions(item))
            for action in actions:
                self._try(index, action)
            by_name.append({action["name"]: action for action in actions})
        for earlier, index in combinations(range(len(by_name)), 2):
            for both in product(by_name[earlier].values(), by_name[index].values()):
                self._try(index, *both)

    def _try(self, index: int, *actions: Mapping[str, Any]) -> None:
        trial = Failures(self._model)
        try:
            for action in actions:
                trial.act(action)
        except NotFlownError as error:
            varies = any(isinstance(self._failures[index].get(key), Parameter) for key in _ACTION_KEYS)
            remedy = " (this may be drawn: take it out of the choice, or clip the distribution)" if varies else ""
            raise GymError(f"episode.failures[{index}]: {error}{remedy}") from None

    def _drawn(self) -> Set[str]:
        return {key for key, chosen in self._chosen.items() if isinstance(chosen, Parameter)}

    def draw(self, random: np.random.Generator) -> Episode:
        """The next episode. As many numbers are drawn whatever is fixed: fixing one thing changes no other."""
        shares = dict(zip(KEYS, random.random(len(KEYS))))
        seed = int(random.integers(_MOST_SEED))
        values = {key: _value(chosen, shares[key]) for key, chosen in self._chosen.items()}
        if "fuel" in values and not isinstance(values["fuel"], list):
            values["fuel"] = [values["fuel"]] * self._info.tank_count
        # Of a generator of their own, so that an episode without them changes no later one.
        apart = np.random.default_rng(seed)
        failures = [self._drawn_failure(item, apart.random(_FAILURE_SHARES)) for item in self._failures]
        seed = seed if self._seed is None else int(self._seed)

        def of(keys: Sequence[str]) -> Dict[str, Any]:
            return {key: values[key] for key in keys if key in values}

        conditions = Conditions(
            self._info.name,
            start=of(tuple(START)),
            weather=of(WEATHER),
            loading=of(LOADING),
            attitude=of(ATTITUDE),
            frame_rate=self._frame_rate,
            seed=seed,
            mode=AUTO,
        )
        # Also what an option has switched off: the environment's own `episode` has it.
        switched_off = {key: None for key in KEYS if key in self._given and key not in values}
        broken = [
            {"name": f.action["name"], "kind": f.action["kind"], "value": f.action["value"], "at": f.at}
            for f in failures
        ]
        options: Dict[str, Any] = {**values, **switched_off, "failures": broken, "seed": seed}
        return Episode(conditions, tuple(sorted(failures, key=lambda failure: failure.at)), options)

    @staticmethod
    def _drawn_failure(item: Mapping[str, Any], shares: np.ndarray) -> Failure:
        drawn: List[Any] = [_value(item.get(key), share) for key, share in zip(_FAILURE_KEYS, shares)]
        name, kind, value, at = drawn
        return Failure(at, _action(item, name, kind, value))
