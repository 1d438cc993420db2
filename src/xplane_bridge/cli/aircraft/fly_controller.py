"""fly_controller: flies a controller of campaigns, module:class or module:function, through the bridge."""

from __future__ import annotations

import argparse
import importlib
from typing import Any, Dict, List, Optional, Sequence

import yaml

from xplane_bridge import lockstep
from xplane_bridge.campaign.definition import make_controller
from xplane_bridge.cli.bridge.flown_law import FlownLaw
from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.errors import XplaneBridgeError, yaml_problem
from xplane_bridge.topics import NAMESPACE, absolute


class ControllerError(XplaneBridgeError):
    """--arguments is no mapping."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="fly_controller",
        description="Flies a controller on control/auto: a class or a function that answers flight states, as "
        "campaigns fly it (docs/experiments/campaigns.md), e.g. xplane_bridge.controllers.twin:Circuit.",
    )
    p.add_argument(
        "controller", metavar="MODULE:NAME", help="what flies; its module's folder in PYTHONPATH, or the one you are in"
    )
    p.add_argument("--arguments", default="{}", metavar="YAML", help='what a class is made with, e.g. "{speed: 66}"')
    p.add_argument("--engage", action="store_true", help="ask for mode AUTO")
    p.add_argument("--any-aircraft", action="store_true", help="fly whatever is loaded")
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    return p


def arguments_of(text: str) -> Dict[str, Any]:
    """What the controller is made with.

    Raises:
        ControllerError: It is no mapping.
    """
    try:
        found = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ControllerError(f"--arguments {text!r} {yaml_problem(error)}") from None
    if not isinstance(found, dict):
        raise ControllerError(f'--arguments {text!r}: expected a mapping, e.g. "{{speed: 66}}"')
    return found


def aircraft_of(name: str) -> List[str]:
    """The aircraft that a controller is for, by the constant AIRCRAFT of its module; empty: any."""
    aircraft = getattr(importlib.import_module(name.partition(":")[0]), "AIRCRAFT", "")
    return [aircraft] if aircraft else []


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs until ROS ends."""
    args = parser().parse_args(ros_arguments(argv))
    law = make_controller(args.controller, arguments_of(args.arguments))
    wanted = [] if args.any_aircraft else aircraft_of(args.controller)
    namespace = args.namespace.rstrip("/")
    start_node("fly_controller", namespace, **lockstep.node_options(namespace))
    FlownLaw(law, "fly_controller", namespace, wanted).run(args.engage)
    return 0
