"""Ports of tests that run side by side: each process draws from a part of its own."""

from __future__ import annotations

from typing import Any

from xplane_bridge.harness import ports

_PROCESSES = 16


def keep_to_own_ports(config: Any, first: int) -> None:
    """Has the free ports of this process be none that other processes draw: another program takes a port some time
    after the draw, and until then it is free.

    Args:
        config: pytest's.
        first: Of these tests' processes, of 16.
    """
    worker = getattr(config, "workerinput", {}).get("workerid", "gw0")
    number = (first + int(worker[len("gw") :])) % _PROCESSES
    size = (ports._END - ports._FIRST) // _PROCESSES
    ports._FIRST += number * size
    ports._END = ports._FIRST + size
