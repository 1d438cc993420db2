"""rerun_flight: what it says of the flight that it has flown again."""

from __future__ import annotations

from pathlib import Path
from typing import List

import pytest

from xplane_bridge.bags.passport import Passport
from xplane_bridge.cli.flights import rerun_flight


def passport(path: Path) -> Passport:
    flight = {"program": "run_scenario", "scenario": "s", "text": "name: s", "options": []}
    return Passport({"experiment": {"flight": flight}}, {}, {"commit": path.read_text(encoding="utf-8")})


@pytest.mark.parametrize(
    ("flown", "said"), [(False, ""), (True, "made otherwise: commit: recorded -> today\n")], ids=["refused", "flown"]
)
@pytest.mark.parametrize("old", [False, True])
def test_only_a_recording_of_this_run_is_compared(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    old: bool,
    flown: bool,
    said: str,
) -> None:
    recorded, output = tmp_path / "recorded.bag", tmp_path / "out"
    recorded.write_text("recorded", encoding="utf-8")
    if old:
        output.mkdir()
        (output / "flight.bag").write_text("old", encoding="utf-8")

    def run(_arguments: List[str]) -> int:
        if flown:
            (output / "flight.bag.active").write_text("today", encoding="utf-8")
            (output / "flight.bag.active").replace(output / "flight.bag")
        return 0 if flown else 1

    monkeypatch.setattr(rerun_flight, "passport_of", passport)
    monkeypatch.setattr(rerun_flight.run_scenario, "main", run)
    assert rerun_flight.main([str(recorded), "--output", str(output)]) == (0 if flown else 1)
    assert capsys.readouterr().out == said


@pytest.mark.parametrize("given", ["flight.bag", ""], ids=["file", "folder"])
def test_a_recording_is_not_flown_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], given: str
) -> None:
    (tmp_path / "flight.bag").write_text("recorded", encoding="utf-8")
    monkeypatch.setattr(rerun_flight, "passport_of", lambda _: passport(tmp_path / "flight.bag"))
    assert rerun_flight.main([str(tmp_path / given), "--output", str(tmp_path)]) == 1
    assert "the recording itself is there; expected another folder" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["flight.bag"]


def test_a_namespace_without_what_plays_into_it_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rerun_flight.main([str(tmp_path / "flight.bag"), "--namespace", "/other"]) == 1
    assert "--namespace /other: without --commands or --pose a bridge of its own" in capsys.readouterr().err


def test_a_scenario_of_the_user_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded, output = tmp_path / "recorded.bag", tmp_path / "out"
    recorded.write_text("recorded", encoding="utf-8")
    output.mkdir()
    scenario = output / "scenario.yaml"
    flown: List[List[str]] = []
    monkeypatch.setattr(rerun_flight, "passport_of", passport)
    monkeypatch.setattr(rerun_flight.run_scenario, "main", lambda arguments: flown.append(arguments) or 0)
    scenario.write_text("name: mine", encoding="utf-8")
    assert rerun_flight.main([str(recorded), "--output", str(output)]) == 1
    assert f"{scenario} is there with another text" in capsys.readouterr().err
    assert (scenario.read_text(encoding="utf-8"), flown) == ("name: mine", [])
    scenario.write_text("name: s", encoding="utf-8")  # of an earlier rerun
    assert rerun_flight.main([str(recorded), "--output", str(output)]) == 0
    assert len(flown) == 1
