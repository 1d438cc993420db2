"""Files that are no campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import pytest

from xplane_bridge.campaign.definition import CampaignError, find_controller, load_campaign, substituted

SCENARIO = b"name: s\naircraft: fixed_wing\nevents: [{at: 1, end: true}]\n"
NAMING = b"name: c\nscenario: s.yaml\n"


@pytest.mark.parametrize("flights", [None, 3])
@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", r"c\.yaml: campaign: None; expected a mapping"),
        (b"[]", r"c\.yaml: campaign: \[\]; expected a mapping"),
        (b"name: M\xfcnchen", r"c\.yaml: is not UTF-8 text"),
        (b"name: [", r"c\.yaml: does not parse as YAML: line 1"),
    ],
)
def test_what_is_no_campaign_is_said(tmp_path: Path, content: bytes, flights: Optional[int], said: str) -> None:
    (tmp_path / "c.yaml").write_bytes(content)
    with pytest.raises(CampaignError, match=said):
        load_campaign(tmp_path / "c.yaml", flights)


def test_a_scenario_file_of_a_campaign_is_read_beside_it(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_bytes(NAMING)
    (tmp_path / "s.yaml").write_bytes(SCENARIO)
    assert load_campaign(tmp_path / "c.yaml", 3).flights == 3
    (tmp_path / "s.yaml").write_bytes(SCENARIO + b"description: M\xfcnchen")
    with pytest.raises(CampaignError, match=r"s\.yaml: is not UTF-8 text"):
        load_campaign(tmp_path / "c.yaml")
    with pytest.raises(CampaignError, match=r"d\.yaml: cannot be read: No such file"):
        load_campaign(tmp_path / "d.yaml", 3)


def test_a_parameter_inside_a_text_keeps_all_digits() -> None:
    drawn = {"day": 20240102, "t": 0.123456789, "n": 3.0, "kind": "v2.0"}
    text = substituted({"table": "gains_$day.csv", "note": "$t $n $kind"}, drawn, "arguments")
    assert text == {"table": "gains_20240102.csv", "note": "0.123456789 3 v2.0"}


@pytest.mark.parametrize(
    ("code", "said"),
    [("def fly(state)\n    pass\n", "SyntaxError"), ("gain = 1 / 0\n", "ZeroDivisionError"), ("x = y\n", "'y'")],
)
def test_a_controller_with_a_mistake_in_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, said: str
) -> None:
    (tmp_path / "controller_of_a_test.py").write_text(code)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(CampaignError, match=rf"'controller_of_a_test:fly': controller_of_a_test cannot .*{said}"):
        find_controller("controller_of_a_test:fly")
