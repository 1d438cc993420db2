"""`xplane_doctor --conformance`: asks, flies the card, and writes what came of it."""

from __future__ import annotations

import sys
from typing import Any, Mapping, Sequence, Tuple

from xplane_bridge.doctor.checks.link import those_of
from xplane_bridge.doctor.conformance import card, results
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer
from xplane_bridge.doctor.observe import beacons, ros, target
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
    where, addresses = _target(settings)
    if not yes and not _agreed(str(where)):
        raise card.CannotRunError("not flown: answer y, or give --yes")

    def say(question: Question, answer: Answer) -> None:
        print(results.line(question, answer), flush=True)

    flown = card.fly(where.address, where.port, settings.journal_folder, questions, say, addresses)
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


def _target(settings: Settings) -> Tuple[target.Target, Tuple[str, ...]]:
    """The X-Plane that is flown, the one that the nodes would take, and the addresses its computer is known by."""
    parameters: Mapping[str, Any] = {}
    heard = beacons.BeaconWatch()
    named = target.choose(settings, parameters, heard)
    # Of this computer, named in full, neither adds anything.
    if not (settings.host and settings.port and named.here):
        parameters = ros.observe(settings.environment, settings.namespace).parameters
        heard = beacons.listen(settings.beacon_group, settings.beacon_port, settings.listen_s)
    where = target.choose(settings, parameters, heard)
    if not where.address:
        raise card.CannotRunError(f"{where.host} has no address: {where.error}")
    found = [seen for seen, _ in target.distinct(heard.sightings)]
    if where.chosen is target.Chosen.BEACON and len(found) > 1:
        raise card.CannotRunError(f"{those_of(found)}; name the one that is to be flown: --host and --port")
    return where, target.addresses_of(where, heard)


def _agreed(where: str) -> bool:
    print(_QUESTION.format(where=where), end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")
