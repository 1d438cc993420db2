from __future__ import annotations

import pytest

from xplane_bridge.analysis.criteria import Criterion
from xplane_bridge.scenario import ScenarioError, parse_scenario

BASE = {"name": "n", "events": [{"at": 0, "hold": {"roll": 0}}, {"at": 5, "label": "fault", "stick": {"roll": 1}}]}


def test_criteria_are_read_from_yaml() -> None:
    scenario = parse_scenario(
        {
            **BASE,
            "criteria": {
                "recovers": {"measure": "settling", "of": "roll", "target": 0, "band": 5, "from": "fault", "below": 4},
                "paired": {"measure": "paired", "above": 0.99},
            },
        }
    )
    assert scenario.criteria == (
        Criterion("recovers", "settling", "roll", 0.0, "fault", None, 5.0, None, 4.0),
        Criterion("paired", "paired", above=0.99),
    )


@pytest.mark.parametrize(
    ("item", "text"),
    [
        ({"measure": "mean", "below": 1}, "criteria.c.measure: 'mean'; expected one of rms"),
        ({"measure": "rms", "of": "roll", "target": 0}, "criteria.c: no bound"),
        ({"measure": "rms", "of": "flaps", "below": 1}, "criteria.c.of: 'flaps'; expected one of roll"),
        ({"measure": "rms", "of": "roll", "below": 1}, "criteria.c.target: missing"),
        ({"measure": "settling", "of": "roll", "target": 0, "below": 1}, "criteria.c.band: missing"),
        (
            {"measure": "maximum", "of": "roll", "below": 1, "from": "x"},
            "criteria.c.from: 'x'; expected seconds, or the",
        ),
        ({"measure": "final", "of": "heading", "target": 0, "below": 5}, "criteria.c.target: does not go with final"),
        (
            {"measure": "rms", "of": "roll", "target": 0, "band": 3, "below": 5},
            "criteria.c.band: does not go with rms; expected it with settling only",
        ),
        ({"measure": "maximum", "of": "roll", "band": 3, "below": 5}, "criteria.c.band: does not go with maximum"),
        ({"measure": "paired", "of": "roll", "above": 1}, "criteria.c.of: does not go with paired"),
        ({"measure": "maximum", "of": "roll", "below": "x"}, "criteria.c.below: 'x'; expected a number"),
        ({"measure": "maximum", "of": "roll", "under": 1}, "criteria.c.under: unknown key"),
        (3, "criteria.c: 3; expected a mapping"),
    ],
)
def test_wrong_criteria_are_named(item: object, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario({**BASE, "criteria": {"c": item}})
    assert text in str(caught.value)
