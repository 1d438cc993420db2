"""X-Plane's loop draws a frame before it flies the next one."""

from __future__ import annotations

import time
from typing import List

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.options import KINEMATIC, Options
from xplane_bridge.emulator.wire.faults import parse_faults

DRAWING_S = 0.045  # at 50 frames/s too long by 25 ms, but less than the 50 ms from which simulated time slows


class SlowView:
    """Takes its time for each picture; fails when asked for the next one before."""

    def __init__(self, emulator: Emulator, pictures: int) -> None:
        self._emulator, self._pictures = emulator, pictures
        self._done_at = 0.0
        self.frames: List[int] = []
        self.periods: List[float] = []
        self.times: List[float] = []
        emulator.view = self

    def show(self, sim) -> None:
        assert self._done_at == 0.0, "the frame before is still being drawn"
        self._done_at = time.monotonic() + DRAWING_S
        self.frames.append(sim.clocks.frame)
        self.periods.append(sim.clocks.wall_period)
        self.times.append(sim.clocks.running)
        self._emulator.stopping = len(self.frames) == self._pictures

    def drawn(self, timeout_s: float) -> bool:
        left = self._done_at - time.monotonic()
        time.sleep(max(0.0, min(left, timeout_s)))
        if left > timeout_s:
            return False
        self._done_at = 0.0
        return True


@pytest.mark.parametrize("fault", ["", "delay=5ms"])
def test_a_frame_lasts_as_long_as_its_picture_takes(fault: str) -> None:
    options = Options(
        bind="127.0.0.1", port=0, beacon=False, aircraft=KINEMATIC, fps=50.0, fault=parse_faults(fault), realtime=False
    )
    emulator = Emulator(options)
    view = SlowView(emulator, 12)
    began = time.monotonic()
    emulator.run()
    elapsed = time.monotonic() - began
    assert view.frames == list(range(1, 13)), "a picture was left out"
    # Each frame but the first lasts what the drawing of the one before took, and says so.
    assert min(view.periods[2:]) > DRAWING_S - 0.001
    assert sum(view.periods[1:]) <= elapsed
    for before, after, period in zip(view.times, view.times[1:], view.periods[1:]):
        assert after - before == pytest.approx(min(period, 1.0 / 19.9), abs=1e-9)


def test_stepped_frames_wait_too() -> None:
    with EmulatorFixture() as bench:
        view = SlowView(bench.emulator, 100)
        bench.step(3)
        assert view.frames == [1, 2, 3]
        assert view.periods == pytest.approx([1.0 / 60.0] * 3)
