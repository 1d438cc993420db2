"""Reads and checks campaign files (docs/experiments/campaigns.md)."""

from __future__ import annotations

import importlib
import math
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

from xplane_bridge.analysis.criteria import CAMERA, Criterion
from xplane_bridge.campaign.distributions import (
    MOST_SOBOL,
    SAMPLINGS,
    CampaignError,
    Design,
    Parameter,
    Value,
    parse_parameter,
)
from xplane_bridge.campaign.warnings_topic import messages_a_second
from xplane_bridge.emulator.aircraft import model_names
from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.emulator.flight.limits import check_atmosphere, check_turbulence, check_wind
from xplane_bridge.errors import is_number
from xplane_bridge.in_process.aircraft import LOADING, WEATHER
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import Scenario, ScenarioError, parse_scenario
from xplane_bridge.scenario.schema import STICK_AXES
from xplane_bridge.scenario.stall_warnings import awaits_stall
from xplane_bridge.scenario.world import KINDS as WORLD_KINDS
from xplane_bridge.scenario.yaml_file import read_yaml_file

_TOP = (
    "name", "description", "scenario", "aircraft", "controller", "arguments", "frame_rate", "longest", "weather",
    "loading", "parameters", "sampling", "flights", "seed", "stop",
)  # fmt: skip
_REFERENCE = re.compile(r"\$(\w+)")
_DRAWN = ("scenario", "aircraft", "arguments", "weather", "loading")  #: may refer to parameters


@dataclass(frozen=True)
class Stop:
    """Ends a campaign early: when the interval of a share is narrow enough, looked at after every so many flights."""

    criterion: str  #: name of a criterion, or `all`
    width: float  #: of the 95 % interval
    every: int = 100


@dataclass(frozen=True)
class FlightPlan:
    """One flight, all parameters drawn: plain values, for another process."""

    flight: int
    parameters: Dict[str, Value]
    scenario: Dict[str, Any]
    aircraft: str
    controller: str
    arguments: Dict[str, Any]
    weather: Dict[str, Any]
    loading: Dict[str, Any]
    frame_rate: float
    longest: float
    seed: int  #: of the turbulence


@dataclass(frozen=True)
class Campaign:
    """A checked campaign file. `document` has the scenario in it, whatever file it came from."""

    name: str
    document: Dict[str, Any]
    parameters: Tuple[Parameter, ...]
    flights: int
    seed: int
    sampling: str
    stop: Optional[Stop]
    scenario_criteria: Tuple[Criterion, ...] = ()  #: of the first flight: bounds may hang on parameters

    @property
    def criteria(self) -> Tuple[str, ...]:
        """Their names."""
        return tuple(criterion.name for criterion in self.scenario_criteria)

    @property
    def design(self) -> Design:
        """Its points."""
        return Design(self.parameters, self.sampling, self.flights, self.seed)

    def plan(self, flight: int, design: Optional[Design] = None) -> FlightPlan:
        """A flight by its number.

        Raises:
            CampaignError: There is no such flight.
        """
        if not 0 <= flight < self.flights:
            raise CampaignError(f"flight {flight}: the campaign has flights 0..{self.flights - 1}")
        design = design or self.design
        values = design.values(flight)
        d = self.document

        def drawn(key: str, default: Any) -> Any:
            return substituted(d.get(key, default), values, key)

        scenario = drawn("scenario", None)
        aircraft = drawn("aircraft", None) or scenario.get("aircraft") or "fixed_wing"
        return FlightPlan(
            flight=flight,
            parameters=values,
            scenario=scenario,
            aircraft=aircraft if isinstance(aircraft, str) else aircraft[0],
            controller=d.get("controller") or scenario.get("controller", ""),
            arguments=drawn("arguments", {}),
            weather=drawn("weather", {}),
            loading=drawn("loading", {}),
            frame_rate=float(d.get("frame_rate", 60.0)),
            longest=float(d.get("longest", 600.0)),
            seed=design.turbulence_seed(flight),
        )


def substituted(item: Any, values: Mapping[str, Value], path: str) -> Any:
    """`item` with each text `$name` replaced by that parameter's value; inside a longer text by its digits.

    Raises:
        CampaignError: There is no such parameter.
    """
    if isinstance(item, Mapping):
        return {key: substituted(value, values, f"{path}.{key}") for key, value in item.items()}
    if isinstance(item, list):
        return [substituted(value, values, f"{path}[{i}]") for i, value in enumerate(item)]
    if not isinstance(item, str):
        return item
    for name in _REFERENCE.findall(item):
        if name not in values:
            raise CampaignError(
                f"{path}: {item!r}; expected a parameter of {', '.join(values) or 'which there are none'}"
            )
    whole = parameter_of(item)
    if whole is not None:
        return values[whole]
    return _REFERENCE.sub(lambda match: _short(values[match.group(1)]), item)


def parameter_of(item: Any) -> Optional[str]:
    """Name of the parameter that `item` is drawn as; None: it is none as a whole."""
    whole = _REFERENCE.fullmatch(item) if isinstance(item, str) else None
    return whole.group(1) if whole else None


def _short(value: Value) -> str:
    return value if isinstance(value, str) else re.sub(r"\.0$", "", str(value))


def load_campaign(path: Path, flights: Optional[int] = None) -> Campaign:
    """Reads a campaign file; `flights` instead of the file's number.

    Raises:
        CampaignError: It cannot be read, or is no campaign.
    """
    document = read_yaml_file(path, CampaignError)
    if isinstance(document, Mapping) and isinstance(document.get("scenario"), str):
        file = _scenario_file(document["scenario"], Path(path))
        document = {**document, "scenario": read_yaml_file(file, CampaignError)}
    try:
        if flights is not None and isinstance(document, Mapping):
            document = {**document, "flights": flights}
        return parse_campaign(document)
    except CampaignError as error:
        raise CampaignError(f"{path}: {error}") from None


def _scenario_file(name: str, campaign: Path) -> Path:
    if name.endswith((".yaml", ".yml")):
        return campaign.parent / name
    return config_file("scenarios", f"{name}.yaml")


def parse_campaign(document: Any) -> Campaign:
    """Checks a campaign that is already a mapping with the scenario in it.

    Raises:
        CampaignError: Says the key's path, what was given, and what was expected.
    """
    d = _mapping(document, "campaign", _TOP)
    _check_plain(d, "")
    name = d.get("name")
    if not isinstance(name, str) or not name:
        raise CampaignError(f"name: {name!r}; expected a short name of the campaign")
    parameters = d.get("parameters", {})
    if not isinstance(parameters, Mapping):
        raise CampaignError(f"parameters: {parameters!r}; expected a mapping of names to distributions")
    drawn = tuple(parse_parameter(str(key), value) for key, value in parameters.items())
    sampling = d.get("sampling", "random")
    if not isinstance(sampling, str) or sampling not in SAMPLINGS:
        raise CampaignError(f"sampling: {sampling!r}; expected one of {', '.join(SAMPLINGS)}")
    if sampling == "sobol" and len(drawn) > MOST_SOBOL:
        raise CampaignError(f"sampling: sobol takes up to {MOST_SOBOL} parameters, there are {len(drawn)}")
    flights = _whole(d, "flights", 100, 1, 10_000_000)
    seed = _whole(d, "seed", 0, 0, 2**63)
    for key, low, high in (("frame_rate", 20.0, 240.0), ("longest", 0.1, 86400.0)):
        value = d.get(key, low)
        if not is_number(value) or not low <= value <= high:
            raise CampaignError(f"{key}: {value!r}; expected a number from {low:g} to {high:g}")
    _mapping(d.get("weather", {}), "weather", WEATHER)
    _mapping(d.get("loading", {}), "loading", LOADING)
    _mapping(d.get("arguments", {}), "arguments", None)
    controller = d.get("controller", "")
    if not isinstance(controller, str) or (controller and ":" not in controller):
        raise CampaignError(f"controller: {controller!r}; expected module:class or module:function")
    scenario_document = _mapping(d.get("scenario"), "scenario", None)
    if "arguments" in d and not (controller or scenario_document.get("controller")):
        raise CampaignError("arguments: without controller; expected what the controller is made with")
    aircraft = d.get("aircraft")
    if aircraft is not None and not isinstance(aircraft, str):
        raise CampaignError(f"aircraft: {aircraft!r}; expected the name of one")
    referred = set(_REFERENCE.findall(repr([d.get(key) for key in _DRAWN])))
    for parameter in drawn:
        if parameter.name not in referred:
            raise CampaignError(
                f"parameters.{parameter.name}: nothing refers to it; expected ${parameter.name} in some of "
                f"{', '.join(_DRAWN)}"
            )
    campaign = Campaign(name, dict(d), drawn, flights, seed, sampling, None)
    scenario = _check_first(campaign)
    stop = _stop(d.get("stop"), [criterion.name for criterion in scenario.criteria])
    return Campaign(name, dict(d), drawn, flights, seed, sampling, stop, scenario.criteria)


def _check_first(campaign: Campaign) -> Scenario:
    """Looks at the first flight, as all others are made of the same document."""
    try:
        scenario = parse_scenario(substituted(campaign.document["scenario"], campaign.design.values(0), "scenario"))
    except ScenarioError as error:
        raise CampaignError(f"scenario: {error}") from None
    plan = campaign.plan(0)
    for aircraft in _all_aircraft(campaign, plan):
        if aircraft not in model_names():
            raise CampaignError(f"aircraft: {aircraft!r}; expected one of {', '.join(model_names())}")
        if scenario.aircraft and aircraft not in scenario.aircraft:
            raise CampaignError(f"aircraft: the scenario is for {', '.join(scenario.aircraft)}, not for {aircraft}")
    _check_weather_and_loading(plan)
    _refuse_unflyable(scenario)
    if plan.controller:
        find_controller(plan.controller)
    return scenario


def _all_aircraft(campaign: Campaign, first: FlightPlan) -> Tuple[Value, ...]:
    """That of the first flight; where it is drawn, all."""
    drawn = parameter_of(campaign.document.get("aircraft"))
    for parameter in campaign.parameters:
        if parameter.name == drawn:
            return parameter.values
    return (first.aircraft,)


def _check_weather_and_loading(plan: FlightPlan) -> None:
    weather = plan.weather
    for key, value in weather.items():
        if not is_number(value):
            raise CampaignError(f"weather.{key}: {value!r}; expected a number")
    try:
        check_wind(weather.get("wind_speed", 0.0))
        check_turbulence(weather.get("turbulence", 0.0))
        check_atmosphere(weather.get("temperature_offset", 0.0), weather.get("sea_level_pressure", 101325.0))
    except FlightModelError as error:
        raise CampaignError(f"weather: {error}") from None
    fuel = plan.loading.get("fuel", [])
    if not isinstance(fuel, list) or not all(is_number(tank) and tank >= 0.0 for tank in fuel):
        raise CampaignError(f"loading.fuel: {fuel!r}; expected a list of numbers of 0 or more [kg], one for each tank")
    for key, low in (("payload", 0.0), ("cg_aft", -math.inf)):
        value = plan.loading.get(key, 0.0)
        if not is_number(value) or value < low:
            raise CampaignError(f"loading.{key}: {value!r}; expected a number{' of 0 or more' if low == 0.0 else ''}")


def _check_plain(item: Any, path: str) -> None:
    """Refuses what JSON does not hold as it is: workers, and who flies a flight again, have the campaign from there."""
    if isinstance(item, Mapping):
        for key, value in item.items():
            if not isinstance(key, str):
                raise CampaignError(f"{path or 'campaign'}: the key {key!r} is no text; expected it in quotes: '{key}'")
            _check_plain(value, f"{path}.{key}" if path else key)
    elif isinstance(item, (list, tuple)):
        for i, value in enumerate(item):
            _check_plain(value, f"{path}[{i}]")
    elif not (item is None or isinstance(item, (str, bool, int, float))):
        raise CampaignError(f"{path}: {item} is a {type(item).__name__}; expected a number or a text: in quotes")


def _refuse_unflyable(scenario: Scenario) -> None:
    """What takes an X-Plane, or a joystick: a flight in process has neither."""
    for i, event in enumerate(scenario.events):
        for kind, value in event.actions:
            if kind in ("dataref", "command", "buttons", *WORLD_KINDS):
                raise CampaignError(
                    f"scenario.events[{i}].{kind}: takes the bridge; expected mode, stick, hold, handles, "
                    "failure, clear_failures, excitation, label or end"
                )
            if kind == "excitation" and value["target"] not in STICK_AXES:
                raise CampaignError(
                    f"scenario.events[{i}].excitation.target: {value['target']!r}; expected one of "
                    f"{', '.join(STICK_AXES)}"
                )
    if scenario.repeat_every is not None:
        raise CampaignError("scenario.repeat_every: a flight of a campaign has an end; expected none")
    if awaits_stall(scenario) and messages_a_second() <= 0:
        raise CampaignError(
            "scenario.events: waits for stall_warning, and config/rx.yaml asks for no warnings (rates/warnings: 0); "
            "expected a rate above 0 there"
        )
    for criterion in scenario.criteria:
        if criterion.measure in CAMERA:
            raise CampaignError(f"scenario.criteria.{criterion.name}: {criterion.measure} takes a camera")


def find_controller(name: str) -> Any:
    """The object `module:name` refers to; the working folder is searched last.

    Raises:
        CampaignError: There is none.
    """
    module, _, attribute = name.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise CampaignError(
            f"controller: {name!r} cannot be had ({error}); expected module:class or module:function, the module's "
            "folder in PYTHONPATH, or the one you are in"
        ) from None
    except Exception as error:  # the user's own code
        raise CampaignError(
            f"controller: {name!r}: {module} cannot be imported ({type(error).__name__}: {error})"
        ) from None
    if not callable(found):
        raise CampaignError(f"controller: {name!r} is no class and no function")
    return found


def make_controller(name: str, arguments: Mapping[str, Any]) -> Any:
    """What flies, with a method `fly`: a class is made with the arguments, a function is asked itself.

    Raises:
        CampaignError: There is none, it does not take the arguments, or does not fly.
    """
    found = find_controller(name)
    if not isinstance(found, type):
        if arguments:
            raise CampaignError(f"arguments: {name} is a function, which takes the state alone; expected none")
        restart = getattr(found, "restart", None)
        return SimpleNamespace(fly=found) if restart is None else SimpleNamespace(fly=found, restart=restart)
    try:
        made = found(**arguments)
    except TypeError as error:
        raise CampaignError(f"arguments: {name} does not take them ({error})") from None
    if not callable(getattr(made, "fly", None)):
        raise CampaignError(f"controller: {name} has no method fly; expected a class whose fly(state) gives a command")
    return made


def _stop(item: Any, criteria: Sequence[str]) -> Optional[Stop]:
    if item is None:
        return None
    given = _mapping(item, "stop", ("criterion", "width", "every"))
    criterion = given.get("criterion", "all")
    if criterion not in (*criteria, "all"):
        raise CampaignError(f"stop.criterion: {criterion!r}; expected all, or one of {', '.join(criteria)}")
    width: Any = given.get("width")
    if not is_number(width) or not 0.0 < width < 1.0:
        raise CampaignError(f"stop.width: {width!r}; expected the width of the 95 % interval, above 0 and below 1")
    return Stop(criterion, float(width), _whole(given, "every", 100, 1, 10_000_000, "stop."))


def _mapping(item: Any, path: str, known: Any) -> Mapping[str, Any]:
    if not isinstance(item, Mapping):
        raise CampaignError(f"{path}: {item!r}; expected a mapping")
    for key in item:
        if known is not None and key not in known:
            raise CampaignError(f"{path}.{key}: unknown key; expected one of {', '.join(known)}")
    return item


def _whole(d: Mapping[str, Any], key: str, default: int, low: int, high: int, path: str = "") -> int:
    value = d.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise CampaignError(f"{path}{key}: {value!r}; expected a whole number from {low} to {high}")
    return value
