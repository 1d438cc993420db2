"""Gusts and their like through tx_node: what the emulator's air does, against what disturbance/state reports."""

from __future__ import annotations

import math
import signal
import subprocess
import sys

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import call, journal_entries, tx_params
from xplane_bridge.bags import Bags
from xplane_bridge.harness import wait_until
from xplane_bridge.resources import program

ACCEPTED, REFUSED, NOT_SUPPORTED, NO_LINK = 1, 2, 3, 4
SETTING = 11
AIR = {
    11: ("sim/weather/wind_now_z_msc", "sim/weather/wind_now_x_msc"),
    12: ("sim/weather/aircraft/wind_now_z_msc", "sim/weather/aircraft/wind_now_x_msc"),
}
GUST = {"kind": "gust", "from_deg": 270.0, "speed": 8.0, "duration": 3.0}
LASTING = {"kind": "shear", "from_deg": 180.0, "speed": 5.0, "gradient": 1e-6}


def fly(world, version="12"):
    """Starts an emulator in a wind of 6 m/s from the north, that its pilot flies level in, and tx_node."""
    from xplane_bridge.msg import DisturbanceState, EventList

    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    options = ("--no-beacon", "--start", "air", "--pilot", pilot, "--version", version, "--wind", "360/6")
    world.xplane = world.emulator(*options)
    world.other = world.wire(world.xplane.port)
    world.air = AIR[int(version.split(".")[0])]
    world.calm = [world.other.read(name) for name in world.air]
    world.events = world.watch("events", EventList)
    world.truth = world.watch("disturbance/state", DisturbanceState)
    world.set_param("aircraft", "fixed_wing")
    world.node = world.start("tx_node", tx_params())
    world.events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events))
    return world


def air_now(world):
    """[m/s] velocity of the air to north and east, as the simulator shows it."""
    south, east = (world.other.read(name) for name in world.air)
    return -south, east


def disturb(world, **request):
    response = call(world, "disturb", "SetDisturbance", **request)
    assert (response.success, response.result.code) == (True, ACCEPTED), response.result.message
    return response.id


def wait_for_wind_of_before(world):
    def is_back():
        return np.allclose([world.other.read(name) for name in world.air], world.calm, atol=0.01)

    wait_until(is_back, WAIT_S, "the wind of before")


@pytest.fixture(scope="module", params=["11.40", "12"])
def flight(request, new_world, tmp_path_factory):
    world = fly(new_world(tmp_path_factory.mktemp("gusts")), request.param)
    yield world
    world.close()


def test_a_gust_is_flown_reported_and_ended(flight):
    steady = -flight.calm[0]
    assert steady == pytest.approx(-6.0, abs=0.01)
    number = disturb(flight, **GUST)
    end = flight.truth.wait_for(lambda s: s.id == number and s.result == "done", WAIT_S)
    states = [s for s in flight.truth.messages if s.id == number and s.active]
    assert len(states) > 50
    for state in states:
        since = state.sim_time - state.start_sim_time
        wanted = 4.0 * (1.0 - math.cos(2.0 * math.pi * since / 3.0))
        assert state.model_ned.y == pytest.approx(wanted, abs=0.01)  # to the east
        assert (state.commanded_ned.y, state.commanded_ned.z) == (pytest.approx(wanted, abs=0.01), 0.0)
        assert state.steady_ned.x == pytest.approx(steady, abs=0.01)
        assert state.wind_speed == pytest.approx(math.hypot(steady, wanted), abs=0.01)
    assert max(state.commanded_ned.y for state in states) > 7.9
    assert (end.kind, end.active, end.speed, end.duration) == ("gust", False, 8.0, 3.0)
    assert end.end_sim_time - end.start_sim_time == pytest.approx(3.0, abs=0.2)
    wait_for_wind_of_before(flight)
    wait_until(lambda: journal_entries(flight) == [], WAIT_S, "an empty journal")
    texts = [(e.kind, e.text, e.success) for e in flight.events.last.events if e.requested_by.endswith("/disturb")]
    assert (SETTING, f"disturbance {number}, gust: begins", True) in texts
    assert (SETTING, f"disturbance {number}, gust: done", True) in texts


def test_the_air_of_the_simulator_is_what_was_commanded(flight):
    number = disturb(flight, **LASTING)
    flight.truth.wait_for(lambda s: s.id == number and s.active, WAIT_S)
    # 5 m/s from the south, on a wind of 6 m/s from the north.
    wait_until(lambda: abs(air_now(flight)[0] + 1.0) < 0.02, WAIT_S, "the wind")
    assert flight.truth.last.wind_speed == pytest.approx(1.0, abs=0.01)
    assert len(journal_entries(flight)) == 1
    # One at a time, and no other wind meanwhile.
    refused = call(flight, "disturb", "SetDisturbance", **GUST)
    assert (refused.success, refused.result.code, refused.id) == (False, REFUSED, number)
    assert "one at a time" in refused.result.message
    layer = {"fields": 1, "wind_layer_altitude": [0.0], "wind_layer_from_deg": [0.0], "wind_layer_speed": [3.0]}
    for service, kind, request in (("set_wind", "SetWind", {"speed": 3.0}), ("set_weather", "SetWeather", layer)):
        refused = call(flight, service, kind, **request)
        assert (refused.success, refused.result.code) == (False, REFUSED)
        assert "kind stop" in refused.result.message
    disturb(flight, kind="stop")
    wait_for_wind_of_before(flight)
    assert flight.truth.last.result.startswith("aborted: stopped by /")
    assert flight.truth.last.result.endswith("/disturb")


@pytest.mark.parametrize(
    ("request_", "code", "words"),
    [
        ({"kind": "storm"}, REFUSED, 'kind is "storm"; expected gust, turbulence, shear, microburst or stop'),
        ({"kind": "stop"}, REFUSED, "no disturbance runs"),
        ({**GUST, "length": 50.0}, REFUSED, "expected one of both above 0"),
        ({**GUST, "radius": 5.0}, REFUSED, "radius is 5: expected 0, kind gust does not use it"),
        ({**GUST, "speed": math.nan}, REFUSED, "speed is nan: expected 0..50 [m/s]"),
        ({**GUST, "vertical_speed": 3.0}, NOT_SUPPORTED, "no dataref sets it"),
        ({"kind": "turbulence", "speed": 10.0}, NOT_SUPPORTED, "horizontal_only"),
    ],
)
def test_what_cannot_be_is_refused_in_words(flight, request_, code, words):
    response = call(flight, "disturb", "SetDisturbance", **request_)
    assert (response.success, response.result.code) == (False, code)
    assert words in response.result.message


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL], ids=["asked", "killed"])
def test_the_wind_of_before_comes_back_when_the_node_ends(world, end):
    fly(world)
    try:
        disturb(world, **LASTING)
        wait_until(lambda: abs(air_now(world)[0] + 1.0) < 0.02, WAIT_S, "the wind")
        world.node.send_signal(end)
        wait_for_wind_of_before(world)
        wait_until(lambda: journal_entries(world) == [], WAIT_S, "an empty journal")
    finally:
        world.close()


def test_without_x_plane_nothing_is_accepted(world):
    from xplane_bridge.srv import SetDisturbance

    world.point_to(9)  # no X-Plane there
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params())
    response = world.call("tx_node/disturb", SetDisturbance, **GUST)
    assert (response.success, response.result.code) == (False, NO_LINK)


SCENARIO = """
name: disturbed
aircraft: fixed_wing
start: {altitude: 300, speed: 65, heading: 90}
events:
  - {at: 0, hold: {roll: 0, altitude: 300, speed: 65}, mode: manual}
  - {at: 2, disturb: {kind: gust, from_deg: 180, speed: 6, length: 130}, label: gust}
  - {at: 6, disturb: {kind: turbulence, from_deg: 250, speed: 10, seed: 7, duration: 4, horizontal_only: true}}
  - {at: 12, end: true}
"""


def test_a_scenario_is_recorded_with_the_truth_of_its_air(tmp_path):
    scenario = tmp_path / "disturbed.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    command = [sys.executable, str(program("run_scenario")), str(scenario), "--output", str(tmp_path / "out")]
    done = subprocess.run([*command, "--lockstep"], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with Bags(tmp_path / "out" / "flight.bag") as bags:
        truth, flown = bags.read("/xplane/disturbance/state"), bags.read("/xplane/flight_state")

    def vector(table, name):
        return np.column_stack([table[f"{name}.{axis}"] for axis in "xyz"])

    active = truth["active"].astype(bool)
    number, time = truth["id"][active], truth["sim_time"][active]
    commanded, model = vector(truth, "commanded_ned")[active], vector(truth, "model_ned")[active]
    assert set(number) == {1, 2}
    # In lock-step what was worked out for a frame blows in the next one; after the last the weather is put back.
    following = np.searchsorted(flown["sim_time"], time + 1e-4)
    last = np.append(np.diff(number) > 0, True)
    shown = vector(flown, "wind_ned")[following[~last]]
    wanted = (vector(truth, "steady_ned")[active] + commanded)[~last]
    assert np.abs(shown - wanted).max() < 0.01
    gust = number == 1
    assert commanded[gust, 0].max() == pytest.approx(6.0, abs=0.05)
    assert time[gust][-1] - time[gust][0] == pytest.approx(2.0, abs=0.1)  # 130 m at 65 m/s
    assert commanded[~gust, :2].std() > 0.1
    assert np.abs(model[~gust, 2]).max() > 0.1
    assert np.abs(commanded[:, 2]).max() == 0.0
