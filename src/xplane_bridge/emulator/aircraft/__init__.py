"""The aircraft that the emulator flies: a folder each, its Python beside its XML. A new one gets a line here."""

from __future__ import annotations

import importlib

from xplane_bridge.emulator.flight.flight_model import FlightModel, FlightModelError

_MODELS = {
    "fixed_wing": ("xplane_bridge.emulator.aircraft.fixed_wing.fixed_wing", "FixedWing"),
    "multirotor": ("xplane_bridge.emulator.aircraft.multirotor.multirotor", "Multirotor"),
    "tiltrotor": ("xplane_bridge.emulator.aircraft.tiltrotor.tiltrotor", "Tiltrotor"),
}


def model_names() -> tuple[str, ...]:
    """The aircraft that ``create_model`` knows."""
    return tuple(_MODELS)


def create_model(name: str, seed: int = 0) -> FlightModel:
    """Builds the aircraft of this name; ``seed`` feeds everything random in it.

    Raises:
        FlightModelError: no such aircraft.
    """
    if name not in _MODELS:
        raise FlightModelError(f"unknown aircraft '{name}': the emulator has {', '.join(_MODELS)}")
    module, cls = _MODELS[name]
    model: FlightModel = getattr(importlib.import_module(module), cls)(seed=seed)
    return model
