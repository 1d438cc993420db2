"""Judges a recorded flight: what is in the bag, how regular it is, and whether it agrees with what was really flown."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.analysis.consistency import ODOMETRY_LIMIT_MPS
from xplane_bridge.analysis.odometry import differences, of_frames
from xplane_bridge.bags import Bags, Table
from xplane_bridge.bags.segments import segments
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.topics import NAMESPACE
from xplane_bridge.units import EARTH_RADIUS_M

#: Topics without which a flight has not been recorded.
REQUIRED_TOPICS = tuple(
    f"{NAMESPACE}/{name}"
    for name in (
        "flight_state",
        "mission/engines",
        "mission/surfaces",
        "odom",
        "imu/data",
        "global_position/global",
        "link_state",
    )
)

#: Largest share by which flight_state's rate may differ from the emulator's frame rate.
RATE_TOLERANCE = 0.02
#: Largest distance of a position from the truth [m].
POSITION_TOLERANCE_M = 0.01

#: Rows of FlightState that are NaN by their definition in some attitudes or are no numbers.
_NOT_JUDGED = ("header.",)


class CheckError(XplaneBridgeError):
    """A flight cannot be judged: a file is missing or does not hold what it should."""


class Verdict(NamedTuple):
    """The outcome of one check."""

    name: str
    passed: bool
    text: str  #: what was measured, and what was wanted
    judged: bool = True  #: whether there was something to judge; otherwise the text says why not

    @property
    def line(self) -> str:
        """It in a line."""
        word = "FAILED" if not self.passed else "ok" if self.judged else "skipped"
        return f"{word:7}  {self.name:10} {self.text}"


@dataclass
class TopicSummary:
    """How one topic came in."""

    topic: str
    msgtype: str
    count: int
    rate: float  #: [1/s]; NaN for less than three messages
    gaps: int  #: intervals longer than one and a half of the usual (median) one
    longest: float  #: [s] longest interval; NaN for less than two messages
    first: str  #: telling values of the first message
    last: str  #: the same of the last one


# ------------------------------------------------------------------------------------------------------- the table

#: Columns of a message in its line, by its type: label, column, factor, digits. Other types show their first columns.
_SUMMARY_COLUMNS: Mapping[str, Sequence[Tuple[str, str, Optional[float], int]]] = {
    "xplane_bridge/FlightState": (
        ("alt", "altitude_msl", 1.0, 0),
        ("roll", "roll_deg", 1.0, 1),
        ("hdg", "heading_true_deg", 1.0, 0),
        ("TAS", "true_airspeed", 1.0, 1),
    ),
    "xplane_bridge/LinkState": (("", "state_name", None, 0),),
    "xplane_bridge/ControlMode": (("", "reason", None, 0),),
    "xplane_bridge/FrameState": (("frame", "frame_sim_time", 1.0, 2), ("age", "state_age", 1.0, 3)),
    "nav_msgs/Odometry": (
        ("x", "pose.pose.position.x", 1.0, 1),
        ("y", "pose.pose.position.y", 1.0, 1),
        ("z", "pose.pose.position.z", 1.0, 1),
    ),
    "sensor_msgs/Imu": (
        ("fx", "linear_acceleration.x", 1.0, 2),
        ("fy", "linear_acceleration.y", 1.0, 2),
        ("fz", "linear_acceleration.z", 1.0, 2),
    ),
    "sensor_msgs/NavSatFix": (("lat", "latitude", 1.0, 6), ("lon", "longitude", 1.0, 6), ("alt", "altitude", 1.0, 1)),
    "geometry_msgs/TwistWithCovarianceStamped": (
        ("x", "twist.twist.linear.x", 1.0, 1),
        ("y", "twist.twist.linear.y", 1.0, 1),
        ("z", "twist.twist.linear.z", 1.0, 1),
    ),
}
_SHOWN_COLUMNS = 2


def summarise(bag: Path) -> List[TopicSummary]:
    """One line for each topic of a bag, by name.

    Raises:
        BagError: The bag cannot be read.
    """
    lines = []
    with Bags(bag) as bags:
        for name, info in sorted(bags.topics.items()):
            lines.append(summarise_table(bags.read(name)) if info.count else _empty(name, info.msgtype))
    return lines


def _empty(topic: str, msgtype: str) -> TopicSummary:
    return TopicSummary(topic, msgtype, 0, math.nan, 0, math.nan, "", "")


def summarise_table(table: Table) -> TopicSummary:
    """The line of one topic."""
    steps = np.diff(table.time) / 1e9
    rate = longest = math.nan
    gaps = 0
    if len(steps) and table.time[-1] > table.time[0]:
        rate = len(steps) / ((table.time[-1] - table.time[0]) / 1e9) if len(steps) > 1 else math.nan
        longest = float(steps.max())
        gaps = int(np.count_nonzero(steps > 1.5 * np.median(steps)))
    first, last = (_row_summary(table, row) for row in (0, -1))
    return TopicSummary(table.topic, table.msgtype, len(table), rate, gaps, longest, first, last)


def _row_summary(table: Table, row: int) -> str:
    parts = (
        _SUMMARY_COLUMNS.get(table.msgtype)
        or [
            (name.rsplit(".", 1)[-1], name, 1.0, 2)
            for name, column in table.columns.items()
            if column.ndim == 1 and column.dtype.kind == "f" and not name.startswith((*_NOT_JUDGED, "sim_time"))
        ][:_SHOWN_COLUMNS]
    )
    words = []
    for label, column, factor, digits in parts:
        if column not in table:
            continue
        value = table[column][row]
        if isinstance(value, np.floating) and math.isnan(value):
            continue
        text = str(value) if factor is None else f"{value * factor:.{digits}f}"
        words.append(f"{label} {text}".strip())
    return ", ".join(words)


def render(summaries: Sequence[TopicSummary]) -> str:
    """The summaries as a text table."""
    head = ("topic", "messages", "rate/Hz", "gaps", "longest/ms", "first", "last")
    rows = [
        (
            line.topic,
            str(line.count),
            "-" if math.isnan(line.rate) else f"{line.rate:.2f}",
            str(line.gaps),
            "-" if math.isnan(line.longest) else f"{line.longest * 1e3:.0f}",
            line.first,
            line.last,
        )
        for line in summaries
    ]
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    right = (False, True, True, True, True, False, False)

    def line_of(row: Sequence[str]) -> str:
        cells = (cell.rjust(w) if r else cell.ljust(w) for cell, w, r in zip(row, widths, right))
        return "  ".join(cells).rstrip()

    return "\n".join([line_of(head), line_of(["-" * width for width in widths]), *map(line_of, rows)])


def pairing_text(bag: Path) -> str:
    """One line on the camera pictures of a bag and their states.

    Raises:
        BagError: The bag cannot be read.
    """
    with Bags(bag) as bags:
        topic = bags.topic_of_type("xplane_bridge/FrameState")
        if topic is None or not bags.topics[topic].count:
            return "no pictures: there is no camera/frame_state"
        bits = bags.constants(topic)
        quality = bags.read(topic, ["quality"])["quality"]
    missing = (quality & bits["QUALITY_STATE_MISSING"]) != 0
    other = (quality & (bits["QUALITY_OFF_FRAME"] | bits["QUALITY_INTERPOLATED"])) != 0
    share = 100.0 * float(np.mean(~missing & ~other))
    return f"pictures: {len(quality)}, {share:.1f} % with the state of their frame, {missing.sum()} without a state"


# ------------------------------------------------------------------------------------------------------- the checks


def judge(bag: Path, truth: Path) -> List[Verdict]:
    """All checks of a flight.

    Args:
        bag: the recording.
        truth: the emulator's `--truth` file of the same flight.

    Raises:
        BagError: The bag cannot be read.
        CheckError: The truth cannot be read.
    """
    with Bags(bag) as bags:
        verdicts = [_topics_are_there(bags)]
        if not verdicts[0].passed:
            return verdicts
        states = bags.read(f"{NAMESPACE}/flight_state")
        odom = bags.read(f"{NAMESPACE}/odom")
        valid_all = int(bags.constants(f"{NAMESPACE}/flight_state")["VALID_ALL"])
    flown = read_truth(truth)
    verdicts.append(check_validity(states, valid_all))
    verdicts.append(check_numbers(states))
    verdicts.append(check_stamps(states))
    verdicts.append(check_rate(states, flown))
    verdicts.append(check_positions(states, flown))
    verdicts.append(check_odometry(odom, states))
    return verdicts


def _topics_are_there(bags: Bags) -> Verdict:
    missing = [topic for topic in REQUIRED_TOPICS if topic not in bags.topics or not bags.topics[topic].count]
    text = f"{len(REQUIRED_TOPICS)} required topics recorded"
    return Verdict("topics", not missing, f"nothing on {', '.join(missing)}" if missing else text)


def check_validity(states: Table, valid_all: int) -> Verdict:
    """Every validity bit is set in every flight state."""
    never_all = np.bitwise_and(states["valid"].astype(np.int64), valid_all) != valid_all
    if not never_all.any():
        return Verdict("validity", True, f"all bits set in all {len(states)} flight states")
    cleared = int(np.bitwise_or.reduce(valid_all & ~states["valid"].astype(np.int64)))
    bits = [str(1 << k) for k in range(32) if cleared & (1 << k)]
    text = f"{int(never_all.sum())} of {len(states)} flight states lack bits, among them VALID_ bits {', '.join(bits)}"
    return Verdict("validity", False, text)


def check_numbers(states: Table) -> Verdict:
    """No flight state has a NaN or an infinity in it."""
    bad = {
        name: int(np.count_nonzero(~np.isfinite(column)))
        for name, column in states.columns.items()
        if column.dtype.kind == "f"
    }
    bad = {name: count for name, count in bad.items() if count}
    text = ", ".join(f"{name} ({count})" for name, count in sorted(bad.items()))
    return Verdict("numbers", not bad, f"not finite: {text}" if bad else "no NaN in any flight state")


def check_stamps(states: Table) -> Verdict:
    """Stamps strictly increase within an epoch."""
    backward = (np.diff(states.stamp) <= 0) & (np.diff(states["epoch"].astype(np.int64)) == 0)
    count = int(np.count_nonzero(backward))
    return Verdict("stamps", not count, f"{count} stamps do not increase" if count else "stamps strictly increase")


def check_rate(states: Table, truth: Mapping[str, np.ndarray]) -> Verdict:
    """Flight states come at the emulator's frame rate: as many as it made frames in the same simulator time."""
    first, last = states["sim_time"][0], states["sim_time"][-1]
    frames = int(np.count_nonzero((truth["sim_time"] >= first) & (truth["sim_time"] <= last)))
    share = len(states) / max(frames, 1)
    text = f"{len(states)} flight states for {frames} frames ({share:.1%}; wanted 100 % +- {RATE_TOLERANCE:.0%})"
    return Verdict("rate", abs(share - 1.0) <= RATE_TOLERANCE, text)


def check_positions(states: Table, truth: Mapping[str, np.ndarray]) -> Verdict:
    """Each position is the emulator's at the same frame."""
    order = np.argsort(truth["sim_time"], kind="stable")
    index = np.searchsorted(truth["sim_time"][order], states["sim_time"])
    index = order[np.minimum(index, len(order) - 1)]
    same = truth["sim_time"][index] == states["sim_time"]
    if not same.all():
        text = f"{int((~same).sum())} flight states carry a simulator time that the emulator never had"
        return Verdict("positions", False, text)
    radius = EARTH_RADIUS_M + truth["altitude_m"][index]
    north = np.radians(states["latitude"] - truth["latitude_deg"][index]) * radius
    east = np.radians(states["longitude"] - truth["longitude_deg"][index]) * radius
    east *= np.cos(np.radians(truth["latitude_deg"][index]))
    up = states["altitude_msl"] - truth["altitude_m"][index]
    worst = float(np.sqrt(north**2 + east**2 + up**2).max())
    text = f"at most {worst * 1e3:.1f} mm from the truth (wanted {POSITION_TOLERANCE_M * 1e3:.0f} mm)"
    return Verdict("positions", worst <= POSITION_TOLERANCE_M, text)


def check_odometry(odom: Table, states: Table) -> Verdict:
    """Odom's position, differenced over a second of simulator time, is its mean twist turned into `map`."""
    parts = segments(states.stamp, states["epoch"])
    difference = differences(of_frames(odom.stamp, odom.columns, states.stamp, states["sim_time_unwrapped"], parts))
    if not len(difference):
        return Verdict("odometry", False, "less than 1 s of odometry without a gap")
    worst = float(np.abs(difference).max())
    text = f"position and twist agree to {worst:.4f} m/s over 1 s (wanted {ODOMETRY_LIMIT_MPS:g} m/s)"
    return Verdict("odometry", worst <= ODOMETRY_LIMIT_MPS, text)


def read_truth(path: Path) -> Dict[str, np.ndarray]:
    """Reads the emulator's `--truth` file: simulator time (float32, as on the wire) and position of each frame.

    Raises:
        CheckError: It is not there, or not such a file.
    """
    wanted = ("sim_time", "latitude_deg", "longitude_deg", "altitude_m")
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        msg = f"{path}: {error.strerror}"
        raise CheckError(msg) from None
    try:
        columns = {name: np.array([float(row[name]) for row in rows]) for name in wanted}
    except (KeyError, TypeError, ValueError) as error:
        msg = f"{path}: not a truth file of the emulator with the columns {', '.join(wanted)} ({error!r})"
        raise CheckError(msg) from None
    if not rows:
        msg = f"{path}: the emulator wrote no frame into it"
        raise CheckError(msg)
    # The wire carries simulator time as float32; the truth file may hold more digits.
    columns["sim_time"] = columns["sim_time"].astype(np.float32)
    return columns
