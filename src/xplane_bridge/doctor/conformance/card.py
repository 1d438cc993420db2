"""Flies the card: asks the questions one after the other, and puts everything back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, List, Sequence, Tuple

from xplane_bridge.doctor import names
from xplane_bridge.doctor.conformance.flight import Flight, NoFlightError
from xplane_bridge.doctor.conformance.journal import Journal, JournalError
from xplane_bridge.doctor.conformance.link import XPlane
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.questions import CARD
from xplane_bridge.doctor.conformance.verdict import Answer, NotTestableError, Verdict

#: How long the first answer is waited for [s].
_PATIENCE_S = 5.0


class CannotRunError(Exception):
    """The card cannot be flown; the text says why and what to do."""


@dataclass(frozen=True)
class Flown:
    """What came of a card.

    Attributes:
        version: X-Plane's, as it gives it.
        answers: By id, in the order asked.
        left: What could not be put back, in words; empty: everything is as it was.
        broken_off: Why the questions after these were not asked; empty: all were.
    """

    version: int
    answers: Dict[str, Answer]
    left: Tuple[str, ...]
    broken_off: str = ""


def chosen(ids: Sequence[str]) -> List[Question]:
    """The questions of these ids, in the order of the card; all where none is given.

    Raises:
        CannotRunError: There is no such id.
    """
    known = [question.id for question in CARD]
    unknown = [id_ for id_ in ids if id_ not in known]
    if unknown:
        raise CannotRunError(f"there is no question {', '.join(unknown)}; there are: {', '.join(known)}")
    return [question for question in CARD if not ids or question.id in ids]


def fly(
    address: str,
    port: int,
    journals: Path,
    questions: Sequence[Question],
    say: Callable[[Question, Answer], None] = lambda _question, _answer: None,
    also: Sequence[str] = (),
) -> Flown:
    """Flies the card.

    Args:
        address: IPv4 address of X-Plane.
        port: UDP port it listens on.
        journals: Folder of the bridge's journals.
        questions: What to ask.
        say: Called with each answer as it comes.
        also: Other IPv4 addresses of X-Plane's computer: a node may have been given one of them.

    Raises:
        CannotRunError: X-Plane does not answer, or a node holds its journal.
    """
    try:
        return _fly(XPlane(address, port, Journal(journals, address, port, also=also)), questions, say)
    except JournalError as error:
        raise CannotRunError(str(error)) from None


def _fly(xplane: XPlane, questions: Sequence[Question], say: Callable[[Question, Answer], None]) -> Flown:
    holders = xplane.journal.holders()
    if holders:
        who = ", ".join(dict.fromkeys(holders))
        raise CannotRunError(f"{who}: end it first, the card flies the aircraft itself")
    answers: Dict[str, Answer] = {}
    left: List[str] = []
    try:
        version = xplane.try_read([names.VERSION], _PATIENCE_S).get(names.VERSION)
        if not version:
            raise CannotRunError(f"nothing answers on {xplane.address}:{xplane.port}: scripts/xplane_doctor says why")
        xplane.version = round(version)
        left += xplane.undo(xplane.journal.orphans())
        broken_off = _ask_all(xplane, questions, answers, left, say)
    finally:
        left += _undo(xplane)
        xplane.close()
    return Flown(xplane.version, answers, tuple(left), broken_off)


def _undo(xplane: XPlane) -> List[str]:
    try:
        return xplane.undo(xplane.journal.own())
    except (JournalError, OSError) as error:  # the answers are to be written all the same
        return [str(error)]


def _ask_all(
    xplane: XPlane,
    questions: Sequence[Question],
    answers: Dict[str, Answer],
    left: List[str],
    say: Callable[[Question, Answer], None],
) -> str:
    """Adds to `answers`, and to `left` what could not be put back; returns why it was broken off, or nothing."""
    try:
        flight = Flight(xplane)
    except NotTestableError as error:
        raise CannotRunError(f"{error}: is a flight loaded, and not paused?") from None
    flying = False
    try:
        for question in questions:
            if question.flies and not flying:
                flight.begin()
                flying = True
            answers[question.id] = _ask(flight, question)
            say(question, answers[question.id])
    except (NoFlightError, NotTestableError, JournalError) as error:
        return str(error)
    except KeyboardInterrupt:
        return "ended by Ctrl-C: the questions after these were not asked"
    finally:
        left += flight.end()
    return ""


def _ask(flight: Flight, question: Question) -> Answer:
    try:
        if question.flies:
            flight.ready()
        return question.check(flight)
    except NotTestableError as error:
        return Answer(Verdict.NOT_TESTABLE, str(error))
