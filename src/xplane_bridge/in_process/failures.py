"""Failures by the names of scenarios, acting in the flight model itself."""

from __future__ import annotations

import re
from typing import Any, Dict, Mapping, Set

from xplane_bridge.emulator.flight.failure_effects import FailureEffects
from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel, SurfaceFault, SurfaceFaultKind
from xplane_bridge.emulator.scenario_pilot import failure_dataref, in_part
from xplane_bridge.errors import XplaneBridgeError

_WING = re.compile(r"(aileron|spoiler|flap|yaw_brake)(\d?)_wing(\d)_(left|right)")
_TAIL = re.compile(r"elevator(\d)_(left|right)")
_FIN = re.compile(r"rudder(\d)_fin(\d)")
_LEAVES = {"aileron": "ail", "spoiler": "spo", "flap": "fla", "yaw_brake": "yawb"}
#: Systems whose failure does not reach the flight model: they change what instruments and busses show.
_NOT_FLOWN = re.compile(r"rel_(esys|genera|batter|pitot|static|ss_|cop_)")


def model_surface(name: str) -> str:
    """The flight model's name (`wing2l_ail1`) of the bridge's surface (`aileron1_wing2_left`); "" if it is none."""
    match = _WING.fullmatch(name)
    if match:
        kind, number, wing, side = match.groups()
        return f"wing{wing}{side[0]}_{_LEAVES[kind]}{number}"
    match = _TAIL.fullmatch(name)
    if match:
        return f"hstab{1 if match.group(2) == 'left' else 2}_elv{match.group(1)}"
    match = _FIN.fullmatch(name)
    return f"vstab{match.group(2)}_rud{match.group(1)}" if match else ""


class NotFlownError(XplaneBridgeError, ValueError):
    """A failure that this aircraft or a flight in process cannot have."""


class Failures:
    """What is broken in one flight."""

    def __init__(self, model: FlightModel) -> None:
        self._model = model
        self._surfaces = {spec.name: spec for spec in model.surfaces}
        self._faults: Dict[str, SurfaceFault] = {}
        self._systems: Set[str] = set()
        self._effects = FailureEffects()
        self._repaired = True  # all systems, also in the controls

    def act(self, failure: Mapping[str, Any]) -> None:
        """A `failure` of a scenario happens, or is cleared.

        Raises:
            NotFlownError: This aircraft has no such part, the value is none of that kind, or a flight in process cannot
                show that it is broken.
            ScenarioError: No such system.
        """
        name, kind = failure["name"], failure["kind"]
        surface = model_surface(name) or (name if name in self._surfaces else "")
        if surface:
            if surface not in self._surfaces:
                raise NotFlownError(
                    f"failure {name!r}: {self._model.info.name} has {', '.join(sorted(self._surfaces))}"
                )
            if failure["clear"]:
                self._faults.pop(surface, None)
            elif kind == "failed":
                raise NotFlownError(f"failure {name!r}: kind is missing; expected what the surface does")
            else:
                self._faults[surface] = self._fault(surface, failure)
            return
        leaf = failure_dataref(name)
        if _NOT_FLOWN.match(leaf):
            raise NotFlownError(
                f"failure {name!r}: instruments and busses are not flown in process; it takes the bridge"
            )
        if not self._effects.acts(leaf, self._model):
            raise NotFlownError(
                f"failure {name!r}: {self._model.info.name} has none of that name that acts in process; expected one "
                f"of its surfaces ({', '.join(sorted(self._surfaces))}), engine_1..{self._model.info.engine_count}, or "
                "a rel_* of its controls"
            )
        refusal = in_part(failure)
        if refusal:
            raise NotFlownError(refusal)
        if failure["clear"]:
            self._systems.discard(leaf)
        else:
            self._systems.add(leaf)

    def _fault(self, surface: str, failure: Mapping[str, Any]) -> SurfaceFault:
        """A surface's failure as the flight model has it, which takes the rate of a slow one as a share of its own."""
        kind, value = SurfaceFaultKind(failure["kind"]), failure["value"]
        if kind is SurfaceFaultKind.SLOW:
            if value is None or not value > 0.0:
                raise NotFlownError(f"failure {failure['name']!r}: value is {value}; expected a rate above 0 deg/s")
            value = min(value / self._surfaces[surface].rate_deg_s, 1.0)
        elif kind is SurfaceFaultKind.REDUCED and (value is None or not 0.0 <= value <= 1.0):
            raise NotFlownError(f"failure {failure['name']!r}: value is {value}; expected 0..1 of the effectiveness")
        return SurfaceFault(kind, value)

    def clear(self) -> None:
        """Everything is repaired."""
        self._faults.clear()
        self._systems.clear()

    def apply(self, controls: Controls, dt: float) -> None:
        """Changes the frame's controls."""
        if self._systems or not self._repaired:
            self._effects.apply(controls, self._systems, self._model, dt)
            self._repaired = not self._systems
            controls.surface_faults = {**controls.surface_faults, **self._faults}
        else:
            controls.surface_faults = self._faults
