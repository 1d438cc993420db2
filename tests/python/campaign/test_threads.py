from __future__ import annotations

import ctypes
import os
from typing import List

import numpy as np
import pytest

from xplane_bridge.campaign.rows import fly_rows
from xplane_bridge.campaign.threads import loaded_openblas

DOCUMENT = {"name": "c", "scenario": {"name": "s", "aircraft": "fixed_wing", "events": [{"at": 0.05, "end": True}]}}


def called(function: str, *arguments: int) -> List[int]:
    """What that function of each OpenBLAS in this process gives, by whatever name it has there."""
    names = [f"{first}openblas_{function}{last}" for first in ("", "scipy_") for last in ("", "64_", "_64")]
    libraries = [ctypes.CDLL(path) for path in loaded_openblas()]
    return [getattr(library, name)(*arguments) for library in libraries for name in names if hasattr(library, name)]


def test_flights_are_flown_with_one_thread_of_linear_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    np.dot(np.eye(2), np.eye(2))
    if not loaded_openblas():
        pytest.skip("this numpy has no OpenBLAS")
    names = [f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL")]
    for name in names:
        monkeypatch.setenv(name, "")  # so that it is put back, also where it was not set
        monkeypatch.delenv(name)
    called("set_num_threads", 2)
    assert set(called("get_num_threads")) == {2}
    assert fly_rows(DOCUMENT, 0, 1)[0]["outcome"] == "flown"
    assert set(called("get_num_threads")) == {1}
    assert [os.environ[name] for name in names] == ["1"] * 3
