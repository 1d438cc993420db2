"""What the exporters share: which topics make a flight, and the latched labels that hold at an instant."""

from __future__ import annotations

from collections import Counter
from typing import Any, Mapping, Sequence

import numpy as np

from xplane_bridge.analysis.resampling import held
from xplane_bridge.bags import BagError, Bags, Table
from xplane_bridge.bags.cameras import COMPRESSED, RAW, cameras
from xplane_bridge.bags.flight import odometry_topic, state_epochs
from xplane_bridge.errors import XplaneBridgeError

FRAME_STATE = "xplane_bridge/FrameState"
MODE = "xplane_bridge/ControlMode"
FAILURES = "xplane_bridge/FailureState"
EXCITATION = "xplane_bridge/ExcitationState"


class ExportError(XplaneBridgeError):
    """An export that cannot be done; the text is one line with the remedy."""


def full_names(bags: Bags, topics: Sequence[str]) -> list[str]:
    """Give topics their full names, each once.

    One that begins with a slash has it, others are below the bridge's name space.
    """
    names = (topic if topic.startswith("/") else f"{bags.name_space}/{topic}" for topic in topics)
    return list(dict.fromkeys(names))


def refuse_pictures(bags: Bags, topics: Sequence[str]) -> None:
    """Raise `BagError` when one of the topics, by full names, holds pictures: a table of them would be of no use."""
    infos = bags.topics
    for topic in topics:
        if topic in infos and infos[topic].msgtype in (RAW, COMPRESSED):
            msg = f"{topic}: pictures do not go into a table; use --format imagefolder, mcap or ros2"
            raise BagError(msg)


def topic_of(bags: Bags, msgtype: str) -> str:
    """Find the topic of a type that the export cannot do without.

    Raises:
        BagError: The bag has no such topic; the text says what to record.
    """
    topic = bags.topic_of_type(msgtype)
    if topic is None or not bags.topics[topic].count:
        names = ", ".join(str(path) for path in bags.paths)
        msg = f"{names}: no message of type {msgtype}; record that topic (launch/record.launch does)"
        raise BagError(msg)
    return topic


def odometry_of(bags: Bags) -> str:
    """Find the topic of the bridge's odometry, for an export that cannot do without.

    Raises:
        BagError: The bag has no such topic, or several; the text says what to record.
    """
    topic = odometry_topic(bags)
    if topic is None:
        names = ", ".join(str(path) for path in bags.paths)
        msg = (
            f"{names}: no odometry of the bridge; expected odom beside flight_state, or local_position/odom of "
            "mavros.launch; record both (launch/record.launch records odom)"
        )
        raise BagError(msg)
    return topic


def breaks(bags: Bags, state: Table) -> np.ndarray:
    """Count how often time or place has begun anew up to each flight state: a reset, a jump, a new origin of `map`.

    Args:
        bags: From which the states were read.
        state: By stamp, with ``epoch``, ``position_epoch`` and ``sim_time_unwrapped``.
    """
    anew = np.zeros(len(state), dtype=bool)
    for epochs in (state_epochs(bags, state), state["position_epoch"].astype(np.int64)):
        anew[1:] |= np.diff(epochs) != 0
    return np.cumsum(anew)


def quality_bits(constants: Mapping[str, Any]) -> dict[str, int]:
    """Give FrameState's quality bits by their names in words, from the constants of the bag's definition."""
    prefix = "QUALITY_"
    return {k[len(prefix) :].lower().replace("_", " "): int(v) for k, v in constants.items() if k.startswith(prefix)}


def frame_quality(bags: Bags, names: Sequence[str] = ()) -> dict[str, Any]:
    """Count the frames of cameras, the perfect ones, and those with each quality bit; empty without frames.

    Of several cameras also those of each, as `cameras`.

    Args:
        bags: Open bags of one flight.
        names: Of the cameras; all when empty.
    """
    found: dict[str, dict[str, Any]] = {}
    counts: Counter[str] = Counter()
    for camera in cameras(bags):
        if names and camera.name not in names:
            continue
        quality = bags.read(camera.frames, ["quality"])["quality"]
        bits = quality_bits(bags.constants(camera.frames))
        own = {word: int(((quality & bit) != 0).sum()) for word, bit in bits.items()}
        found[camera.name] = {"frames": len(quality), "perfect": int((quality == 0).sum()), "bits": own}
        counts.update(own)
    if not found:
        return {}
    total = {name: sum(part[name] for part in found.values()) for name in ("frames", "perfect")}
    return {**total, "bits": dict(counts), **({"cameras": found} if len(found) > 1 else {})}


def labels(bags: Bags, base: np.ndarray) -> dict[str, np.ndarray]:
    """Give what holds at each instant of `base` [ns]; None before the first label, or without topic.

    Returns:
        ``mode`` (1 manual, 2 automatic), ``failsafe`` (whether the failsafe flew, because the source of that mode was
        silent), ``failures`` (``name:kind:value;...`` of the active ones, empty for none) and ``excitation``
        (``kind:target`` of the running one, empty for none), shape (m,).
    """
    none = np.full(len(base), None, dtype=object)
    out = {"mode": none, "failsafe": none, "failures": none, "excitation": none}
    mode = bags.topic_of_type(MODE)
    if mode and bags.topics[mode].count:
        table = bags.read(mode)
        out["mode"] = _held(base, table, table["mode"])
        out["failsafe"] = _held(base, table, table["failsafe"])
    failures = bags.topic_of_type(FAILURES)
    if failures and bags.topics[failures].count:
        table = bags.read(failures)
        rows = zip(table["names"], table["kinds"], table["values"], table["active"])
        texts = np.array([_failures(*row) for row in rows], dtype=object)
        out["failures"] = _held(base, table, texts)
    excitation = bags.topic_of_type(EXCITATION)
    if excitation and bags.topics[excitation].count:
        table = bags.read(excitation)
        each = zip(table["active"], table["kind"], table["target"])
        texts = np.array([f"{kind}:{target}" if on else "" for on, kind, target in each], dtype=object)
        out["excitation"] = _held(base, table, texts)
    return out


def _held(base: np.ndarray, table: Table, values: np.ndarray) -> np.ndarray:
    order = np.argsort(table.stamp, kind="stable")
    return held(base, table.stamp[order], values[order])


def _failures(names: object, kinds: object, values: object, active: object) -> str:
    parts = []
    for name, kind, value, on in zip(names, kinds, values, active):  # type: ignore[call-overload]
        if on:
            parts.append(f"{name}:{kind}" if np.isnan(value) else f"{name}:{kind}:{float(np.float32(value)):.6g}")
    return ";".join(parts)
