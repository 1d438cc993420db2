"""Scripted flights: one YAML schema (config/scenarios/README.md) and one player."""

from xplane_bridge.scenario.holds import HoldGains, Targets
from xplane_bridge.scenario.loader import load_scenario, parse_scenario
from xplane_bridge.scenario.player import Action, Commands, FlightSample, Player
from xplane_bridge.scenario.schema import Event, Scenario, ScenarioError

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
