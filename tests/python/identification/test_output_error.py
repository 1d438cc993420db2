"""The simulation below the fit, against exact steps from one frame to the next."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from xplane_bridge.identification.output_error import Samples, fit, simulate

A = np.array([[-0.02, 0.1, -9.8, 0.0], [-0.1, -2.0, 75.0, 0.0], [0.0, -0.1, -3.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
B = np.array([[0.1, 0.0], [-4.0, 0.3], [-9.0, 0.0], [0.0, 0.2]])


def flown(frames: int, lengths: tuple[float, ...]) -> Samples:
    """A window with frames of these lengths, exact for inputs that go straight from one frame to the next."""
    draw = np.random.default_rng(frames)
    steps = draw.choice(lengths, frames - 1)
    inputs = draw.normal(size=(frames, 2)).cumsum(axis=0) * 0.01
    states = [draw.normal(size=4)]
    for k, step in enumerate(steps):
        slope = (inputs[k + 1] - inputs[k]) / step
        augmented = np.zeros((8, 8))  # x, u and its slope
        augmented[:4, :4], augmented[:4, 4:6], augmented[4:6, 6:] = A, B, np.eye(2)
        states.append((expm(augmented * step) @ np.concatenate([states[-1], inputs[k], slope]))[:4])
    return Samples(np.concatenate([[0.0], steps.cumsum()]), np.array(states), inputs)


@pytest.mark.parametrize("lengths", [(1 / 64,), (0.016, 0.017, 0.033)])
@pytest.mark.parametrize("frames", [3, 4, 5, 26, 361])
def test_a_simulated_window_is_the_one_flown_step_by_step(frames: int, lengths: tuple[float, ...]) -> None:
    window = flown(frames, lengths)
    assert simulate(window, A, B) == pytest.approx(window.states, abs=1e-8)


@pytest.mark.parametrize("lengths", [(1 / 64,), (0.016, 0.017, 0.033)])
def test_a_fit_of_windows_of_different_lengths_finds_the_system(lengths: tuple[float, ...]) -> None:
    windows = [flown(frames, lengths) for frames in (150, 200, 361)]
    found = fit(windows, 0.9 * A, 1.1 * B)
    assert found.converged
    assert found.a == pytest.approx(A, abs=1e-4)
    assert found.b == pytest.approx(B, abs=1e-4)
