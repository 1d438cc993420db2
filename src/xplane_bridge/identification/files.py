"""Linear models in files: YAML, JSON, MATLAB; and as python-control's systems."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Callable, Optional

import numpy as np
import yaml

from xplane_bridge import __version__
from xplane_bridge.errors import text_problem, yaml_problem
from xplane_bridge.identification.model import (
    AXES,
    REDUCED,
    AxisModel,
    Estimate,
    IdentificationError,
    LinearModel,
    Mode,
    Signal,
    name_modes,
)

#: What a file says of itself.
FORMAT = "xplane_bridge linear model 1"
_DIGITS = 8


def write_model(model: LinearModel, path: Path) -> None:
    """Write a model in the format that the file's suffix names.

    Raises:
        IdentificationError: No such format, or the file cannot be written.
    """
    writer = _WRITERS.get(path.suffix)
    if writer is None:
        msg = f"{path}: expected a file that ends in {', '.join(_WRITERS)}"
        raise IdentificationError(msg)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writer(to_dict(model), path)
    except OSError as error:
        msg = f"{path}: {error.strerror or error}"
        raise IdentificationError(msg) from None


def read_model(path: Path) -> LinearModel:
    """Read a model that `write_model` wrote as YAML or JSON.

    Raises:
        IdentificationError: It cannot be read, or holds something else.
    """
    try:
        text = path.read_text(encoding="utf-8")
        # To YAML a number as JSON writes it may be a text: 1e-05.
        content = json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: {text_problem(error)}"
        raise IdentificationError(msg) from None
    except json.JSONDecodeError as error:
        msg = f"{path}: does not parse as JSON: {error}"
        raise IdentificationError(msg) from None
    except yaml.YAMLError as error:
        msg = f"{path}: {yaml_problem(error)}"
        raise IdentificationError(msg) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        msg = f"{path}: not a model of identify_model or linearise_model (expected `format: {FORMAT}`)"
        raise IdentificationError(msg)
    axes = {name: _axis_from(name, values) for name, values in content["axes"].items()}
    trim = {name: Estimate(entry["value"], entry["unit"]) for name, entry in content["trim"].items()}
    return LinearModel(content["aircraft"], trim, axes, content["source"])


def state_space(model: AxisModel) -> Any:
    """Give a model as python-control's StateSpace, with the names of its signals.

    Raises:
        IdentificationError: python-control is not installed.
    """
    try:
        import control
    except ImportError:
        msg = "python-control is not installed: pip install control"
        raise IdentificationError(msg) from None
    system = control.ss(model.a, model.b, model.c, model.d)
    labels = {
        "states": [signal.name for signal in model.axis.states],
        "inputs": [signal.name for signal in model.inputs],
        "outputs": [signal.name for signal in model.outputs],
    }
    system.set_states(labels["states"])
    system.set_inputs(labels["inputs"])
    system.set_outputs(labels["outputs"])
    return system


def to_dict(model: LinearModel) -> dict[str, Any]:
    """Give a model as plain maps, lists and numbers; what is not known is left out."""
    return {
        "format": FORMAT,
        "version": __version__,
        "aircraft": model.aircraft,
        "source": model.source,
        "trim": {name: _estimate(value) for name, value in model.trim.items()},
        "axes": {name: _axis(axis) for name, axis in model.axes.items()},
    }


def _axis(model: AxisModel) -> dict[str, Any]:
    out: dict[str, Any] = {
        "states": [{"name": s.name, "unit": s.unit} for s in model.axis.states],
        "inputs": [{"name": s.name, "unit": s.unit} for s in model.inputs],
        "outputs": [{"name": s.name, "unit": s.unit} for s in model.outputs],
    }
    for name in ("a", "b", "c", "d"):
        out[name.upper()] = _matrix(getattr(model, name))
    if model.a_interval is not None and model.b_interval is not None:
        out["A_interval_95"], out["B_interval_95"] = _matrix(model.a_interval), _matrix(model.b_interval)
    out["modes"] = [_mode(mode) for mode in model.modes]
    if model.derivatives:
        out["derivatives"] = {name: _estimate(value) for name, value in model.derivatives.items()}
    out["reduced"] = {}
    for name in REDUCED[model.axis.name]:
        states, a, b = model.reduced(name)
        out["reduced"][name] = {"states": states, "A": _matrix(a), "B": _matrix(b)}
    if model.facts:
        out["facts"] = model.facts
    if model.warnings:
        out["warnings"] = model.warnings
    return out


def _axis_from(name: str, values: dict[str, Any]) -> AxisModel:
    axis = AXES[name]
    a, b, c, d = (np.array(values[key], dtype=float) for key in "ABCD")
    inputs = tuple(Signal(entry["name"], entry["unit"]) for entry in values["inputs"])
    model = AxisModel(axis, inputs, a, b, c, d, name_modes(axis, a))
    if "A_interval_95" in values:
        model.a_interval, model.b_interval = np.array(values["A_interval_95"]), np.array(values["B_interval_95"])
    widths = {entry["name"]: entry.get("interval_95", [math.nan, math.nan]) for entry in values["modes"]}
    model.modes = [Mode(m.name, m.eigenvalue, *widths.get(m.name, (math.nan, math.nan))) for m in model.modes]
    model.derivatives = {
        key: Estimate(entry["value"], entry["unit"], entry.get("interval_95", math.nan))
        for key, entry in values.get("derivatives", {}).items()
    }
    model.facts, model.warnings = values.get("facts", {}), values.get("warnings", [])
    return model


def _mode(mode: Mode) -> dict[str, Any]:
    out: dict[str, Any] = {
        "name": mode.name,
        "eigenvalue": [_rounded(mode.eigenvalue.real), _rounded(mode.eigenvalue.imag)],
        "unit": "1/s",
        "frequency_rad_s": _rounded(mode.frequency),
        "damping": _rounded(mode.damping),
    }
    if math.isfinite(mode.interval_real):
        out["interval_95"] = [_rounded(mode.interval_real), _rounded(mode.interval_imag)]
    return out


def _estimate(value: Estimate) -> dict[str, Any]:
    out: dict[str, Any] = {"value": _rounded(value.value), "unit": value.unit}
    if math.isfinite(value.interval):
        out["interval_95"] = _rounded(value.interval)
    return out


def _matrix(values: np.ndarray) -> list[list[float]]:
    return [[_rounded(value) for value in row] for row in values]


def _rounded(value: float) -> float:
    return float(f"{float(value):.{_DIGITS}g}")


class _Dumper(yaml.SafeDumper):  # type: ignore[misc]  # PyYAML has no types
    """Rows of matrices and small maps on one line."""

    def represent_sequence(self, tag: str, sequence: Any, flow_style: Optional[bool] = None) -> Any:
        flat = all(isinstance(item, (int, float)) for item in sequence)
        return super().represent_sequence(tag, sequence, flat or flow_style)

    def represent_mapping(self, tag: str, mapping: Any, flow_style: Optional[bool] = None) -> Any:
        items = mapping.values() if isinstance(mapping, dict) else []
        flat = bool(items) and len(items) <= 3 and all(isinstance(item, (int, float, str)) for item in items)
        return super().represent_mapping(tag, mapping, flat or flow_style)


def _write_yaml(content: dict[str, Any], path: Path) -> None:
    path.write_text(yaml.dump(content, Dumper=_Dumper, sort_keys=False, width=120), encoding="utf-8")


def _write_json(content: dict[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _write_matlab(content: dict[str, Any], path: Path) -> None:
    """A structure for each axis: A, B, C, D and the names of the signals, for `ss(m.A, m.B, m.C, m.D)`."""
    from scipy.io import savemat

    structures: dict[str, Any] = {
        "aircraft": content["aircraft"],
        "trim": {name: entry["value"] for name, entry in content["trim"].items()},
    }
    for name, axis in content["axes"].items():
        structures[name] = {
            **{key: np.array(axis[key]) for key in "ABCD"},
            **{
                f"{kind}_{what}": np.array([signal[key] for signal in axis[kind]], dtype=object)
                for kind in ("states", "inputs", "outputs")
                for key, what in (("name", "names"), ("unit", "units"))
            },
            "eigenvalues": np.array([complex(*mode["eigenvalue"]) for mode in axis["modes"]]),
        }
    savemat(str(path), structures)


_WRITERS: dict[str, Callable[[dict[str, Any], Path], None]] = {
    ".yaml": _write_yaml,
    ".json": _write_json,
    ".mat": _write_matlab,
}
