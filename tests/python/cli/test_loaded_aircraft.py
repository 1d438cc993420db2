"""Which aircraft a program may fly: names of config/aircraft against the ICAO code of the one loaded."""

from __future__ import annotations

import pytest

from xplane_bridge.cli.bridge.loaded_aircraft import AircraftError, identities_of, refusal

TWIN, QUAD = {"fixed_wing": ["DA62", "BE58"]}, {"multirotor": ["QUAD"]}


@pytest.mark.parametrize(
    ("identities", "icao", "words"),
    [
        (TWIN, "DA62", ""),
        ({**TWIN, **QUAD}, "QUAD", ""),
        ({"anything": []}, "B738", ""),
        ({}, "B738", ""),
        ({"toy": ["a toy"]}, "", ""),  # by its description, as it has no code
        ({"toy": [" a toy "]}, "", ""),
        ({"nothing": [""]}, "", "but the aircraft loaded is one without"),
        (TWIN, "QUAD", "this is for fixed_wing (DA62, BE58), but the aircraft loaded is QUAD (a toy)"),
        ({**TWIN, **QUAD}, "B738", "fixed_wing (DA62, BE58) or multirotor (QUAD), but the aircraft loaded is B738"),
        (TWIN, "", "but the aircraft loaded is one without ICAO code (a toy)"),
    ],
)
def test_an_aircraft_that_does_not_fit_is_refused_by_both_names(identities: dict, icao: str, words: str) -> None:
    text = refusal(identities, icao, "a toy")
    assert words in text
    assert bool(text) == bool(words)


def test_codes_come_from_the_bridge_before_the_packages_files() -> None:
    codes = identities_of(["fixed_wing", "multirotor", "mine"], {"fixed_wing": ["XX"], "mine": []})
    assert codes["fixed_wing"] == ["XX"]
    assert "QUAD" in codes["multirotor"]
    assert codes["mine"] == []


def test_an_unknown_aircraft_is_said_with_those_there_are() -> None:
    with pytest.raises(AircraftError, match=r"which aircraft is zeppelin\?.*fixed_wing.yaml, .*multirotor.yaml"):
        identities_of(["zeppelin"], {"fixed_wing": []})
