"""Which process runs what, where tests run side by side: long ones begin first, the others keep to their file.

pytest-xdist begins with the files of most tests. Those of few, which fly for minutes, came last then, and the other
processes had nothing to do meanwhile.
"""

from __future__ import annotations

import itertools
import os
from typing import Any, Optional, Sequence


def rank(nodeid: str, long: Sequence[str]) -> int:
    """The number of the name that a test has; as many as there are names when it has none of them.

    Args:
        nodeid: The test's.
        long: Files, which stay whole, and tests by file and beginning, e.g. "test_flights.py::" for all of that file.
    """
    return next((number for number, name in enumerate(long) if f"/{name}" in nodeid), len(long))


def long_ones_first(config: Any, log: Any, long: Sequence[str], busy: Sequence[str] = (), at_once: int = 0) -> Any:
    """A scheduler that gives each test whose name is among these to a process by itself, and the others by file.

    Tests that wait for simulated time leave the processors to others, so more processes than processors are of use; but
    only so many of them run tests that keep a processor busy.

    Args:
        config: pytest's.
        log: pytest-xdist's.
        long: As of `rank`, by which the tests are in order already.
        busy: Folders and files of tests that keep a processor busy, e.g. "flights/".
        at_once: How many processes run such ones at once; 0: two more than there are processors, as each of them also
            waits at times.
    """
    from xdist.scheduler import LoadFileScheduling

    lanes = at_once or len(os.sched_getaffinity(0)) + 2

    class LongOnesFirst(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            scope: str = nodeid if "::" in [*long, ""][rank(nodeid, long)] else super()._split_scope(nodeid)
            return scope

        def _assign_work_unit(self, node: Any) -> None:
            scope = self._next_of(node)
            if scope is not None:
                self.workqueue.move_to_end(scope, last=False)
                super()._assign_work_unit(node)

        def _reschedule(self, node: Any) -> None:
            if self.workqueue and not node.shutting_down and self._next_of(node) is None:
                node.shutdown()  # after what it has; the rest is for those that run busy ones already
                return
            super()._reschedule(node)

        def _next_of(self, node: Any) -> Optional[str]:
            others = sum(self._is_at_busy(other) for other in self.assigned_work if other is not node)
            busy_ones = (scope for scope in self.workqueue if _is_busy(scope) and others < lanes)
            waiting_ones = (scope for scope in self.workqueue if not _is_busy(scope))
            return next(itertools.chain(busy_ones, waiting_ones), None)

        def _is_at_busy(self, node: Any) -> bool:
            units = self.assigned_work[node].items()
            return any(_is_busy(scope) and not all(unit.values()) for scope, unit in units)

    def _is_busy(scope: str) -> bool:
        return rank(scope, busy) < len(busy)

    config.option.loadscopereorder = False  # before pytest-xdist 3.7, files of many tests still come first
    return LongOnesFirst(config, log)
