"""What a question of the card asks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.verdict import Answer


@dataclass(frozen=True)
class Question:
    """One line of the card.

    Attributes:
        id: As in `[? id]` in the sources; stable.
        assumes: What the package takes for true.
        check: Finds out; raises NotTestableError.
        flies: Whether it needs an aircraft that flies, and so a flight placed anew.
    """

    id: str
    assumes: str
    check: Callable[[Flight], Answer]
    flies: bool = True
