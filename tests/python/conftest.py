"""The order of these tests where they run side by side."""

from __future__ import annotations

from typing import Any

import pytest

from support.interrupts import heed_ctrl_c
from support.scheduling import long_ones_first, rank
from support.worker_ports import keep_to_own_ports

#: Files and tests that take long, the longest first.
LONG = (
    "bags/test_long_recordings.py",
    "identification/test_identify.py",
    "gym/test_learner.py::test_stable",
    "test_failsafes.py",
    "controllers/test_flights.py",
    "campaign/test_runner.py",
)


heed_ctrl_c()


def pytest_configure(config: pytest.Config) -> None:
    """Before any test draws a port."""
    keep_to_own_ports(config, 16)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Replaces pytest-xdist's own order of tests."""
    return long_ones_first(config, log, LONG)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts long tests first."""
    items.sort(key=lambda item: rank(item.nodeid, LONG))
