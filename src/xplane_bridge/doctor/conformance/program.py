"""`xplane_doctor --conformance`: asks, flies the card, and writes what came of it."""

from __future__ import annotations

import sys
from typing import Sequence

from xplane_bridge.doctor.conformance import card, results
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer
from xplane_bridge.doctor.observe import beacons, target
from xplane_bridge.doctor.settings import Settings

_QUESTION = """\
The card flies X-Plane {where} for about two minutes:
  the flight is placed anew, 1500 m above ground, and never below 300 m;
  stick, surfaces, weather, view and a failure are taken and given back, the flight is loaded again at the end.
  A person at the controls must keep off them. Data Output's target is not given back.
Fly it? [y/N] """


def main(settings: Settings, only: Sequence[str], yes: bool) -> int:
    """Flies the card.

    Args:
        settings: Where X-Plane is.
        only: Ids of the questions; empty: all.
        yes: Not to be asked.

    Returns:
        0 flown, 1 flown but not everything could be put back, 2 it cannot run or was broken off.
    """
    try:
        return _main(settings, only, yes)
    except card.CannotRunError as error:
        print(f"xplane_doctor: {error}", file=sys.stderr)
        return 2


def _main(settings: Settings, only: Sequence[str], yes: bool) -> int:
    questions = card.chosen(only)
    heard = (
        beacons.BeaconWatch()
        if settings.host
        else beacons.listen(settings.beacon_group, settings.beacon_port, settings.listen_s)
    )
    where = target.choose(settings, {}, heard)
    if not where.address:
        raise card.CannotRunError(f"{where.host} has no address: {where.error}")
    if not yes and not _agreed(str(where)):
        raise card.CannotRunError("not flown: answer y, or give --yes")

    def say(question: Question, answer: Answer) -> None:
        print(results.line(question, answer), flush=True)

    flown = card.fly(where.address, where.port, settings.journal_folder, questions, say)
    if flown.answers:
        file = results.file_of(settings.journal_folder, where.address, where.port)
        report = results.store(file, flown, where.address, where.port)
        print(f"written: {file} (the nodes read it at start), {report} (for a bug report)", file=sys.stderr)
    for each in flown.left:
        print(f"xplane_doctor: not put back: {each}", file=sys.stderr)
    if flown.broken_off:
        print(f"xplane_doctor: {flown.broken_off}", file=sys.stderr)
        return 2
    return 1 if flown.left else 0


def _agreed(where: str) -> bool:
    print(_QUESTION.format(where=where), end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")
