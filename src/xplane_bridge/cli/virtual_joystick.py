"""virtual_joystick: plays a scenario's stick movements as sensor_msgs/Joy, as if a pilot held a device."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from xplane_bridge.cli.entry import guarded, ros_arguments
from xplane_bridge.cli.scenario_player import add_stick_options, play
from xplane_bridge.topics import NAMESPACE, absolute


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    p = argparse.ArgumentParser(
        prog="virtual_joystick",
        description=(
            "Plays a scenario (config/scenarios/README.md) as a joystick on the topic joy; joystick_mapper_node with "
            "the same --joy-config turns it back into commands. Modes are asked for by the device's buttons."
        ),
    )
    p.add_argument("scenario", metavar="SCENARIO", help="file, or stem of a file in config/scenarios")
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    add_stick_options(p)
    args = p.parse_args(ros_arguments(argv))
    return play(args, argv, "virtual_joystick", joystick=True)
