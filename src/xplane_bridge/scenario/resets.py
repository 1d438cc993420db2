"""A flight that a scenario begins at a place or at an airport: what is read of it, the request it becomes."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Tuple

#: Its numbers, as reset_flight has them.
NUMBERS: Mapping[str, Tuple[float, float]] = {
    "latitude": (-89.9, 89.9),
    "longitude": (-180.0, 180.0),
    "altitude_msl": (-500.0, 30000.0),
    "roll_deg": (-180.0, 180.0),
    "pitch_deg": (-90.0, 90.0),
    "heading_true_deg": (0.0, 360.0),
    "true_airspeed": (0.0, 600.0),
    "flight_path_angle_deg": (-90.0, 90.0),
    "spot_index": (0.0, 1000.0),
    "runway_end": (0.0, 1.0),
    "final_distance": (500.0, 50000.0),
}
WHOLE = ("spot_index", "runway_end")
#: Where it begins, as ResetFlight counts; a place is what is meant without.
STARTS: Mapping[str, int] = {"place": 0, "ramp": 1, "runway": 2, "final": 3}
TEXTS = ("start", "airport", "spot")


def reset_request(value: Mapping[str, Any]) -> Dict[str, Any]:
    """Fields of ResetFlight."""
    request: Dict[str, Any] = {key: int(number) if key in WHOLE else number for key, number in value.items()}
    if "start" in request:
        request["start"] = STARTS[request["start"]]
    return request
