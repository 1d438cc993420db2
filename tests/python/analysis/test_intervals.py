from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.analysis.intervals import quantile, rank_correlation, wilson


def test_wilson_as_published() -> None:
    # 8 of 10: 0.490 .. 0.943; 0 of 10: 0 .. 0.278 (Brown, Cai and DasGupta 2001 give the formula, z = 1.96).
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)
    assert wilson(0, 0) == (0.0, 1.0)


def test_the_median_of_ten_lies_between_the_second_and_the_ninth() -> None:
    # Tables of the sign test: for n = 10 these two hold the median with 97.9 %, third and eighth with 89.1 %.
    got = quantile(np.array([9.0, 2, 7, 4, 5, 6, 3, 8, 1, 10]), 0.5)
    assert got.value == 5.0
    assert got.interval == (2.0, 9.0)


def test_an_extreme_quantile_of_few_values_has_no_interval() -> None:
    got = quantile(np.array([1.0, math.inf, 3.0, math.nan]), 0.95)
    assert got.value == math.inf
    assert all(math.isnan(x) for x in got.interval)
    assert math.isnan(quantile(np.array([math.nan]), 0.5).value)


def test_rank_correlation_with_hours_of_television() -> None:
    # The worked example of many textbooks: -29 / 165.
    iq = np.array([106.0, 100, 86, 101, 99, 103, 97, 113, 112, 110])
    hours = np.array([7.0, 27, 2, 50, 28, 29, 20, 12, 6, 17])
    assert rank_correlation(iq, hours) == pytest.approx(-29.0 / 165.0, abs=1e-12)


def test_equal_values_share_their_rank_and_infinities_are_last() -> None:
    # Ranks 1, 2.5, 2.5, 4 against 1, 2, 3, 4: 4.5 / sqrt(4.5 * 5).
    assert rank_correlation(np.array([0.0, 5, 5, math.inf]), np.array([1.0, 2, 3, 4])) == pytest.approx(
        4.5 / math.sqrt(22.5), abs=1e-12
    )
    assert math.isnan(rank_correlation(np.ones(5), np.arange(5.0)))
