"""What the flight answers."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, Dict


class Verdict(enum.Enum):
    """What the flight says of an assumption."""

    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    #: This aircraft, version or set-up cannot show it.
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class Answer:
    """What the flight says.

    Attributes:
        verdict: Of the assumption.
        text: The numbers it follows from, with units, on one line.
        facts: The same for programs; values that JSON can hold.
    """

    verdict: Verdict
    text: str
    facts: Dict[str, Any] = field(default_factory=dict)


class NotTestableError(Exception):
    """Raised by a question that cannot be settled here; the text says why."""


def judged(confirmed: bool, text: str, **facts: Any) -> Answer:
    """Confirmed or refuted, with the numbers."""
    return Answer(Verdict.CONFIRMED if confirmed else Verdict.REFUTED, text, facts)
