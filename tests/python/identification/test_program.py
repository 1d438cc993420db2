"""The program identify_model: files, page, refusals; and the example of docs/experiments/identification.md."""

from __future__ import annotations

import importlib
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from support.flights.manoeuvre_flight import LATERAL, PITCH, Manoeuvre, flown
from support.flights.synthetic_flight import FlightBag
from support.markdown import blocks
from support.room_table import ROOT
from xplane_bridge.bags import Bags
from xplane_bridge.cli import identify_model
from xplane_bridge.cli.linearise_model import summary
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.identification import files, identify
from xplane_bridge.identification.linearisation import Condition, linearise
from xplane_bridge.identification.model import Estimate

PAGE = ROOT / "docs/experiments/identification.md"


@pytest.fixture(scope="module")
def twin() -> FlightModel:
    return create_model("fixed_wing")


#: What the passport of a flight of the emulator's twin says of the aircraft.
TWIN = {"aircraft_file": "fixed_wing", "aircraft_icao": "DA62", "aircraft_description": "Light twin"}


@pytest.fixture(scope="module")
def bag(twin: FlightModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("flown")
    return with_passports(flown(PITCH + LATERAL, model=twin).write(folder / "bare.bag"), folder / "flight.bag", TWIN)


def with_passports(bare: Path, path: Path, *aircraft: dict[str, str]) -> Path:
    with Bags(bare) as bags, FlightBag(path) as out:
        for k, (topic, time, raw) in enumerate(bags.recorded()):
            if k < len(aircraft):
                values = {"header": out.header(time, ""), "parameters": "{}", **aircraft[k]}
                out.add("/xplane/experiment", "xplane_bridge/Experiment", time, values)
            out.add_recorded(topic, time, raw)
    return path


@pytest.fixture(scope="module")
def gusty(twin: FlightModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gusty") / "gusty.bag"
    return flown((Manoeuvre("pitch"), Manoeuvre("pitch", -0.1)), model=twin, turbulence=2.0, seed=1).write(path)


def test_the_example_of_the_page_works(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flight.bag").write_bytes(bag.read_bytes())
    example = [block for block in blocks(PAGE) if block.section == "An example"]
    for block in example:
        if block.language == "bash":
            program, *arguments = shlex.split(block.text)
            assert (ROOT / program).is_file()
            assert importlib.import_module(f"xplane_bridge.cli.{Path(program).name}").main(arguments) == 0
    made = {path.name for path in tmp_path.iterdir()}
    assert made == {"flight.bag", "twin.yaml", "model.yaml", "model.mat", "model.html"}
    twin, model = files.read_model(tmp_path / "twin.yaml"), files.read_model(tmp_path / "model.yaml")
    for axis, mode in (("longitudinal", "short_period"), ("lateral", "roll"), ("lateral", "dutch_roll")):
        expected, found = (m.axes[axis].mode(mode).eigenvalue for m in (twin, model))
        assert abs(found - expected) < 0.01 * abs(expected), mode
    assert model.axes["lateral"].a_interval is not None
    mat = loadmat("model.mat", squeeze_me=True)
    assert np.allclose(mat["longitudinal"]["A"].item(), model.axes["longitudinal"].a)
    pytest.importorskip("control")
    names: dict = {}
    exec(next(block.text for block in example if block.language == "python"), names)
    assert names["system"].nstates == 4


def test_the_page_needs_no_network_and_shows_every_window(bag: Path, tmp_path: Path) -> None:
    page = tmp_path / "model.html"
    arguments = [str(bag), "--axis", "lateral", "-o", str(tmp_path / "model.yaml"), "--report", str(page)]
    assert identify_model.main(arguments) == 0
    text = page.read_text(encoding="utf-8")
    without_plotly = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"(src|href)=\"(https?:)?//", without_plotly)
    assert re.findall(r'id="(figure-lateral-[\w-]+)"', text) == [
        *(f"figure-lateral-fitted-{k}" for k in (4, 5, 7, 8)),
        *(f"figure-lateral-validation-{k}" for k in (6, 9)),
    ]
    for words in ("dutch roll", "Theil coefficient", "Cl_p", "Trim point", "Lateral validation 9: 3-2-1-1 on yaw"):
        assert words in text, words
    assert "longitudinal" not in without_plotly.lower()


def test_each_of_several_excitations_of_one_number_has_a_name(
    twin: FlightModel, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    recording = flown(PITCH, model=twin)
    recording.excitation = [{**row, "id": max(1, row["id"] - 1)} for row in recording.excitation]  # 1, 1, 2
    bag, page, model = recording.write(tmp_path / "flight.bag"), tmp_path / "model.html", tmp_path / "model.yaml"
    assert identify_model.main([str(bag), "--validate", "1"]) == 1
    error = capsys.readouterr().err
    assert (
        "excitation 1 cannot be kept for validation; flight has: 1.1, 1.2, 2; 1.1 is the first one of number" in error
    )
    for kept, fitted in (("2", ["1.1", "1.2"]), ("1.2", ["1.1", "2"])):
        assert identify_model.main([str(bag), "--validate", kept, "--report", str(page), "-o", str(model)]) == 0
        keys = [*(f"longitudinal-fitted-{name}" for name in fitted), f"longitudinal-validation-{kept}"]
        text = page.read_text(encoding="utf-8")
        assert re.findall(r'id="figure-(longitudinal-[\w.-]+)"', text) == keys
        assert re.findall(r'<section id="(longitudinal-[\w.-]+)"', text) == keys
        used = [label.split()[1] for label in files.read_model(model).source["windows"]]
        assert used == fitted


def test_values_are_printed_with_intervals_and_warnings_once(
    twin: FlightModel, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    bag = flown(PITCH + LATERAL, model=twin, surfaces_every=3).write(tmp_path / "flight.bag")
    model, page = tmp_path / "model.yaml", tmp_path / "model.html"
    arguments = [str(bag), "--aircraft", "fixed_wing", "-o", str(model), "--report", str(page)]
    assert identify_model.main(arguments) == 0
    out, err = capsys.readouterr()
    assert err.count("surfaces: 999") == 1
    assert page.read_text(encoding="utf-8").count("surfaces: 999") == 1
    printed = {name: rest for name, *rest in re.findall(r"(C\w+) +(\S+) \+- (\S+)( \?)?", out)}
    axes = files.read_model(model).axes.values()
    found = {name: entry for axis in axes for name, entry in axis.derivatives.items()}
    assert list(printed) == list(found)
    for name, (value, width, mark) in printed.items():
        assert float(value) == pytest.approx(found[name].value, rel=1e-3)
        assert float(width) == pytest.approx(found[name].interval, rel=0.06)
        assert bool(mark) == (found[name].interval > 0.5 * abs(found[name].value))


def test_a_value_whose_interval_is_wide_is_marked() -> None:
    derivatives = {"Cm_q": Estimate(-22.0, "", 0.4), "CL_de": Estimate(-0.15, "1/rad", 0.08), "Cm_de": Estimate(-1.2)}
    lines = summary(
        replace(linearise(Condition("fixed_wing", 75.0, 1000.0)).axes["longitudinal"], derivatives=derivatives)
    )
    assert lines[-2].split() == ["Cm_q", "-22", "+-", "0.4", "CL_de", "-0.15", "+-", "0.08", "?", "Cm_de", "-1.2"]
    assert lines[-1] == "  ?: the interval (95 %) is more than half of the value"


def test_turbulence_ends_with_an_error_and_the_page_shows_why(
    gusty: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    model, page = tmp_path / "model.yaml", tmp_path / "model.html"
    assert identify_model.main([str(gusty), "-o", str(model), "--report", str(page)]) == 1
    error = capsys.readouterr().err
    assert "no model written: longitudinal: residuals of " in error
    assert "--accept writes it all the same" in error
    assert not model.exists()
    assert "What speaks against the model" in page.read_text(encoding="utf-8")
    assert identify_model.main([str(gusty), "-o", str(model), "--accept"]) == 0
    assert "warning: accepted: longitudinal: residuals of " in capsys.readouterr().err
    assert files.read_model(model).axes["longitudinal"].a.shape == (4, 4)


@pytest.mark.parametrize(
    ("options", "without"), [([], ""), (["--validate", "2"], ""), (["--validate", "5"], " without --validate")]
)
def test_where_one_axis_is_refused_it_says_how_the_other_one_is_written(
    bag: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, options: list[str], without: str
) -> None:
    def refused(*arguments: Any) -> identify.Identification:
        found = identified(*arguments)
        found.results["lateral"].refusals.append("something else than the inputs moved the aircraft")
        return found

    identified = identify.identify
    monkeypatch.setattr(identify, "identify", refused)
    assert identify_model.main([str(bag), *options]) == 1
    hint = f"--axis longitudinal{without} writes that axis alone, --accept writes it all the same"
    assert f"moved the aircraft; {hint}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--axis", "lateral"], "no excitation moves the lateral axis"),
        (["--validate", "9"], "excitation 9 cannot be kept for validation; gusty has: 1, 2"),
        (["--aircraft", "fixed_wings"], "--aircraft fixed_wings: config/geometry has: fixed_wing; give the sizes of"),
        (["--geometry", "none.yaml"], "none.yaml: No such file or directory; give a file as in config/geometry"),
        (["--accept", "-o", "model.doc"], "model.doc: expected a file that ends in .yaml, .json, .mat"),
    ],
)
def test_refusals_are_in_words(
    gusty: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert identify_model.main([str(gusty), *arguments]) == 1
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("aircraft", "name", "why"),
    [
        ([TWIN], "fixed_wing", ""),
        ([], "", "the recording does not say which aircraft was flown"),
        # Flown by the twin's file of config/aircraft, which knows this code too.
        (
            [{**TWIN, "aircraft_description": "Diamond DA62"}],
            "DA62 Diamond DA62",
            "config/geometry has no sizes of the recorded aircraft, DA62 Diamond DA62: no coefficients",
        ),
        (
            [{"aircraft_file": "b737_800", "aircraft_icao": "B738", "aircraft_description": "Boeing 737-800"}],
            "B738 Boeing 737-800",
            "config/geometry has no sizes of the recorded aircraft, B738 Boeing 737-800: no coefficients",
        ),
        (
            [{"aircraft_file": "tiltrotor", "aircraft_icao": "TILT", "aircraft_description": "Tiltrotor"}],
            "tiltrotor",
            "config/geometry has no sizes of the recorded aircraft, tiltrotor: no coefficients",
        ),
        ([TWIN, {**TWIN, "aircraft_icao": "C172"}], "", "several aircraft (DA62 Light twin, then C172 Light twin)"),
    ],
)
def test_coefficients_are_those_of_the_aircraft_that_was_flown(
    gusty: Path, aircraft: list[dict[str, str]], name: str, why: str, capsys: pytest.CaptureFixture, tmp_path: Path
) -> None:
    bag = with_passports(gusty, tmp_path / "flight.bag", *aircraft)
    output = tmp_path / "model.yaml"
    assert identify_model.main([str(bag), "--accept", "-o", str(output)]) == 0
    model = files.read_model(output)
    assert model.aircraft == name
    assert bool(model.axes["longitudinal"].derivatives) == (not why)
    said = capsys.readouterr().err
    assert why in said
    assert [text for text in model.warnings if "no coefficients" in text] == [
        text[len("warning: ") :] for text in said.splitlines() if "no coefficients" in text
    ]


def test_an_aircraft_that_is_named_is_taken_whatever_was_recorded(gusty: Path, tmp_path: Path) -> None:
    output = tmp_path / "model.yaml"
    assert identify_model.main([str(gusty), "--accept", "--aircraft", "fixed_wing", "-o", str(output)]) == 0
    model = files.read_model(output)
    assert (model.aircraft, "Cm_de" in model.axes["longitudinal"].derivatives) == ("fixed_wing", True)


def test_no_bag_is_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert identify_model.main([str(tmp_path / "none.bag")]) == 1
    assert "No such file or directory" in capsys.readouterr().err
