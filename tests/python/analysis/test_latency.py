"""Delays put into made-up motion and drawn pictures come out again, and too little motion is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from xplane_bridge.analysis.image_rotation import rotation_between, rotation_motion
from xplane_bridge.analysis.latency import (
    LatencyError,
    accumulated_rotation,
    fit_delay,
    require_usable,
    value_motion,
    view_axis,
)
from xplane_bridge.emulator.view.renderer import Scene
from xplane_bridge.emulator.view.renderer.painter import Painter


def multisine(t: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Roll angle [rad]: 14 deg/s^2 rms of acceleration at scale 1."""
    parts = ((0.3, 6.0, 0.1), (0.7, 1.2, 1.3), (1.1, 0.3, 2.9))
    return scale * np.radians(sum(a * np.sin(2 * math.pi * f * t + p) for f, a, p in parts))


@pytest.mark.parametrize("delay", [0.0, 0.037, 0.2])
def test_fit_finds_the_delay_in_noise_with_drift_and_outliers(delay: float) -> None:
    random = np.random.default_rng(3)
    lead_time = np.arange(0.0, 62.0, 1 / 60)
    stamps = np.arange(0.5, 61.0, 1 / 30) + random.normal(0.0, 0.002, 1815)
    noise = random.normal(0.0, np.radians(0.02), len(stamps))
    noise[random.integers(0, len(stamps), 40)] += 0.2
    late = value_motion(stamps, 1.02 * multisine(stamps - delay) + 0.001 * stamps + noise)
    result = fit_delay(late, lead_time, multisine(lead_time))
    assert result.delay == pytest.approx(delay, abs=0.003)
    assert result.gain == pytest.approx(1.02, abs=0.02)
    assert abs(result.delay - delay) < 4.0 * result.sigma + 1e-4
    require_usable(result, "test")


def test_interval_is_as_wide_as_the_scatter() -> None:
    lead_time = np.arange(0.0, 32.0, 1 / 60)
    found, sigmas = [], []
    for seed in range(12):
        random = np.random.default_rng(seed)
        stamps = np.arange(0.5, 31.0, 1 / 30)
        late = value_motion(stamps, multisine(stamps - 0.05) + random.normal(0.0, np.radians(0.05), len(stamps)))
        result = fit_delay(late, lead_time, multisine(lead_time))
        found.append(result.delay)
        sigmas.append(result.sigma)
    assert 0.4 < np.mean(sigmas) / np.std(found) < 2.5


def test_small_motion_is_refused_in_words() -> None:
    random = np.random.default_rng(3)
    lead_time = np.arange(0.0, 32.0, 1 / 60)
    stamps = np.arange(0.5, 31.0, 1 / 30)
    late = value_motion(stamps, multisine(stamps - 0.05, 0.05) + random.normal(0.0, np.radians(0.03), len(stamps)))
    with pytest.raises(LatencyError, match=r"too small|do not move together"):
        require_usable(fit_delay(late, lead_time, multisine(lead_time, 0.05)), "pictures")


@pytest.mark.parametrize("delay", [-0.14, 0.45, 0.5])
def test_a_delay_outside_the_search_is_refused(delay: float) -> None:
    lead_time = np.arange(0.0, 62.0, 1 / 60)
    stamps = np.arange(1.0, 61.0, 1 / 30)
    noise = np.random.default_rng(3).normal(0.0, 0.002, len(stamps))
    late = value_motion(stamps, multisine(stamps - delay) + noise)
    with pytest.raises(LatencyError, match=r"the delay lies outside -100 \.\. 400 ms"):
        require_usable(fit_delay(late, lead_time, multisine(lead_time)), "pictures")


def test_foreign_motion_and_wrong_gain_are_refused() -> None:
    lead_time = np.arange(0.0, 32.0, 1 / 60)
    stamps = np.arange(0.5, 31.0, 1 / 30)
    other = value_motion(stamps, np.random.default_rng(1).normal(0.0, 0.1, len(stamps)))
    with pytest.raises(LatencyError, match="do not move together"):
        require_usable(fit_delay(other, lead_time, multisine(lead_time)), "pictures")
    triple = value_motion(stamps, 3.0 * multisine(stamps))
    with pytest.raises(LatencyError, match=r"3\.00 times"):
        require_usable(fit_delay(triple, lead_time, multisine(lead_time)), "pictures")
    with pytest.raises(LatencyError, match="usable samples"):
        fit_delay(value_motion(stamps[:20], stamps[:20]), lead_time, multisine(lead_time))


def test_axes_of_the_views() -> None:
    half = math.sqrt(0.5)
    # Optical frame of the forward view: its z axis ahead (REP 103): quaternion (0.5, -0.5, 0.5, -0.5).
    assert view_axis(np.array((0.5, -0.5, 0.5, -0.5))) == pytest.approx((1.0, 0.0, 0.0))
    # Straight down with the top of the picture ahead: half a turn about (1, -1, 0).
    assert view_axis(np.array((0.0, half, -half, 0.0))) == pytest.approx((0.0, 0.0, 1.0))


def test_rotation_accumulates_about_the_axis() -> None:
    time = np.array((0.0, 1.0, 3.0))
    rates = np.array(((0.1, 9.0, 0.0), (0.3, 9.0, 0.0), (0.3, 9.0, 0.0)))
    assert accumulated_rotation(time, rates, np.array((1.0, 0.0, 0.0))) == pytest.approx((0.0, 0.2, 0.8))


def grey(painter: Painter, scene: Scene) -> np.ndarray:
    return cv2.cvtColor(painter.paint(scene), cv2.COLOR_BGR2GRAY)


SCENE = Scene(latitude_deg=47.0, longitude_deg=8.0, altitude_m=600.0, pitch_deg=-5.0)


@pytest.mark.parametrize("turn", [-3.0, -0.2, 0.0, 1.0, 4.0])
def test_picture_turns_with_the_roll(turn: float) -> None:
    painter = Painter(640, 480, (47.02, 8.0), strip=False)
    before = grey(painter, SCENE)
    angle = rotation_between(before, grey(painter, replace(SCENE, roll_deg=turn)))
    assert angle is not None
    assert math.degrees(angle) == pytest.approx(turn, abs=0.05)


def test_blank_pictures_show_nothing() -> None:
    assert rotation_between(np.zeros((240, 320), np.uint8), np.zeros((240, 320), np.uint8)) is None


def test_delay_of_drawn_pictures() -> None:
    """The whole chain but the bag: 20 s of pictures that show the state 60 ms before their stamp."""
    painter = Painter(320, 240, (47.02, 8.0))
    stamps = np.arange(1.0, 21.0, 1 / 30)
    time = np.arange(0.0, 22.0, 1 / 60)
    rate = np.gradient(multisine(time, 2.0), time)
    lead = accumulated_rotation(time, np.column_stack((rate, 0 * rate, 0 * rate)), np.array((1.0, 0.0, 0.0)))

    def pictures():
        for number, stamp in enumerate(stamps):
            shown = stamp - 0.06
            roll = math.degrees(float(multisine(np.array(shown), 2.0)))
            north = 60.0 * shown / 111000.0
            scene = replace(SCENE, frame=number, roll_deg=roll, latitude_deg=47.0 + north)
            yield stamp, grey(painter, scene)

    result = fit_delay(rotation_motion(pictures(), ignore_bottom=0.05), time, lead)
    require_usable(result, "pictures")
    assert result.delay == pytest.approx(0.06, abs=0.004)
    assert result.gain == pytest.approx(1.0, abs=0.05)
