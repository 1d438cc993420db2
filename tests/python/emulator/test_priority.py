"""Real-time priority, and what ends it."""

from __future__ import annotations

import logging
import os
import sys
import threading
import time

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.emulator import priority
from xplane_bridge.harness.processes import ManagedProcess, wait_until


def granted() -> bool:
    """Whether the system grants it, asked by a thread of its own."""
    policies: list[int] = []

    def ask() -> None:
        priority.RealTimePriority(True)
        policies.append(os.sched_getscheduler(0))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return bool(policies[0] & os.SCHED_FIFO)


@pytest.mark.skipif(not granted(), reason="no real-time priority here")
def test_a_thread_without_rest_gives_it_back_and_one_that_rests_keeps_it(caplog):
    """The policies are the kernel's own words."""
    seen: dict[str, int] = {}
    ended = threading.Event()

    def fly(name: str, work_s: float, rest_s: float) -> None:
        held = priority.RealTimePriority(True)
        while not ended.is_set():
            until = time.thread_time() + work_s
            while time.thread_time() < until:
                pass
            time.sleep(rest_s)
            held.watch()
            seen[name] = os.sched_getscheduler(0)

    def given_back() -> bool:
        return not seen["restless"] & os.SCHED_FIFO

    threads = [
        threading.Thread(target=fly, args=(name, work_s, rest_s))
        for name, work_s, rest_s in (("restless", 0.004, 0.0), ("resting", 0.001, 0.004))
    ]
    try:
        for thread in threads:
            thread.start()
        wait_until(lambda: {"restless", "resting"} <= seen.keys(), WAIT_S, "frame of both")
        wait_until(given_back, WAIT_S, "end of the restless one's priority")
        assert seen["resting"] & os.SCHED_FIFO
    finally:
        ended.set()
        for thread in threads:
            thread.join()
    (record,) = (record for record in caplog.records if record.levelno == logging.WARNING)
    assert "more than 80 % of a processor" in record.message


def test_a_system_without_it_is_no_error(monkeypatch):
    def refused(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    priority.RealTimePriority(True).watch()


@pytest.mark.skipif(not granted(), reason="no real-time priority here")
def test_the_emulator_gives_it_back(tmp_path):
    """With frames that take more than they may at once."""
    program = """
import sys
from xplane_bridge.emulator import priority
from xplane_bridge.cli.xplane_emulator import main
priority._SHARE, priority._PATIENCE_S = 0.0, 0.001
sys.exit(main(["--port", "0", "--bind", "127.0.0.1", "--no-beacon"]))
"""
    with ManagedProcess("emulator", [sys.executable, "-c", program], tmp_path) as emulator:
        emulator.wait_for_line("^READY", WAIT_S)
        emulator.wait_for_line("real-time priority is given back", WAIT_S)
        assert not os.sched_getscheduler(emulator.pid) & os.SCHED_FIFO
