"""A campaign whose file names its parameters in another order: draws go to parameters by their order."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, List

import pandas as pd
import pytest

from xplane_bridge.campaign.definition import Campaign
from xplane_bridge.campaign.runner import PARTS, TABLE
from xplane_bridge.cli import run_campaign

PARAMETERS = {"share": {"uniform": [0, 10]}, "height": {"uniform": [0, 200]}}


def fly(folder: Path, parameters: dict) -> int:
    document = {
        "name": "c",
        "parameters": parameters,
        "flights": 14,
        "sampling": "sobol",
        "scenario": {
            "name": "s",
            "description": "$share of $height m",
            "aircraft": "fixed_wing",
            "start": {"speed": 70, "altitude": 1000},
            "criteria": {"high": {"measure": "maximum", "of": "roll", "below": 90}},
            "events": [{"at": 0.1, "end": True}],
        },
    }
    path = folder.with_suffix(".yaml")
    path.write_text(json.dumps(document), encoding="utf-8")
    return run_campaign.main([str(path), "-o", str(folder), "--workers", "0"])


def test_a_folder_is_flown_on_in_the_order_in_which_it_was_begun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "c"
    assert fly(folder, PARAMETERS) == 0
    whole = pd.read_parquet(folder / TABLE)
    (folder / PARTS / "flights-00000010-0004.parquet").unlink()
    (folder / TABLE).unlink()
    drawn: List[Campaign] = []

    def write_page(_folder: Any, campaign: Campaign, _table: pd.DataFrame) -> None:
        drawn.append(campaign)

    monkeypatch.setattr(run_campaign, "write_page", write_page)
    assert fly(folder, {name: PARAMETERS[name] for name in sorted(PARAMETERS)}) == 0
    table = pd.read_parquet(folder / TABLE)
    names = ["flight", "parameter_share", "parameter_height"]
    pd.testing.assert_frame_equal(table[names], whole[names])
    assert drawn[0].plan(13).parameters == {name: whole[f"parameter_{name}"][13] for name in PARAMETERS}
