"""docs/control/failsafes.md: its table is what the emulator's aircraft do, and the shipped ones are right."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from support.flights.failsafe_flights import SHIPPED, STARTS, Outcome, outcomes, table
from xplane_bridge.emulator.aircraft import model_names

DOCUMENT = Path(__file__).resolve().parents[2] / "docs/control/failsafes.md"


@pytest.fixture(scope="module")
def flown() -> list[Outcome]:
    return list(outcomes())


def rows(text: str) -> list[list[str]]:
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]


def test_the_documents_table_is_what_they_fly(flown: list[Outcome]) -> None:
    new = table(flown)
    said, flew = rows(DOCUMENT.read_text(encoding="utf-8")), rows(new)
    assert len(said) == len(flew), new
    for old, now in zip(said, flew):
        for written, measured in zip(old, now):
            assert re.sub(r"-?\d+", "", written) == re.sub(r"-?\d+", "", measured), new
            numbers = [float(number) for number in re.findall(r"-?\d+", measured)]
            # Whole numbers, and another machine's last bits: they grow where an aircraft tumbles.
            assert [float(n) for n in re.findall(r"-?\d+", written)] == pytest.approx(numbers, abs=2.0, rel=0.02), new


def test_every_aircraft_of_the_emulator_was_flown() -> None:
    assert {start.aircraft for start in STARTS} == set(model_names())


def test_the_shipped_failsafes_let_aircraft_live(flown: list[Outcome]) -> None:
    dead = [(o.start.aircraft, o.start.phase, o.moment) for o in flown if o.kind == SHIPPED and not o.lives]
    assert dead == [("tiltrotor", "hover", "throttle low")], "no lever that stays where it is carries it then"
    for start in STARTS:
        steady = next(o for o in flown if (o.start, o.moment, o.kind) == (start, "steady flight", SHIPPED))
        assert abs(steady.sunk_m) < 30.0
