"""A scenario as a flight to start: emulator, bridge, player, and what else flies with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from xplane_bridge.harness.flight import FlightPlan
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.resources import config_file, program
from xplane_bridge.scenario import Scenario, ScenarioError
from xplane_bridge.scenario.virtual_stick import refuse_buttons

PLAYER, CONTROLLER = "scenario_player", "controller"
#: What the player writes when it begins.
_PLAYS = r"^playing "
#: What fly_controller writes when it flies.
_COMMANDS = r"^commanding on "
#: In lock-step, when it can.
_IS_READY = r"^ready for "
#: `start` of a scenario to the emulator's options.
_START = {"latitude": "--lat", "longitude": "--lon", "altitude": "--alt", "heading": "--heading", "speed": "--speed"}


def scenario_plan(
    scenario: Scenario,
    source: str,
    output: Path,
    duration: float,
    aircraft: Optional[str] = None,
    joystick: Optional[str] = None,
    controller: Sequence[str] = (),
    controller_ready: str = "",
    emulator_options: Sequence[str] = (),
    launch_args: Optional[Dict[str, Any]] = None,
    transport: str = "rref",
    lockstep: Optional[Lockstep] = None,
) -> FlightPlan:
    """What to start for a scenario.

    Args:
        scenario: what to fly.
        source: of the scenario: stem of a file in config/scenarios, or a path.
        output: folder of everything that is written, also by the player.
        duration: [s] after which it ends at the latest.
        aircraft: what to fly; the scenario's first when omitted.
        joystick: device through which to fly; commands when omitted.
        controller: program that flies in mode auto; the scenario's own, by fly_controller, when omitted.
        controller_ready: regular expression of what it writes when it can; empty: it can when it is connected.
        emulator_options: beside those of the scenario's `start`, which they override.
        launch_args: for demo.launch.
        transport: rref or data.
        lockstep: fly in lock-step so; player, joystick_mapper_node and a controller are participants by themselves.

    Raises:
        ScenarioError: It is for other aircraft, or presses buttons of a joystick that there is none of.
        ResourceError: There is no such joystick.
    """
    chosen = aircraft or (scenario.aircraft[0] if scenario.aircraft else "fixed_wing")
    if scenario.aircraft and chosen not in scenario.aircraft:
        raise ScenarioError(f"{scenario.name} is for {', '.join(scenario.aircraft)}, not for {chosen}")
    options: List[str] = []
    for key, value in scenario.start.items():
        options += ["--start", "ground"] if key == "on_ground" else [_START[key], f"{value:.9g}"]
    if scenario.aerodrome:
        place = (scenario.aerodrome[key] for key in ("latitude", "longitude", "heading"))
        options.append("--aerodrome=" + ",".join(f"{value:.9g}" for value in place))
    options += emulator_options
    arguments = dict(launch_args or {})
    plan = FlightPlan(output, duration, chosen, transport, options, arguments, player=PLAYER, lockstep=lockstep)
    player = [str(program("scenario_player")), source, "--log", str(plan.played.resolve())]
    plan.ready[PLAYER] = _PLAYS if lockstep is None else _IS_READY
    if joystick:
        # Only to see that there is one: its path may hold a space, which roslaunch cannot take.
        config_file("joysticks", f"{joystick}.yaml")
        arguments.update(joystick="mapper", joy_config=joystick)
        player += ["--joystick", "--joy-config", joystick]
        if lockstep is not None:
            lockstep.participants.append("joystick_mapper_node")
            lockstep.stick = PLAYER
    else:
        refuse_buttons(scenario, "--joystick NAME")
    if scenario.controller and not controller:
        controller = [str(program("fly_controller")), scenario.controller]
        if lockstep is None:  # there it commands when the flight begins, which waits for all participants
            controller_ready = controller_ready or _COMMANDS
        else:
            lockstep.participants.append("fly_controller")
    if controller:
        plan.controller = CONTROLLER
        plan.programs[CONTROLLER] = list(controller)
        if controller_ready:
            plan.ready[CONTROLLER] = controller_ready
    if lockstep is not None:
        lockstep.participants.append(PLAYER)
    plan.programs[PLAYER] = player  # last: it must not begin before the others can follow
    return plan
