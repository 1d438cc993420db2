from __future__ import annotations

import numpy as np

from xplane_bridge.bags.segments import segments


def ns(*seconds: float) -> np.ndarray:
    return np.array([round(s * 10**9) for s in seconds], dtype=np.int64)


def test_segments_cut_at_gaps_epochs_and_backward_time() -> None:
    time = ns(0, 0.1, 0.2, 1.0, 1.1, 0.5, 0.6)
    epoch = np.array([1, 1, 1, 1, 2, 2, 2])
    assert segments(time, epoch) == [slice(0, 3), slice(3, 4), slice(4, 5), slice(5, 7)]
    assert segments(time) == [slice(0, 3), slice(3, 5), slice(5, 7)]
    assert segments(ns()) == []


def test_slow_samples_are_one_segment_and_their_gaps_still_cut() -> None:
    # States at 1 Hz, one of them lost, then silence for ten seconds.
    assert segments(ns(0, 1, 2, 4, 5, 6, 16, 17)) == [slice(0, 6), slice(6, 8)]
    assert segments(ns(0, 0, 0)) == [slice(0, 3)]
    assert segments(ns(5)) == [slice(0, 1)]
