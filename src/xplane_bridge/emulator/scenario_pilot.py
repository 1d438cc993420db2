"""The emulator's pilot: plays a scenario from inside the simulator, without any client."""

from __future__ import annotations

import math
from typing import Any, List, Mapping, Tuple

from xplane_bridge.emulator.datarefs.control_inputs import PilotCommands
from xplane_bridge.emulator.flight.frame import Frame
from xplane_bridge.scenario import Action, FlightSample, Player, Scenario, ScenarioError
from xplane_bridge.scenario.world import KINDS as WORLD_KINDS
from xplane_bridge.units import GRAVITY_MPS2

_FAILURES = "sim/operation/failures/"
_TRIMS = {"trim_roll": "aileron_trim", "trim_pitch": "elevator_trim", "trim_yaw": "rudder_trim"}
_EXCITED = ("roll", "pitch", "yaw")
_FAILED, _REPAIRED = 6.0, 0.0
#: Failures of systems by their plain names; {} is the number counted from 0.
_SYSTEMS = {
    "engine": "rel_engfai{}",
    "generator": "rel_genera{}",
    "battery": "rel_batter{}",
}
_NUMBERED = {"bus_1": "rel_esys", "bus_2": "rel_esys2", "pitot_1": "rel_pitot", "pitot_2": "rel_pitot2"}
_NUMBERED.update({"static_1": "rel_static", "static_2": "rel_static2", "gyro_1": "rel_ss_ahz", "gyro_2": "rel_cop_ahz"})


class ScenarioPilot:
    """Callable that the emulator asks once a frame: (flight time, frame) -> PilotCommands.

    Raises:
        ScenarioError: The scenario asks for what only a client can bring about.
    """

    def __init__(self, scenario: Scenario) -> None:
        for event in scenario.events:
            for kind, value in event.actions:
                if kind == "failure":
                    failure_dataref(value["name"])
                    refusal = in_part(value)
                    if refusal:
                        raise ScenarioError(refusal)
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
        writes = [(f"sim/cockpit2/controls/{_TRIMS[name]}", value) for name, value in handles.items() if name in _TRIMS]
        for action in commands.actions:
            writes += self._writes(action)
        return PilotCommands(
            roll=commands.stick["roll"],
            pitch=commands.stick["pitch"],
            yaw=commands.stick["yaw"],
            throttle=commands.throttle,
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
            name = _FAILURES + failure_dataref(action.value["name"])
            if action.value["clear"]:
                return [(name, _REPAIRED)]
            self._failed.append(name)
            return [(name, _FAILED)]
        return []


def failure_dataref(name: str) -> str:
    """The `rel_*` leaf of a system's plain name (`engine_1`, `bus_2`, ...) or of itself.

    Raises:
        ScenarioError: Not expressible as one: surfaces, which take tx_node's algorithm, or an unknown name.
    """
    if name.startswith("rel_"):
        return name
    if name in _NUMBERED:
        return _NUMBERED[name]
    system, _, number = name.rpartition("_")
    if system in _SYSTEMS and number.isdigit() and int(number) >= 1:
        return _SYSTEMS[system].format(int(number) - 1)
    raise ScenarioError(
        f"failure {name!r}: the emulator's pilot can only fail rel_* datarefs, engine_N, generator_N, battery_N, "
        f"bus_N, pitot_N, static_N and gyro_N; surfaces fail through tx_node (set_failure)"
    )


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
