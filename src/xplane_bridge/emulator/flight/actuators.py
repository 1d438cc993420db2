"""Control-surface actuators: rate limits, and the faults that break them."""

from __future__ import annotations

import math
from typing import Any, Optional, Sequence

from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    FlightModelError,
    Side,
    SurfaceFault,
    SurfaceFaultKind,
    SurfaceKind,
    SurfaceSpec,
)

#: A free surface of wing or tailplane trails: its trailing edge goes up by this per angle of attack.
FLOAT_PER_ALPHA = 0.5
#: How fast a free surface finds its trailing angle [deg/s].
FLOAT_RATE_DEG_S = 90.0


class SurfaceActuator:
    """One surface. ``position_deg`` is what X-Plane would report, ``effective_deg`` what the air feels."""

    __slots__ = ("_stuck_deg", "effective_deg", "position_deg", "spec")

    def __init__(self, spec: SurfaceSpec) -> None:
        self.spec = spec
        self.position_deg = 0.0
        self.effective_deg = 0.0
        self._stuck_deg: Optional[float] = None  # where a fault without an angle caught the surface

    def jump(self, position_deg: float) -> None:
        """Moves at once, as a write to X-Plane's dataref does, beyond the stops too."""
        self.position_deg = position_deg
        self.effective_deg = position_deg
        self._stuck_deg = None

    def step(self, target_deg: float, dt: float) -> None:
        """The healthy surface on its way to where the controls want it."""
        spec = self.spec
        target = min(max(target_deg, spec.minimum_deg), spec.maximum_deg)
        reach = spec.rate_deg_s * dt
        self.position_deg += min(max(target - self.position_deg, -reach), reach)
        self.effective_deg = self.position_deg
        self._stuck_deg = None

    def step_broken(
        self, target_deg: float, dt: float, fault: SurfaceFault, alpha_deg: float, overridden: bool
    ) -> None:
        """The same with a fault. ``overridden``: ``target_deg`` was written by a client and acts at once."""
        spec, kind = self.spec, fault.kind
        share = 1.0 if fault.value is None else fault.value  # `check` refuses None where a share is meant
        if kind is not SurfaceFaultKind.STUCK:
            self._stuck_deg = None
        if kind is SurfaceFaultKind.STUCK:
            if self._stuck_deg is None or fault.value is not None:
                self._stuck_deg = self.position_deg if fault.value is None else fault.value
            self._approach(self._stuck_deg, spec.rate_deg_s * dt)
        elif kind is SurfaceFaultKind.CENTRED:
            self._approach(0.0, spec.rate_deg_s * dt)
        elif kind is SurfaceFaultKind.HARD_OVER_UP:
            self._approach(spec.fully_up_deg, spec.rate_deg_s * dt)
        elif kind is SurfaceFaultKind.HARD_OVER_DOWN:
            self._approach(spec.fully_down_deg, spec.rate_deg_s * dt)
        elif kind is SurfaceFaultKind.FLOATING:
            trailing = 0.0 if spec.kind is SurfaceKind.RUDDER else FLOAT_PER_ALPHA * spec.up_sign * alpha_deg
            self._approach(min(max(trailing, spec.minimum_deg), spec.maximum_deg), FLOAT_RATE_DEG_S * dt)
        elif kind is SurfaceFaultKind.GONE:
            self.position_deg = 0.0
        elif overridden:
            self.position_deg = target_deg
        else:
            rate = spec.rate_deg_s * (share if kind is SurfaceFaultKind.SLOW else 1.0)
            self._approach(min(max(target_deg, spec.minimum_deg), spec.maximum_deg), rate * dt)
        self.effective_deg = self.position_deg * (share if kind is SurfaceFaultKind.REDUCED else 1.0)

    def _approach(self, target_deg: float, reach_deg: float) -> None:
        self.position_deg += min(max(target_deg - self.position_deg, -reach_deg), reach_deg)

    def save(self) -> list[Optional[float]]:
        """What ``restore`` needs."""
        return [self.position_deg, self.effective_deg, self._stuck_deg]

    def restore(self, saved: Sequence[Any]) -> None:
        """Puts the actuator back into the state of ``save``."""
        self.position_deg, self.effective_deg, self._stuck_deg = saved


class SurfaceSet:
    """All surfaces of an aircraft."""

    def __init__(self, specs: Sequence[SurfaceSpec]) -> None:
        self.actuators = [SurfaceActuator(spec) for spec in specs]
        self.by_name: dict[str, SurfaceActuator] = {a.spec.name: a for a in self.actuators}

    def check(self, controls: Controls) -> None:
        """Raises ``FlightModelError`` for an unknown surface or a fault whose value makes no sense."""
        for name, fault in controls.surface_faults.items():
            self._check_name(name)
            is_share = fault.kind in (SurfaceFaultKind.REDUCED, SurfaceFaultKind.SLOW)
            if is_share and (fault.value is None or not 0.0 <= fault.value <= 1.0):
                raise FlightModelError(f"fault {fault.kind.value} of '{name}' has value {fault.value}, expected 0..1")
            if fault.value is not None and not math.isfinite(fault.value):
                raise FlightModelError(
                    f"fault {fault.kind.value} of '{name}' has value {fault.value}, expected degrees"
                )
        for name, angle in controls.surface_deg.items():
            self._check_name(name)
            if not math.isfinite(angle):
                raise FlightModelError(f"surface '{name}' is commanded to {angle}, expected degrees")

    def _check_name(self, name: str) -> None:
        if name not in self.by_name:
            raise FlightModelError(f"no surface '{name}': this aircraft has {', '.join(self.by_name) or 'none'}")

    def step(self, targets_deg: Sequence[float], dt: float, controls: Controls, alpha_deg: float) -> None:
        """Moves every surface; ``targets_deg`` in the order of the specifications."""
        faults = controls.surface_faults
        if not faults and not controls.override_surfaces:
            for actuator, target in zip(self.actuators, targets_deg):
                actuator.step(target, dt)
            return
        for actuator, target in zip(self.actuators, targets_deg):
            name = actuator.spec.name
            if controls.override_surfaces:
                target = controls.surface_deg.get(name, actuator.position_deg)
            fault = faults.get(name)
            if fault is not None:
                actuator.step_broken(target, dt, fault, alpha_deg, controls.override_surfaces)
            elif controls.override_surfaces:
                actuator.jump(target)
            else:
                actuator.step(target, dt)


def asymmetric(command: float, up_deg: float, down_deg: float) -> float:
    """Deflection [deg] for a command -1..1, + for trailing edge down, with stops of their own (both positive)."""
    return command * (down_deg if command > 0.0 else up_deg)


def sided(
    name: str, kind: SurfaceKind, side: Side, negative_deg: float, positive_deg: float, rate_deg_s: float
) -> SurfaceSpec:
    """A specification from the stops of negative and of positive deflections, both given as positive angles."""
    return SurfaceSpec(name, kind, side, -negative_deg, positive_deg, rate_deg_s)
