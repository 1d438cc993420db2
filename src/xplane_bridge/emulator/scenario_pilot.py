"""The emulator's pilot: plays a scenario from inside the simulator, without any client."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Mapping, Tuple

from xplane_bridge.emulator.datarefs.control_inputs import PilotCommands
from xplane_bridge.emulator.flight.earth import wrap_degrees, wrap_half_turn
from xplane_bridge.emulator.flight.frame import Frame
from xplane_bridge.emulator.options import KINEMATIC, Options
from xplane_bridge.scenario import Action, FlightSample, Player, Scenario, ScenarioError, load_scenario
from xplane_bridge.scenario.world import KINDS as WORLD_KINDS
from xplane_bridge.units import GRAVITY_MPS2
from xplane_bridge.xplane_names import versions_with

#: Keys of a scenario's `start`, and what of `InitialState` they are.
START = {
    "latitude": "latitude_deg", "longitude": "longitude_deg", "heading": "heading_deg", "altitude": "altitude_m",
    "speed": "airspeed_mps", "on_ground": "on_ground",
}  # fmt: skip
_FAILURES = "sim/operation/failures/"
_EXCITED = ("roll", "pitch", "yaw")
_FAILED, _REPAIRED = 6.0, 0.0
#: Systems as tx_node has them (lib/core/failures/failures.cpp): how many, and what fails with each.
_SYSTEMS = (
    ("engine", 8, ("rel_engfai{from_0}",)),
    ("bus", 6, ("rel_esys{second_on}",)),
    ("generator", 8, ("rel_genera{from_0}",)),
    ("battery", 8, ("rel_batter{from_0}",)),
    ("pitot", 2, ("rel_pitot{second_on}",)),
    ("static", 2, ("rel_static{second_on}",)),
    ("gyro", 2, ("rel_{seat}_ahz", "rel_{seat}_dgy")),
)
#: Leaves of the failure datarefs by a system's name: `engine_1`, `bus_2`, ...
SYSTEMS: Dict[str, Tuple[str, ...]] = {
    f"{system}_{i + 1}": tuple(
        leaf.format(from_0=i, second_on=i + 1 if i else "", seat="cop" if i else "ss") for leaf in leaves
    )
    for system, count, leaves in _SYSTEMS
    for i in range(count)
}
_NAMES = ", ".join(f"{system}_1..{count}" for system, count, _ in _SYSTEMS)


class ScenarioPilot:
    """Callable that the emulator asks once a frame: (flight time, frame) -> PilotCommands.

    Args:
        scenario: What to fly.
        version: Of the X-Plane that the emulator is, one of `xplane_names.VERSIONS`.

    Raises:
        ScenarioError: The scenario asks for what only a client can bring about.
    """

    def __init__(self, scenario: Scenario, version: str) -> None:
        for event in scenario.events:
            for kind, value in event.actions:
                if kind == "failure":
                    _check_failure(value, version)
                if kind == "excitation" and "," in value["target"]:
                    raise ScenarioError(
                        "excitation: the emulator's pilot moves one axis; tx_node moves several at once"
                    )
                if kind == "excitation" and value["target"] not in _EXCITED:
                    raise ScenarioError(
                        f"excitation of {value['target']}: the emulator's pilot moves {', '.join(_EXCITED)}; tx_node "
                        "moves throttle and surfaces (inject_excitation)"
                    )
                if kind in WORLD_KINDS:
                    way = {"reset": "reset_flight", "traffic": "traffic/command"}.get(kind, f"set_{kind}")
                    raise ScenarioError(f"{kind}: the emulator's pilot only flies; tx_node sets {kind} ({way})")
        self.player = Player(scenario, apply_excitations=True)
        self._failed: List[str] = []

    def __call__(self, flight_time: float, frame: Frame) -> PilotCommands:
        """What the scenario wants at this flight time [s]."""
        commands = self.player.step(flight_time, sample_of(frame))
        handles = commands.handles
        writes: List[Tuple[str, float]] = []
        for action in commands.actions:
            writes += self._writes(action)
        return PilotCommands(
            roll=commands.stick["roll"],
            pitch=commands.stick["pitch"],
            yaw=commands.stick["yaw"],
            throttle=commands.throttle,
            trim_roll=handles.get("trim_roll"),
            trim_pitch=handles.get("trim_pitch"),
            trim_yaw=handles.get("trim_yaw"),
            flaps=handles.get("flaps"),
            gear_down=handles["gear"] >= 0.5 if "gear" in handles else None,
            speedbrake=handles.get("speedbrake"),
            thrust_vector=handles.get("thrust_vector"),
            brakes=handles.get("brakes"),
            datarefs=tuple(writes),
        )

    def _writes(self, action: Action) -> List[Tuple[str, float]]:
        """Datarefs that do an action; modes, commands and labels are for clients and mean nothing here."""
        if action.kind == "dataref":
            return list(action.value.items())
        if action.kind == "clear_failures":
            names, self._failed = self._failed, []
            return [(name, _REPAIRED) for name in names]
        if action.kind == "failure":
            names = [_FAILURES + leaf for leaf in failure_leaves(action.value["name"])]
            if action.value["clear"]:
                return [(name, _REPAIRED) for name in names]
            self._failed += names
            return [(name, _FAILED) for name in names]
        return []


def load_flown(path: Path, aircraft: str) -> Scenario:
    """Reads the scenario that the pilot flies with an aircraft.

    Raises:
        ScenarioError: It cannot be read, or is for other aircraft.
    """
    scenario = load_scenario(path)
    if scenario.aircraft and aircraft not in (*scenario.aircraft, KINEMATIC):
        fits = ", ".join(scenario.aircraft)
        raise ScenarioError(f"{path}: is a scenario for {fits}, not for {aircraft}: choose --aircraft {fits}")
    return scenario


def started_as(scenario: Scenario, options: Options) -> Options:
    """The options with a scenario's start and aerodrome, where the command line gives none."""
    start = {START[key]: value for key, value in scenario.start.items()}
    fields: Dict[str, Any] = {field: value for field, value in start.items() if field not in options.start_given}
    initial = replace(options.initial, **fields)
    initial = replace(
        initial,
        longitude_deg=wrap_half_turn(initial.longitude_deg),
        heading_deg=wrap_degrees(initial.heading_deg),
    )
    aerodrome = options.aerodrome
    if aerodrome is None and scenario.aerodrome:
        place = scenario.aerodrome
        aerodrome = (place["latitude"], place["longitude"], place["heading"])
    return replace(options, initial=initial, aerodrome=aerodrome)


def failure_leaves(name: str) -> Tuple[str, ...]:
    """The `rel_*` that fail by a name, a system's or their own; none for surfaces and for what no X-Plane has."""
    if name.startswith("rel_") and versions_with(_FAILURES + name):
        return (name,)
    return SYSTEMS.get(name, ())


def _check_failure(failure: Mapping[str, Any], version: str) -> None:
    """Looks whether the pilot can bring a failure about.

    Raises:
        ScenarioError: It cannot.
    """
    leaves = failure_leaves(failure["name"])
    if not leaves or not all(version in versions_with(_FAILURES + leaf) for leaf in leaves):
        raise ScenarioError(
            f"failure {failure['name']!r}: expected {_NAMES}, or a rel_* dataref that X-Plane {version} has; surfaces "
            "fail through tx_node (set_failure), not by the emulator's pilot"
        )
    refusal = in_part(failure)
    if refusal:
        raise ScenarioError(refusal)


def in_part(failure: Mapping[str, Any]) -> str:
    """Why a system cannot fail as a `failure` asks for it; empty when it can."""
    kind, value = failure["kind"], failure["value"]
    if failure["clear"] or (kind == "failed" and value is None):
        return ""
    return (
        f"failure {failure['name']!r}: kind {kind}, value {value}; expected kind failed, and no value: a system works "
        "or does not"
    )


def sample_of(frame: Frame) -> FlightSample:
    """The player's view of an emulator frame."""
    m = frame.m
    return FlightSample(
        roll=frame.true_phi,
        pitch=frame.true_theta,
        heading=frame.true_psi,
        altitude=m.altitude_m,
        agl=frame.height,
        climb=-m.v_down_mps,
        speed=m.calibrated_airspeed_mps,
        alpha=math.degrees(m.alpha_rad),
        beta=math.degrees(m.beta_rad),
        roll_rate=math.degrees(m.p_rad_s),
        pitch_rate=math.degrees(m.q_rad_s),
        yaw_rate=math.degrees(m.r_rad_s),
        load_factor=-m.specific_force_z_mps2 / GRAVITY_MPS2,
        on_ground=m.on_ground_any,
        stall_warning=m.stall_warning,
    )
