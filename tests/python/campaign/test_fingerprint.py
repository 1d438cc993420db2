from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict, Iterator, Set

import pytest

from xplane_bridge.campaign import fingerprint as module
from xplane_bridge.campaign.definition import Campaign, parse_campaign
from xplane_bridge.campaign.fingerprint import CPU, differences, fingerprint
from xplane_bridge.campaign.rows import cpu_kind

CODE, COMPILED, CONTROLLER = "code of xplane_bridge", "compiled module xplane_bridge._core", "code of the controller"

CONFIGURATION = "configuration (config/rx.yaml, config/tx.yaml, config/aircraft)"


def campaign(**more: Any) -> Campaign:
    scenario = {"name": "s", "events": [{"at": 1, "end": True}]}
    return parse_campaign({"name": "c", "scenario": scenario, **more})


def forget() -> None:
    """As in a process that has just begun."""
    for function in (module._package_digest, module._file_digest, module._controller_digest):
        function.cache_clear()


def fresh(of: Campaign) -> Dict[str, str]:
    """As another process has it."""
    forget()
    return fingerprint(of)


def changed(one: Dict[str, str], other: Dict[str, str]) -> Set[str]:
    assert one.keys() == other.keys()
    return {key for key in one if one[key] != other[key]}


@pytest.fixture(autouse=True)
def _forgets() -> Iterator[None]:
    yield
    forget()


def test_every_source_of_the_package_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "xplane_bridge"
    shutil.copytree(module._PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "*.so", "*.txt"))
    before = fresh(campaign())
    monkeypatch.setattr(module, "_PACKAGE", package)
    now = fresh(campaign())
    assert not changed(before, now)  # whatever folder it lies in
    files = ("constants.py", "controllers/set_points.py", "emulator/servos.py", "emulator/wire/server.py",
             "emulator/aircraft/fixed_wing/fixed_wing.xml", "in_process/new.py")  # fmt: skip
    for name in files:
        with (package / name).open("a", encoding="utf-8") as file:
            file.write("\n")
        assert changed(now, fresh(campaign())) == {CODE}, name
        now = fresh(campaign())
    (package / "constants.py").rename(package / "other.py")
    assert changed(now, fresh(campaign())) == {CODE}


def test_the_compiled_module_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = tmp_path / "_core.so"
    built.write_bytes(b"one")
    monkeypatch.setattr(module, "require", lambda _: SimpleNamespace(__file__=str(built)))
    before = fresh(campaign())
    built.write_bytes(b"two")
    assert fingerprint(campaign()) == before  # this process still flies what it has loaded
    assert changed(before, fresh(campaign())) == {COMPILED}


def test_what_lies_beside_the_controller_counts_up_to_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_law_of_roll.py").write_text("def fly(state):\n    return {}\n", encoding="utf-8")
    helper = tmp_path / "gains.py"
    (tmp_path / "below").mkdir()
    monkeypatch.syspath_prepend(str(tmp_path))
    flown = campaign(controller="my_law_of_roll:fly")
    seen = [fresh(flown)]
    for path, text in (
        (helper, "GAIN = 1\n"),
        (helper, "GAIN = 2\n"),
        (tmp_path / "my_law_of_roll.py", "fly = dict\n"),
    ):
        path.write_text(text, encoding="utf-8")
        assert changed(seen[-1], fresh(flown)) == {CONTROLLER}
        seen.append(fresh(flown))
    for name in ("below/far.py", "notes.txt"):
        (tmp_path / name).write_text("x", encoding="utf-8")
        assert fresh(flown) == seen[-1]
    monkeypatch.setattr(module, "_MOST_BESIDE", 1)  # gains.py, and the controller's always
    seen.append(fresh(flown))
    (tmp_path / "later.py").write_text("x", encoding="utf-8")
    assert fresh(flown) == seen[-1]
    (tmp_path / "my_law_of_roll.py").write_text("fly = print\n", encoding="utf-8")
    assert changed(seen[-1], fresh(flown)) == {CONTROLLER}


def test_a_controller_of_the_package_is_in_the_packages_code() -> None:
    with_one = campaign(controller="xplane_bridge.cli.attitude_hold:AttitudeHold", arguments={"wanted": {"roll": 0}})
    assert changed(fresh(with_one), fresh(campaign())) == {CONTROLLER}
    assert fresh(with_one)[CONTROLLER] == "of xplane_bridge"
    assert fresh(campaign())[CONTROLLER] == "none"


def test_the_configuration_of_every_aircraft_that_may_be_drawn_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "aircraft").mkdir()
    for name in ("rx", "tx", "aircraft/fixed_wing", "aircraft/multirotor", "aircraft/tiltrotor"):
        (tmp_path / f"{name}.yaml").write_text("{}", encoding="utf-8")
    monkeypatch.setattr(module, "config_file", lambda *parts: tmp_path.joinpath(*parts))
    drawn = campaign(aircraft="$model", parameters={"model": {"choice": ["fixed_wing", "multirotor"]}})
    before = fresh(drawn), fresh(campaign(aircraft="fixed_wing"))
    (tmp_path / "aircraft/multirotor.yaml").write_text("{a: 1}", encoding="utf-8")
    assert changed(before[0], fresh(drawn)) == {CONFIGURATION}
    assert not changed(before[1], fresh(campaign(aircraft="fixed_wing")))
    (tmp_path / "rx.yaml").write_text("{rates: {warnings: 2}}", encoding="utf-8")  # when a stall warning is seen
    assert changed(before[1], fresh(campaign(aircraft="fixed_wing"))) == {CONFIGURATION}


def test_the_kind_of_cpu_counts_and_differences_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    here = fresh(campaign())
    assert here[CPU] == cpu_kind() != ""
    monkeypatch.setattr(module, "cpu_kind", lambda: "Other 9000")
    monkeypatch.setattr("numpy.__version__", "0.1")
    there = fresh(campaign())
    wanted = f"kind of CPU (Other 9000 instead of {here[CPU]}), numpy (0.1 instead of {here['numpy']})"
    assert differences(there, here) == wanted
    assert differences(here, here) == ""
    del there["numpy"]
    assert differences(there, here).endswith(f"numpy (not noted instead of {here['numpy']})")
