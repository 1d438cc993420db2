"""The watch of the window counts frames only where readings can distinguish them."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import pytest

from xplane_bridge.doctor.conformance import pictures
from xplane_bridge.doctor.conformance.pictures import compare

WANTED = 40


def seen_with(frames_by_reading, frames_by_picture, patience_s=30.0):
    """What is seen where so many frames come before each reading and a picture stays for so many frames."""
    came = itertools.cycle(frames_by_reading)
    now = {"frame": 0, "new": 0}

    def checks():
        while True:
            now["new"] = next(came)
            now["frame"] += now["new"]
            yield now["frame"] // frames_by_picture

    return compare(checks(), lambda: now["new"], WANTED, patience_s)


@pytest.mark.parametrize("frames_by_reading", [(0, 0, 1), (1,), (1, 1, 1, 1, 1, 1, 1, 2)])
def test_a_picture_that_changes_is_distinguished_from_one_that_stays_for_two_frames(frames_by_reading):
    changing, staying = seen_with(frames_by_reading, 1), seen_with(frames_by_reading, 2)
    assert min(changing.frames, staying.frames) >= WANTED
    assert changing.changes == changing.distinct
    assert staying.changes < 0.7 * staying.distinct


def test_readings_in_bursts_do_not_count_as_pictures_that_stay(monkeypatch):
    # A clock of its own, for as many readings on any computer: a millisecond each.
    clock = itertools.count()
    monkeypatch.setattr(pictures, "time", SimpleNamespace(monotonic=lambda: 1e-3 * next(clock)))
    # More readings than frames, but three frames between two of them: a third of the pictures was never seen.
    seen = seen_with((0, 0, 0, 0, 1, 0, 0, 3), 1, patience_s=0.2)
    assert seen.frames == 0
    assert seen.grabs > 2 * WANTED


def test_a_busy_while_is_left_out():
    seen = seen_with((5,) * 20 + (1,) * 100, 2)
    assert seen.frames >= WANTED
    assert seen.changes < 0.7 * seen.distinct
