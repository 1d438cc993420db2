"""Identified models as one HTML page: modes, derivatives, matrices, and each window as flown and as modelled."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Optional

import numpy as np

from xplane_bridge.plotting import interactive
from xplane_bridge.plotting.page import Section, day_of, number, page, rows_table
from xplane_bridge.plotting.spec import Panel, Series, TimeFigure

if TYPE_CHECKING:
    from xplane_bridge.bags.flight import Flight
    from xplane_bridge.identification.identify import AxisResult, Identification
    from xplane_bridge.identification.model import AxisModel
    from xplane_bridge.identification.windows import Window

#: Units as they are shown: radians as degrees.
_SHOWN = {"rad": ("deg", math.degrees(1.0)), "rad/s": ("deg/s", math.degrees(1.0)), "m/s": ("m/s", 1.0)}


def build(found: Identification, flight: Flight) -> str:
    """Make the page."""
    sections: list[Section] = [("summary", "Summary", _summary(found))]
    for name, result in found.results.items():
        sections.append((name, f"{name.capitalize()} model", _model(result.model)))
        for use, windows, runs in (
            ("fitted", result.windows, result.simulated),
            ("validation", result.validation, result.validated),
        ):
            for window, run in zip(windows, runs):
                figure = _figure(window, run, result, use)
                title = f"{name.capitalize()} {use} {window.excitation.name}: {figure.title}"
                sections.append((figure.key, title, interactive.draw(figure, int(window.stamp[0]))))
    subtitle = f"{flight.name} \u00b7 {day_of(flight.start)}"
    return page(f"Identified model: {found.model.aircraft or flight.name}", subtitle, sections)


def _summary(found: Identification) -> str:
    cards = "".join(
        f'<div class="card"><b>{number(entry.value)} {html.escape(entry.unit)}</b>'
        f"<span>{html.escape(name.replace('_', ' '))}</span></div>"
        for name, entry in found.model.trim.items()
    )
    text = f'<h3>Trim point: means of the windows</h3><div class="cards">{cards}</div>'
    for title, style, lines in (
        ("What speaks against the model", "bad", found.refusals),
        ("Warnings", "note", found.model.warnings),
        ("Left out", "note", found.notes),
    ):
        if lines:
            items = "".join(f'<li class="{style}">{html.escape(line)}</li>' for line in lines)
            text += f"<h3>{title}</h3><ul>{items}</ul>"
    return text


def _model(model: AxisModel) -> str:
    text = "<h3>Modes</h3>" + _modes(model)
    fits = [("fit", model.facts.get("fit", {})), ("validation", model.facts.get("validation", {}))]
    rows = [
        (html.escape(name), what, f"{100 * values['explained']:.2f} %", number(values["theil"], 3))
        for what, outputs in fits
        for name, values in outputs.items()
    ]
    text += "<h3>Fit</h3>" + rows_table(("state", "", "variance explained", "Theil coefficient"), rows, (2, 3))
    if model.derivatives:
        cells = [(html.escape(k), number(e.value), _width(e.interval), e.unit) for k, e in model.derivatives.items()]
        text += "<h3>Derivatives</h3>" + rows_table(("coefficient", "value", "95 % +-", "unit"), cells, (1, 2))
    text += "<h3>Matrices</h3>"
    states, inputs = [s.name for s in model.axis.states], [s.name for s in model.inputs]
    outputs = [s.name for s in model.outputs]
    for name, matrix, widths, left, top in (
        ("A", model.a, model.a_interval, states, states),
        ("B", model.b, model.b_interval, states, inputs),
        ("C", model.c, None, outputs, states),
        ("D", model.d, None, outputs, inputs),
    ):
        text += _matrix(name, matrix, widths, left, top)
    units = ", ".join(f"{s.name} [{s.unit}]" for s in (*model.outputs, *model.inputs))
    return text + f"<p>{html.escape(units)}; differences from the trim point, time in s.</p>"


def _modes(model: AxisModel) -> str:
    rows = []
    for mode in model.modes:
        imag = f" &plusmn; {number(mode.eigenvalue.imag)} i" if mode.eigenvalue.imag else ""
        slow = f"{2 * math.pi / mode.eigenvalue.imag:.3g} s period" if imag else f"{_constant(mode.eigenvalue.real)}"
        width = f"{_width(mode.interval_real)}" + (f", {_width(mode.interval_imag)} i" if imag else "")
        rows.append(
            (mode.name.replace("_", " "), f"{number(mode.eigenvalue.real)}{imag}", width, number(mode.frequency),
             number(mode.damping, 3), slow)
        )  # fmt: skip
    head = ("mode", "eigenvalue [1/s]", "95 % +-", "frequency [rad/s]", "damping", "")
    return rows_table(head, rows, (1, 2, 3, 4))


def _constant(real: float) -> str:
    return f"{1.0 / abs(real):.3g} s time constant" + (", unstable" if real > 0.0 else "") if real else "neutral"


def _width(value: float) -> str:
    return number(value, 2) if math.isfinite(value) else "&ndash;"


def _matrix(name: str, matrix: np.ndarray, widths: Optional[np.ndarray], left: list[str], top: list[str]) -> str:
    rows = []
    for i, label in enumerate(left):
        cells = [html.escape(label)]
        for k in range(matrix.shape[1]):
            width = f" &plusmn; {number(widths[i, k], 2)}" if widths is not None and widths[i, k] > 0.0 else ""
            cells.append(f"{number(matrix[i, k])}{width}")
        rows.append(tuple(cells))
    return rows_table((name, *top), rows, range(1, len(top) + 1))


def _figure(window: Window, run: np.ndarray, result: AxisResult, use: str) -> TimeFigure:
    model, stamp = result.model, window.stamp[1:-1]
    panels = []
    for signals, simulated in ((model.inputs, None), (model.axis.states, run)):
        for k, signal in enumerate(signals):
            unit, factor = _SHOWN.get(signal.unit, (signal.unit, 1.0))
            series = [Series("measured", stamp, factor * window.columns[signal.name][1:-1])]
            if simulated is not None:
                series.append(Series("model", stamp, factor * simulated[:, k], dashed=True))
            panels.append(Panel(f"{signal.name.replace('_', ' ')} [{unit}]", series))
    e = window.excitation
    return TimeFigure(f"{model.axis.name}-{use}-{e.name}", f"{e.kind} on {', '.join(e.targets)}", panels)
