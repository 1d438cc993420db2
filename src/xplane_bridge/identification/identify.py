"""From a recorded flight to linear models: fit, intervals, tests of the residuals, validation."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Optional

import numpy as np

from xplane_bridge.bags.flight import Flight
from xplane_bridge.identification import intervals
from xplane_bridge.identification.coefficients import Geometry, derivatives, mass_warning
from xplane_bridge.identification.equation_error import equation_error
from xplane_bridge.identification.model import (
    AXES,
    Axis,
    AxisModel,
    IdentificationError,
    LinearModel,
    Signal,
    name_modes,
    signal_names,
    trim_estimates,
)
from xplane_bridge.identification.output_error import Fit, fit, refit, simulate
from xplane_bridge.identification.windows import TAIL_S, Window, find_windows, with_known_inputs
from xplane_bridge.units import GRAVITY_MPS2

#: An input that moves less than this in all windows is none [rad].
_LEAST_INPUT_RAD = math.radians(0.1)
#: From so many windows that move an input on, its last one is kept for validation.
_SPARE_FROM = 3
#: Residuals are smoothed over this time before they are compared with the motion: noise goes, what lasts stays [s].
_SMOOTHING_S = 0.25
#: Share of the motion that lasting residuals may have, and from which on a warning is given.
_MOST_LASTING, _MUCH_LASTING = 0.07, 0.04
#: Widest interval of the main modes, against their size.
_WIDEST = 0.25
#: By how much less residuals must change with inputs shifted by a frame, in multiples of what noise does, and at least.
_SHIFT_SIGMA, _SHIFT_GAIN = 3.0, 0.01
#: Beyond these the motion is not small [rad], [rad], share of the speed.
_LARGE = {"alpha": math.radians(5.0), "beta": math.radians(6.0), "roll": math.radians(35.0)}
_LARGE_SPEED = 0.15
_WORST_VALIDATION = 0.15
_MAIN_MODES = {"longitudinal": ("short_period",), "lateral": ("roll", "dutch_roll")}
_TESTED = {"longitudinal": ("alpha", "pitch_rate"), "lateral": ("beta", "roll_rate", "yaw_rate")}


@dataclass
class AxisResult:
    """The model of one axis and what it was made from."""

    model: AxisModel
    windows: list[Window]
    simulated: list[np.ndarray]  #: states by window
    validation: list[Window] = field(default_factory=list)
    validated: list[np.ndarray] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)  #: why the model is not to be used


@dataclass
class Identification:
    """What a flight gives."""

    model: LinearModel
    results: dict[str, AxisResult]
    notes: list[str]  #: manoeuvres that were left out, and axes without a model, and why

    @property
    def refusals(self) -> list[str]:
        """Of all axes."""
        return [f"{name}: {text}" for name, result in self.results.items() for text in result.refusals]


def identify(
    flight: Flight,
    axis: Optional[str] = None,
    geometry: Optional[Geometry] = None,
    aircraft: str = "",
    tail: float = TAIL_S,
    validate: Optional[str] = None,
) -> Identification:
    """Identify the axes that a flight's excitations move.

    Args:
        flight: Read with `bags.flight.read_flight`.
        axis: Only this one.
        geometry: Sizes of the aircraft, for derivatives as coefficients.
        aircraft: Its name, for the file.
        tail: How long the motion is followed after an excitation [s].
        validate: Name of the excitation that is kept for validation of the axes that it moves; None: chosen, as for the
            others.

    Raises:
        IdentificationError: There is nothing to identify from. A model that is not to be used is no exception: see
            `AxisResult.refusals`.
    """
    windows, notes = find_windows(flight, tail)
    names = list(AXES) if axis is None else [axis]
    usable: dict[str, list[Window]] = {}
    reasons: list[str] = []
    for name in names:
        usable[name], unknown = with_known_inputs(windows, AXES[name])
        reasons += unknown
    known = {w.excitation.name for mine in usable.values() for w in mine}
    if validate is not None and known and validate not in known:
        have = ", ".join(w.excitation.name for w in windows if w.excitation.name in known)
        of_axis = "" if axis is None else f" for the {axis} axis"
        about = f"excitation {validate} "
        left_out = "".join(f"; {note}" for note in (*notes, *reasons) if about in note)
        if any(name.startswith(f"{validate}.") for name in known):
            left_out += f"; {validate}.1 is the first one of number {validate}: numbers begin anew with tx_node"
        msg = f"{about}cannot be kept for validation; {flight.name} has{of_axis}: {have}{left_out}"
        raise IdentificationError(msg)
    results = {}
    for name, mine in usable.items():
        if not mine:
            continue
        try:
            results[name] = identify_axis(mine, AXES[name], geometry, validate)
        except IdentificationError as error:
            reasons.append(f"no {name} model: {error}")
    if not results:
        there = "; ".join(w.excitation.label for w in windows)
        msg = "; ".join(reasons) or f"no excitation moves the {axis} axis; there is: {there}"
        raise IdentificationError(f"{flight.name}: {msg}")
    used = [w for result in results.values() for w in result.windows]
    source = {"program": "identify_model", "bag": flight.name, "windows": [w.excitation.label for w in used]}
    model = LinearModel(
        aircraft, trim_estimates(_mean_conditions(used)), {k: r.model for k, r in results.items()}, source
    )
    return Identification(model, results, notes + reasons)


def identify_axis(
    windows: list[Window], axis: Axis, geometry: Optional[Geometry] = None, validate: Optional[str] = None
) -> AxisResult:
    """Identify one axis from its windows.

    Raises:
        IdentificationError: No input moves in what is to be fitted, or the only window is to be kept for validation.
    """
    fitted, spare = _split(windows, validate)
    inputs = _moved_inputs(fitted, axis)
    conditions = _mean_conditions(fitted)
    found, free = _fit(fitted, axis, inputs, conditions)
    samples = [w.samples(axis, inputs) for w in fitted]
    width = intervals.factor(found, sum(len(s.time) for s in samples))
    covariance = intervals.covariance(found)
    modes = intervals.mode_intervals(name_modes(axis, found.a), found, covariance, width)
    c, d = _output_rows(fitted, axis, inputs)
    model = AxisModel(axis, inputs, found.a, found.b, c, d, modes)
    model.a_interval, model.b_interval = intervals.element_intervals(found, covariance, width)
    of_loading: list[str] = []
    if geometry is not None:
        speed, pressure = conditions["true_airspeed"][0], conditions["dynamic_pressure"][0]
        mass = conditions["mass"][0]
        if math.isfinite(pressure):
            known = None if not math.isfinite(mass) else mass
            model.derivatives = derivatives(model, geometry, speed, pressure, known)
            of_loading = mass_warning(geometry, known)
    result = AxisResult(model, fitted, found.simulated, spare)
    result.validated = [simulate(w.samples(axis, inputs), found.a, found.b) for w in spare]
    model.warnings = of_loading + _input_warning(fitted) + [text for w in fitted for text in w.warnings]
    model.warnings += _size_warnings(fitted, axis)
    model.warnings += _shift_warning(fitted, axis, inputs, found, free)
    _judge_residuals(result, found)
    _judge_modes(result, found)
    _judge_validation(result, inputs)
    model.facts["fit"] = _goodness(fitted, found.simulated, axis, inputs)
    model.facts["windows"] = [w.excitation.label for w in fitted]
    return result


def _moved(windows: list[Window], axis: Axis) -> tuple[Signal, ...]:
    return tuple(s for s in axis.inputs if any(np.ptp(w.columns[s.name]) > _LEAST_INPUT_RAD for w in windows))


def _moved_inputs(windows: list[Window], axis: Axis) -> tuple[Signal, ...]:
    moved = _moved(windows, axis)
    if not moved:
        names = " nor ".join(signal_names(axis.inputs))
        labels = ", ".join(w.excitation.label for w in windows)
        msg = (
            f"{labels}: neither {names} moves by more than {math.degrees(_LEAST_INPUT_RAD):.1f} deg; is the command on "
            "its way to the surfaces (control/applied), and the amplitude large enough?"
        )
        raise IdentificationError(msg)
    return moved


def _split(windows: list[Window], validate: Optional[str]) -> tuple[list[Window], list[Window]]:
    """The windows to fit, and those kept for validation: of each target that has enough its last one."""
    if validate in [w.excitation.name for w in windows]:
        spare = [w for w in windows if w.excitation.name == validate]
        rest = [w for w in windows if w.excitation.name != validate]
        if not rest:
            msg = f"{spare[0].excitation.label} is the only window: nothing would be left to fit; fly one more"
            raise IdentificationError(msg)
        return rest, spare
    spare = []
    for targets in sorted({w.excitation.targets for w in windows}):
        same = [w for w in windows if w.excitation.targets == targets]
        if len(same) >= _SPARE_FROM:
            spare.append(same[-1])
    return [w for w in windows if not any(w is s for s in spare)], spare


def _fit(
    windows: list[Window], axis: Axis, inputs: tuple[Signal, ...], conditions: dict[str, tuple[float, str]]
) -> tuple[Fit, np.ndarray]:
    """Output error from equation error. What gravity does is known, and not estimated.

    The last row (rate of an angle) is estimated although kinematics gives it: a simulator's integration makes it some
    per mille another one, and delays of the inputs go there instead of into the modes.
    """
    samples = [w.samples(axis, inputs) for w in windows]
    a, b = equation_error([s.time for s in samples], [s.states for s in samples], [s.inputs for s in samples])
    free = np.ones((len(a), len(a) + b.shape[1]), dtype=bool)
    free[:, 3] = False
    speed, path = conditions["true_airspeed"][0], math.radians(conditions["flight_path"][0])
    if axis.name == "longitudinal":
        a[:, 3] = [-GRAVITY_MPS2 * math.cos(path), -GRAVITY_MPS2 * math.sin(path) / speed, 0.0, 0.0]
    else:
        pitch = math.radians(conditions["pitch"][0])
        a[:, 3] = [GRAVITY_MPS2 * math.cos(pitch) / speed, 0.0, 0.0, 0.0]
    return fit(samples, a, b, free), free


def _output_rows(windows: list[Window], axis: Axis, inputs: tuple[Signal, ...]) -> tuple[np.ndarray, np.ndarray]:
    """C and D: the states themselves, and the specific forces by least squares on measured states and inputs."""
    left, right = [], []
    for window in windows:
        s = window.samples(axis, inputs)
        forces = np.column_stack([window.columns[signal.name] for signal in axis.forces])[1:-1]
        known = np.hstack([s.states, s.inputs])
        left.append(known - known.mean(axis=0))
        right.append(forces - forces.mean(axis=0))
    rows = np.linalg.lstsq(np.vstack(left), np.vstack(right), rcond=None)[0].T
    count = len(axis.states)
    return (
        np.vstack([np.eye(count), rows[:, :count]]),
        np.vstack([np.zeros((count, len(inputs))), rows[:, count:]]),
    )


def _mean_conditions(windows: list[Window]) -> dict[str, tuple[float, str]]:
    first = windows[0].conditions
    return {name: (float(np.mean([w.conditions[name][0] for w in windows])), unit) for name, (_, unit) in first.items()}


def _input_warning(windows: list[Window]) -> list[str]:
    gap = max(window.bridged for window in windows)
    if gap == 0.0:
        return []
    return [
        f"mission/surfaces has no sample for every frame (up to {gap * 1e3:.0f} ms apart): inputs are interpolated; "
        "let rx_node ask for them every frame (rates: surfaces: 999) before recording"
    ]


def _size_warnings(windows: list[Window], axis: Axis) -> list[str]:
    out = []
    names = signal_names(axis.states)
    for window in windows:
        large = [name for name in _LARGE if name in names and _reach(window.columns[name]) > _LARGE[name]]
        if (
            "true_airspeed" in names
            and _reach(window.columns["true_airspeed"]) > _LARGE_SPEED * window.conditions["true_airspeed"][0]
        ):
            large.append("true_airspeed")
        if large:
            out.append(
                f"{window.excitation.label}: {', '.join(large)} move far from trim, where the aircraft is not linear; "
                "use a smaller amplitude, or both signs of the same manoeuvre"
            )
    return out


def _reach(values: np.ndarray) -> float:
    return float(np.max(np.abs(values - values[0])))


def _shift_warning(
    windows: list[Window], axis: Axis, inputs: tuple[Signal, ...], found: Fit, free: np.ndarray
) -> list[str]:
    """Whether inputs of one frame earlier or later fit better: then they are not of the same frames as the states.

    It shows where surfaces move fast, so it is looked for in what the rates' residuals change from frame to frame.
    """
    rates = [k for k, signal in enumerate(axis.states) if signal.name.endswith("_rate")]
    changes = {}
    for shift in (-1, 0, 1):
        residuals = refit([w.samples(axis, inputs, shift) for w in windows], found, free)
        changes[shift] = np.concatenate([np.diff(r[:, rates], axis=0) ** 2 for r in residuals])
    costs = {
        shift: float(np.mean(squares.mean(axis=0) / changes[0].mean(axis=0))) for shift, squares in changes.items()
    }
    best = min(costs, key=lambda shift: costs[shift])
    # What noise alone makes of the difference: a shift's share of the squares, over as many samples.
    noise = 2.0 * math.sqrt(max((costs[-1] + costs[1]) / 2.0 - 1.0, 0.0) / changes[0].size)
    if best == 0 or 1.0 - costs[best] <= max(_SHIFT_SIGMA * noise, _SHIFT_GAIN):
        return []
    gain = 100.0 * (1.0 - costs[best])
    found_late = "late: those of one frame later" if best < 0 else "early: those of one frame earlier"
    return [
        f"the inputs come about one frame too {found_late} fit better (residuals change {gain:.0f} % less); inputs and "
        "states must be of the same frame, so compare sim_time of flight_state and mission/surfaces"
    ]


def _judge_residuals(result: AxisResult, found: Fit) -> None:
    """Refuse where something that was not measured moves the aircraft: residuals that last, and are large."""
    axis = result.model.axis
    shares = {}
    for k, name in enumerate(signal_names(axis.states)):
        lasting, motion = [], []
        for window, residual in zip(result.windows, found.residuals):
            lasting.append(_smoothed(window.time[1:-1], residual[:, k]))
            values = window.columns[name][1:-1]
            motion.append(values - values.mean())
        shares[name] = float(_rms(lasting) / max(_rms(motion), 1e-12))
    result.model.facts["lasting_residuals"] = {name: round(share, 5) for name, share in shares.items()}
    tested = {name: share for name, share in shares.items() if name in _TESTED[axis.name]}
    worst = max(tested, key=lambda name: tested[name])
    text = (
        f"residuals of {worst} last longer than noise does and are {100 * tested[worst]:.0f} % of its motion "
        f"(expected at most {100 * _MOST_LASTING:.0f} %): something else than the inputs moved the aircraft, most "
        f"likely turbulence{_wind_words(result.windows)}, or it was flown beyond what is linear; fly in calm air, or "
        "longer and with several windows"
    )
    if tested[worst] > _MOST_LASTING:
        result.refusals.append(text)
    elif tested[worst] > _MUCH_LASTING:
        result.model.warnings.append(text)


def _smoothed(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    count = max(1, round(_SMOOTHING_S / float(np.mean(np.diff(time)))))
    return np.convolve(values, np.ones(count) / count, mode="valid" if count < len(values) else "same")


def _rms(parts: list[np.ndarray]) -> float:
    return math.sqrt(float(np.mean(np.concatenate(parts) ** 2)))


def _wind_words(windows: list[Window]) -> str:
    gust = max(w.conditions.get("gust", (math.nan, ""))[0] for w in windows)
    return f" (the wind changed by {gust:.1f} m/s rms)" if math.isfinite(gust) and gust > 0.1 else ""


def _judge_modes(result: AxisResult, found: Fit) -> None:
    model = result.model
    if not found.converged:
        result.refusals.append(
            "the fit does not come to an end: the manoeuvres do not determine the model; excite each input by itself "
            "(3-2-1-1 or multisine), and longer"
        )
    names = [mode.name for mode in model.modes]
    missing = [name for name in _MAIN_MODES[model.axis.name] if name not in names]
    if missing:
        there = ", ".join(f"{mode.eigenvalue:.3g}" for mode in model.modes)
        result.refusals.append(f"no {' nor '.join(missing)} among the eigenvalues ({there}): excite that motion more")
        return
    for name in _MAIN_MODES[model.axis.name]:
        share = model.mode(name).relative_interval
        if not share < _WIDEST:
            result.refusals.append(
                f"the interval of the {name} mode is {100 * share:.0f} % of it, expected less than "
                f"{100 * _WIDEST:.0f} %: the manoeuvres hardly show it; fly more windows, or a larger amplitude"
            )


def _judge_validation(result: AxisResult, inputs: tuple[Signal, ...]) -> None:
    model = result.model
    if not result.validation:
        model.warnings.append(
            f"no window is left for validation; fly the same excitation {_SPARE_FROM} times, or name one with "
            "--validate"
        )
        return
    model.facts["validation"] = _goodness(result.validation, result.validated, model.axis, inputs)
    labels = ", ".join(w.excitation.label for w in result.validation)
    others = [s for s in _moved(result.validation, model.axis) if s not in inputs]
    if others:
        names = " and ".join(signal_names(others))
        model.warnings.append(
            f"validation: {labels} moves {names}, which no fitted window does: the model is without that input and "
            "cannot follow the motion; fly one more manoeuvre that moves it, or keep another one with --validate"
        )
    tested = _TESTED[model.axis.name]
    worst = max((model.facts["validation"][name]["theil"], name) for name in tested)
    if worst[0] > _WORST_VALIDATION:
        model.warnings.append(
            f"validation: {worst[1]} of {labels} has a Theil coefficient of {worst[0]:.2f}, expected at most "
            f"{_WORST_VALIDATION}: the model does not hold for that window"
        )


def _goodness(
    windows: list[Window], simulated: list[np.ndarray], axis: Axis, inputs: tuple[Signal, ...]
) -> dict[str, Any]:
    """Share of the variance explained, and Theil's coefficient (0 perfect, 1 nothing), by state."""
    out = {}
    for k, name in enumerate(signal_names(axis.states)):
        measured, modelled = [], []
        for window, run in zip(windows, simulated):
            values = window.samples(axis, inputs).states[:, k]
            measured.append(values - values.mean())
            modelled.append(run[:, k] - values.mean())
        error = [m - y for m, y in zip(measured, modelled)]
        explained = 1.0 - (_rms(error) / max(_rms(measured), 1e-12)) ** 2
        theil = _rms(error) / max(_rms(measured) + _rms(modelled), 1e-12)
        out[name] = {"explained": round(explained, 5), "theil": round(theil, 5)}
    return out
