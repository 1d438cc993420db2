"""Shares, quantiles and rank correlations of repeated trials, with 95 % intervals."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

#: Two-sided 95 %.
_Z = NormalDist().inv_cdf(0.975)


class Interval(NamedTuple):
    """From `low` to `high`."""

    low: float
    high: float


def wilson(passed: int, trials: int) -> Interval:
    """Wilson's interval of a share; it stays within 0..1 and is useful also where all or none have passed."""
    if trials == 0:
        return Interval(0.0, 1.0)
    share, z2 = passed / trials, _Z * _Z
    centre = (share + z2 / (2.0 * trials)) / (1.0 + z2 / trials)
    half = _Z / (1.0 + z2 / trials) * math.sqrt(share * (1.0 - share) / trials + z2 / (4.0 * trials * trials))
    low = 0.0 if passed == 0 else max(centre - half, 0.0)
    return Interval(low, 1.0 if passed == trials else min(centre + half, 1.0))


class Quantile(NamedTuple):
    """A quantile of what was measured, with an interval for that of all that could be."""

    value: float
    interval: Interval  #: NaN where there are too few values for one


def quantile(values: np.ndarray, share: float) -> Quantile:
    """The quantile by order statistics: nothing is assumed of the distribution; infinite values count as they are.

    The value is the smallest at or below which `share` of the values lie. The interval lies between two of the values,
    so many places apart that a binomial count of those below the quantile falls between them in 95 % of all samples.
    """
    ordered = np.sort(values[~np.isnan(values)])
    n = len(ordered)
    if n == 0:
        return Quantile(math.nan, Interval(math.nan, math.nan))
    value = float(ordered[min(max(math.ceil(share * n) - 1, 0), n - 1)])
    below = _binomial_cumulative(n, share)
    low = int(np.searchsorted(below, 0.025, side="right"))  # the count that is reached with 97.5 %
    high = int(np.searchsorted(below, 0.975, side="left")) + 1
    if low < 1 or high > n:
        return Quantile(value, Interval(math.nan, math.nan))
    return Quantile(value, Interval(float(ordered[low - 1]), float(ordered[high - 1])))


def _binomial_cumulative(n: int, share: float) -> np.ndarray:
    """P(count <= k) for k = 0..n."""
    k = np.arange(n + 1)
    logs = np.array([math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) for i in k])
    return np.cumsum(np.exp(logs + k * math.log(share) + (n - k) * math.log1p(-share)))


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's: -1..1; equal values share their rank; NaN where there is nothing to compare."""
    both = ~(np.isnan(a) | np.isnan(b))
    x, y = _ranks(a[both]), _ranks(b[both])
    if len(x) < 3 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return math.nan
    return float(np.corrcoef(x, y)[0, 1])


def _ranks(values: np.ndarray) -> np.ndarray:
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return (last - (counts - 1) / 2.0)[inverse]
