"""Test inputs for system identification, as functions of time: doublet, 3-2-1-1, multisine, chirp.

The signals are tx_node's (core/control/excitation.hpp), for those who fly without it; InjectExcitation.srv has the
formulas.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, Mapping, Sequence, Tuple

import numpy as np

from xplane_bridge.scenario.schema import ScenarioError
from xplane_bridge.surfaces import SURFACES

#: Raised cosine at both ends of a multisine and a chirp [s].
FADE_S = 0.5
_MOST_SINES = 2000
_AXES = ("roll", "pitch", "yaw", "throttle")
#: Samples of the highest sine's period by which the multisine's peak is found.
_PEAK_SAMPLES = 32


def check(parameters: Mapping[str, Any], path: str = "excitation") -> None:
    """Looks whether there is such an input.

    Args:
        parameters: An `excitation` of a kind that there is, with kind, target, amplitude, duration [s], frequency,
            frequency_end [Hz] and seed.
        path: By which errors name it.

    Raises:
        ScenarioError: There is none: says which value, and what is expected.
    """
    kind, duration = parameters["kind"], parameters["duration"]
    amplitude = parameters["amplitude"]
    axes = _axes(parameters["target"], f"{path}.target")
    if not amplitude > 0.0 or (axes and amplitude > 1.0):
        expected = "a number above 0, up to 1, which is full travel" if axes else "a number above 0"
        raise ScenarioError(f"{path}.amplitude: {amplitude:g}; expected {expected}")
    if kind in ("doublet", "3-2-1-1"):
        return
    low, high = parameters["frequency"], parameters["frequency_end"]
    if high < low:
        raise ScenarioError(f"{path}.frequency_end: {high:g}; expected a number not below frequency ({low:g})")
    if duration < 2.0 * FADE_S:
        raise ScenarioError(
            f"{path}.duration: {duration:g}; expected {2.0 * FADE_S:g} s or more: a {kind} fades in and out for "
            f"{FADE_S:g} s each"
        )
    if kind == "multisine":
        first, last = _harmonics(low, high, duration)
        targets = max(1, len(axes))
        if not targets <= last - first + 1 <= _MOST_SINES * targets:
            raise ScenarioError(
                f"{path}.frequency_end: {high:g}; expected {targets} to {_MOST_SINES * targets} multiples of "
                f"1/duration between it and frequency ({low:g})"
            )


def _axes(target: str, path: str) -> Sequence[str]:
    """The axes that are moved; none where it is a surface."""
    if target in SURFACES:
        return ()
    axes = target.replace(" ", "").split(",")
    if not all(axis in _AXES for axis in axes):
        raise ScenarioError(
            f"{path}: {target!r}; expected {', '.join(_AXES)} or one surface (docs/control/surfaces.md), of a "
            'multisine also several axes, for example "roll,pitch"'
        )
    if len(set(axes)) < len(axes):
        raise ScenarioError(f"{path}: {target!r}; expected each axis once")
    return axes


def value(parameters: Mapping[str, Any], time_s: float) -> float:
    """The input at `time_s` after its start, within +-amplitude; 0 before and after.

    Args:
        parameters: A checked `excitation`; its target is not looked at.
        time_s: Time since the start [s].

    Raises:
        ScenarioError: No input of this kind is made here.
    """
    duration: float = parameters["duration"]
    amplitude: float = parameters["amplitude"]
    if not 0.0 <= time_s < duration:
        return 0.0
    kind = parameters["kind"]
    if kind == "doublet":
        return amplitude if time_s < 0.5 * duration else -amplitude
    if kind == "3-2-1-1":
        pulses = 7.0 * time_s / duration
        return amplitude if pulses < 3.0 or 5.0 <= pulses < 6.0 else -amplitude
    low, high = parameters["frequency"], parameters["frequency_end"]
    if kind == "chirp":
        return amplitude * _window(time_s, duration) * math.sin(2.0 * math.pi * _cycles(low, high, duration, time_s))
    if kind != "multisine":
        raise ScenarioError(f"excitation.kind: {kind!r}; expected doublet, 3-2-1-1, multisine or chirp")
    turns, phases, peak = _multisine(low, high, duration, parameters["seed"])
    total = float(np.cos(turns * time_s + phases).sum())
    return amplitude * _window(time_s, duration) * total / peak


def _window(time_s: float, duration: float) -> float:
    edge = min(time_s, duration - time_s)
    return 1.0 if edge >= FADE_S else 0.5 * (1.0 - math.cos(math.pi * edge / FADE_S))


def _cycles(low: float, high: float, duration: float, time_s: float) -> float:
    """Of a chirp whose frequency grows exponentially."""
    ratio = math.log(high / low)
    return low * time_s if ratio < 1e-9 else low * duration / ratio * math.expm1(ratio * time_s / duration)


def _harmonics(low: float, high: float, duration: float) -> Tuple[int, int]:
    """First and last multiple of 1/duration in the band, both ends included despite rounding."""
    return max(1, math.ceil(low * duration - 1e-9)), math.floor(high * duration + 1e-9)


@lru_cache(maxsize=8)
def _multisine(low: float, high: float, duration: float, seed: int) -> Tuple[np.ndarray, np.ndarray, float]:
    """Angular rates [rad/s], phases [rad] and peak of its sines, each of amplitude 1."""
    first, last = _harmonics(low, high, duration)
    harmonics = np.arange(first, last + 1)
    n = np.arange(len(harmonics))
    # Schroeder (1970) for a flat spectrum; the seed moves all in time.
    phases = np.fmod(-np.pi * n * (n + 1.0) / len(n) + 2.0 * np.pi * _unit(seed) * harmonics, 2.0 * np.pi)
    samples = 1
    while samples < _PEAK_SAMPLES * (last + 1):
        samples *= 2
    lines = np.zeros(samples, dtype=complex)
    lines[harmonics] = np.exp(1j * phases)
    peak = float(np.abs(np.fft.ifft(lines).real).max() * samples)
    return 2.0 * np.pi * harmonics / duration, phases, peak


def _unit(seed: int) -> float:
    """0 to below 1 from a seed, by SplitMix32's finaliser."""
    if not seed:
        return 0.0
    bits = 0xFFFFFFFF
    z = seed * 0x9E3779B9 & bits
    z = (z ^ (z >> 16)) * 0x85EBCA6B & bits
    z = (z ^ (z >> 13)) * 0xC2B2AE35 & bits
    return (z ^ (z >> 16)) / 2.0**32
