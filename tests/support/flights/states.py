"""FlightStates for players that fly without ROS."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any


def state(sim_time: float, **values: Any) -> SimpleNamespace:
    """One of epoch 1 in level flight: what a player looks at."""
    known = dict.fromkeys(
        [
            "roll_deg",
            "pitch_deg",
            "heading_true_deg",
            "altitude_msl",
            "altitude_agl",
            "vertical_speed",
            "calibrated_airspeed",
            "alpha_deg",
            "beta_deg",
            "load_factor_normal",
        ],
        0.0,
    )
    rates = SimpleNamespace(x=0.0, y=0.0, z=0.0)
    flags = {"on_ground": False, "paused": False}
    return SimpleNamespace(
        **{**known, **flags, "epoch": 1, "sim_time_unwrapped": sim_time, "angular_velocity": rates, **values}
    )
