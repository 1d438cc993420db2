"""scenario_player: plays a scenario through a running bridge; launch/failure.launch starts it."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Dict, Iterator, Optional, Sequence

from xplane_bridge import lockstep
from xplane_bridge.cli.bridge.loaded_aircraft import LoadedAircraft
from xplane_bridge.cli.bridge.waiting import PATIENCE_S, about_joy, surroundings, wait_for_state
from xplane_bridge.cli.entry import guarded, ros_arguments, start_node, writing
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import Scenario, ScenarioError, load_scenario
from xplane_bridge.scenario.lockstep_player import LockstepPlayer
from xplane_bridge.scenario.ros_player import RosPlayer
from xplane_bridge.scenario.virtual_stick import VirtualStick, load_stick, refuse_buttons
from xplane_bridge.topics import NAMESPACE, absolute

_DEVICE = "logitech_extreme_3d_pro"


def scenario_of(name: str) -> Scenario:
    """A scenario by the stem of a file in config/scenarios, or by a path.

    Raises:
        ScenarioError: There is none, or it is not one.
    """
    return load_scenario(scenario_file(name))


def scenario_file(name: str) -> Path:
    """The file of a scenario, by its stem in config/scenarios, or by a path.

    Raises:
        ScenarioError: There is none.
    """
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = config_file("scenarios", f"{name}.yaml")
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in config_file("scenarios", "README.md").parent.glob("*.yaml")))
        raise ScenarioError(f"there is no scenario {name}; expected a file, or one of: {known}")
    return path


def add_stick_options(p: argparse.ArgumentParser) -> None:
    """Options of programs that play as a joystick."""
    p.add_argument(
        "--joy-config",
        metavar="NAME",
        help="device to play: stem of a file in config/joysticks, or a file (default: the one that "
        f"joystick_mapper_node flies with, else {_DEVICE})",
    )
    p.add_argument("--stick-mode", type=int, choices=(1, 2), help="1: pitch left, throttle right; 2: the other way")


def stick_mode_of(given: Optional[int], mapped: Any) -> Optional[int]:
    """The stick mode to play: of joystick_mapper_node, which takes the axes by it; None: of the device's file.

    Raises:
        ScenarioError: Another one was given.
    """
    mode = mapped if mapped in (1, 2) else None  # what else is there, the mapper refuses itself
    if given is not None and mode is not None and given != mode:
        raise ScenarioError(
            f"--stick-mode {given}: joystick_mapper_node takes the axes as stick mode {mode}; leave the option out, or "
            f"start the mapper with stick_mode:={given}"
        )
    return given if mode is None else mode


def device_file(name: str) -> Path:
    """The file of a joystick, by its stem in config/joysticks, or by a path."""
    file = Path(name)
    return file if file.suffix == ".yaml" else config_file("joysticks", f"{name}.yaml")


def stick_of(joy_config: Optional[str], stick_mode: Optional[int], mapped: Any) -> VirtualStick:
    """The device to play.

    Args:
        joy_config: As it was given; None: not at all.
        stick_mode: Likewise.
        mapped: Parameters of joystick_mapper_node, which are its device's file; None: it is not there.

    Raises:
        ScenarioError: joystick_mapper_node would make something else of what is played, or there is no such device.
    """
    mapped = mapped if isinstance(mapped, dict) else {}
    mode = stick_mode_of(stick_mode, mapped.get("stick_mode"))
    if not isinstance(mapped.get("direct"), dict):
        return load_stick(device_file(joy_config or _DEVICE), mode)
    flown = VirtualStick(mapped, mode or 2)
    if joy_config is not None:
        stick = load_stick(device_file(joy_config), mode)
        if stick.name != flown.name:
            raise ScenarioError(
                f"--joy-config {joy_config} is {stick.name!r}, but joystick_mapper_node flies with {flown.name!r}; "
                "leave it out, or start the mapper with the same joy_config"
            )
    return flown


def _watch_joy(namespace: str, node: str) -> threading.Timer:
    """Warns on a thread of its own, after some seconds, where what is played moves nothing."""

    def look() -> None:
        text = about_joy(f"{namespace}/joy", surroundings())
        if text:
            print(f"{node}: {text}", file=sys.stderr, flush=True)

    watch = threading.Timer(PATIENCE_S, look)
    watch.daemon = True
    return watch


def _write(log: Path, player: RosPlayer) -> None:
    text = json.dumps(player.report(), indent=2) + "\n"
    with writing(ScenarioError, f"--log {log}", "expected a file that can be written"):
        log.write_text(text, encoding="utf-8")


@contextmanager
def _logged(player: RosPlayer, node: str, log: Optional[Path]) -> Iterator[None]:
    """Writes at the end when what happened. An error of the flight comes before one of the file."""
    try:
        yield
    except BaseException:
        if log is not None:
            try:
                _write(log, player)
            except ScenarioError as error:
                print(f"{node}: {error}", file=sys.stderr, flush=True)
        raise
    if log is not None:
        _write(log, player)


def play(
    args: argparse.Namespace, argv: Optional[Sequence[str]], node: str, joystick: bool, log: Optional[Path] = None
) -> int:
    """Plays `args.scenario` in a ROS node of this process; returns the exit code."""
    scenario = scenario_of(args.scenario)
    # What can be refused without ROS is refused at once.
    stick = stick_of(args.joy_config, args.stick_mode, None) if joystick else None
    if not joystick:
        refuse_buttons(scenario, "--joystick")
    if log is not None and not os.path.isdir(log.parent):  # Path.is_dir() raises below a folder of another user
        raise ScenarioError(f"--log {log}: there is no folder {log.parent}; make it, or give another file")
    namespace = args.namespace.rstrip("/")
    init_argv = None if argv is None else list(argv)
    rospy = start_node(node, namespace, argv=init_argv, **lockstep.node_options(namespace))
    if joystick:
        mapped = rospy.get_param(f"{namespace}/joystick_mapper_node", None)
        stick = stick_of(args.joy_config, args.stick_mode, mapped)
    remedy = f"load one that it is for, or play another scenario (aircraft in {args.scenario} says which it is for)"
    aircraft = LoadedAircraft(namespace, node, scenario.aircraft, remedy, lambda text: player.fail(text))
    kwargs: Dict[str, Any] = {"stick": stick, "say": lambda text: print(text, flush=True)}
    if lockstep.is_on(namespace):
        player: RosPlayer = LockstepPlayer(scenario, namespace, check=aircraft.check, **kwargs)
    else:
        player = RosPlayer(scenario, namespace, **kwargs)
        aircraft.check()
        wait_for_state(namespace, node)
    watch = _watch_joy(namespace, node)
    if joystick:
        watch.start()
    try:
        with _logged(player, node, log):
            player.run()
    finally:
        watch.cancel()
    return 0


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    p = argparse.ArgumentParser(
        prog="scenario_player",
        description=(
            "Plays a scenario (config/scenarios/README.md) through a running bridge: stick and handles on "
            "control/manual, modes, failures and excitations by tx_node. Exit code 1: something it asked for was "
            "refused."
        ),
    )
    p.add_argument("scenario", metavar="SCENARIO", help="file, or stem of a file in config/scenarios")
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    p.add_argument("--joystick", action="store_true", help="fly by messages on joy, through joystick_mapper_node")
    add_stick_options(p)
    p.add_argument("--log", type=Path, metavar="FILE", help="write there when what happened (JSON)")
    args = p.parse_args(ros_arguments(argv))
    return play(args, argv, "scenario_player", args.joystick, args.log)
