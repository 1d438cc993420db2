"""What the exporters share: which topics make a flight, and the latched labels that hold at an instant."""

from __future__ import annotations

import numpy as np

from xplane_bridge.analysis.resampling import held
from xplane_bridge.bags import BagError, Bags, Table

STATE = "xplane_bridge/FlightState"
FRAME_STATE = "xplane_bridge/FrameState"
MODE = "xplane_bridge/ControlMode"
FAILURES = "xplane_bridge/FailureState"
EXCITATION = "xplane_bridge/ExcitationState"
ODOMETRY = "nav_msgs/Odometry"


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
        rows = zip(table["active"], table["kind"], table["target"])
        texts = np.array([f"{kind}:{target}" if on else "" for on, kind, target in rows], dtype=object)
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
