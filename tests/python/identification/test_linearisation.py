"""The emulator's twin at 75 m/s and 1,000 m, against perturbations flown and evaluated apart from the program's."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import expm

from xplane_bridge.cli import linearise_model
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.identification import files
from xplane_bridge.identification.coefficients import geometry_of, read_geometry
from xplane_bridge.identification.linearisation import Condition, linearise
from xplane_bridge.identification.model import AXES, Estimate, IdentificationError, LinearModel, name_modes

#: Found once by other code: 16 perturbed flights of 4 s, the map from frame to frame, its logarithm [1/s].
KNOWN = {
    "short_period": -2.588 + 3.908j,
    "phugoid": -0.013 + 0.162j,
    "roll": -5.975,
    "dutch_roll": -0.675 + 2.604j,
    "spiral": -0.028,
}


@pytest.fixture(scope="module")
def twin() -> LinearModel:
    return linearise(Condition("fixed_wing", 75.0, 1000.0), geometry_of("fixed_wing"))


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [("short_period", 2e-3), ("phugoid", 1e-2), ("roll", 5e-4), ("dutch_roll", 5e-4), ("spiral", 2e-2)],
)
def test_the_eigenvalues_are_those_found_before(twin: LinearModel, name: str, tolerance: float) -> None:
    axis = "longitudinal" if name in ("short_period", "phugoid") else "lateral"
    found = twin.axes[axis].mode(name).eigenvalue
    assert abs(found - KNOWN[name]) < tolerance * abs(KNOWN[name])


def test_perturbations_of_another_size_give_the_same_model(twin: LinearModel) -> None:
    other = linearise(Condition("fixed_wing", 75.0, 1000.0), scale=4.0)
    for name, axis in twin.axes.items():
        for matrix, again in ((axis.a, other.axes[name].a), (axis.b, other.axes[name].b)):
            assert np.allclose(matrix, again, rtol=5e-3, atol=0.01)


def test_the_derivatives_are_those_of_the_aircrafts_file(twin: LinearModel) -> None:
    # fixed_wing.xml: Cm_de -0.01047 per deg and half, Cm_q -17 and Cm_alphadot -5, Cl_da 2 * 0.00135 per deg,
    # Cn_dr 0.00131 per deg of a rudder to the right, CL_alpha 5.0 less what drag and the tail add.
    longitudinal, lateral = twin.axes["longitudinal"].derivatives, twin.axes["lateral"].derivatives
    per_deg = math.degrees(1.0)
    assert longitudinal["Cm_de"].value == pytest.approx(-2 * 0.01047 * per_deg, rel=0.015)
    assert longitudinal["Cm_q"].value == pytest.approx(-22.0, rel=0.01)
    assert longitudinal["CL_alpha"].value == pytest.approx(5.0, rel=0.03)
    assert lateral["Cl_da"].value == pytest.approx(2 * 0.00135 * per_deg, rel=0.02)
    assert lateral["Cl_p"].value == pytest.approx(-0.40 - 0.12, rel=0.03)
    assert lateral["Cn_dr"].value == pytest.approx(-0.00131 * per_deg, rel=0.02)
    assert lateral["Cn_beta"].value == pytest.approx(0.085, rel=0.05)


def test_the_model_flies_as_the_aircraft_does(twin: LinearModel) -> None:
    """A flight that no perturbation had: elevator and rates together, two seconds."""
    model = create_model("fixed_wing")
    controls = model.reset(InitialState(altitude_m=1000.0, airspeed_mps=75.0))
    trimmed = model.state.copy()
    controls.override_surfaces = True
    controls.surface_deg = dict(trimmed.surfaces_deg)
    for name in ("hstab1_elv1", "hstab2_elv1"):
        controls.surface_deg[name] += 0.3
    model.place(pqr_rad_s=(0.02, 0.01, -0.02))
    for _ in range(120):
        model.step(1.0 / 60.0, controls)
    s = model.state
    flown = np.array([s.true_airspeed_mps - 75.0, s.alpha_rad - trimmed.alpha_rad, s.q_rad_s - trimmed.q_rad_s])
    axis = twin.axes["longitudinal"]
    x0, u = np.array([0.0, 0.0, 0.01 - trimmed.q_rad_s, 0.0]), np.radians(0.3)
    block = expm(np.block([[axis.a, axis.b * u], [np.zeros((1, 5))]]) * 2.0)
    modelled = block[:4, :4] @ x0 + block[:4, 4]
    assert np.allclose(flown, modelled[:3], rtol=0.03, atol=2e-4)
    lateral = twin.axes["lateral"]
    rolled = expm(lateral.a * 2.0) @ np.array([0.0, 0.02, -0.02, 0.0])
    assert np.allclose([s.beta_rad, s.p_rad_s, s.r_rad_s, s.roll_rad], rolled, rtol=0.03, atol=2e-4)


def test_slower_flight_is_another_trim_point() -> None:
    slow = linearise(Condition("fixed_wing", 60.0, 1000.0))
    assert slow.trim["true_airspeed"].value == pytest.approx(60.0)
    assert slow.trim["alpha"].value > 2.0
    # Aerodynamic damping and stiffness go with speed and its square.
    assert slow.axes["lateral"].mode("roll").eigenvalue.real == pytest.approx(-5.975 * 60 / 75, rel=0.03)
    assert slow.axes["longitudinal"].a[2, 1] == pytest.approx(-16.1 * (60 / 75) ** 2, rel=0.03)


def test_modes_have_the_names_of_flight_mechanics() -> None:
    both_real = np.diag([-1.0, -2.0, -0.1, -0.2])
    assert [m.name for m in name_modes(AXES["longitudinal"], both_real)] == ["mode_1", "mode_2", "mode_3", "mode_4"]
    lateral = np.zeros((4, 4))
    lateral[0, 0], lateral[1, 1] = -5.0, 0.01
    lateral[2:, 2:] = [[-0.5, 2.0], [-2.0, -0.5]]
    modes = {m.name: m for m in name_modes(AXES["lateral"], lateral)}
    assert modes["dutch_roll"].eigenvalue == pytest.approx(-0.5 + 2j)
    assert modes["dutch_roll"].damping == pytest.approx(0.5 / math.hypot(0.5, 2.0))
    assert (modes["roll"].eigenvalue, modes["spiral"].eigenvalue) == (-5.0, 0.01)
    assert modes["spiral"].damping == -1.0


def test_the_program_writes_every_format(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    outputs = [tmp_path / name for name in ("model.yaml", "model.json", "deep/model.mat")]
    arguments = [word for path in outputs for word in ("-o", str(path))]
    assert linearise_model.main(["fixed_wing", "--speed", "75", *arguments]) == 0
    assert "short_period" in capsys.readouterr().out
    model = files.read_model(outputs[0])
    again = files.read_model(outputs[1])
    mat = loadmat(str(outputs[2]), squeeze_me=True)
    for name, axis in model.axes.items():
        assert np.array_equal(axis.a, again.axes[name].a)
        assert np.allclose(axis.a, mat[name]["A"].item())
        assert np.allclose(axis.d, mat[name]["D"].item().reshape(axis.d.shape))
        assert [str(text) for text in mat[name]["states_names"].item()] == [s.name for s in axis.axis.states]
        eigenvalues = np.atleast_1d(mat[name]["eigenvalues"].item())
        assert np.allclose(eigenvalues, [m.eigenvalue for m in axis.modes])
    short = model.axes["longitudinal"].reduced("short_period")
    assert short[0] == ["alpha", "pitch_rate"]
    assert np.array_equal(short[1], model.axes["longitudinal"].a[1:3, 1:3])
    assert np.array_equal(short[2], model.axes["longitudinal"].b[1:3])


def test_python_control_takes_the_model(twin: LinearModel) -> None:
    control = pytest.importorskip("control")
    system = files.state_space(twin.axes["lateral"])
    assert isinstance(system, control.StateSpace)
    assert (system.nstates, system.ninputs, system.noutputs) == (4, 2, 5)
    assert system.input_labels == ["aileron", "rudder"]
    assert sorted(system.poles().real) == pytest.approx(sorted(np.linalg.eigvals(twin.axes["lateral"].a).real))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["glider"], "unknown aircraft 'glider': the emulator has fixed_wing"),
        (["multirotor"], "is trimmed at 0.0 m/s: expected at least 20 m/s"),
        (["fixed_wing", "--speed", "20"], "the twin starts in the air at 30..110 m/s"),
        (["fixed_wing", "-o", "model.txt"], "expected a file that ends in .yaml, .json, .mat"),
        (["fixed_wing", "--geometry", "none.yaml"], "none.yaml: No such file or directory"),
    ],
)
def test_refusals_are_in_words(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert linearise_model.main(arguments) == 1
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wing_area: 17\n", "chord, span, mass, ixx, iyy, izz is missing"),
        ("wing_area: -1\nchord: 1\nspan: 1\nmass: 1\nixx: 1\niyy: 1\nizz: 1\n", "wing_area is -1, expected a positive"),
        ("wing_area: wide\nchord: 1\nspan: 1\nmass: 1\nixx: 1\niyy: 1\nizz: 1\n", "wing_area is 'wide'"),
        ("wings: 2\n", "unknown key wings; expected: wing_area"),
        ("[1, 2]\n", "expected a map with the keys wing_area"),
        ("a: [\n", "does not parse as YAML"),
    ],
)
def test_a_bad_file_of_sizes_is_refused_in_words(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "sizes.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(IdentificationError, match=r"sizes\.yaml") as caught:
        read_geometry(path)
    assert words in str(caught.value)


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_small_numbers_of_a_file_are_numbers(form: str, twin: LinearModel, tmp_path: Path) -> None:
    trim = {**twin.trim, "beta": Estimate(3e-9, "rad")}
    files.write_model(replace(twin, trim=trim), tmp_path / f"model.{form}")
    assert files.read_model(tmp_path / f"model.{form}").trim["beta"].value == 3e-9


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize("text", ["a: 1\n", "[]\n", "a: [\n"])
def test_a_file_that_is_no_model_is_refused_in_words(text: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"model.{ending}"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(IdentificationError, match=r"model\.\w+: (not a model of identify_model|does not parse)"):
        files.read_model(path)


def test_another_loading_than_that_of_the_moments_of_inertia_is_said(twin: LinearModel) -> None:
    geometry = geometry_of("fixed_wing")
    assert twin.axes["lateral"].warnings == []
    light = linearise(Condition("fixed_wing", 75.0, 1000.0, fuel_kg=(5.0, 5.0)), geometry)
    for axis in light.axes.values():
        (warning,) = axis.warnings
        assert re.match(rf"the aircraft had \d+ kg, the geometry {geometry.mass:.0f} kg: coefficients of mom", warning)
