"""Where a recording must not be bridged."""

from __future__ import annotations

from typing import Optional

import numpy as np

#: [s] Two samples further apart than this are a gap.
DEFAULT_MAX_GAP = 0.5
#: Slow samples lie further apart: of them a gap is longer than this many median periods.
_SLOW_PERIODS = 3.0
#: By how many of its float32 steps a simulated time may be off: unwrapped it is kept within two; half a one to spare.
_FLOAT32_STEPS = 2.5


def segments(time: np.ndarray, epoch: Optional[np.ndarray] = None, max_gap: float = DEFAULT_MAX_GAP) -> list[slice]:
    """Cut a recording where it must not be bridged.

    Args:
        time: int64 [ns], shape (n,), non-decreasing inside an epoch.
        epoch: Counter of shape (n,) that changes at resets and jumps; none when omitted.
        max_gap: [s] longest distance of two samples of one segment; of slow samples, three median periods.

    Returns:
        Slices of the samples, in order, that together cover all of them.
    """
    if not len(time):
        return []
    step = np.diff(time)
    onward = step[step > 0]
    longest = max(max_gap * 1e9, _SLOW_PERIODS * float(np.median(onward)) if len(onward) else 0.0)
    cut = (step > longest) | (step < 0)
    if epoch is not None:
        cut |= np.diff(epoch.astype(np.int64)) != 0
    edges = [0, *(np.flatnonzero(cut) + 1).tolist(), len(cut) + 1]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:])]


def rounding(sim_time: np.ndarray) -> np.ndarray:
    """Give by how much simulated times [s], or stamps made of them, may go back though time goes on or stands [s]."""
    out: np.ndarray = _FLOAT32_STEPS * np.spacing(sim_time.astype(np.float32)).astype(np.float64)
    return out


def disordered(epoch: np.ndarray, sim_time: np.ndarray) -> np.ndarray:
    """Find the samples that lie among others of another time: the host's clock, by which they are sorted, was set back.

    Args:
        epoch: Counter of shape (n,) that rises where `sim_time` may begin anew or the clock was set back. It may fall
            where `sim_time` goes on: an rx_node that was started anew counts from 0.
        sim_time: [s] simulated time, which otherwise goes on or stands still.

    Returns:
        Whether a sample lies before it and is later, or behind it and is earlier.
    """
    counted_anew = (np.diff(epoch.astype(np.int64)) < 0) & (np.diff(sim_time) >= -rounding(sim_time[1:]))
    order = np.lexsort((sim_time, epoch, np.cumsum(np.append(False, counted_anew)[: len(epoch)])))
    later = np.abs(np.diff(sim_time[order])) > rounding(sim_time[order[1:]])
    rank = np.zeros(len(epoch), dtype=np.int64)
    rank[order[1:]] = np.cumsum(later)
    out: np.ndarray = (rank < np.maximum.accumulate(rank)) | (rank > np.minimum.accumulate(rank[::-1])[::-1])
    return out
