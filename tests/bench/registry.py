"""What benchmarks report, and the list of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, List, Optional


@dataclass
class Measure:
    """One number, and what is wanted of it."""

    name: str
    value: float
    unit: str
    budget: Optional[float] = None  #: the wanted bound; None: only reported
    at_least: bool = False  #: the budget is a lower bound

    @property
    def passed(self) -> Optional[bool]:
        """Whether the budget is kept; None without one."""
        if self.budget is None:
            return None
        return bool(self.value >= self.budget if self.at_least else self.value <= self.budget)


@dataclass
class Context:
    """What a benchmark may use."""

    folder: Path  #: for logs and other files
    seconds: float  #: how long each measurement is to last [s]


Benchmark = Callable[[Context], List[Measure]]
#: All benchmarks by name, in the order they are registered in.
BENCHMARKS: Dict[str, Benchmark] = {}


def benchmark(function: Benchmark) -> Benchmark:
    """Registers a benchmark under its function's name."""
    BENCHMARKS[function.__name__] = function
    return function
