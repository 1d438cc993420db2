"""How pages write numbers."""

from __future__ import annotations

import math

import pytest

from xplane_bridge.plotting.page import number


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (9999.4, 4, "9999"),
        (9999.7, 4, "10,000"),
        (-999.6, 3, "-1,000"),
        (99.96, 3, "100"),
        (0.00012345, 3, "0.000123"),
        (1234567.0, 4, "1,234,567"),
        (math.nan, 4, "&ndash;"),
        (-math.inf, 4, "-&infin;"),
    ],
)
def test_a_number_is_written_out(value: float, digits: int, text: str) -> None:
    assert number(value, digits) == text
