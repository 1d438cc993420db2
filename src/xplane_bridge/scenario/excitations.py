"""Test inputs for system identification, as functions of time: doublet, 3-2-1-1, multisine, chirp."""

from __future__ import annotations

import math
import random
from typing import Any, Mapping

from xplane_bridge.scenario.schema import ScenarioError

#: Sines of a multisine.
_SINES = 8


def value(parameters: Mapping[str, Any], time_s: float) -> float:
    """The input at `time_s` after its start, within +-amplitude; 0 before and after.

    Args:
        parameters: A checked `excitation`: kind, amplitude, duration [s], frequency, frequency_end [Hz], seed.
        time_s: Time since the start [s].

    Raises:
        ScenarioError: No input of this kind is made here.
    """
    duration: float = parameters["duration"]
    amplitude: float = parameters["amplitude"]
    if not 0.0 <= time_s < duration:
        return 0.0
    part = time_s / duration
    kind = parameters["kind"]
    if kind == "doublet":
        return amplitude if part < 0.5 else -amplitude
    if kind == "3-2-1-1":
        return amplitude if part < 3 / 7 or 5 / 7 <= part < 6 / 7 else -amplitude
    if kind not in ("chirp", "multisine"):
        raise ScenarioError(f"excitation.kind: {kind!r}; expected doublet, 3-2-1-1, multisine or chirp")
    low: float = parameters["frequency"]
    high: float = parameters["frequency_end"]
    if kind == "chirp":
        return amplitude * math.sin(2 * math.pi * (low * time_s + 0.5 * (high - low) * time_s * part))
    chance = random.Random(parameters["seed"])
    phases = [chance.uniform(0.0, 2 * math.pi) for _ in range(_SINES)]
    frequencies = [low + (high - low) * i / (_SINES - 1) for i in range(_SINES)]
    total = sum(math.sin(2 * math.pi * f * time_s + phase) for f, phase in zip(frequencies, phases))
    return _limit(amplitude * total / math.sqrt(_SINES), amplitude)


def _limit(number: float, bound: float) -> float:
    return min(max(number, -bound), bound)
