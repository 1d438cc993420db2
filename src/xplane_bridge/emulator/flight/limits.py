"""What may be asked of an aircraft and its air; every refusal says what was expected."""

from __future__ import annotations

import json
import math
from typing import Any, Dict, Sequence

from xplane_bridge.emulator.flight.flight_model import FlightModelError, ModelState

#: Faster no aircraft moves or turns: a flight model that says so has given up, though its numbers are finite.
_HIGHEST_SPEED_MPS = 5000.0
_HIGHEST_RATE_RAD_S = 1000.0


def is_sane(state: ModelState) -> bool:
    """Whether a motion is one that there is: finite numbers, speed and rates within reach."""
    total = state.latitude_deg + state.longitude_deg + state.altitude_m + sum(state.quaternion)
    speed = math.hypot(math.hypot(state.u_mps, state.v_mps), state.w_mps)
    fastest_turn = max(abs(state.p_rad_s), abs(state.q_rad_s), abs(state.r_rad_s))
    return math.isfinite(total) and speed < _HIGHEST_SPEED_MPS and fastest_turn < _HIGHEST_RATE_RAD_S


def check_fuel(fuel_kg: Sequence[float], capacity_kg: Sequence[float]) -> None:
    """Raises a `FlightModelError` unless each tank can hold its fuel."""
    if len(fuel_kg) != len(capacity_kg) or not all(0.0 <= f <= c for f, c in zip(fuel_kg, capacity_kg)):
        raise FlightModelError(f"fuel {list(fuel_kg)} kg: expected one value per tank, 0..{list(capacity_kg)}")


def check_payload(payload_kg: float, most_kg: float) -> None:
    """Raises a `FlightModelError` unless the aircraft can carry it."""
    if not 0.0 <= payload_kg <= most_kg:
        raise FlightModelError(f"payload {payload_kg} kg: expected 0..{most_kg}")


def payload_place(cg_aft_m: float, mass_kg: float, payload_kg: float, reach_m: float) -> float:
    """How far aft the payload must be for a centre of gravity [m]; everything else has its own at the reference point.

    Args:
        cg_aft_m: Wanted, aft of the reference point.
        mass_kg: Of what it is the centre of: all with the payload, without the fuel.
        payload_kg: What is moved.
        reach_m: How far it can be moved.

    Raises:
        FlightModelError: The payload cannot be moved so far.
    """
    moment = cg_aft_m * mass_kg
    if abs(moment) > reach_m * payload_kg:
        raise FlightModelError(
            f"centre of gravity {cg_aft_m} m aft: the payload of {payload_kg} kg can be moved by "
            f"{reach_m} m only; load more, or ask for less"
        )
    return moment / payload_kg if payload_kg > 0.0 else 0.0


def check_turbulence(intensity_mps: float) -> None:
    """Raises a `FlightModelError` unless it is a standard deviation of gusts that there is."""
    if not 0.0 <= intensity_mps <= 20.0:
        raise FlightModelError(f"turbulence of {intensity_mps} m/s: expected 0..20 (light 1, moderate 2, severe 4)")


def check_wind(speed_mps: float) -> None:
    """Raises a `FlightModelError` unless it is a speed; from where it blows is another number."""
    if not 0.0 <= speed_mps <= 100.0:
        raise FlightModelError(f"wind of {speed_mps:g} m/s: expected 0..100")


def check_atmosphere(temperature_offset_k: float, sea_level_pressure_pa: float) -> None:
    """Raises a `FlightModelError` unless there are such days."""
    if not (abs(temperature_offset_k) <= 60.0 and 85000.0 <= sea_level_pressure_pa <= 110000.0):
        raise FlightModelError(
            f"atmosphere {temperature_offset_k} K off standard, {sea_level_pressure_pa} Pa at sea level: "
            "expected -60..60 K, 85000..110000 Pa"
        )


def opened_situation(situation: bytes, model: str, version: int) -> Dict[str, Any]:
    """The values of a saved situation; raises a `FlightModelError` unless it is one of this model and version."""
    try:
        saved: Dict[str, Any] = json.loads(situation.decode())
        of, saved_version = saved["model"], saved["version"]
    except (ValueError, KeyError, TypeError) as error:
        raise FlightModelError(f"not a saved situation of the emulator: {error}") from error
    if (of, saved_version) != (model, version):
        raise FlightModelError(f"situation of '{of}', version {saved_version}: '{model}', version {version} is loaded")
    return saved
