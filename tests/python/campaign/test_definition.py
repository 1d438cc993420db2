"""Files that are no campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import pytest

from xplane_bridge.campaign.definition import CampaignError, load_campaign

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
