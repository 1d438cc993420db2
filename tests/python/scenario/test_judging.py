"""What of a recording counts for the criteria of a scenario."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Dict

import numpy as np
import pytest

from xplane_bridge.scenario import parse_scenario
from xplane_bridge.scenario.judging import _COLUMNS, _RATES, judge

#: Level until the scenario ends at 2 s, 10 s after the simulator's start; then half a second of something else.
FRAME_S = 1 / 60
CRITERIA = {
    "whole": {"measure": "peak", "of": "roll", "target": 0, "below": 5},
    "last": {"measure": "final", "of": "roll", "below": 5},
    "altitude": {"measure": "minimum", "of": "altitude", "above": 900},
}
SCENARIO = parse_scenario({"name": "n", "criteria": CRITERIA, "events": [{"at": 2, "end": True}]})


def flight() -> Any:
    count, ended = 150, 120
    states = {column: np.zeros(count) for column in (*_COLUMNS.values(), *_RATES.values())}
    states["epoch"] = np.full(count, 3)
    states["sim_time_unwrapped"] = 10.0 + FRAME_S * np.arange(count)
    states["roll_deg"][ended + 1 :] = 40.0
    states["altitude_msl"] = np.where(np.arange(count) == ended, 800.0, 1000.0)
    return SimpleNamespace(tables={"state": states}, cameras=[])


def played(**more: Any) -> Dict[str, Any]:
    """As RosPlayer writes it, whose time is a sum of the states' differences."""
    duration = float(np.sum(np.diff(flight().tables["state"]["sim_time_unwrapped"][:121])))
    return {"begin": {"epoch": 3, "sim_time_unwrapped": 10.0}, "labels": {}, "duration": duration, **more}


def values(log: Dict[str, Any], **more: Any) -> Dict[str, float]:
    return {s.name: s.value for s in judge(SCENARIO, flight(), log, **more)}


def test_what_is_recorded_after_the_end_of_the_scenario_does_not_count() -> None:
    assert values(played(finished=True)) == {"whole": 0.0, "last": 0.0, "altitude": 800.0}


def test_as_many_frames_count_as_a_campaign_has_flown() -> None:
    assert values(played(finished=True), frames=121) == values(played(finished=True))
    assert values(played(finished=False), frames=121) == values(played(finished=True))
    assert values(played(finished=True), frames=120)["altitude"] == 1000.0


@pytest.mark.parametrize("log", [played(finished=False), played()])
def test_of_a_scenario_that_was_not_played_to_its_end_all_counts(log: Dict[str, Any]) -> None:
    assert values(log)["whole"] == 40.0


def test_a_frame_counts_once_however_long_it_was_paused() -> None:
    scenario = parse_scenario(
        {
            "name": "n",
            "criteria": {"level": {"measure": "rms", "of": "roll", "target": 0, "below": 50}},
            "events": [{"at": 2, "end": True}],
        }
    )
    paused = flight()
    states = paused.tables["state"]
    # A second of pause at 40 deg, the frame before the end; in it the terrain below loads.
    states["roll_deg"][119] = 40.0
    rows = np.sort(np.concatenate([np.arange(150), np.full(60, 119)]))
    repeated = {column: values[rows] for column, values in states.items()}
    repeated["altitude_agl"] = np.linspace(0.0, 1.0, len(rows))
    paused.tables["state"] = repeated
    expected = np.sqrt(40.0**2 / 121)
    for more in ({}, {"frames": 121}):
        assert judge(scenario, paused, played(finished=True), **more)[0].value == pytest.approx(expected)
    # The first frame of a reset is one of its own, though simulated time stands there.
    repeated["epoch"] = np.where(np.arange(len(rows)) > 119, 4, 3)
    expected = np.sqrt(2 * 40.0**2 / 122)
    assert judge(scenario, paused, played(), frames=122)[0].value == pytest.approx(expected)
