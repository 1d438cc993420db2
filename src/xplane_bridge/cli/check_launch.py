"""check_launch: looks at the arguments of a launch file before anything starts; launch/check.launch calls it.

roslaunch itself names the XML tag that does not work out. This names the argument, what was given, and what there is.
Ranges and single parameters are the nodes' own to judge.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import yaml

from xplane_bridge.cli.entry import guarded, ros_arguments
from xplane_bridge.errors import XplaneBridgeError, unsettable, yaml_entries, yaml_problem
from xplane_bridge.resources import config_file

#: The value by which an argument leaves a parameter as its file has it.
AS_IN_FILE = "config"
_FLAGS = ("true", "false", "1", "0")
#: The arguments that name files of parameters of single nodes, each as the file below config/ is called.
_OF_NODES = ("rx", "tx", "capture", "joystick_reader")

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


def _attribute(_: str, value: str, __: Given) -> str:
    """A flag that becomes a node's attribute: roslaunch takes 1 and 0 for `if`, `unless` and parameters only."""
    return "" if value.lower() in ("true", "false") else "expected true or false, as a word"


def _field_of_view(name: str, value: str, given: Given) -> str:
    return "" if value == "main" or not _number(name, value, given) else "expected a number, or main"


def _namespace(_: str, value: str, __: Given) -> str:
    """Whether the shell moves nodes away from where the launch files' options and remappings look: at full names.

    What a group around the launch file or `__ns` does is not seen here.
    """
    around = os.environ.get("ROS_NAMESPACE", "").strip("/")
    if not around or value.startswith("/"):
        return ""
    place = f"/{around}/{value}"
    return (
        f"ROS_NAMESPACE={os.environ['ROS_NAMESPACE']} would put nodes below {place}, while recordings, cameras and "
        f"programs look for /{value}; unset ROS_NAMESPACE"
    )


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
    elif not path.is_absolute():
        return _full_path("joy_config", value)
    return _shipped("joystick", "joysticks", "joy_config", _readable)("joy_config", str(path), given)


def _full_path(name: str, value: str) -> str:
    """What is said of a file that a node reads: nodes do not run in the folder where roslaunch was started."""
    return f"a relative path; give the full one, e.g. {name}:=$PWD/{value}"


def _composed(path: Path) -> Optional[yaml.Node]:
    """The content of a YAML file; composed, not constructed: roslaunch knows tags of its own, e.g. for degrees."""
    return yaml.compose(path.read_text(encoding="utf-8"))


def _leaves(node: Optional[yaml.Node], above: str = "") -> Iterator[Tuple[str, yaml.Node]]:
    """The parameters of a mapping, by their full names (`lockstep/enabled`)."""
    for key, value in yaml_entries(node):
        if isinstance(value, yaml.MappingNode):
            yield from _leaves(value, f"{above}{key.value}/")
        else:
            yield f"{above}{key.value}", value


def _read(value: str) -> Tuple[str, Optional[yaml.Node]]:
    """A file of parameters (there, readable, YAML, a mapping): what is wrong, and its content."""
    try:
        node = _composed(Path(value))
    except OSError as error:
        return f"{error.strerror}; expected a YAML file of parameters", None
    except UnicodeDecodeError:
        return "is no text; expected a YAML file of parameters", None
    except yaml.YAMLError as error:
        return yaml_problem(error), None
    if node is not None and not isinstance(node, yaml.MappingNode):
        return "is YAML, but no list of `key: value`", None
    return "", node


def _readable(_: str, value: str, __: Given) -> str:
    """A file of parameters that a program of ours reads."""
    return _read(value)[0]


def _parameters(_: str, value: str, __: Given) -> str:
    """A file of parameters that roslaunch loads; where it cannot, it names neither the file nor the key."""
    problem, node = _read(value)
    return problem or "; ".join(" ".join(each) for each in unsettable(node))


def _common(name: str, value: str, given: Given) -> str:
    """The shared parameters. Of others at the namespace no node takes notice: they are refused here."""
    problem = _parameters(name, value, given)
    if problem:
        return problem
    shared = dict(_leaves(_composed(config_file("common.yaml"))))
    homes: Dict[str, List[str]] = {}
    for of in _OF_NODES:
        for key, _ in _leaves(_composed(config_file(f"{of}.yaml"))):
            homes.setdefault(key, []).append(f"{of}_config")
    strange = [
        f"{key} ({'belongs into ' + ' or '.join(homes[key]) if key in homes else 'unknown'})"
        for key, _ in _leaves(_composed(Path(value)))
        if key not in shared
    ]
    return f"take out {', '.join(strange)}; it is for {', '.join(shared)}" if strange else ""


def _frames(measured: str) -> Dict[str, Tuple[str, str]]:
    """Of each parameter that names a frame: what camera.launch gives, and the first camera's, as shipped."""
    shipped = dict(_leaves(_composed(config_file("capture.yaml"))))
    stem = measured[: -len("optical")]
    named = {"frame_measured": measured}
    named.update({f"frame_{view}": f"{stem}{view}_optical" for view in ("forward", "rear", "down")})
    return {key: (name, shipped[key].value) for key, name in named.items()}


def _camera(_: str, value: str, __: Given) -> str:
    """The name of a further camera: a namespace, and the start of its frames' names."""
    if not re.fullmatch(r"\w+(/\w+)*", value, re.ASCII):
        return "expected letters, digits and underscores, as in camera:=belly: topics are named after it"
    frames = _frames(f"{value}_optical").values()
    shared = {name for name, _ in frames} & {first for _, first in frames}
    if not shared:
        return ""
    return f"the first camera has {', '.join(sorted(shared))}; give a name that is not taken, e.g. camera:=camera2"


def _other_frames(said: Mapping[str, yaml.Node], measured: str) -> str:
    """Frames that camera.launch would overwrite with its own; copies of the shipped file have the first camera's."""
    others = [
        f"{key} (here {name})"
        for key, (name, first) in _frames(measured).items()
        if key in said and said[key].value not in (name, first)
    ]
    return f"take out {', '.join(others)}: a further camera's frames are named after it" if others else ""


def _capture_config(name: str, value: str, given: Given) -> str:
    """Parameters of capture_node; of a further camera (camera.launch alone has field_of_view) they say which window."""
    problem = _parameters(name, value, given)
    if problem or "field_of_view" not in given:
        return problem
    said = dict(_leaves(_composed(Path(value))))
    problem = _other_frames(said, given["frame"]) if "frame" in given else ""
    if problem or "window_index" in given:
        return problem
    if "source" in said and said["source"].value != "x11":
        return ""
    of_window = [f"window/{key}" for key in ("index", "point", "title", "class", "id", "region")]
    if any(said[key].value not in ("", "-1", []) for key in of_window if key in said):
        return ""
    return "does not say which of X-Plane's windows: give window_index:=1, or window: {index: 1} in the file"


def _engage(name: str, value: str, given: Given) -> str:
    """Whether mavros_relay asks for mode AUTO, which only set-points are flown in."""
    problem = _flag(name, value, given)
    if problem or value.lower() not in ("true", "1") or given.get("set_points", "").lower() in ("true", "1"):
        return problem
    return "needs set_points:=true (default: with aircraft:=multirotor, which alone flies set-points)"


def _shipped(kind: str, folder: str, stem: str, look: Check = _parameters) -> Check:
    """A file of parameters that is named by its stem, unless by its path.

    Args:
        kind: Of thing, for the message.
        folder: Below config/.
        stem: The argument that names the stem.
        look: What the file has to be.
    """

    def check(name: str, value: str, given: Given) -> str:
        path = Path(value)
        home = config_file(folder, "README.md").parent
        if path.is_file() or path.parent.resolve() != home.resolve():
            return look(name, value, given)
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

    if Path(value).suffix in (".yaml", ".yml") and not Path(value).is_absolute():
        return _full_path("scenario", value)
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
    "camera": _camera,
    "frame": lambda *_: "",  # derived: what capture_config is held against
    **dict.fromkeys(("rx", "tx", "capture", "listen_for_beacon", "publish_tf", "configure_xplane"), _flag),
    **dict.fromkeys(("set_points", "lockstep"), _flag),
    "required": _attribute,
    "ns": _namespace,
    "engage": _engage,
    "compression": _one_of("none", "lz4", "bz2"),
    **dict.fromkeys(("bag", "prefix"), _recording),
    "joystick": _joystick,
    "joy_config": _joy_config,
    "common_config": _common,
    **dict.fromkeys(("rx_config", "tx_config", "joystick_reader_config"), _parameters),
    "capture_config": _capture_config,
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
