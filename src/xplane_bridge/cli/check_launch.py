"""check_launch: looks at the arguments of a launch file before anything starts; launch/check.launch calls it.

roslaunch itself names the XML tag that does not work out. This names the argument, what was given, and what there is.
Ranges and single parameters are the nodes' own to judge.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Callable, Dict, List, Mapping, Optional, Sequence

import yaml

from xplane_bridge.cli.entry import guarded, ros_arguments
from xplane_bridge.errors import XplaneBridgeError, yaml_problem
from xplane_bridge.resources import config_file

#: The value by which an argument leaves a parameter as its file has it.
AS_IN_FILE = "config"
_FLAGS = ("true", "false", "1", "0")

Given = Mapping[str, str]
Check = Callable[[str, str, Given], str]


def _whole(_: str, value: str, __: Given) -> str:
    try:
        int(value)
    except ValueError:
        return f"expected a whole number, or {AS_IN_FILE} where the argument has that"
    return ""


def _number(_: str, value: str, __: Given) -> str:
    try:
        float(value)
    except ValueError:
        return f"expected a number, or {AS_IN_FILE} where the argument has that"
    return ""


def _flag(_: str, value: str, __: Given) -> str:
    return "" if value.lower() in _FLAGS else "expected true or false"


def _field_of_view(name: str, value: str, given: Given) -> str:
    return "" if value == "main" or not _number(name, value, given) else "expected a number, or main"


def _one_of(*choices: str) -> Check:
    return lambda _, value, __: "" if value in choices else f"expected one of {', '.join(choices)}"


def _joystick(name: str, value: str, given: Given) -> str:
    """Who publishes joy; for failure.launch, which has no joy_config_file: whether the player plays a joystick."""
    check = _one_of("none", "mapper", "joy", "sdl", "virtual", "xplane") if "joy_config_file" in given else _flag
    return check(name, value, given)


def _joy_config(_: str, value: str, given: Given) -> str:
    """The joystick where no argument names its file: failure.launch, whose player finds it by itself."""
    if "joy_config_file" in given:
        return ""
    path = Path(value)
    if path.suffix != ".yaml":
        path = config_file("joysticks", "README.md").with_name(f"{value}.yaml")
    return _shipped("joystick", "joysticks", "joy_config")("joy_config", str(path), given)


def _parameters(_: str, value: str, __: Given) -> str:
    """A file of parameters: there, readable, YAML, a mapping."""
    try:
        # Composed, not constructed: roslaunch knows tags of its own, e.g. for degrees.
        node = yaml.compose(Path(value).read_text(encoding="utf-8"))
    except OSError as error:
        return f"{error.strerror}; expected a YAML file of parameters"
    except UnicodeDecodeError:
        return "is no text; expected a YAML file of parameters"
    except yaml.YAMLError as error:
        return yaml_problem(error)
    if node is not None and not isinstance(node, yaml.MappingNode):
        return "is YAML, but no list of `key: value`"
    return ""


def _shipped(kind: str, folder: str, stem: str) -> Check:
    """A file of parameters that is named by its stem, unless by its path.

    Args:
        kind: Of thing, for the message.
        folder: Below config/.
        stem: The argument that names the stem.
    """

    def check(name: str, value: str, given: Given) -> str:
        path = Path(value)
        home = config_file(folder, "README.md").parent
        if path.is_file() or path.parent.resolve() != home.resolve():
            return _parameters(name, value, given)
        there = ", ".join(sorted(file.stem for file in home.glob("*.yaml")))
        return (
            f"there is no {kind} of that name ({stem}:={path.stem}); there is {there}; "
            f"or a file of your own with {name}:=PATH"
        )

    return check


def _recording(_: str, value: str, __: Given) -> str:
    """A file that rosbag writes, from ROS's folder on."""
    home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
    folder = (home / value).parent
    return "" if folder == home or folder.is_dir() else f"there is no folder {folder}; make it, then record"


def _scenario(_: str, value: str, __: Given) -> str:
    from xplane_bridge.cli.scenario_player import scenario_of

    try:
        scenario_of(value)
    except XplaneBridgeError as error:
        return str(error)
    return ""


CHECKS: Dict[str, Check] = {
    **dict.fromkeys(("port", "data_port", "stick_mode", "split_size", "buffer", "xplane_version"), _whole),
    "window_index": _whole,
    **dict.fromkeys(("display_delay", "max_publish_rate", "image_rate", "heading", "pitch", "roll"), _number),
    "field_of_view": _field_of_view,
    **dict.fromkeys(("rx", "tx", "capture", "listen_for_beacon", "publish_tf", "configure_xplane", "required"), _flag),
    **dict.fromkeys(("set_points", "engage", "lockstep"), _flag),
    "compression": _one_of("none", "lz4", "bz2"),
    **dict.fromkeys(("bag", "prefix"), _recording),
    "joystick": _joystick,
    "joy_config": _joy_config,
    **dict.fromkeys(("common_config", "rx_config", "tx_config", "capture_config"), _parameters),
    "aircraft_file": _shipped("aircraft", "aircraft", "aircraft"),
    "joy_config_file": _shipped("joystick", "joysticks", "joy_config"),
    "scenario": _scenario,
}


def problems(given: Given) -> List[str]:
    """What is wrong with the arguments, a line each; empty values were not given."""
    lines = []
    for name, value in given.items():
        text = "" if value in ("", AS_IN_FILE) else CHECKS[name](name, value, given)
        if text:
            lines.append(f"{name}:={value}: {text}")
    return lines


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Looks at arguments; 1 when one of them cannot be."""
    p = argparse.ArgumentParser(prog="check_launch", description="Looks at the arguments of a launch file.")
    p.add_argument("arguments", nargs="*", metavar="KEY=VALUE", help=", ".join(sorted(CHECKS)))
    args = p.parse_args(ros_arguments(argv))
    given: Dict[str, str] = {}
    for word in args.arguments:
        key, separator, value = word.partition("=")
        if not separator or key not in CHECKS:
            p.error(f"{word!r}: expected KEY=VALUE, KEY one of {', '.join(sorted(CHECKS))}")
        given[key] = value
    lines = problems(given)
    for line in lines:
        print(f"xplane_bridge: {line}", file=sys.stderr)
    if not lines:
        print("good")
    return 1 if lines else 0
