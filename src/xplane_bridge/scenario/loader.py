"""Reads and checks scenarios: a misspelt key is an error, not a flight without its failure."""

from __future__ import annotations

import math
import warnings
from dataclasses import fields
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from xplane_bridge.analysis.criteria import CAMERA, MEASURES, SCORED, TARGETED, Criterion
from xplane_bridge.constants import EXCITATION_KINDS, FAILURE_KINDS
from xplane_bridge.scenario import excitations
from xplane_bridge.scenario.holds import HoldGains
from xplane_bridge.scenario.resets import NUMBERS, STARTS, TEXTS
from xplane_bridge.scenario.schema import (
    HANDLES,
    HOLDS,
    MODES,
    OLD_HANDLES,
    STICK_AXES,
    VARIABLES,
    Condition,
    Event,
    Scenario,
    ScenarioError,
)
from xplane_bridge.scenario.traffic import MOST, RANGES
from xplane_bridge.scenario.values import (
    expect_mapping,
    expect_number,
    expect_numbers,
    expect_one_of,
    expect_text,
    expect_whole,
    short,
)
from xplane_bridge.scenario.world import DISTURBANCE_NEEDS, DISTURBANCES, LAYERS, TIME, WEATHER, WIND
from xplane_bridge.scenario.yaml_file import read_yaml_file

_TOP = (
    *("name", "description", "aircraft", "controller", "repeat_every", "start", "aerodrome", "gains", "criteria"),
    "events",
)
_START = {
    "latitude": (-90.0, 90.0),
    "longitude": (-180.0, 180.0),
    "altitude": (-500.0, 20000.0),
    "heading": (-360.0, 360.0),
    "speed": (0.0, 300.0),
}
#: Variables that are true or false.
_YES_OR_NO = ("on_ground", "stall_warning")
_MOST_SEED = 2**32 - 1  # InjectExcitation's is a uint32
_AERODROME = ("latitude", "longitude", "heading")
_TIMING = ("at", "after", "when", "timeout", "over")


def load_scenario(path: Path) -> Scenario:
    """Reads a scenario file.

    Raises:
        ScenarioError: The file cannot be read, is no YAML, or is no scenario.
    """
    document = read_yaml_file(path, ScenarioError)
    try:
        return parse_scenario(document)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from None


def parse_scenario(document: Any) -> Scenario:
    """Checks a scenario that is already a mapping.

    Raises:
        ScenarioError: Says the key's path, what was given, and what was expected.
    """
    top = expect_mapping(document, "scenario", _TOP)
    name = expect_text(top, "name", "")
    if not name:
        raise ScenarioError("name: missing; expected a short name of the scenario")
    aircraft = top.get("aircraft", [])
    aircraft = [aircraft] if isinstance(aircraft, str) else aircraft
    if not isinstance(aircraft, list) or not all(isinstance(item, str) for item in aircraft):
        raise ScenarioError(f"aircraft: {aircraft!r}; expected a name or a list of names")
    gains = expect_mapping(top.get("gains", {}), "gains", [item.name for item in fields(HoldGains)])
    for key in gains:
        expect_number(gains[key], f"gains.{key}", 0.0, math.inf)
    start = _start(top.get("start", {}))
    aerodrome = _aerodrome(top.get("aerodrome", {}))
    controller = expect_text(top, "controller", "")
    if controller and not all(controller.partition(":")):
        raise ScenarioError(f"controller: {controller!r}; expected module:class or module:function")
    repeat = top.get("repeat_every")
    if repeat is not None:
        repeat = expect_number(repeat, "repeat_every", 1.0, 86400.0)
    events = top.get("events")
    if not isinstance(events, list) or not events:
        raise ScenarioError(f"events: {short(events)}; expected a list of at least one event")
    parsed = tuple(_event(item, f"events[{i}]") for i, item in enumerate(events))
    _check_times(parsed, repeat)
    _check_repairs(parsed)
    criteria = _criteria(top.get("criteria", {}), parsed)
    description = expect_text(top, "description", "")
    return Scenario(name, description, tuple(aircraft), repeat, start, gains, criteria, parsed, controller, aerodrome)


def _start(item: Any) -> Dict[str, float]:
    given = expect_mapping(item, "start", (*_START, "on_ground"))
    on_ground = given.get("on_ground", False)
    if not isinstance(on_ground, bool):
        raise ScenarioError(f"start.on_ground: {on_ground!r}; expected true or false")
    start = expect_numbers({key: value for key, value in given.items() if key != "on_ground"}, "start", _START)
    return {**start, **({"on_ground": True} if on_ground else {})}


def _aerodrome(item: Any) -> Dict[str, float]:
    given = expect_numbers(item, "aerodrome", {key: _START[key] for key in _AERODROME})
    missing = [key for key in _AERODROME if key not in given]
    if given and missing:
        raise ScenarioError(f"aerodrome.{missing[0]}: missing; expected {', '.join(_AERODROME)}")
    return given


def _check_repairs(events: Sequence[Event]) -> None:
    """A misspelt name would repair nothing, without a word in most players."""
    failures = [(i, value) for i, event in enumerate(events) for kind, value in event.actions if kind == "failure"]
    broken = sorted({value["name"] for _, value in failures if not value["clear"]})
    for i, value in failures:
        if value["clear"] and value["name"] not in broken:
            raise ScenarioError(
                f"events[{i}].failure.name: {value['name']!r} is cleared, but no event breaks it; expected "
                f"{' or '.join(broken) or 'an event that does'}"
            )


def _check_times(events: Sequence[Event], repeat: Optional[float]) -> None:
    last = 0.0
    for i, event in enumerate(events):
        if event.at is None:
            continue
        if event.at < last:
            raise ScenarioError(
                f"events[{i}].at: {event.at}; expected {last} or more: events stand in the order of their time"
            )
        if repeat is not None and event.at >= repeat:
            raise ScenarioError(f"events[{i}].at: {event.at}; expected less than repeat_every ({repeat})")
        last = event.at


def _criteria(item: Any, events: Sequence[Event]) -> Tuple[Criterion, ...]:
    if not isinstance(item, Mapping):
        raise ScenarioError(f"criteria: {short(item)}; expected a mapping of names to criteria")
    labels = [value for event in events for kind, value in event.actions if kind == "label"]
    return tuple(_criterion(str(name), value, f"criteria.{name}", labels) for name, value in item.items())


def _criterion(name: str, item: Any, path: str, labels: Sequence[str]) -> Criterion:
    given = expect_mapping(item, path, ("measure", "of", "target", "from", "to", "band", "above", "below"))
    measure = expect_one_of(given.get("measure"), f"{path}.measure", MEASURES)
    bounds = _limits(given, path)
    if not bounds:
        raise ScenarioError(f"{path}: no bound; expected above and/or below")
    if measure in CAMERA:
        surplus = [key for key in ("of", "target", "from", "to", "band") if key in given]
        if surplus:
            raise ScenarioError(f"{path}.{surplus[0]}: does not go with {measure}; expected bounds only")
        return Criterion(name, measure, above=bounds.get("above"), below=bounds.get("below"))
    variable = expect_one_of(given.get("of"), f"{path}.of", SCORED)
    if measure in TARGETED and "target" not in given:
        raise ScenarioError(f"{path}.target: missing; expected what {measure} compares with")
    if measure not in TARGETED and "target" in given:
        raise ScenarioError(
            f"{path}.target: does not go with {measure}, which is the variable's own value; expected bounds on that, "
            f"or one of {', '.join(TARGETED)}"
        )
    if measure == "settling" and "band" not in given:
        raise ScenarioError(f"{path}.band: missing; expected the largest |{variable} - target| that counts as settled")
    if measure != "settling" and "band" in given:
        raise ScenarioError(f"{path}.band: does not go with {measure}; expected it with settling only")
    numbers = {
        key: expect_number(given[key], f"{path}.{key}", low, math.inf)
        for key, low in (("target", -math.inf), ("band", 0.0))
        if key in given
    }
    start = _edge(given.get("from", 0.0), f"{path}.from", labels)
    end = _edge(given["to"], f"{path}.to", labels) if "to" in given else None
    if not isinstance(start, str) and isinstance(end, float) and start >= end:
        raise ScenarioError(f"{path}.to: {end:g}; expected more than from ({start:g})")
    return Criterion(name, measure, variable, start=start, end=end, **numbers, **bounds)


def _limits(given: Mapping[str, Any], path: str) -> Dict[str, float]:
    """Those of `above` and `below` that are given; nothing is above the higher of two and below the lower one."""
    out = {
        key: expect_number(given[key], f"{path}.{key}", -math.inf, math.inf)
        for key in ("above", "below")
        if key in given
    }
    above, below = out.get("above", -math.inf), out.get("below", math.inf)
    if above >= below:
        raise ScenarioError(f"{path}: above {above:g} and below {below:g}, which nothing is; expected above < below")
    return out


def _edge(value: Any, path: str, labels: Sequence[str]) -> Union[float, str]:
    if isinstance(value, str):
        if value not in labels:
            have = ", ".join(repr(label) for label in labels) or "none"
            raise ScenarioError(f"{path}: {value!r}; expected seconds, or the label of an event (there is {have})")
        return value
    return expect_number(value, path, 0.0, 1e6)


def _event(item: Any, path: str) -> Event:
    known = (*_TIMING, *_ACTIONS)
    event = expect_mapping(item, path, known)
    if "at" in event and "after" in event:
        raise ScenarioError(f"{path}: has both 'at' and 'after'; expected one of them")
    timing: Dict[str, Any] = {}
    for key, low in (("at", 0.0), ("after", 0.0), ("timeout", 0.0), ("over", 0.0)):
        if key in event:
            timing[key] = expect_number(event[key], f"{path}.{key}", low, 1e6)
    if "when" in event:
        timing["when"] = _conditions(event["when"], f"{path}.when")
    if "timeout" in event and "when" not in event:
        raise ScenarioError(f"{path}.timeout: without 'when'; expected a condition to wait for")
    if "over" in event and "stick" not in event:
        raise ScenarioError(f"{path}.over: without 'stick'; expected stick movements that take so long")
    actions = tuple((key, _ACTIONS[key](value, f"{path}.{key}")) for key, value in event.items() if key in _ACTIONS)
    if not actions and not timing:
        raise ScenarioError(f"{path}: is empty; expected a time, a condition or an action of {', '.join(_ACTIONS)}")
    return Event(actions=actions, **timing)


def _conditions(item: Any, path: str) -> Tuple[Condition, ...]:
    conditions = []
    for variable, bounds in expect_mapping(item, path, VARIABLES).items():
        place = f"{path}.{variable}"
        if variable == "mode":
            mode = MODES[expect_one_of(bounds, place, MODES)]
            conditions.append(Condition(variable, mode - 0.5, mode + 0.5))
        elif isinstance(bounds, bool):
            if variable not in _YES_OR_NO:
                raise ScenarioError(f"{place}: {bounds!r}; expected [low, high], or above and/or below")
            conditions.append(Condition(variable, above=0.5) if bounds else Condition(variable, below=0.5))
        else:
            conditions.append(Condition(variable, **_bounds(bounds, place)))
    return tuple(conditions)


def _bounds(item: Any, path: str) -> Dict[str, float]:
    """Of a condition, `above` and/or `below`, however they are written."""
    if isinstance(item, list):
        if len(item) != 2:
            raise ScenarioError(f"{path}: {item!r}; expected two bounds [low, high]")
        low, high = (expect_number(bound, path, -math.inf, math.inf) for bound in item)
        return _limits({"above": low, "below": high}, path)
    limits = _limits(expect_mapping(item, path, ("above", "below")), path)
    if not limits:
        raise ScenarioError(f"{path}: {short(item)}; expected above and/or below")
    return limits


# --- actions: each checks its value and returns it in its final form ---


def _stick(item: Any, path: str) -> Dict[str, float]:
    return expect_numbers(item, path, STICK_AXES, some=True)


def _hold(item: Any, path: str) -> Dict[str, Optional[float]]:
    """Targets; null lets one go, and the word `none` all of them."""
    if item is None or item == "none":
        return dict.fromkeys(HOLDS)
    given = expect_mapping(item, path, HOLDS)
    if not given:
        raise ScenarioError(f"{path}: is empty; expected targets of {', '.join(HOLDS)}")
    targets: Dict[str, Optional[float]] = {}
    for key, value in given.items():
        targets[key] = None if value is None else expect_number(value, f"{path}.{key}", *HOLDS[key])
    return targets


def _handles(item: Any, path: str) -> Dict[str, float]:
    if isinstance(item, dict):
        for key in OLD_HANDLES.keys() & item.keys():
            warnings.warn(f"{path}.{key}: is now called {OLD_HANDLES[key]}", FutureWarning, stacklevel=2)
        item = {OLD_HANDLES.get(key, key): value for key, value in item.items()}
    return expect_numbers(item, path, HANDLES, some=True)


def _buttons(item: Any, path: str) -> Dict[str, List[int]]:
    given = expect_mapping(item, path, ("press", "release", "tap"))
    out = {}
    for key, value in given.items():
        numbers = value if isinstance(value, list) else [value]
        if not numbers or not all(isinstance(n, int) and not isinstance(n, bool) and 0 <= n < 64 for n in numbers):
            raise ScenarioError(f"{path}.{key}: {value!r}; expected button numbers 0..63")
        out[key] = numbers
    return out


def _mode(item: Any, path: str) -> int:
    return MODES[expect_one_of(item, path, MODES)]


def _failure(item: Any, path: str) -> Dict[str, Any]:
    given = expect_mapping(item, path, ("name", "kind", "value", "clear"))
    name, kind = expect_text(given, "name", "", path), expect_text(given, "kind", "failed", path)
    if not name:
        raise ScenarioError(f"{path}.name: missing; expected a surface, a system, or a rel_* dataref")
    expect_one_of(kind, f"{path}.kind", FAILURE_KINDS)
    value = given.get("value")
    if value is not None:
        value = expect_number(value, f"{path}.value", -180.0, 180.0)
    clear = given.get("clear", False)
    if not isinstance(clear, bool):
        raise ScenarioError(f"{path}.clear: {clear!r}; expected true or false")
    return {"name": name, "kind": kind, "value": value, "clear": clear}


def _excitation(item: Any, path: str) -> Dict[str, Any]:
    known = ("kind", "target", "amplitude", "duration", "frequency", "frequency_end", "seed")
    given = expect_mapping(item, path, known)
    kind, target = expect_text(given, "kind", "", path), expect_text(given, "target", "", path)
    expect_one_of(kind, f"{path}.kind", EXCITATION_KINDS)
    if not target:
        raise ScenarioError(f"{path}.target: missing; expected roll, pitch, yaw, throttle or a surface's name")
    if "," in target and kind != "multisine":
        raise ScenarioError(
            f"{path}.target: {target!r}; expected one target: only a multisine moves several axes at once"
        )
    out: Dict[str, Any] = {"kind": kind, "target": target}
    for key, default, low, high in (
        ("amplitude", None, 0.0, 45.0),
        ("duration", None, 0.1, 600.0),
        ("frequency", 0.1, 0.01, 10.0),
        ("frequency_end", 2.0, 0.01, 10.0),
    ):
        if key not in given and default is None:
            raise ScenarioError(f"{path}.{key}: missing; expected a number from {low} to {high}")
        out[key] = expect_number(given.get(key, default), f"{path}.{key}", low, high)
    out["seed"] = int(expect_whole(given.get("seed", 0), f"{path}.seed", 0, _MOST_SEED))
    excitations.check(out, path)
    return out


def _datarefs(item: Any, path: str) -> Dict[str, float]:
    if not isinstance(item, dict) or not item:
        raise ScenarioError(f"{path}: {short(item)}; expected datarefs with their values")
    return {str(key): expect_number(value, f"{path}.{key}", -math.inf, math.inf) for key, value in item.items()}


def _reset(item: Any, path: str) -> Dict[str, Any]:
    given = expect_mapping(item, path, (*TEXTS, *NUMBERS))
    out: Dict[str, Any] = expect_numbers({k: v for k, v in given.items() if k in NUMBERS}, path, NUMBERS)
    start = expect_one_of(given.get("start", "place"), f"{path}.start", STARTS)
    needed = ("latitude", "longitude", "altitude_msl") if start == "place" else ("airport",)
    for key in (*needed, *(("final_distance", "true_airspeed") if start == "final" else ())):
        if key not in given:
            raise ScenarioError(f"{path}.{key}: missing; expected it with start {start}")
    for key in TEXTS:
        if key in given:
            out[key] = _word(given[key], f"{path}.{key}")
    return out


def _wind(item: Any, path: str) -> Dict[str, float]:
    return expect_numbers(item, path, WIND, some=True)


def _disturb(item: Any, path: str) -> Dict[str, Any]:
    if not isinstance(item, Mapping) or "kind" not in item:
        raise ScenarioError(f"{path}: {short(item)}; expected a mapping with kind: {', '.join(DISTURBANCES)}")
    kind = expect_one_of(item["kind"], f"{path}.kind", DISTURBANCES)
    ranges = DISTURBANCES[kind]
    given = expect_mapping(item, path, ("kind", "horizontal_only", *ranges))
    out: Dict[str, Any] = {"kind": kind}
    if "horizontal_only" in given:
        if not isinstance(given["horizontal_only"], bool):
            raise ScenarioError(f"{path}.horizontal_only: {short(given['horizontal_only'])}; expected true or false")
        out["horizontal_only"] = given["horizontal_only"]
    out.update(expect_numbers({key: value for key, value in given.items() if key in ranges}, path, ranges))
    for key in DISTURBANCE_NEEDS[kind]:
        if key not in out:
            low, high = ranges[key]
            raise ScenarioError(f"{path}.{key}: missing; expected a number from {low:g} to {high:g}")
    pair = {"gust": ("length", "duration"), "shear": ("gradient", "roughness")}.get(kind)
    if pair and bool(out.get(pair[0])) == bool(out.get(pair[1])):
        raise ScenarioError(f"{path}: expected either {pair[0]} or {pair[1]}")
    if kind == "gust" and not (out.get("speed") or out.get("vertical_speed")):
        raise ScenarioError(f"{path}.speed: missing; expected the peak of the gust, up to 50 m/s")
    if not out.get("horizontal_only") and (kind in ("turbulence", "microburst") or out.get("vertical_speed")):
        raise ScenarioError(
            f"{path}.horizontal_only: missing; expected true: no X-Plane can be sent the vertical wind of a {kind}"
        )
    return out


def _time(item: Any, path: str) -> Dict[str, float]:
    return expect_numbers(item, path, TIME, some=True)


def _weather(item: Any, path: str) -> Dict[str, Any]:
    given = expect_mapping(item, path, (*LAYERS, *WEATHER))
    if not given:
        raise ScenarioError(f"{path}: is empty; expected some of {', '.join((*LAYERS, *WEATHER))}")
    out: Dict[str, Any] = expect_numbers({k: v for k, v in given.items() if k in WEATHER}, path, WEATHER)
    for key, (ranges, needed) in LAYERS.items():
        if key not in given:
            continue
        if not isinstance(given[key], list) or (key == "wind" and not given[key]):
            raise ScenarioError(f"{path}.{key}: {short(given[key])}; expected a list of layers, from the lowest up")
        out[key] = [expect_numbers(layer, f"{path}.{key}[{i}]", ranges) for i, layer in enumerate(given[key])]
        for i, layer in enumerate(out[key]):
            for name in needed:
                if name not in layer:
                    low, high = ranges[name]
                    raise ScenarioError(
                        f"{path}.{key}[{i}].{name}: missing; expected a number from {low:g} to {high:g}"
                    )
    return out


def _traffic(item: Any, path: str) -> List[Dict[str, float]]:
    if not isinstance(item, list) or len(item) > MOST:
        raise ScenarioError(f"{path}: {short(item)}; expected a list of up to {MOST} aircraft, [] gives them back")
    out = [expect_numbers(each, f"{path}[{i}]", {"number": (1, MOST), **RANGES}) for i, each in enumerate(item)]
    numbers = [each.get("number") for each in out]
    for i, number in enumerate(numbers):
        if number is None or number in numbers[:i]:
            raise ScenarioError(f"{path}[{i}].number: {number}; expected a whole number from 1 to {MOST}, each once")
    return out


def _word(item: Any, path: str) -> str:
    if not isinstance(item, str) or not item:
        raise ScenarioError(f"{path}: {item!r}; expected a text")
    return item


def _true(item: Any, path: str) -> bool:
    if item is not True:
        raise ScenarioError(f"{path}: {item!r}; expected true")
    return True


_ACTIONS: Dict[str, Callable[[Any, str], Any]] = {
    "stick": _stick,
    "hold": _hold,
    "handles": _handles,
    "buttons": _buttons,
    "mode": _mode,
    "failure": _failure,
    "clear_failures": _true,
    "excitation": _excitation,
    "reset": _reset,
    "wind": _wind,
    "disturb": _disturb,
    "weather": _weather,
    "time": _time,
    "traffic": _traffic,
    "dataref": _datarefs,
    "command": _word,
    "label": _word,
    "end": _true,
}
