from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from support.room_table import ROOT
from xplane_bridge.campaign import report
from xplane_bridge.campaign.definition import parse_campaign
from xplane_bridge.cli import run_campaign

DOCUMENT = {
    "name": "a <b>",
    "parameters": {"x": {"uniform": [0, 1], "unit": "m"}, "word": {"choice": ["p", "q"]}},
    "scenario": {
        "name": "s",
        "description": "$x m, $word",
        "criteria": {
            "low": {"measure": "peak", "of": "roll", "target": 0, "below": 5},
            "high": {"measure": "minimum", "of": "altitude", "above": 900},
        },
        "events": [{"at": 1, "end": True}],
    },
}


def table() -> pd.DataFrame:
    rows = [
        # flight, outcome, low, met, high, met
        (0, "flown", 1.0, True, 950.0, True),
        (1, "flown", 9.0, False, 950.0, True),
        (2, "flown", 7.0, False, 950.0, True),
        (3, "no start", np.nan, False, np.nan, False),
        (4, "flown", 6.0, False, 800.0, False),
        (5, "flown", np.inf, False, 950.0, True),
    ]
    names = ["flight", "outcome", "value_low", "met_low", "value_high", "met_high"]
    frame = pd.DataFrame(rows, columns=names)
    frame["passed"] = frame["met_low"] & frame["met_high"]
    frame["parameter_x"], frame["parameter_word"] = np.arange(6) / 10.0, "p"
    frame["reason"], frame["sha256"] = "<why>", ["a", "b", "c", "", "d", "e"]
    return frame


def test_the_worst_come_first() -> None:
    campaign = parse_campaign(DOCUMENT)
    assert list(report.worst_first(campaign, table())["flight"]) == [3, 4, 5, 1, 2, 0]
    assert report.flights_to_draw(campaign, table()) == [4, 5, 1, 2, 0]  # 3 never flew


def test_what_could_not_be_measured_is_the_worst() -> None:
    flights = table().iloc[[4, 4, 4]].reset_index(drop=True).assign(flight=[0, 1, 2], value_high=[np.nan, 700.0, 800.0])
    assert list(report.worst_first(parse_campaign(DOCUMENT), flights)["flight"]) == [0, 1, 2]


def test_of_two_bounds_the_one_that_is_violated_counts() -> None:
    criterion = {"measure": "final", "of": "altitude", "above": -10, "below": 10}
    campaign = parse_campaign({**DOCUMENT, "scenario": {**DOCUMENT["scenario"], "criteria": {"level": criterion}}})
    flights = pd.DataFrame({"flight": range(5), "outcome": "flown", "value_level": [12.0, -40.0, 25.0, -11.0, np.nan]})
    flights["met_level"] = False
    assert list(report.worst_first(campaign, flights)["flight"]) == [4, 1, 2, 0, 3]


def test_a_bound_that_is_drawn_is_that_of_each_flight() -> None:
    """Beyond its own bound flight 0 is by 1, 1 by 3, 2 by 2; beyond that of flight 0, flight 2 would be the first."""
    criteria = {
        "low": {"measure": "peak", "of": "roll", "target": 0, "below": "$t"},
        "high": {"measure": "minimum", "of": "altitude", "above": "$t"},
    }
    document = {**DOCUMENT, "parameters": {"t": {"uniform": [1, 90]}}, "scenario": {**DOCUMENT["scenario"],
                "description": "", "criteria": criteria}}  # fmt: skip
    flights = pd.DataFrame({"flight": range(3), "outcome": "flown", "parameter_t": [10.0, 20.0, 40.0], "met_low": False,
                            "value_low": [11.0, 23.0, 42.0], "met_high": True, "value_high": 1000.0})  # fmt: skip
    assert list(report.worst_first(parse_campaign(document), flights)["flight"]) == [1, 2, 0]
    flights["value_low"], flights["met_low"], flights["met_high"] = 0.0, True, False
    flights["value_high"] = [9.0, 17.0, 38.0]
    assert list(report.worst_first(parse_campaign(document), flights)["flight"]) == [1, 2, 0]


def test_how_well_a_criterion_was_met_does_not_decide() -> None:
    """Flight 0 is 1 deg beyond the bound and hardly high enough, flight 1 is 2 deg beyond it and high up."""
    flights = table().iloc[[1, 1, 0]].reset_index(drop=True).assign(flight=[0, 1, 2])
    flights["value_low"], flights["value_high"] = [6.0, 7.0, 0.0], [901.0, 5000.0, 950.0]
    assert list(report.worst_first(parse_campaign(DOCUMENT), flights)["flight"]) == [1, 0, 2]


def test_what_a_flight_that_did_not_end_had_measured_is_no_value_of_the_whole_flight() -> None:
    """Those that crash early have had no time to roll: with them, the correlation has the wrong sign."""
    count = 100
    x = np.linspace(0.0, 1.0, count)
    crashed = x > 0.6
    flights = pd.DataFrame({"flight": range(count), "outcome": np.where(crashed, "crashed", "flown")})
    flights["value_low"], flights["met_low"] = np.where(crashed, 0.1, 1.0 + 6.0 * x), ~crashed
    flights["value_high"], flights["met_high"], flights["passed"] = 950.0, True, ~crashed
    flights["parameter_x"], flights["parameter_word"], flights["reason"], flights["sha256"] = x, "p", "", "a"
    text = report.page(parse_campaign(DOCUMENT), flights, {}, "")
    assert "<td>low</td><td>60 of 100</td><td>1.121</td>" in text
    assert "<td>low</td><td>+1.00</td>" in text


def test_the_page_needs_no_network_and_says_what_was_flown() -> None:
    campaign = parse_campaign(DOCUMENT)
    trace = {"time": np.arange(3.0), "roll": np.arange(3.0), "altitude": np.ones(3), "speed": np.ones(3)}
    text = report.page(campaign, table(), {4: trace}, "refly & compare")
    assert not re.search(r"(src|href)\s*=|https?:|@import|url\(", text)
    assert "<b>" not in text
    assert "a &lt;b&gt;" in text
    assert "&lt;why&gt;" in text
    assert "refly &amp; compare NUMBER" in text
    # 1 of 6 passed; Wilson by hand: centre (1/6 + 0.3201) / 1.6402, half 0.5975 / 1.6402 * ...
    assert "<td>1 of 6</td><td>16.7%</td><td>3.0% .. 56.4%</td>" in text
    assert "5 flown, 1 no start" in text
    assert text.count("<circle") == 5 + 5 + 2  # one flight has no values: on the lower edges
    assert re.findall(r'<circle class=(\w+) cx="[\d.]+" cy="4.0"', text) == ["missed"]  # the one that never settles
    assert "above the frame: it never settles" in text
    assert text.count("<polyline") == 3


def test_the_example_of_the_document_flies(tmp_path: Path, monkeypatch) -> None:
    text = (ROOT / "docs/experiments/campaigns.md").read_text(encoding="utf-8")
    for name, language in (("gusts.yaml", "yaml"), ("my_controller.py", "python")):
        block = text.split(f"`{name}`:\n\n```{language}\n", 1)[1].split("```", 1)[0]
        (tmp_path / name).write_text(block, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    out = tmp_path / "out"
    command = [str(tmp_path / "gusts.yaml"), "-o", str(out), "--flights", "3", "--workers", "0"]
    assert run_campaign.main(command) == 0
    flown = pd.read_parquet(out / "table.parquet")
    assert list(flown["outcome"]) == ["flown"] * 3
    assert flown["value_level"].between(0.0, 90.0).all()
    assert flown["met_level"].sum() == (flown["value_level"] < 6.0).sum()
    assert "Flight 0" in (out / "report.html").read_text(encoding="utf-8")
    assert run_campaign.main(["-o", str(out), "--refly", "2"]) == 0
    trace = pd.read_csv(out / "refly_2.csv")
    assert trace["time"].iloc[-1] == 8.0


def test_the_shipped_campaigns_are_campaigns(capsys) -> None:
    from xplane_bridge.campaign.definition import load_campaign

    files = sorted((ROOT / "config/campaigns").glob("*.yaml"))
    assert files
    for path in files:
        assert load_campaign(path).flights >= 100
    assert run_campaign.main(["-o", "nowhere", "--refly", "1"]) == 1
    assert "holds no campaign" in capsys.readouterr().err
