"""The shipped flights, in process: scenarios with a controller meet their criteria, and fly where they should."""

from __future__ import annotations

import copy
import re
from typing import Any, Dict, List, Tuple

import pytest
import yaml

from support.room_table import ROOT
from xplane_bridge.campaign.definition import parse_campaign
from xplane_bridge.campaign.flight import Flight, FlightResult
from xplane_bridge.compiled import core
from xplane_bridge.controllers.geometry import Field, Place
from xplane_bridge.controllers.multirotor import Square
from xplane_bridge.controllers.tiltrotor import OutAndBack
from xplane_bridge.controllers.twin import Circuit, TakeOff
from xplane_bridge.resources import config_file

pytestmark = pytest.mark.skipif(core is None, reason="the compiled module is not there")

#: What fails in these does not reach the flight model; the controllers do not look at it.
INSTRUMENTS = ("blocked_pitot", "bus_failure")
FLIGHTS = (
    "bus_failure", "blocked_pitot", "engine_out_after_takeoff", "quadrotor_square", "tiltrotor_conversion",
    "twin_circuit",
)  # fmt: skip


def document(name: str) -> Dict[str, Any]:
    """A scenario as a flight in process can fly it."""
    found = yaml.safe_load(config_file("scenarios", f"{name}.yaml").read_text(encoding="utf-8"))
    if name in INSTRUMENTS:
        for event in found["events"]:
            event.pop("failure", None)
    return found


def flown(scenario: Dict[str, Any], **more: Any) -> FlightResult:
    return Flight(parse_campaign({"name": "c", "scenario": scenario, **more}).plan(0)).fly()


class Watched:
    """Keeps where the flight was: simulator time [s], place [m], height [m], on the ground."""

    track: List[Tuple[float, Place, float, bool]]
    latest: Watched

    def watch(self, state: Any) -> None:
        if not hasattr(self, "track"):
            self.track, self._field = [], Field(state)
            type(self).latest = self
        self.track.append(
            (state.sim_time_unwrapped, self._field.place(state), state.altitude_agl, bool(state.on_ground))
        )


class WatchedCircuit(Watched, Circuit):
    def fly(self, state: Any) -> Dict[str, float]:
        self.watch(state)
        return super().fly(state)


class WatchedTakeOff(Watched, TakeOff):
    def fly(self, state: Any) -> Dict[str, float]:
        self.watch(state)
        return super().fly(state)


class WatchedSquare(Watched, Square):
    def fly(self, state: Any) -> Dict[str, float]:
        self.watch(state)
        return super().fly(state)


class WatchedOutAndBack(Watched, OutAndBack):
    def fly(self, state: Any) -> Dict[str, float]:
        self.watch(state)
        return super().fly(state)


def shown(name: str) -> Dict[str, float]:
    """The numbers that docs/control/flights.md shows of a flight, by criterion."""
    text = (ROOT / "docs/control/flights.md").read_text(encoding="utf-8")
    section = next(part for part in text.split("\n## ") if f"`{name}`, " in part)
    rows = re.findall(r"^\| ([\w ]+) \| .*? \| (-?[\d.]+)\D* \| \w+ ", section, re.MULTILINE)
    return {criterion: float(number) for criterion, number in rows}


def assert_shown(name: str, result: FlightResult) -> None:
    """The page states what was measured; another processor may differ in the last digits of a flight of minutes."""
    assert_met(result)
    assert shown(name) == pytest.approx(result.values, rel=0.02, abs=0.05)


def assert_met(result: FlightResult) -> None:
    assert (result.outcome, result.reason) == ("flown", "")
    missed = {name: result.values[name] for name, met in result.met.items() if not met}
    assert not missed
    assert result.passed


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_flights_on_which_instruments_fail_need_none_of_them(name: str) -> None:
    assert_shown(name, flown(document(name)))


def test_the_twin_lands_on_the_runway_that_it_left() -> None:
    assert_shown("twin_circuit", flown(document("twin_circuit"), controller=f"{__name__}:WatchedCircuit"))
    track = WatchedCircuit.latest.track
    airborne = [place for _, place, height, _ in track if height > 2.0]
    downwind = [place for _, place, _, _ in track if -3000.0 < place.ahead < 2000.0 and place.right < -500.0]
    assert len(downwind) > 1000
    assert all(abs(place.right + 1900.0) < 25.0 for place in downwind)  # a left-hand circuit
    landing = airborne[-1]
    assert abs(landing.right) < 3.0
    assert 100.0 < landing.ahead < 700.0
    stopped = track[-1][1]
    assert abs(stopped.right) < 5.0
    assert stopped.ahead < 1600.0
    assert track[-1][3]


def test_the_twin_keeps_to_its_runway_on_one_engine() -> None:
    name = "engine_out_after_takeoff"
    assert_shown(name, flown(document(name), controller=f"{__name__}:WatchedTakeOff"))
    assert max(abs(place.right) for _, place, _, _ in WatchedTakeOff.latest.track) < 25.0


@pytest.mark.parametrize("weather", [{}, {"wind_speed": 4, "wind_from": 200, "turbulence": 0.5}])
def test_the_quadrotor_is_at_each_corner_and_lands_where_it_began(weather: Dict[str, float]) -> None:
    scenario = document("quadrotor_square")
    if weather:  # it leans against the wind
        del scenario["criteria"]["hovers"]
    result = flown(scenario, controller=f"{__name__}:WatchedSquare", weather=weather)
    assert_met(result)
    if not weather:
        assert_shown("quadrotor_square", result)
    track = WatchedSquare.latest.track
    for corner in ((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)):
        there = [time for time, place, _, _ in track if place.to(Place(*corner)).length < 0.7]
        assert len(there) > 150, corner  # for the three seconds of its wait, at 60 Hz
    assert track[-1][1].length < 0.5
    # Nowhere outside: 1.5 m beyond the sides.
    assert all(-1.5 < axis < 21.5 for _, place, _, _ in track for axis in place)


def test_the_tiltrotor_flies_straight_out_and_lands_upright() -> None:
    name = "tiltrotor_conversion"
    assert_shown(name, flown(document(name), controller=f"{__name__}:WatchedOutAndBack"))
    track = WatchedOutAndBack.latest.track
    assert all(abs(place.right) < 10.0 for _, place, _, _ in track)
    touched = next(place for time, place, _, on_ground in track if time > 100.0 and on_ground)
    assert touched.ahead > 3000.0
    assert track[-1][1].to(touched).length < 0.5


def test_a_scenarios_own_controller_flies_unless_the_campaign_has_one() -> None:
    scenario = document("bus_failure")
    campaign = {"name": "c", "scenario": scenario}
    assert parse_campaign(campaign).plan(0).controller == "xplane_bridge.controllers.twin:Hold"
    assert (
        parse_campaign({**campaign, "controller": f"{__name__}:WatchedTakeOff"}).plan(0).controller.endswith("TakeOff")
    )
    arguments = {"speed": 66.0, "turn": -30.0}
    judged = copy.deepcopy(scenario)
    judged["criteria"] = {
        "speed": {"measure": "final", "of": "speed", "above": 65, "below": 67},
        "turned": {"measure": "final", "of": "heading", "above": 338, "below": 342},
    }
    judged["events"][-1]["at"] = 120  # it begins 9 m/s too slow, and the last metres per second take their time
    assert_met(flown(judged, arguments=arguments))


def test_every_scenario_with_a_controller_is_flown_here() -> None:
    scenarios = config_file("scenarios", "README.md").parent.glob("*.yaml")
    assert sorted(path.stem for path in scenarios if "controller:" in path.read_text(encoding="utf-8")) == sorted(
        FLIGHTS
    )
