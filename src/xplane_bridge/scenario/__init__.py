"""Scripted flights: one YAML schema (config/scenarios/README.md) and one player."""

from .holds import HoldGains, Targets
from .loader import load_scenario, parse_scenario
from .player import Action, Commands, FlightSample, Player
from .schema import Event, Scenario, ScenarioError

__all__ = [
    "Action",
    "Commands",
    "Event",
    "FlightSample",
    "HoldGains",
    "Player",
    "Scenario",
    "ScenarioError",
    "Targets",
    "load_scenario",
    "parse_scenario",
]
