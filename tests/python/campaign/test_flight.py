from __future__ import annotations

import datetime
import math
import struct
from typing import Any, Dict, List

import pytest

from xplane_bridge.campaign.definition import CampaignError, make_controller, parse_campaign
from xplane_bridge.campaign.flight import Flight
from xplane_bridge.campaign.warnings_topic import WarningInStep
from xplane_bridge.compiled import NotCompiledError
from xplane_bridge.emulator.wire.subscriptions import Pacer

EVENTS = [{"at": 0, "mode": "auto", "stick": {"roll": 0, "pitch": 0, "yaw": 0}}, {"at": 1, "end": True}]


def campaign(events: Any = EVENTS, **more: Any) -> Any:
    scenario = {"name": "s", "aircraft": "fixed_wing", "start": {"speed": 70}, "events": events}
    scenario.update(more.pop("scenario", {}))
    return parse_campaign({"name": "c", "scenario": scenario, **more})


class Recorder:
    """A controller that remembers what it saw; rolls by a fixed stick."""

    seen: list

    def __init__(self, stick: float = 0.0) -> None:
        self.stick = stick
        Recorder.seen = []

    def fly(self, state: Any) -> Dict[str, float]:
        Recorder.seen.append((state.sim_time_unwrapped, state.control_roll))
        return {"roll": self.stick * len(Recorder.seen), "pitch": 0.0}


def test_a_command_flies_in_the_frame_after_the_state_it_answers_and_as_float32() -> None:
    # The hand-over from manual to automatic may change 2 a second: this stick is slower.
    Flight(campaign(controller=f"{__name__}:Recorder", arguments={"stick": 0.01}).plan(0)).fly()
    times, rolls = zip(*Recorder.seen[:4])
    assert times == pytest.approx((0.0, 1 / 60, 2 / 60, 3 / 60))
    exact = [struct.unpack("<f", struct.pack("<f", 0.01 * k))[0] for k in range(4)]
    assert list(rolls) == exact


def test_a_function_is_asked_itself_and_restarted_as_an_object_is() -> None:
    assert make_controller(f"{__name__}:nothing", {}).fly(None) == {}
    assert not hasattr(make_controller(f"{__name__}:nothing", {}), "restart")
    assert make_controller(f"{__name__}:restarted", {}).restart() == "again"
    with pytest.raises(CampaignError, match=r"arguments: .*:nothing is a function, which takes the state alone"):
        make_controller(f"{__name__}:nothing", {"gain": 1})


def restarted(_state: Any) -> Dict[str, float]:
    return {}


restarted.restart = lambda: "again"  # type: ignore[attr-defined]


def nothing(_state: Any) -> Dict[str, float]:
    return {}


def outside(_state: Any) -> Dict[str, float]:
    return {"roll": 1.5}


def broken(state: Any) -> Dict[str, float]:
    return {"roll": 1.0 / (1.0 if state.sim_time_unwrapped < 0.5 else 0.0)}


@pytest.mark.parametrize(
    ("changes", "outcome", "reason"),
    [
        ({"controller": f"{__name__}:nothing"}, "flown", ""),
        ({"scenario": {"start": {"speed": 200}}}, "no start", "airspeed 200"),
        ({"controller": f"{__name__}:outside"}, "controller failed", "roll is 1.5: expected -1..1"),
        ({"controller": f"{__name__}:broken"}, "controller failed", "at 0.50 s: ZeroDivisionError"),
        ({"longest": 0.5}, "not finished", "has not ended after 0.5 s"),
        ({"scenario": {"start": {"altitude": 15, "speed": 60}}, "events": [
            {"at": 0, "stick": {"pitch": -1, "roll": 1}}, {"at": 30, "end": True}]}, "crashed", "at "),
    ],
)  # fmt: skip
def test_however_a_flight_ends_it_has_an_outcome(changes: dict, outcome: str, reason: str) -> None:
    result = Flight(campaign(**changes).plan(0)).fly()
    assert (result.outcome, reason in result.reason) == (outcome, True), result.reason
    assert result.passed == (outcome == "flown")
    assert bool(result.sha256) == (outcome != "no start")


def test_a_criterion_of_the_whole_flight_is_met_by_a_whole_flight_only() -> None:
    level = {"measure": "peak", "of": "roll", "target": 0, "below": 60}
    criteria = {"whole": level, "begin": {**level, "to": 0.3}, "longer": {**level, "to": 0.9}}
    result = Flight(campaign(longest=0.5, scenario={"criteria": criteria}).plan(0)).fly()
    assert result.outcome == "not finished"
    assert result.met == {"whole": False, "begin": True, "longer": False}


@pytest.mark.parametrize("last", [{"at": 1, "label": "done", "end": True}, {"at": 1, "label": "done"}])
def test_the_event_that_ends_a_flight_is_labelled(last: Dict[str, Any]) -> None:
    level = {"measure": "peak", "of": "roll", "target": 0, "to": "done", "below": 60}
    result = Flight(campaign([*EVENTS[:1], last], scenario={"criteria": {"level": level}}).plan(0)).fly()
    assert (result.outcome, result.met) == ("flown", {"level": True})
    assert result.duration == pytest.approx(1.0)


def test_what_the_last_event_asks_for_is_refused_as_at_any_other() -> None:
    refused = {"at": 1, "excitation": {**doublet(0.1, 0.5), "target": "throttle"}, "end": True}
    with pytest.raises(CampaignError, match="at 1 s: no source commands throttle"):
        Flight(campaign([EVENTS[0], refused]).plan(0)).fly()


def test_a_flight_that_ends_in_its_last_frame_is_flown() -> None:
    assert Flight(campaign(longest=1.0).plan(0)).fly().outcome == "flown"


def test_a_flight_is_the_same_again_also_after_others() -> None:
    c = campaign(weather={"wind_speed": 5, "wind_from": 90, "turbulence": 2}, flights=2)
    first = Flight(c.plan(0)).fly().sha256
    other = Flight(c.plan(1)).fly().sha256
    assert Flight(c.plan(0)).fly().sha256 == first != other


def test_the_arbiter_limits_what_flies() -> None:
    # config/aircraft/fixed_wing.yaml: flaps move by 0.5 a second.
    events = [{"at": 0, "handles": {"flaps": 0}}, {"at": 0.5, "handles": {"flaps": 1}}, {"at": 1.5, "end": True}]
    flight = Flight(campaign(events).plan(0))
    flight.fly()
    assert flight._aircraft.controls.flap_request == pytest.approx(0.5, abs=0.5 / 60 + 1e-6)


def test_what_the_scenario_breaks_is_broken_and_repaired() -> None:
    broken = [
        {"at": 0, "stick": {"roll": 0}},
        {"at": 0.2, "failure": {"name": "aileron1_wing2_left", "kind": "stuck", "value": -7.5}, "label": "stuck"},
        {"at": 1, "end": True},
    ]
    flight = Flight(campaign(broken).plan(0))
    flight.fly()
    assert flight._aircraft.state.surfaces_deg["wing2l_ail1"] == -7.5
    flight = Flight(campaign([*broken[:2], {"at": 0.5, "clear_failures": True}, broken[2]]).plan(0))
    flight.fly()
    assert abs(flight._aircraft.state.surfaces_deg["wing2l_ail1"]) < 2.0  # the roll trim is left


def test_wind_loading_and_start_are_those_of_the_campaign() -> None:
    start = {"speed": 60, "altitude": 1500, "heading": 90, "latitude": 10, "longitude": 20}
    c = campaign(
        weather={"wind_speed": 10, "wind_from": 270},
        loading={"payload": 50, "fuel": [20, 30]},
        scenario={"start": start},
    )
    flight = Flight(c.plan(0))
    flight._start()
    state = flight._aircraft.state
    assert (state.wind_north_mps, state.wind_east_mps) == pytest.approx((0.0, 10.0), abs=1e-9)
    assert (state.payload_kg, state.fuel_kg) == (50.0, [20.0, 30.0])
    assert (state.latitude_deg, state.longitude_deg, state.altitude_m) == pytest.approx((10.0, 20.0, 1500.0))
    assert state.true_airspeed_mps == pytest.approx(60.0, abs=1e-3)
    assert math.degrees(state.heading_rad) == pytest.approx(90.0)


def test_an_excitation_is_added_to_what_is_commanded() -> None:
    events = [
        {"at": 0, "stick": {"roll": 0.1}},
        {"at": 0.5, "excitation": {"kind": "doublet", "target": "roll", "amplitude": 0.2, "duration": 1.0}},
        {"at": 2, "end": True},
    ]
    trace = Flight(campaign(events).plan(0)).fly(trace=True).trace
    # Row k holds what flew into it: the doublet begins with the command of frame 31, and turns with that of 60.
    stick = trace["stick_roll"]
    assert [round(stick[k], 6) for k in (31, 32, 60, 61, 90, 91)] == [0.1, 0.3, 0.3, -0.1, -0.1, 0.1]


def excited(*events: Dict[str, Any], end: float = 1.0, **more: Any) -> Any:
    """The stick's pitch in each frame of a flight with these events."""
    begin = {"at": 0, "stick": {"roll": 0, "pitch": 0, "yaw": 0}}
    flight = Flight(campaign([begin, *events, {"at": end, "end": True}], **more).plan(0))
    return flight.fly(trace=True).trace["stick_pitch"]


def doublet(amplitude: float, duration: float) -> Dict[str, Any]:
    return {"kind": "doublet", "target": "pitch", "amplitude": amplitude, "duration": duration}


def test_an_excitation_begins_in_the_frame_after_its_event_as_through_the_nodes() -> None:
    stick = excited({"at": 0.5, "excitation": doublet(0.1, 0.19)})  # until frame 41; a stick shows a frame later
    tenth = struct.unpack("<f", struct.pack("<f", 0.1))[0]
    assert list(stick[30:33]) == [0.0, 0.0, tenth]
    assert list(stick[36:38]) == [tenth, -tenth]
    assert list(stick[42:44]) == [-tenth, 0.0]


def test_an_excitation_of_the_first_event_begins_when_its_axis_is_commanded() -> None:
    """The first command answers the first state; the excitation is as one of the second state."""
    assert list(excited({"at": 0, "excitation": doublet(0.1, 0.19)})) == list(
        excited({"at": 0.01, "excitation": doublet(0.1, 0.19)})
    )


def test_one_excitation_may_begin_where_another_ends_and_not_before() -> None:
    first, second = {"at": 0.5, "excitation": doublet(0.1, 0.19)}, {"at": 0.7, "excitation": doublet(0.2, 0.2)}
    assert excited(first, second)[44] == pytest.approx(0.2)
    with pytest.raises(CampaignError, match=r"excitation at 0\.65 s: another runs: one at a time"):
        excited(first, {**second, "at": 0.65})


def test_a_change_of_the_mode_ends_an_excitation() -> None:
    stick = excited({"at": 0.5, "excitation": doublet(0.1, 0.4)}, {"at": 0.6, "mode": "auto"},
                    controller=f"{__name__}:Recorder")  # fmt: skip
    assert stick[36] > 0.05
    assert not stick[37:].any()


def test_an_excitation_ends_where_tx_node_would_end_it() -> None:
    """Beyond the roll that the aircraft's file allows."""
    stick = excited({"at": 0, "stick": {"roll": 1}}, {"at": 0.2, "excitation": doublet(0.05, 4.0)}, end=4.0)
    assert stick[20] > 0.0
    assert not stick[200:].any()


LEVER = {**doublet(0.1, 0.5), "target": "throttle"}


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([{"at": 0.5, "excitation": LEVER}], r"at 0\.5 s: no source commands throttle"),
        (
            [{"at": 0, "stick": {"roll": 1}}, {"at": 3, "excitation": doublet(0.1, 0.5)}],
            "at 3 s: the attitude is beyond",
        ),
    ],
)
def test_an_excitation_that_tx_node_refuses_is_refused(events: Any, message: str) -> None:
    with pytest.raises(CampaignError, match=f"scenario: excitation {message}"):
        excited(*events, end=4.0)


def falls_silent(state: Any) -> Dict[str, float]:
    """Commands for half a second, and again after one."""
    return {"pitch": 0.0} if state.sim_time < 0.5 or state.sim_time > 1.0 else {}


def test_an_excitation_ends_with_the_commands_of_its_axis() -> None:
    begin = {"at": 0, "mode": "auto"}
    stick = excited(begin, {"at": 0.3, "excitation": doublet(0.1, 4.0)}, end=1.5, controller=f"{__name__}:falls_silent")
    silent = 30 + 30  # and config/tx.yaml's command_timeout
    assert stick[silent - 2] > 0.05
    assert not stick[silent + 2 :].any()


def test_a_change_of_the_mode_acts_on_what_was_commanded_before_its_frame() -> None:
    """As through tx_node: from where the stick was before; then its command of the frame comes, and is no hand-over."""
    hand_over = {"at": 0.5, "mode": "manual", "stick": {"roll": 1}}
    events = [{"at": 0, "mode": "auto", "stick": {"roll": 0}}, hand_over, {"at": 1, "end": True}]
    trace = Flight(campaign(events, controller=f"{__name__}:Recorder").plan(0)).fly(trace=True).trace
    assert list(trace["stick_roll"][30:32]) == [0.0, 1.0]


def test_the_stick_takes_over_from_the_controller() -> None:
    # config/tx.yaml: by more than 0.3 of movement.
    events = [
        {"at": 0, "mode": "auto", "stick": {"roll": 0}},
        {"at": 0.5, "stick": {"roll": 0.35}},
        {"after": 0, "when": {"mode": "manual"}, "label": "manual"},
        {"at": 1, "end": True},
    ]
    flight = Flight(campaign(events, controller=f"{__name__}:Recorder").plan(0))
    assert flight.fly().outcome == "flown"
    assert flight._labels["manual"] == pytest.approx(0.5 + 2 / 60)
    assert flight._aircraft.mode == 1


def test_a_condition_on_the_mode_goes_by_that_of_two_frames_ago_as_through_the_nodes() -> None:
    when = {"when": {"mode": "auto"}, "mode": "manual", "label": "seen"}
    flight = Flight(campaign([EVENTS[0], when, {"after": 0.5, "end": True}], controller=f"{__name__}:Recorder").plan(0))
    assert flight.fly().outcome == "flown"
    assert flight._labels["seen"] == pytest.approx(2 / 60)


STALL = [
    {"at": 0, "stick": {"roll": 0, "pitch": 0.2, "yaw": 0, "throttle": 0}},
    {"at": 0.5, "stick": {"pitch": 1}, "over": 3},
    {"when": {"stall_warning": True}, "timeout": 30, "stick": {"pitch": -0.3, "throttle": 1}, "label": "stalls"},
    {"after": 0.5, "end": True},
]


@pytest.mark.parametrize("frame_rate", [50, 60])
def test_a_condition_on_the_stall_warning_goes_by_the_topic_as_through_the_nodes(frame_rate: int) -> None:
    seen: List[bool] = []
    c = campaign(STALL, frame_rate=frame_rate, scenario={"start": {"speed": 60, "altitude": 1500}})
    flight = Flight(c.plan(0), lambda view: seen.append(view.stall_warning))
    assert flight.fly().outcome == "flown"
    # config/rx.yaml asks for five messages a second, and one counts in the first frame more than 0.2 s after it.
    every = frame_rate // 5
    message = next(frame for frame in range(0, len(seen), every) if seen[frame])
    assert flight._labels["stalls"] * frame_rate == pytest.approx(message + every + 1)


@pytest.mark.parametrize("frame_rate", [20.0, 24.0, 33.3, 50.0, 60.0, 100.0, 128.0, 144.0, 240.0])
@pytest.mark.parametrize("rate", [1, 2, 5, 7, 30, 1000])
def test_messages_of_warnings_come_in_the_frames_in_which_the_emulator_sends_them(frame_rate: float, rate: int) -> None:
    pacer, topic = Pacer(rate), WarningInStep(frame_rate, rate)
    sent, due, shown, last = [], 0, [], -1
    for frame in range(1200):
        due += pacer.due(frame / frame_rate, 1.0 / frame_rate)
        sent.append(due)
        # Of each message whether its number is odd: so each differs from the one before.
        shown.append(topic.at(frame, due % 2 == 1))
    age = max(0.2, 1.0 / rate)
    for frame in range(1200):
        while last + 1 < frame and round((last + 1) / frame_rate * 1e6) < round(frame / frame_rate * 1e6) - age * 1e6:
            last += 1
        assert shown[frame] == (last >= 0 and sent[last] % 2 == 1), frame


def test_a_stall_warning_that_the_bridge_does_not_publish_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("xplane_bridge.campaign.definition.messages_a_second", lambda: 0)
    assert campaign().name == "c"
    with pytest.raises(CampaignError, match=r"waits for stall_warning, and config/rx\.yaml asks for no warnings"):
        campaign(STALL)


def test_without_the_compiled_module_the_way_to_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("xplane_bridge.compiled.core", None)
    with pytest.raises(NotCompiledError, match="scripts/setup"):
        Flight(campaign().plan(0))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"events": [{"at": 0, "dataref": {"sim/none": 1}}]}, "scenario.events[0].dataref: takes the bridge"),
        ({"events": [{"at": 0, "stick": {"roll": "$no"}}]}, "expected a parameter of"),
        ({"controller": "nowhere:Missing"}, "controller: 'nowhere:Missing' cannot be had"),
        ({"controller": "math"}, "expected module:class or module:function"),
        ({"scenario": {"aircraft": "tiltrotor"}, "aircraft": "fixed_wing"}, "the scenario is for tiltrotor"),
        ({"weather": {"wind": 3}}, "weather.wind: unknown key"),
        ({"flights": 0}, "flights: 0; expected a whole number from 1"),
        ({"stop": {"criterion": "x", "width": 0.1}}, "stop.criterion: 'x'"),
        ({"parameter": {}}, "campaign.parameter: unknown key"),
        ({"weather": {"wind_speed": "6 m/s"}}, "weather.wind_speed: '6 m/s'; expected a number"),
        ({"weather": {"wind_speed": -6}}, "weather: wind of -6 m/s: expected 0..100"),
        ({"weather": {"turbulence": True}}, "weather.turbulence: True; expected a number"),
        (
            {"weather": {"sea_level_pressure": 1013.25}},
            "1013.25 Pa at sea level: expected",
        ),
        ({"loading": {"fuel": 100}}, "loading.fuel: 100; expected a list of numbers"),
        ({"loading": {"payload": -1}}, "loading.payload: -1; expected a number of 0 or more"),
        (
            {"aircraft": "$a", "parameters": {"a": {"choice": ["fixed_wing", "quadcopter"]}}},
            "aircraft: 'quadcopter'; expected one of",
        ),
        ({"parameters": {"gusts": {"uniform": [0, 5]}}}, "parameters.gusts: nothing refers to it; expected $gusts in"),
        (
            {"controller": "math:sin", "arguments": {"schedule": {40: 0.03}}},
            "arguments.schedule: the key 40 is no text; expected it in quotes: '40'",
        ),
        ({"description": datetime.date(2024, 5, 1)}, "description: 2024-05-01 is a date; expected"),
    ],
)
def test_a_wrong_campaign_is_named(changes: dict, text: str) -> None:
    with pytest.raises(CampaignError) as raised:
        campaign(**changes)
    assert text in str(raised.value)


def test_a_whole_number_that_is_chosen_stays_one() -> None:
    excitation = {"kind": "multisine", "target": "roll", "amplitude": 0.1, "duration": 1, "seed": "$s"}
    events = [{"at": 0, "excitation": excitation}, {"at": 0.1, "end": True}]
    plan = campaign(events, parameters={"s": {"choice": [3, 4]}}).plan(0)
    assert repr(plan.scenario["events"][0]["excitation"]["seed"]) in ("3", "4")


def test_parameters_go_anywhere_in_the_scenario() -> None:
    c = campaign(
        [{"at": "$when", "stick": {"roll": "$roll"}, "label": "roll $roll"}, {"after": 1, "end": True}],
        parameters={"when": {"uniform": [1, 2]}, "roll": {"choice": [0.25]}},
    )
    plan = c.plan(0)
    event = plan.scenario["events"][0]
    assert event["at"] == plan.parameters["when"]
    assert (event["stick"], event["label"]) == ({"roll": 0.25}, "roll 0.25")
    assert math.isfinite(event["at"])
