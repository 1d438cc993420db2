"""Flights of the emulator's twin with test signals, identified, against its linearised self."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from support.flights.manoeuvre_flight import LATERAL, PITCH, Film, Manoeuvre, Recording, flown
from xplane_bridge.bags.flight import Flight
from xplane_bridge.constants import SurfaceStatesValid
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight import jsbsim_model
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.identification.coefficients import geometry_of
from xplane_bridge.identification.identify import AxisResult, identify
from xplane_bridge.identification.intervals import _coloured
from xplane_bridge.identification.linearisation import Condition, linearise
from xplane_bridge.identification.model import IdentificationError, LinearModel
from xplane_bridge.identification.windows import find_windows, read_excitations

GEOMETRY = geometry_of("fixed_wing")


@pytest.fixture(scope="module")
def twin() -> FlightModel:
    return create_model("fixed_wing")


@pytest.fixture(scope="module")
def truth() -> LinearModel:
    return linearise(Condition("fixed_wing", 75.0, 1000.0), GEOMETRY)


@pytest.fixture(scope="module")
def calm(twin: FlightModel) -> Recording:
    return flown(PITCH + LATERAL, model=twin)


@pytest.fixture(scope="module")
def found(calm: Recording) -> dict[str, AxisResult]:
    return identify(calm.flight(), geometry=GEOMETRY).results


def error(result: AxisResult, truth: LinearModel, mode: str) -> float:
    """Of an eigenvalue, against its size."""
    expected = truth.axes[result.model.axis.name].mode(mode).eigenvalue
    return abs(result.model.mode(mode).eigenvalue - expected) / abs(expected)


def longitudinal(recording: Recording) -> AxisResult:
    return identify(recording.flight(), "longitudinal", GEOMETRY).results["longitudinal"]


# ---------------------------------------------------------------------------------------------------------- accuracy


@pytest.mark.parametrize(
    ("axis", "mode", "budget"),
    [("longitudinal", "short_period", 0.02), ("lateral", "roll", 0.02), ("lateral", "dutch_roll", 0.01)],
)
def test_modes_in_calm_air_are_within_their_budgets(
    found: dict[str, AxisResult], truth: LinearModel, axis: str, mode: str, budget: float
) -> None:
    assert error(found[axis], truth, mode) < budget
    assert not found[axis].refusals


def test_three_axes_moved_at_once_give_both_models(twin: FlightModel, truth: LinearModel) -> None:
    together = Manoeuvre("roll,pitch,yaw", amplitude=0.06, kind="multisine", duration=12.0, frequency=0.2, seed=1)
    others = [replace(together, seed=seed) for seed in (11, 21)]
    results = identify(flown([together, *others], model=twin).flight(), geometry=GEOMETRY).results
    assert error(results["longitudinal"], truth, "short_period") < 0.04
    assert error(results["lateral"], truth, "roll") < 0.04
    assert error(results["lateral"], truth, "dutch_roll") < 0.02
    for name, axis in (("Cm_de", "longitudinal"), ("Cl_da", "lateral"), ("Cn_dr", "lateral")):
        expected = truth.axes[axis].derivatives[name].value
        assert results[axis].model.derivatives[name].value == pytest.approx(expected, rel=0.05), name


def test_derivatives_are_those_of_the_aircraft(found: dict[str, AxisResult], truth: LinearModel) -> None:
    assert found["longitudinal"].model.derivatives["Cm_de"].value == pytest.approx(-1.2, rel=0.03)
    for axis, names in (("longitudinal", ("Cm_alpha", "Cm_q", "CL_alpha")), ("lateral", ("Cl_p", "Cl_da", "Cn_dr"))):
        for name in names:
            expected = truth.axes[axis].derivatives[name].value
            assert found[axis].model.derivatives[name].value == pytest.approx(expected, rel=0.03), name


def test_forces_are_outputs(found: dict[str, AxisResult], truth: LinearModel) -> None:
    force, expected = found["longitudinal"].model.c[5], truth.axes["longitudinal"].c[5]
    assert force[1] == pytest.approx(expected[1], rel=0.03)
    assert found["lateral"].model.c[4, 0] == pytest.approx(truth.axes["lateral"].c[4, 0], rel=0.03)


def test_a_window_that_was_not_used_validates(found: dict[str, AxisResult]) -> None:
    for result, numbers in ((found["longitudinal"], [3]), (found["lateral"], [6, 9])):
        assert [w.excitation.number for w in result.validation] == numbers
        assert not set(numbers) & {w.excitation.number for w in result.windows}
        for values in result.model.facts["validation"].values():
            assert values["explained"] > 0.99
        assert not result.model.warnings


def test_a_window_that_is_named_validates_its_axis_and_leaves_the_other_alone(calm: Recording) -> None:
    results = identify(calm.flight(), validate="2").results
    assert [w.excitation.number for w in results["longitudinal"].validation] == [2]
    assert [w.excitation.number for w in results["lateral"].validation] == [6, 9]
    with pytest.raises(IdentificationError, match=r"excitation 2 cannot .* flown has for the lateral axis: 4, 5, 6"):
        identify(calm.flight(), "lateral", validate="2")


def test_an_input_that_only_the_validating_window_moves_is_left_out(calm: Recording) -> None:
    rows = [row for row in calm.excitation if row["id"] in (4, 5, 7)]
    model = identify(without(calm, excitation=rows), validate="7").results["lateral"].model
    assert ([signal.name for signal in model.inputs], model.b.shape) == (["aileron"], (4, 1))
    assert any("7 (3-2-1-1 on yaw) moves rudder, which no fitted window does" in text for text in model.warnings)


def test_sensor_noise_changes_little_and_the_intervals_show_it(twin: FlightModel, truth: LinearModel) -> None:
    result = longitudinal(flown(PITCH, model=twin, noise=1.0, seed=4))
    assert error(result, truth, "short_period") < 0.025
    assert 0.001 < result.model.mode("short_period").relative_interval < 0.03
    assert not result.refusals


def changed_aircraft(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pattern: str, value: str) -> FlightModel:
    """The twin with one number of its file changed."""
    source = jsbsim_model._ROOT / "aircraft"
    for name in ("planet.xml", "fixed_wing/fixed_wing.xml"):
        (tmp_path / "aircraft" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "aircraft" / name).write_bytes((source / name).read_bytes())
    path = tmp_path / "aircraft/fixed_wing/fixed_wing.xml"
    text, count = re.subn(pattern, value, path.read_text(encoding="utf-8"))
    assert count == 1
    ElementTree.fromstring(text)
    path.write_text(text, encoding="utf-8")
    monkeypatch.setattr(jsbsim_model, "_ROOT", tmp_path)
    return create_model("fixed_wing")


def test_an_elevator_of_20_percent_less_is_found(
    found: dict[str, AxisResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weak = changed_aircraft(tmp_path, monkeypatch, r"-0\.01047", "-0.008376")
    result = longitudinal(flown(PITCH, model=weak))
    before, after = (r.model.derivatives["Cm_de"].value for r in (found["longitudinal"], result))
    assert after / before == pytest.approx(0.8, abs=0.01)
    assert result.model.derivatives["Cm_q"].value == pytest.approx(-22.0, rel=0.03)


def coverage(twin: FlightModel, truth: LinearModel, seeds: range) -> np.ndarray:
    """Share of the flights in which the intervals of Cm_alpha and of Cm_q hold the true values."""
    film = Film(twin)
    results = (longitudinal(flown(SMALL, model=film.again(), noise=1.0, seed=seed)) for seed in seeds)
    return np.mean([covers(result, truth) for result in results], axis=0)


def test_a_film_shows_what_the_model_flies(twin: FlightModel) -> None:
    film = Film(twin)
    for seed in (1, 2):
        shown, flew = (flown(SMALL, model=model, noise=1.0, seed=seed) for model in (film.again(), twin))
        assert shown.state == flew.state
        assert shown.surfaces == flew.surfaces


def test_residuals_that_follow_each_other_widen_the_intervals_as_they_should() -> None:
    rng = np.random.default_rng(3)
    noise = np.convolve(rng.normal(size=60), np.ones(4) / 2.0, mode="same")
    residuals = np.column_stack([noise, np.roll(noise, 5)])[5:45]  # the second is the first of five frames before
    slopes = rng.normal(size=(40, 2, 3))
    count, lags = len(residuals), 10
    expected = np.zeros((3, 3))
    for i in range(count):
        for j in range(max(0, i - lags), min(count, i + lags + 1)):
            lag = abs(j - i)
            early, late = (
                (residuals[: count - lag], residuals[lag:]) if j >= i else (residuals[lag:], residuals[: count - lag])
            )
            together = early.T @ late / count * (1.0 - lag / (lags + 1))  # E[v(i) v(j)']
            expected += slopes[i].T @ together @ slopes[j]
    assert _coloured(slopes, residuals) == pytest.approx(expected)


def test_intervals_cover_the_truth(twin: FlightModel, truth: LinearModel) -> None:
    assert coverage(twin, truth, range(6)).mean() > 0.7


@pytest.mark.full
def test_intervals_cover_the_truth_in_nine_of_ten_flights(twin: FlightModel, truth: LinearModel) -> None:
    assert coverage(twin, truth, range(100)).min() >= 0.9


#: Small enough for the aircraft to be linear.
SMALL = (Manoeuvre("pitch", 0.05), Manoeuvre("pitch", -0.05))


def covers(result: AxisResult, truth: LinearModel) -> tuple[bool, bool]:
    """Whether the intervals of Cm_alpha and Cm_q hold the true values.

    Coefficients: M_alpha goes with the square of the speed, which is 0.2 % lower in the windows than at their start.
    """
    expected, found = truth.axes["longitudinal"].derivatives, result.model.derivatives
    return tuple(abs(found[k].value - expected[k].value) <= found[k].interval for k in ("Cm_alpha", "Cm_q"))


def test_an_excitation_of_a_restarted_node_is_another_one(calm: Recording) -> None:
    first = [row for row in calm.excitation if row["id"] == calm.excitation[0]["id"]]
    later = [row for row in calm.excitation if row["target"] == "roll"]
    again = [{**row, "id": first[0]["id"]} for row in later if row["id"] == later[0]["id"]]
    found = read_excitations(Recording(calm.state, calm.surfaces, first[:1] + again).flight().tables["excitation"])
    assert [each.targets for each in found] == [("pitch",), ("roll",)]
    assert found[0].result == "no end in the bag"
    assert found[1].start == again[0]["start_sim_time"]


@pytest.mark.parametrize("factor", [1.0, 3.0, 12.0])
@pytest.mark.parametrize("surfaces_every", [1, 3])
def test_a_simulator_slower_than_real_time_gives_the_same_windows(
    twin: FlightModel, calm: Recording, factor: float, surfaces_every: int
) -> None:
    recording = calm if surfaces_every == 1 else flown(PITCH, model=twin, surfaces_every=surfaces_every)
    expected, _ = find_windows(recording.flight())
    slow = recording.flight()
    begin = slow.tables["state"].time[0]
    for role, table in slow.tables.items():
        slow.tables[role] = replace(table, time=begin + ((table.time - begin) * factor).astype(np.int64))
    found, left_out = find_windows(slow)
    assert left_out == []
    assert [len(window.time) for window in found] == [len(window.time) for window in expected]
    for window, other in zip(found, expected):
        lasts = 3.5 if window.excitation.kind == "3-2-1-1" else 2.0
        assert window.time[-1] == pytest.approx(lasts + 2.0, abs=0.02)  # with its tail
        assert window.bridged == other.bridged
        for name, values in window.columns.items():
            assert np.array_equal(values, other.columns[name]), name


HOUR = 3_600_000_000_000  # [ns]


def an_hour_later(flown: Recording, simulated_s: float) -> dict[str, list[dict]]:
    """The rows of another flight, whose simulated time is that of the first and as much more."""

    def later(row: dict) -> dict:
        moved = {name: row[name] + simulated_s for name in row if name.endswith("sim_time")}
        begun = {"epoch": row["epoch"] + 100} if "epoch" in row else {}
        return {**row, **moved, **begun, "stamp": row["stamp"] + HOUR}

    return {role: [later(row) for row in getattr(flown, role)] for role in ("state", "surfaces", "excitation")}


def test_a_manoeuvre_is_not_cut_by_one_of_another_flight(calm: Recording) -> None:
    once, _ = find_windows(calm.flight())
    for simulated_s in (0.02, 1.0):
        later = an_hour_later(calm, simulated_s)
        twice, left_out = find_windows(
            Recording(*(getattr(calm, role) + rows for role, rows in later.items())).flight()
        )
        assert left_out == []
        assert [len(window.time) for window in twice] == 2 * [len(window.time) for window in once]


def test_one_manoeuvre_that_two_flights_begin_with_is_two(short: Recording) -> None:
    later = an_hour_later(short, 0.0)
    both = Recording(*(getattr(short, role) + rows for role, rows in later.items()))
    found, left_out = find_windows(both.flight())
    assert left_out == []
    assert len(found) == 2 * len(find_windows(short.flight())[0])


def test_each_of_two_flights_with_the_same_simulated_times_has_its_own_frames(calm: Recording) -> None:
    # X-Plane was restarted after the first one, and its time began anew.
    later = an_hour_later(calm, 0.0)
    both = Recording(*(getattr(calm, role) + rows for role, rows in later.items()))
    once, _ = find_windows(calm.flight())
    twice, left_out = find_windows(both.flight())
    assert left_out == []
    assert [int(w.stamp[0]) for w in twice] == [int(w.stamp[0]) + more for more in (0, HOUR) for w in once]
    # Where the second one's frames are missing, the first one's are not taken for them.
    lost, left_out = find_windows(Recording(calm.state, both.surfaces, both.excitation).flight())
    assert [int(w.stamp[0]) for w in lost] == [int(w.stamp[0]) for w in once]
    assert len(left_out) == len(once)


def test_an_excitation_of_single_surfaces_is_one_of_their_axis(calm: Recording, found: dict[str, AxisResult]) -> None:
    surfaces = {"pitch": "elevator1_left, elevator1_right", "roll": "aileron1_wing2_left", "yaw": "rudder1_fin1"}
    renamed = [{**row, "target": surfaces[row["target"]]} for row in calm.excitation]
    flight = Recording(calm.state, calm.surfaces, renamed).flight()
    results = identify(flight, geometry=GEOMETRY).results
    assert {axis: result.model.derivatives for axis, result in results.items()} == {
        axis: result.model.derivatives for axis, result in found.items()
    }


# ------------------------------------------------------------------------------------------------ what is to be noticed


@pytest.mark.parametrize(("shift", "words"), [(1, "one frame too late"), (-1, "one frame too early")])
@pytest.mark.parametrize("axis", ["longitudinal", "lateral"])
def test_inputs_of_another_frame_are_noticed(calm: Recording, axis: str, shift: int, words: str) -> None:
    flight = shifted(calm.flight(), shift)
    result = identify(flight, axis, GEOMETRY).results[axis]
    assert [text for text in result.model.warnings if words in text]


def shifted(flight: Flight, frames: int) -> Flight:
    """The same with the surfaces of so many frames before."""
    columns = flight.tables["surfaces"].columns
    for name in ("delta_aileron", "delta_elevator", "delta_rudder"):
        columns[name] = np.roll(columns[name], frames)
    return flight


@pytest.mark.parametrize("axis", ["longitudinal", "lateral"])
def test_noise_is_not_taken_for_inputs_of_another_frame(twin: FlightModel, axis: str) -> None:
    manoeuvres = PITCH if axis == "longitudinal" else LATERAL
    result = identify(flown(manoeuvres, model=twin, noise=1.0, seed=1).flight(), axis).results[axis]
    assert not [text for text in result.model.warnings if "one frame" in text]


def test_turbulence_is_refused(twin: FlightModel) -> None:
    result = longitudinal(flown(PITCH, model=twin, turbulence=2.0, seed=1))
    assert len(result.refusals) >= 1
    assert "most likely turbulence (the wind changed by" in result.refusals[0]
    assert "fly in calm air" in result.refusals[0]


def test_surfaces_at_20_hz_are_interpolated_with_a_warning(twin: FlightModel, truth: LinearModel) -> None:
    result = longitudinal(flown(PITCH, model=twin, surfaces_every=3))
    assert error(result, truth, "short_period") < 0.02
    assert "rates: surfaces: 999" in result.model.warnings[0]
    assert "(up to 50 ms apart)" in result.model.warnings[0]


def test_what_holds_of_both_axes_is_warned_of_once(truth: LinearModel) -> None:
    axes = {name: replace(model, warnings=[f"{name} alone", "of both"]) for name, model in truth.axes.items()}
    assert replace(truth, axes=axes).warnings == ["longitudinal alone", "of both", "lateral alone"]


def test_a_controller_in_the_loop_is_noticed(twin: FlightModel) -> None:
    result = longitudinal(flown(PITCH, model=twin, pitch_feedback=2.0))
    assert "the elevator goes on moving after the excitation's end" in result.model.warnings[0]


def test_auto_is_noticed(calm: Recording) -> None:
    flight = Recording(calm.state, calm.surfaces, calm.excitation, [{"stamp": 0, "mode": 2}]).flight()
    result = identify(flight, "longitudinal").results["longitudinal"]
    assert "a controller flew (AUTO)" in result.model.warnings[0]


def test_a_manoeuvre_beyond_the_linear_is_noticed(twin: FlightModel) -> None:
    result = longitudinal(flown((Manoeuvre("pitch", 0.3), Manoeuvre("pitch", -0.3)), model=twin))
    assert [text for text in result.model.warnings if "where the aircraft is not linear" in text]


def test_one_window_leaves_none_for_validation(twin: FlightModel) -> None:
    result = longitudinal(flown((Manoeuvre("pitch", 0.1),), model=twin))
    assert not result.validation
    assert [text for text in result.model.warnings if "no window is left for validation" in text]


def test_frames_of_changing_length_are_no_matter(twin: FlightModel, truth: LinearModel) -> None:
    recording = flown(PITCH, model=twin)
    kept = [k for k in range(len(recording.state)) if k % 7 not in (2, 5)]
    few = Recording([recording.state[k] for k in kept], recording.surfaces, recording.excitation)
    assert error(longitudinal(few), truth, "short_period") < 0.02


# ----------------------------------------------------------------------------------------------------------- refusals


def without(recording: Recording, **changes: list) -> Flight:
    roles = {name: getattr(recording, name) for name in ("state", "surfaces", "excitation", "mode", "fuel")}
    return Recording(**{**roles, **changes}).flight()


@pytest.fixture(scope="module")
def short(twin: FlightModel) -> Recording:
    return flown(PITCH[:1], model=twin)


@pytest.mark.parametrize(
    ("role", "words"),
    [
        ("state", "flown has no flight_state; record all topics"),
        ("surfaces", "flown has no mission/surfaces; record all topics"),
        ("excitation", "flown has no excitation/state; record all topics"),
    ],
)
def test_a_bag_without_a_topic_is_refused(short: Recording, role: str, words: str) -> None:
    with pytest.raises(IdentificationError, match=re.escape(words)):
        identify(without(short, **{role: []}))


def changed(rows: list[dict], **values: object) -> list[dict]:
    return [{**row, **values} for row in rows]


@pytest.mark.parametrize(
    ("role", "change", "words"),
    [
        ("excitation", {"active": False}, "no excitation ran; windows are taken from excitation/state"),
        ("excitation", {"target": "throttle"}, "(3-2-1-1 on throttle): moves neither elevator nor aileron nor rudder"),
        ("state", {"valid": 262143 - 512}, "air velocity was not known all the time"),
        ("state", {"on_ground": True}, "the aircraft was on the ground"),
        ("state", {"paused": True}, "simulator time stood still in it"),
        ("surfaces", {"valid": 0}, "elevator not known all the time"),
        ("surfaces", {"delta_elevator": np.float32(0.0)}, "elevator moves by more than 0.1 deg"),
    ],
)
def test_a_flight_that_says_nothing_is_refused(short: Recording, role: str, change: dict, words: str) -> None:
    with pytest.raises(IdentificationError, match=re.escape(words)):
        identify(without(short, **{role: changed(getattr(short, role), **change)}))


def test_an_aborted_excitation_is_refused(short: Recording) -> None:
    begin, end = short.excitation
    aborted = [begin, {**end, "result": "aborted: roll 46.0 deg is beyond the limit of 45.0 deg"}]
    with pytest.raises(IdentificationError, match=r"was aborted: roll 46\.0 deg"):
        identify(without(short, excitation=aborted))


def test_a_gap_is_refused(short: Recording) -> None:
    state = short.state[:100] + short.state[140:]
    with pytest.raises(IdentificationError, match="have a gap or a reset in it"):
        identify(without(short, state=state))


def test_a_clock_set_back_is_refused(short: Recording) -> None:
    state = list(short.state)
    times = [{name: row[name] for name in ("sim_time", "sim_time_unwrapped")} for row in state[100:102]]
    state[100:102] = [{**row, **time} for row, time in zip(state[100:102], reversed(times))]
    with pytest.raises(IdentificationError, match="the host's clock was set back in it"):
        identify(without(short, state=state))


def test_silent_surfaces_are_refused(short: Recording) -> None:
    surfaces = short.surfaces[:100] + short.surfaces[140:]
    with pytest.raises(IdentificationError, match=r"mission/surfaces is silent for 0\.68 s"):
        identify(without(short, surfaces=surfaces))


def test_a_window_that_is_left_out_is_reported_and_the_others_are_used(calm: Recording) -> None:
    begin, end, *rest = calm.excitation
    found = identify(without(calm, excitation=[begin, {**end, "result": "aborted: stopped by /me"}, *rest]))
    assert found.notes == ["excitation 1 (3-2-1-1 on pitch) was aborted: stopped by /me"]
    assert [w.excitation.number for w in found.results["longitudinal"].windows] == [2, 3]


def test_a_window_of_an_unknown_input_is_left_out_for_its_axis_alone(calm: Recording) -> None:
    *_, last, _end = calm.excitation  # yaw
    rows = [
        {**row, "valid": row["valid"] & ~SurfaceStatesValid.RUDDER} if 1.0 < late < 1.2 else row
        for row in calm.surfaces
        for late in [row["sim_time"] - last["start_sim_time"]]
    ]
    found = identify(without(calm, surfaces=rows))
    assert found.notes == [
        "excitation 9 (3-2-1-1 on yaw) for the lateral axis: rudder not known all the time (bits in `valid` of "
        "surfaces)"
    ]
    assert [w.excitation.number for w in found.results["lateral"].windows] == [4, 5, 7, 8]
    assert [w.excitation.number for w in found.results["longitudinal"].windows] == [1, 2]
    with pytest.raises(IdentificationError, match=r"9 cannot be kept .* 6, 7, 8; excitation 9 .* rudder not known"):
        identify(without(calm, surfaces=rows), validate="9")


def test_an_axis_without_a_model_does_not_take_that_of_the_other(calm: Recording) -> None:
    still = without(calm, surfaces=changed(calm.surfaces, delta_aileron=np.float32(0.0), delta_rudder=np.float32(0.0)))
    found = identify(still)
    assert list(found.results) == list(found.model.axes) == ["longitudinal"]
    (note,) = found.notes
    assert note.startswith("no lateral model: excitation 4 (3-2-1-1 on roll), ")
    assert "neither aileron nor rudder moves by more than 0.1 deg" in note
    with pytest.raises(IdentificationError, match=r"^flown: no lateral model: excitation 4 .* neither aileron nor"):
        identify(still, "lateral")


def test_without_a_model_of_any_axis_every_reason_is_said(calm: Recording) -> None:
    known = SurfaceStatesValid.AILERON1 | SurfaceStatesValid.RUDDER
    still = {"delta_aileron": np.float32(0.0), "delta_rudder": np.float32(0.0)}
    with pytest.raises(IdentificationError) as raised:
        identify(without(calm, surfaces=changed(calm.surfaces, valid=known, **still)))
    assert "excitation 1 (3-2-1-1 on pitch) for the longitudinal axis: elevator not known" in str(raised.value)
    assert "; no lateral model: excitation 4 (3-2-1-1 on roll), " in str(raised.value)


def test_an_axis_or_a_window_that_is_not_there_is_refused(short: Recording) -> None:
    with pytest.raises(IdentificationError, match=r"no excitation moves the lateral axis; there is: excitation 1"):
        identify(short.flight(), "lateral")
    with pytest.raises(IdentificationError, match="excitation 7 cannot be kept for validation; flown has: 1"):
        identify(short.flight(), validate="7")
    with pytest.raises(IdentificationError, match="is the only window: nothing would be left to fit"):
        identify(short.flight(), validate="1")
