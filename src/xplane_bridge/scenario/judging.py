"""Measures the criteria of a scenario in a recorded flight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional

import numpy as np

from xplane_bridge.analysis.frames import frames_of
from xplane_bridge.analysis.scoring import Score, score
from xplane_bridge.scenario.schema import Scenario, ScenarioError

if TYPE_CHECKING:
    from xplane_bridge.bags.flight import Flight

#: Scenario variables (units of scenarios) by FlightState columns (SI, angles in degrees).
_COLUMNS = {
    "roll": "roll_deg",
    "pitch": "pitch_deg",
    "heading": "heading_true_deg",
    "altitude": "altitude_msl",
    "agl": "altitude_agl",
    "climb": "vertical_speed",
    "speed": "calibrated_airspeed",
    "alpha": "alpha_deg",
    "beta": "beta_deg",
    "load_factor": "load_factor_normal",
}
#: A state counts as that of the player's last step when its time is so near to it: far below a frame [s].
_SAME_TIME_S = 1e-6
_RATES = {"roll_rate": "angular_velocity.x", "pitch_rate": "angular_velocity.y", "yaw_rate": "angular_velocity.z"}


def judge(scenario: Scenario, flight: Flight, played: Mapping[str, Any], frames: Optional[int] = None) -> List[Score]:
    """Scores a flight that was flown by a `RosPlayer`.

    Where the scenario was played to its end, the state that ended it is the last that counts, as in a campaign: what is
    recorded until all programs have ended is not of the scenario. A frame that a pause repeats counts once.

    Args:
        scenario: What was flown.
        flight: The recording.
        played: The player's log: `begin` (epoch and sim_time_unwrapped of its first state), `labels` [s], `finished`
            and `duration` [s].
        frames: How many frames count at most, from that state on; all when omitted.

    Raises:
        ScenarioError: The recording has no state of the time the scenario was played in.
    """
    if "state" not in flight.tables or not played.get("begin"):
        raise ScenarioError(f"{scenario.name}: no flight state was recorded while it was played")
    state = flight.tables["state"]
    epoch, sim_time = state["epoch"], state["sim_time_unwrapped"]
    elapsed, once = frames_of(epoch, sim_time)
    begin = played["begin"]
    first = np.flatnonzero((epoch == begin["epoch"]) & (sim_time >= begin["sim_time_unwrapped"] - _SAME_TIME_S))
    if not len(first):
        raise ScenarioError(f"{scenario.name}: the state it began with was not recorded")
    end = len(elapsed)
    if played.get("finished"):
        last = elapsed[first[0]] + played["duration"] + _SAME_TIME_S
        end = min(end, int(np.searchsorted(elapsed, last, side="right")))
    once[first[0]] = True
    rows = first[0] + np.flatnonzero(once[first[0] : end])[:frames]
    time = elapsed[rows] - elapsed[first[0]]
    values = {name: np.asarray(state[column][rows], dtype=float) for name, column in _COLUMNS.items()}
    values.update({name: np.degrees(state[column][rows]) for name, column in _RATES.items()})
    return score(scenario.criteria, time, values, played["labels"], _camera(flight))


def _camera(flight: Flight) -> Dict[str, float]:
    if not flight.cameras:
        return {}
    quality = np.concatenate([camera.table["quality"] for camera in flight.cameras])
    missing = quality & flight.cameras[0].constants["QUALITY_STATE_MISSING"]
    return {"paired": float(np.mean(missing == 0)), "perfect": float(np.mean(quality == 0))}
