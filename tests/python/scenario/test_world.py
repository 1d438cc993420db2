"""Wind, weather and time of scenarios: what is read of them, and the requests they become."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from xplane_bridge.campaign.definition import CampaignError, _refuse_unflyable
from xplane_bridge.constants import DISTURBANCE_KINDS
from xplane_bridge.emulator.scenario_pilot import ScenarioPilot
from xplane_bridge.scenario import ScenarioError, parse_scenario
from xplane_bridge.scenario.resets import NUMBERS, STARTS, TEXTS, reset_request
from xplane_bridge.scenario.world import DISTURBANCES, disturbance_request, time_request, weather_request, wind_request
from xplane_bridge.xplane_names import NEWEST

ROOT = Path(__file__).resolve().parents[3]


def service(name):
    """Constants and fields of a request."""
    text = (ROOT / f"srv/{name}.srv").read_text(encoding="utf-8").split("\n---\n")[0]
    code = [line.split("#")[0].split() for line in text.splitlines()]
    constants = {words[1]: int(words[3]) for words in code if len(words) == 4}
    return SimpleNamespace(**constants), {words[1]: words[0] for words in code if len(words) == 2}


def read(**actions):
    scenario = parse_scenario({"name": "t", "events": [{"at": 0, **actions}]})
    return dict(scenario.events[0].actions)


def test_a_disturbance_becomes_its_request():
    _, fields = service("SetDisturbance")
    assert set().union(*DISTURBANCES.values()) | {"kind", "horizontal_only"} == set(fields)
    assert set(DISTURBANCES) == {*DISTURBANCE_KINDS, "stop"}
    given = {"kind": "turbulence", "speed": 12, "from_deg": 250, "seed": 3, "horizontal_only": True}
    request = disturbance_request(read(disturb=given)["disturb"])
    assert request == given
    assert isinstance(request["seed"], int)
    gust = {"kind": "gust", "speed": 8, "from_deg": 270, "length": 200}
    assert read(disturb=gust)["disturb"] == gust
    assert read(disturb={"kind": "stop"})["disturb"] == {"kind": "stop"}


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ("gust", "expected a mapping with kind: gust, turbulence, shear, microburst, stop"),
        ({"kind": "storm"}, "disturb.kind: 'storm'; expected one of gust,"),
        ({"kind": "gust", "speed": 8}, "disturb: expected either length or duration"),
        ({"kind": "gust", "speed": 8, "length": 100, "duration": 2}, "expected either length or duration"),
        ({"kind": "gust", "duration": 2}, "disturb.speed: missing"),
        ({"kind": "gust", "speed": 80, "duration": 2}, "disturb.speed: 80; expected a number from 0 to 50"),
        ({"kind": "gust", "vertical_speed": 5, "duration": 2}, "disturb.horizontal_only: missing; expected true"),
        ({"kind": "shear", "speed": 8}, "expected either gradient or roughness"),
        ({"kind": "shear", "speed": 8, "length": 9}, "disturb.length: unknown key"),
        ({"kind": "turbulence", "speed": 8}, "disturb.horizontal_only: missing; expected true"),
        (
            {"kind": "turbulence", "speed": 8, "horizontal_only": True, "seed": 0.5},
            "seed: 0.5; expected a whole",
        ),
        ({"kind": "microburst", "speed": 8, "horizontal_only": True}, "disturb.latitude: missing"),
        ({"kind": "microburst", "speed": 8, "horizontal_only": 1}, "disturb.horizontal_only: 1; expected true or"),
    ],
)
def test_a_wrong_disturbance_is_refused_with_what_was_expected(given, complaint):
    with pytest.raises(ScenarioError, match=re.escape(complaint)):
        read(disturb=given)


def test_weather_becomes_the_request_with_its_bits():
    value = read(
        weather={
            "wind": [{"altitude": 0, "from_deg": 270, "speed": 5}, {"altitude": 2000, "from_deg": 300, "speed": 12}],
            "clouds": [{"base": 900, "top": 1500, "cover": 0.5, "type": 2}],
            "visibility": 5000,
        }
    )["weather"]
    bits, fields = service("SetWeather")
    request = weather_request(value, bits)
    assert request.keys() <= fields.keys()
    assert request.pop("fields") == 1 + 2 + 4
    assert request == {
        "wind_layer_altitude": [0.0, 2000.0],
        "wind_layer_from_deg": [270.0, 300.0],
        "wind_layer_speed": [5.0, 12.0],
        "wind_layer_shear": [0.0, 0.0],
        "wind_layer_turbulence": [0.0, 0.0],
        "cloud_base": [900.0],
        "cloud_top": [1500.0],
        "cloud_cover": [0.5],
        "cloud_type": [2],
        "visibility": 5000.0,
    }
    clear = weather_request(read(weather={"clouds": [], "sea_level_pressure": 100000})["weather"], bits)
    assert (clear["fields"], clear["cloud_base"], clear["sea_level_pressure"]) == (2 + 32, [], 100000.0)


def test_time_and_wind_become_requests():
    bits, fields = service("SetTime")
    request = time_request(read(time={"date_days": 20, "time_ratio": 2})["time"], bits)
    assert request == {"fields": 1 + 4, "date_days": 20, "time_ratio": 2}
    assert request.keys() <= fields.keys()
    assert time_request({"zulu_time": 3600.5}, bits) == {"fields": 2, "zulu_time": 3600.5}
    assert wind_request(read(wind={"turbulence": 0.2})["wind"]) == {"speed": 0.0, "from_deg": 360.0, "turbulence": 0.2}
    assert wind_request(read(wind={"speed": 4, "from_deg": 90})["wind"]) == {
        "speed": 4,
        "from_deg": 90,
        "turbulence": 0,
    }
    for calm in ({"speed": 0, "from_deg": 0}, {"turbulence": 0}):  # three zeros would be refused as nothing
        assert wind_request(read(wind=calm)["wind"]) == {"speed": 0.0, "from_deg": 360.0, "turbulence": 0.0}


def test_starts_become_requests():
    constants, fields = service("ResetFlight")
    for name, number in STARTS.items():
        assert getattr(constants, name.upper()) == number
    value = read(
        reset={"start": "final", "airport": "XEMU", "runway_end": 1, "final_distance": 4000, "true_airspeed": 60}
    )["reset"]
    request = reset_request(value)
    assert request == {"start": 3, "airport": "XEMU", "runway_end": 1, "final_distance": 4000.0, "true_airspeed": 60.0}
    assert isinstance(request["runway_end"], int)
    assert {*NUMBERS, *TEXTS} == fields.keys()
    assert reset_request(read(reset={"latitude": 47, "longitude": 8, "altitude_msl": 900})["reset"]).keys() == {
        "latitude",
        "longitude",
        "altitude_msl",
    }


@pytest.mark.parametrize(
    ("actions", "complaint"),
    [
        ({"weather": {}}, "weather: is empty; expected some of wind, clouds, visibility"),
        ({"weather": {"fog": 1}}, "weather.fog: unknown key"),
        ({"weather": {"wind": []}}, "weather.wind: []; expected a list of layers"),
        ({"weather": {"wind": [{"altitude": 0, "speed": 5}]}}, "weather.wind[0].from_deg: missing; expected a number"),
        ({"weather": {"clouds": [{"base": 0, "top": 5, "cover": 2}]}}, "clouds[0].cover: 2; expected a number from 0"),
        ({"weather": {"sea_level_pressure": 1013}}, "sea_level_pressure: 1013; expected a number from 85000 to 110000"),
        ({"time": {"zulu_time": 90000}}, "time.zulu_time: 90000; expected a number from 0 to 86400"),
        ({"reset": {"start": "gate"}}, "reset.start: 'gate'; expected one of place, ramp, runway, final"),
        ({"reset": {}}, "reset.latitude: missing; expected it with start place"),
        ({"reset": {"start": "ramp"}}, "reset.airport: missing; expected it with start ramp"),
        ({"reset": {"start": "final", "airport": "A"}}, "reset.final_distance: missing; expected it with start final"),
        ({"reset": {"start": "ramp", "airport": "A", "runway_end": 2}}, "runway_end: 2; expected a whole number from"),
        ({"reset": {"start": "ramp", "airport": 7}}, "reset.airport: 7; expected a text"),
        ({"reset": {"start": "ramp", "airport": "A", "runway_end": 0.9}}, "runway_end: 0.9; expected a whole number"),
        ({"reset": {"start": "ramp", "airport": "A", "spot_index": 2.5}}, "spot_index: 2.5; expected a whole number"),
        ({"time": {"time_ratio": 1.9}}, "time.time_ratio: 1.9; expected a whole number from 1 to 16"),
        ({"time": {"date_days": 10.5}}, "time.date_days: 10.5; expected a whole number from 0 to 365"),
        (
            {"weather": {"clouds": [{"base": 0, "top": 5, "cover": 1, "type": 2.9}]}},
            "clouds[0].type: 2.9; expected a whole number from 0 to 5",
        ),
        ({"wind": {"knots": 5}}, "wind.knots: unknown key; expected one of speed, from_deg, turbulence"),
    ],
)
def test_what_is_wrong_is_said_with_its_key(actions, complaint):
    with pytest.raises(ScenarioError, match=re.escape(complaint)):
        read(**actions)


@pytest.mark.parametrize(
    "actions",
    [
        {"reset": {"start": "ramp", "airport": "XEMU"}},
        {"wind": {"speed": 5}},
        {"weather": {"visibility": 500}},
        {"time": {"time_ratio": 2}},
    ],
)
def test_what_flies_without_the_bridge_refuses_them(actions):
    scenario = parse_scenario({"name": "t", "events": [{"at": 0, **actions}]})
    (kind,) = actions
    with pytest.raises(ScenarioError, match=f"tx_node sets {kind}"):
        ScenarioPilot(scenario, NEWEST["11"])
    with pytest.raises(CampaignError, match=f"{kind}: takes the bridge"):
        _refuse_unflyable(scenario)
