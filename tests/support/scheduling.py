"""Which process runs what, where tests run side by side: long ones begin first, the others keep to their file.

pytest-xdist begins with the files of most tests. Those of few, which fly for minutes, came last then, and the other
processes had nothing to do meanwhile.
"""

from __future__ import annotations

from typing import Any, Sequence


def rank(nodeid: str, long: Sequence[str]) -> int:
    """The number of the name that a test has; as many as there are names when it has none of them.

    Args:
        nodeid: The test's.
        long: Files, which stay whole, and tests by file and beginning, e.g. "test_flights.py::" for all of that file.
    """
    return next((number for number, name in enumerate(long) if f"/{name}" in nodeid), len(long))


def long_ones_first(config: Any, log: Any, long: Sequence[str]) -> Any:
    """A scheduler that gives each test whose name is among these to a process by itself, and the others by file.

    Args:
        config: pytest's.
        log: pytest-xdist's.
        long: As of `rank`, by which the tests are in order already.
    """
    from xdist.scheduler import LoadFileScheduling

    class LongOnesFirst(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            scope: str = nodeid if "::" in [*long, ""][rank(nodeid, long)] else super()._split_scope(nodeid)
            return scope

    config.option.loadscopereorder = False  # before pytest-xdist 3.7, files of many tests still come first
    return LongOnesFirst(config, log)
