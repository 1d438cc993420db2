"""How good a recording is: rates, gaps and jitter of a topic, validity of the state, pairing of the images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping, NamedTuple, Sequence

import numpy as np

#: A pause of more than this many median periods counts as a gap.
GAP_FACTOR = 3.0

#: FrameState's bits that make an image unfit for learning. The others only say what was assumed.
BAD_QUALITY = (
    "QUALITY_STATE_MISSING",
    "QUALITY_OFF_FRAME",
    "QUALITY_DISPLAY_UNKNOWN",
    "QUALITY_CLOCK_UNSURE",
    "QUALITY_FROZEN",
    "QUALITY_BLACK",
    "QUALITY_PAUSED",
    "QUALITY_REPLAY",
    "QUALITY_EXTERNAL_VIEW",
    "QUALITY_EPOCH_EDGE",
)

#: What FrameState's bits say of an image, for people who do not know the message.
QUALITY_WORDS = {
    "STATE_MISSING": "no state could be paired with it",
    "INTERPOLATED": "its state lies between two received ones, which come more slowly than frames",
    "OFF_FRAME": "its state is not of the very frame, but of one close by",
    "DISPLAY_UNKNOWN": "when it appeared was not seen: it has the time at which it was read",
    "CLOCK_UNSURE": "the simulator's clock was not known to half a frame",
    "FROZEN": "the window stood still while the aircraft moved",
    "BLACK": "it is black, or almost",
    "PAUSED": "the simulator stood still",
    "REPLAY": "the simulator played a replay",
    "VIEW_UNKNOWN": "X-Plane did not say where its camera looks: the configured view is assumed",
    "FOV_ASSUMED": "X-Plane did not say its field of view, or says two: the configured one is assumed",
    "EXTERNAL_VIEW": "the camera is outside the aircraft",
    "EPOCH_EDGE": "its frame lies at a reset, a pause or a gap",
    "DELAY_ASSUMED": "the delay of the display was not measured: the state may be frames off",
    "BORDERLINE": "half way between two frames, or seen late: the state may be one frame off",
    "POSE_UNSURE": "where the camera was in the aircraft is not settled",
}


@dataclass(frozen=True)
class Timing:
    """When the messages of a topic came."""

    count: int
    duration: float  #: [s] first to last
    rate: float  #: [1/s] mean; NaN with fewer than two messages
    period: float  #: [s] median; NaN with fewer than two messages
    jitter: float  #: [s] standard deviation of the periods, gaps left out
    gaps: int  #: pauses longer than `GAP_FACTOR` periods
    longest_gap: float  #: [s] the longest pause between two messages
    backward: int  #: steps back in time


def timing(time: np.ndarray) -> Timing:
    """Describe when messages came.

    Args:
        time: int64 [ns], shape (n,), in the order of arrival.
    """
    count = len(time)
    if count < 2:
        return Timing(count, 0.0, float("nan"), float("nan"), float("nan"), 0, float("nan"), 0)
    periods = np.diff(time) / 1e9
    median = float(np.median(periods))
    gaps = periods > GAP_FACTOR * median if median > 0 else np.zeros(len(periods), dtype=bool)
    duration = float((time[-1] - time[0]) / 1e9)
    kept = periods[~gaps]
    return Timing(
        count,
        duration,
        (count - 1) / duration if duration > 0 else float("nan"),
        median,
        float(np.std(kept)) if len(kept) else float("nan"),
        int(gaps.sum()),
        float(periods.max()),
        int((periods < 0).sum()),
    )


def bit_shares(values: np.ndarray, constants: Mapping[str, int], prefix: str) -> dict[str, float]:
    """Give for each single-bit constant (``VALID_POSITION``) the share of messages that have it set, 0 to 1."""
    out = {}
    for name, bit in constants.items():
        if name.startswith(prefix) and bit > 0 and bit & (bit - 1) == 0:
            share = np.mean((values.astype(np.int64) & bit) != 0) if len(values) else float("nan")
            out[name[len(prefix) :]] = float(share)
    return out


class Pace(NamedTuple):
    """How fast a simulator ran; pauses and gaps left out."""

    host: float  #: [s] of real time
    simulated: float  #: [s] of the simulator, by the speed of time that was asked of it
    slowest: float  #: [1/s] frames in the worst second of real time; NaN where not known
    fastest: float  #: [1/s] frames in the best one

    @property
    def factor(self) -> float:
        """How many times as long as it should simulated time took; NaN where there is none."""
        return self.host / self.simulated if self.simulated > 0.0 else float("nan")


def pace(time: np.ndarray, state: Mapping[str, np.ndarray], parts: list[slice], asked: np.ndarray) -> Pace:
    """Compare the simulator's time with the host's.

    Args:
        time: Stamps, int64 [ns], shape (n,).
        state: Columns of FlightState.
        parts: Segments of the flight states.
        asked: Speed of the simulator's time that was asked for, 1 real time, shape (n,).
    """
    pairs = [np.arange(part.start, part.stop - 1) for part in parts if part.stop - part.start > 1]
    k = np.concatenate(pairs) if pairs else np.empty(0, dtype=int)
    sim, paused = state["sim_time_unwrapped"], state["paused"].astype(bool)
    k = k[(sim[k + 1] > sim[k]) & ~paused[k] & ~paused[k + 1]]
    if not len(k):
        return Pace(0.0, 0.0, float("nan"), float("nan"))
    host, simulated = (time[k + 1] - time[k]) / 1e9, sim[k + 1] - sim[k]
    period = state["frame_period"][k + 1]
    # The period is one of real time: a frame simulates as many times as long.
    frames = simulated / (np.where(period > 0.0, period, np.nan) * np.maximum(asked[k + 1], 1.0))
    second = np.cumsum(host).astype(int)
    spans, counts = np.bincount(second, host), np.bincount(second, frames)
    rates = counts[spans > 0.5] / spans[spans > 0.5]
    ends = (float(rates.min()), float(rates.max())) if len(rates) else (float("nan"), float("nan"))
    return Pace(float(host.sum()), float(np.sum(simulated / asked[k + 1])), *ends)


class Pairing(NamedTuple):
    """How images and states were paired."""

    images: int
    perfect: float  #: share of images with quality 0
    with_state: float  #: share of images with a state
    error_p50: float  #: [s] |simulator time of the state - of the picture|
    error_p95: float  #: [s]
    error_max: float  #: [s]
    dropped: int  #: pictures seen but not published, from the first image on
    frozen: int  #: images flagged frozen, likewise
    unpaired: int  #: images without a state, likewise


def pairing(frames: Mapping[str, np.ndarray], constants: Mapping[str, int]) -> Pairing:
    """Describe the pairing of a camera's images.

    Args:
        frames: Columns of FrameState, in time order; each of shape (n,).
        constants: Of FrameState.
    """
    nan = float("nan")
    quality = frames["quality"].astype(np.int64)
    if not len(quality):
        return Pairing(0, nan, nan, nan, nan, nan, 0, 0, 0)
    missing = (quality & int(constants["QUALITY_STATE_MISSING"])) != 0
    frozen = (quality & int(constants["QUALITY_FROZEN"])) != 0
    error = np.abs(frames["sim_time_error"][np.isfinite(frames["sim_time_error"])])
    p50, p95, worst = np.percentile(error, [50, 95, 100]) if len(error) else (nan, nan, nan)
    return Pairing(
        len(quality),
        float(np.mean(quality == 0)),
        float(np.mean(~missing)),
        float(p50),
        float(p95),
        float(worst),
        _counted(frames["dropped"], 0),
        _counted(frames["frozen"], int(frozen[0])),
        _counted(frames["unpaired"], int(missing[0])),
    )


class Joined(NamedTuple):
    """How the pictures of several cameras join by the simulator's frame that they show."""

    frames: tuple[int, ...]  #: of each camera: frames that it has a picture of
    of_any: int  #: frames that at least one camera has a picture of
    of_all: int  #: frames that every camera has one of
    perfect: int  #: of these, those with quality 0 on every picture
    rows: tuple[np.ndarray, ...]  #: of each camera: its pictures of the frames that all have, frame by frame


_FRAME_KEY = np.dtype([("epoch", np.int64), ("sim_time", np.float64)])


def joined(cameras: Sequence[Mapping[str, np.ndarray]], constants: Mapping[str, int]) -> Joined:
    """Join pictures of one frame: X-Plane draws all its windows of one frame's state, so their keys are equal.

    A picture without a state, or of a paused simulator, is of no frame that is known.

    Args:
        cameras: Columns of FrameState of each, in time order; each of shape (n,).
        constants: Of FrameState.
    """
    keys, rows = [], []
    for columns in cameras:
        missing = (columns["quality"].astype(np.int64) & int(constants["QUALITY_STATE_MISSING"])) != 0
        known = np.flatnonzero(np.isfinite(columns["frame_sim_time"]) & ~missing)
        key = np.empty(len(known), dtype=_FRAME_KEY)
        key["epoch"], key["sim_time"] = columns["state.epoch"][known], columns["frame_sim_time"][known]
        distinct, first = np.unique(key, return_index=True)
        keys.append(distinct)
        rows.append(known[first])
    _, frame, count = np.unique(np.concatenate(keys), return_inverse=True, return_counts=True)
    of_all = np.split(count[frame] == len(cameras), np.cumsum([len(key) for key in keys])[:-1])
    shared = tuple(row[inside] for row, inside in zip(rows, of_all))
    perfect = np.all([columns["quality"][row] == 0 for columns, row in zip(cameras, shared)], axis=0)
    return Joined(tuple(map(len, keys)), len(count), len(shared[0]), int(np.sum(perfect)), shared)


def _counted(counter: np.ndarray, first: int) -> int:
    """Returns how far a node's counter went during the recording.

    Args:
        counter: Since the node's start, which begins anew at 0 when the node does; shape (n,).
        first: What the first message itself counts; what came before it is not of this recording.
    """
    steps = np.diff(counter.astype(np.int64))
    return first + int(np.where(steps < 0, counter[1:], steps).sum())
