"""How sure a fit is: intervals that know that residuals are coloured.

The covariance that a fit gives by itself (Cramer-Rao) takes the residuals for white noise. Those of a flight are not:
what the model lacks, and what gusts do, lasts. Maine and Iliff's correction puts the residuals' own autocorrelation
between the sensitivities; here with the cross-correlation of the outputs, and with a taper over the lags, so that the
result is a covariance whatever the residuals are.
"""

from __future__ import annotations

from typing import Sequence

import numpy as np
from scipy.stats import t as student

from xplane_bridge.identification.model import Mode
from xplane_bridge.identification.output_error import Fit

#: Lags that are taken into account, as a share of a window.
_LAGS = 0.25
_CONFIDENCE = 0.95


def covariance(found: Fit) -> np.ndarray:
    """Covariance of the model's parameters, in the order of `Fit.free`; windows are independent of each other.

    What a window has of its own (initial state, bias) is eliminated from its sensitivities first.
    """
    scale = 1.0 / np.sqrt(found.variance)
    count = len(found.free)
    information, spread = np.zeros((count, count)), np.zeros((count, count))
    for slopes, residuals in zip(found.sensitivities, found.residuals):
        weighted = (slopes * scale[:, None]).reshape(-1, slopes.shape[2])
        basis = np.linalg.qr(weighted[:, count:])[0]
        shared = weighted[:, :count]
        shared = (shared - basis @ (basis.T @ shared)).reshape(*residuals.shape, count)
        information += np.tensordot(shared, shared, axes=([0, 1], [0, 1]))
        spread += _coloured(shared, residuals * scale)
    inverse = np.linalg.pinv(information, rcond=1e-14)
    return inverse @ spread @ inverse


def _coloured(s: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Sum over all pairs of frames of s_i' R(j - i) s_j, by their spectra.

    R(l) = E[v(t) v(t + l)'] is the residuals' tapered correlation.
    """
    n = len(v)
    lags = max(1, round(_LAGS * n))
    length = 1 << int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(v, length, axis=0)
    correlation = np.fft.irfft(spectrum[:, :, None] * np.conj(spectrum[:, None, :]), length, axis=0) / n
    taper = np.zeros(length)
    taper[: lags + 1] = 1.0 - np.arange(lags + 1) / (lags + 1)
    taper[length - lags :] = taper[1 : lags + 1][::-1]
    density = np.fft.rfft(correlation * taper[:, None, None], axis=0)
    slopes = np.fft.rfft(s, length, axis=0)
    pushed = density @ slopes
    weights = np.full(len(density), 2.0 / length)
    weights[[0, -1]] = 1.0 / length
    return np.real(np.tensordot(np.conj(slopes), pushed * weights[:, None, None], axes=([0, 1], [0, 1])))


def factor(found: Fit, samples: int) -> float:
    """From a standard deviation to the half width of a 95 % interval."""
    own = sum(s.shape[2] - len(found.free) for s in found.sensitivities)
    freedom = max(samples * found.a.shape[0] - len(found.free) - own, 1)
    return float(student.ppf(0.5 + _CONFIDENCE / 2.0, freedom))


def element_intervals(found: Fit, covariances: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Half widths for A and B; 0 for elements that are known and not estimated."""
    out = np.zeros((found.a.shape[0], found.a.shape[1] + found.b.shape[1]))
    out[tuple(found.free.T)] = width * np.sqrt(np.maximum(np.diag(covariances), 0.0))
    return out[:, : found.a.shape[1]], out[:, found.a.shape[1] :]


def mode_intervals(modes: Sequence[Mode], found: Fit, covariances: np.ndarray, width: float) -> list[Mode]:
    """The modes with their intervals, by the derivative of each eigenvalue."""
    values, right = np.linalg.eig(found.a)
    left = np.linalg.inv(right)
    n = found.a.shape[0]
    out = []
    for mode in modes:
        k = int(np.argmin(np.abs(values - mode.eigenvalue)))
        gradient = np.array([left[k, row] * right[col, k] if col < n else 0.0 for row, col in found.free])
        real = float(np.sqrt(max(gradient.real @ covariances @ gradient.real, 0.0)))
        imag = float(np.sqrt(max(gradient.imag @ covariances @ gradient.imag, 0.0)))
        out.append(Mode(mode.name, mode.eigenvalue, width * real, width * imag))
    return out
