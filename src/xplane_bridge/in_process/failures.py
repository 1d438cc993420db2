"""Failures by the names of scenarios, acting in the flight model itself."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any, Dict, Mapping, Set, Tuple

from xplane_bridge.emulator.command_channels import TRIMS
from xplane_bridge.emulator.flight.failure_effects import TRIM_FAILURES, FailureEffects
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    FlightModel,
    SurfaceFault,
    SurfaceFaultKind,
    SurfaceSpec,
)
from xplane_bridge.emulator.scenario_pilot import failure_leaves, in_part
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.surfaces import SURFACES

_CONTROLS = [f.name for f in fields(Controls)]
_MOST_STUCK_DEG = 90.0
#: Kinds of a surface's failure that take a value.
WITH_VALUE = ("stuck", "reduced", "slow")
#: Systems whose failure does not reach the flight model: they change what instruments and busses show.
_NOT_FLOWN = re.compile(r"rel_(esys|genera|batter|pitot|static|ss_|cop_)")


class NotFlownError(XplaneBridgeError, ValueError):
    """A failure that this aircraft or a flight in process cannot have."""


class Failures:
    """What is broken in one flight."""

    def __init__(self, model: FlightModel) -> None:
        self._model = model
        specs = {spec.name: spec for spec in model.surfaces}
        self._surfaces = {name: specs[own] for name, own in SURFACES.items() if own in specs}
        self._faults: Dict[str, SurfaceFault] = {}
        self._broken: Dict[str, Tuple[str, ...]] = {}  # leaves by the name under which they were broken
        self._systems: Set[str] = set()  # all these leaves
        self._effects = FailureEffects()
        self._flown = Controls()
        self._repaired = True  # all systems, also in what they held

    def act(self, failure: Mapping[str, Any]) -> None:
        """A `failure` of a scenario happens, or is cleared, by the rules of tx_node; what is not broken stays as it is.

        Raises:
            NotFlownError: This aircraft has no such part, the value is none of that kind, it is broken by another name,
                or a flight in process cannot show that it is broken.
        """
        name = failure["name"]
        if name in SURFACES:
            self._act_on_surface(name, failure)
            return
        leaves = failure_leaves(name)
        if any(_NOT_FLOWN.match(leaf) for leaf in leaves):
            raise NotFlownError(
                f"failure {name!r}: instruments and busses are not flown in process; it takes the bridge"
            )
        if not any(self._effects.acts(leaf, self._model) for leaf in leaves):
            raise NotFlownError(
                f"failure {name!r}: {self._model.info.name} has none of that name that acts in process; expected one "
                f"of its surfaces ({', '.join(self._surfaces)}), engine_1..{self._model.info.engine_count}, or "
                "a rel_* of its controls"
            )
        refusal = in_part(failure)
        if refusal:
            raise NotFlownError(refusal)
        if failure["clear"]:
            self._broken.pop(name, None)
        else:
            for other, broken in self._broken.items():
                if other != name and not set(broken).isdisjoint(leaves):
                    raise NotFlownError(f"failure {name!r}: broken already as {other}; expected it to be cleared first")
            self._broken[name] = leaves
        self._systems = {leaf for broken in self._broken.values() for leaf in broken}

    def _act_on_surface(self, name: str, failure: Mapping[str, Any]) -> None:
        if name not in self._surfaces:
            have = ", ".join(self._surfaces) or "none"
            raise NotFlownError(f"failure {name!r}: expected a surface that {self._model.info.name} has ({have})")
        surface = self._surfaces[name]
        if failure["clear"]:
            self._faults.pop(surface.name, None)
        elif failure["kind"] == "failed":
            raise NotFlownError(f"failure {name!r}: kind is missing; expected what the surface does")
        else:
            self._faults[surface.name] = self._fault(surface, failure)

    @staticmethod
    def _fault(surface: SurfaceSpec, failure: Mapping[str, Any]) -> SurfaceFault:
        """A surface's failure as the flight model has it, which takes the rate of a slow one as a share of its own."""
        kind, value = SurfaceFaultKind(failure["kind"]), failure["value"]
        expected = ""
        if kind is SurfaceFaultKind.STUCK:
            if value is not None and not abs(value) <= _MOST_STUCK_DEG:
                expected = f"-{_MOST_STUCK_DEG:g}..{_MOST_STUCK_DEG:g} deg, or none: where it is"
        elif kind is SurfaceFaultKind.REDUCED:
            if value is None or not 0.0 <= value <= 1.0:
                expected = "0..1 of the effectiveness"
        elif kind is SurfaceFaultKind.SLOW:
            if value is None or not value > 0.0:
                expected = "a rate above 0 deg/s"
            else:
                value = min(value / surface.rate_deg_s, 1.0)
        elif value is not None:
            expected = f"none for kind {kind.value}; stuck, reduced and slow take one"
        if expected:
            raise NotFlownError(f"failure {failure['name']!r}: value is {failure['value']}; expected {expected}")
        return SurfaceFault(kind, value)

    def clear(self) -> None:
        """Everything is repaired."""
        self._faults.clear()
        self._broken.clear()
        self._systems = set()

    def apply(self, controls: Controls, dt: float) -> Controls:
        """What flies of a frame's controls: they themselves, or what failed systems make of them, until the next call.

        Commanded ones stay as they are, but for trims that failures have moved, as in the emulator.
        """
        if self._repaired and not self._systems:
            controls.surface_faults = self._faults
            return controls
        flown = self._flown
        for name in _CONTROLS:
            setattr(flown, name, getattr(controls, name))
        flown.throttle = controls.throttle.copy()  # all else is replaced, not changed
        self._effects.apply(flown, self._systems, self._model, dt)
        self._repaired = not self._systems
        flown.surface_faults = {**flown.surface_faults, **self._faults}
        if not TRIM_FAILURES.isdisjoint(self._systems):
            for name in TRIMS:
                setattr(controls, name, getattr(flown, name))
        return flown
