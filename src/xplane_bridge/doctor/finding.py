"""What a check has found out."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, Dict


class Severity(enum.Enum):
    """How much a finding matters."""

    #: As it should be.
    OK = "ok"
    #: Worth knowing when something is looked for; nothing has to be done.
    NOTE = "note"
    #: Something works worse than it could, or will fail under conditions that the text names.
    WARNING = "warning"
    #: Something cannot work.
    PROBLEM = "problem"

    @property
    def counts(self) -> bool:
        """Whether the user has to do something: the exit code is 1 then."""
        return self in (Severity.WARNING, Severity.PROBLEM)


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Attributes:
        id: Names the kind of finding, for programs that read the report; stable.
        severity: How much it matters.
        text: What was found, one line, with the addresses, names and numbers it is about.
        remedy: What to do about it; empty where there is nothing to do.
        facts: The numbers and names of the text, for programs; values that JSON can hold.
    """

    id: str
    severity: Severity
    text: str
    remedy: str = ""
    facts: Dict[str, Any] = field(default_factory=dict)


def ok(id_: str, text: str, **facts: Any) -> Finding:
    """A finding that all is well with something."""
    return Finding(id_, Severity.OK, text, "", facts)


def note(id_: str, text: str, remedy: str = "", **facts: Any) -> Finding:
    """A finding worth knowing."""
    return Finding(id_, Severity.NOTE, text, remedy, facts)


def warning(id_: str, text: str, remedy: str, **facts: Any) -> Finding:
    """A finding that the user has to do something about, though the rest may work."""
    return Finding(id_, Severity.WARNING, text, remedy, facts)


def problem(id_: str, text: str, remedy: str, **facts: Any) -> Finding:
    """A finding of something that cannot work."""
    return Finding(id_, Severity.PROBLEM, text, remedy, facts)
