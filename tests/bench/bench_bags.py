"""Benchmarks of reading bags: arrays of an hour against the rosbag API and plain rosbags, and memory."""

from __future__ import annotations

import importlib.util
import shutil
import time
from pathlib import Path
from typing import List

import numpy as np
from registry import Context, Measure, benchmark
from rosbags.highlevel import AnyReader

from support.flights.long_recording import READERS, peak_mb, write_long_recording
from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.harness import HarnessError

_TOPIC = "/xplane/flight_state"
#: [1/s] One hour is 360 000 messages; the peers read a tenth of it, which is long enough for a rate.
_RATE = 100
_PEER_SHARE = 10


def _minutes(context: Context) -> float:
    """How much flight is read: an hour by default (20 s), less for shorter measurements, never more."""
    return min(60.0, 3.0 * context.seconds)


@benchmark
def bags(context: Context) -> List[Measure]:
    """One hour of flight states at 100 Hz to arrays of all columns (3 minutes of it a second of --seconds)."""
    _require_rosbag()
    context.folder.mkdir(parents=True, exist_ok=True)
    minutes = _minutes(context)
    long, short = context.folder / "long.bag", context.folder / "short.bag"
    count = round(60.0 * minutes * _RATE)
    _write(long, count)
    _write(short, max(1, count // _PEER_SHARE))
    began = time.perf_counter()
    with Bags(long) as reader:
        table = reader.read(_TOPIC)
    long_s = time.perf_counter() - began
    ours = len(table) / long_s
    rosbag_api, rosbags = _rosbag_api(short, table.columns), _rosbags(short, table.columns)
    return [
        Measure(f"{minutes:g} minutes at 100 Hz to arrays, all columns", long_s, "s"),
        Measure("messages read / written", len(table) / count, "-", budget=1.0, at_least=True),
        Measure("ours / rosbag Python API", ours / rosbag_api, "times", budget=10.0, at_least=True),
        Measure("ours / plain rosbags deserialisation", ours / rosbags, "times", budget=2.5, at_least=True),
    ]


@benchmark
def bag_memory(context: Context) -> List[Measure]:
    """Largest memory of what reads an hour of all topics and pictures (20 GB; 3 minutes a second of --seconds)."""
    context.folder.mkdir(parents=True, exist_ok=True)
    minutes = _minutes(context)
    short, long = context.folder / "short.bag", context.folder / "long.bag"
    write_long_recording(short, 1.0)
    write_long_recording(long, 60.0 * minutes)
    measures = []
    for name in READERS:
        alone = peak_mb(name, short, context.folder / "out")
        peak = peak_mb(name, long, context.folder / "out")
        shutil.rmtree(context.folder / "out")
        measures.append(Measure(f"{name}: {minutes:g} minutes", peak, "MB", budget=500.0))
        measures.append(Measure(f"{name}: a second, imports and code", alone, "MB"))
    long.unlink()
    return measures


def _require_rosbag() -> None:
    if importlib.util.find_spec("rosbag") is None:
        msg = "the rosbag API is not there to compare with: apt-get install python3-rosbag (scripts/setup does)"
        raise HarnessError(msg)


def _write(path: Path, count: int) -> None:
    path.unlink(missing_ok=True)
    with FlightBag(path) as bag:
        bag.add(_TOPIC, "xplane_bridge/FlightState", stamp_ns(0.0), bag.state(0.0, 0))
        name = "xplane_bridge/msg/FlightState"
        message = bag.definitions.message(name, bag.state(0.0, 0))
        for k in range(1, count):
            message.header.seq, message.sim_time_unwrapped, message.roll_deg = k, k / _RATE, float(k % 90)
            raw = bytes(bag.definitions.store.serialize_ros1(message, name))
            bag.add_raw(_TOPIC, "xplane_bridge/FlightState", stamp_ns(k / _RATE), raw)


def _value(message: object, path: str) -> object:
    for part in path.split("."):
        message = getattr(message, part)
    return message


def _collect(messages: object, columns: object) -> int:
    """What a user of message objects does: all columns into lists, then into arrays."""
    paths = [path for path in columns if not path.startswith("header.")]
    rows = [[_value(message, path) for path in paths] for message in messages]
    arrays = [np.array(column) for column in zip(*rows)]
    assert len(arrays) == len(paths)
    return len(rows)


def _rosbag_api(path: Path, columns: object) -> float:
    import rosbag

    began = time.perf_counter()
    with rosbag.Bag(str(path)) as bag:
        count = _collect((message for _, message, _ in bag.read_messages(topics=[_TOPIC])), columns)
    return count / (time.perf_counter() - began)


def _rosbags(path: Path, columns: object) -> float:
    began = time.perf_counter()
    with AnyReader([path]) as reader:
        messages = (reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages())
        count = _collect(messages, columns)
    return count / (time.perf_counter() - began)
