"""The rooms of the Python package: imports as docs/architecture.md allows them, and tests beside what they test."""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from support.room_table import MOST_FILES, ROOT, not_needed, require_floors, room_table

PACKAGE = ROOT / "src" / "xplane_bridge"
TABLE = room_table("Python rooms")
ROS = re.compile(
    r"^(ros(py|lib|bag|graph|launch|node|topic|service|param|msg)|tf2?|tf2_\w+|actionlib|message_filters|cv_bridge|"
    r"genpy|(\w+_)?msgs|std_srvs|xplane_bridge\.(msg|srv))(\.|$)"
)
ROS_ROOMS = {"cli", "harness", "lockstep", "scenario"}
#: Rooms for machines that have neither, also by way of the rooms they import.
WITHOUT_ROS_AND_EMULATOR = {"doctor", "eye"}


def modules() -> dict[str, Path]:
    """Every module of the package by its full name."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


def imported(text: str, module: str, is_package: bool) -> set[str]:
    """What a source imports anywhere in it: modules of the package to the file, others as they are written."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parent = module.split(".")[: len(module.split(".")) - node.level + is_package] if node.level else []
            base = ".".join([*parent, *([node.module] if node.module else [])])
            members = {f"{base}.{alias.name}" for alias in node.names}
            modules_of_it = {name for name in members if name in MODULES or ROS.match(name)}
            names |= modules_of_it | ({base} if len(modules_of_it) < len(members) else set())
    return names


def imports_of(module: str) -> set[str]:
    path = MODULES[module]
    return imported(path.read_text(encoding="utf-8"), module, path.name == "__init__.py")


def room_of(module: str) -> str | None:
    """The innermost room that holds a module of the package; None for `xplane_bridge` itself, which any may import."""
    path = module.split(".")[1:]
    for length in range(len(path), 0, -1):
        if "/".join(path[:length]) in TABLE:
            return "/".join(path[:length])
    assert not path, f"{module} lies in no room of docs/architecture.md"
    return None


def forbidden(room: str | None, name: str) -> bool:
    """Whether a module of this room may not import this."""
    if ROS.match(name):
        return room not in ROS_ROOMS
    if name.split(".")[0] == "support":  # of the tests
        return True
    if name.split(".")[0] != "xplane_bridge":
        return False
    other = room_of(name)
    return other is not None and other != room and (room is None or other not in TABLE[room])


def test_every_import_is_allowed_by_the_room_table():
    wrong = [
        f"{MODULES[module].relative_to(ROOT)}: {name}"
        for module in MODULES
        for name in sorted(imports_of(module))
        if forbidden(room_of(module), name)
    ]
    assert not wrong


def test_the_room_table_names_the_rooms_there_are_and_they_form_floors():
    rooms = {room_of(module) for module in MODULES} - {None}
    assert rooms == set(TABLE), "rooms of the table that do not exist"
    require_floors(TABLE)


@pytest.mark.parametrize("heading", ["C++ rooms", "Python rooms"])
def test_the_picture_of_the_floors_has_each_room_above_all_that_it_may_use(heading):
    texts = ElementTree.parse(ROOT / "docs/images/rooms.svg").getroot().iter("{http://www.w3.org/2000/svg}text")
    drawn = {text.text: float(text.get("y")) for text in texts if text.get("class") == "room"}
    table = room_table(heading)
    assert set(drawn) == set(TABLE) | set(room_table("C++ rooms"))
    assert [(room, other) for room, below in table.items() for other in below if drawn[other] <= drawn[room]] == []


def test_the_room_table_allows_nothing_that_no_file_needs():
    used = {room: set() for room in TABLE}
    for module in MODULES:
        if room_of(module) is not None:
            ours = {
                name for name in imports_of(module) if name.split(".")[0] == "xplane_bridge" and not ROS.match(name)
            }
            used[room_of(module)] |= {room_of(name) for name in ours}
    assert not_needed(TABLE, used) == {}


@pytest.mark.parametrize("room", sorted(WITHOUT_ROS_AND_EMULATOR))
def test_no_ros_and_no_emulator_by_any_way(room):
    reached, new = set(), {room}
    while new:
        reached |= new
        new = set().union(*(TABLE[name] for name in new)) - reached
    assert not reached & ROS_ROOMS
    assert not any(name.split("/")[0] == "emulator" for name in reached)


def test_no_module_imports_itself_by_way_of_others():
    below = {module: imports_of(module) & set(MODULES) - {module, "xplane_bridge"} for module in MODULES}
    while True:
        free = {module for module, needs in below.items() if not needs & set(below)}
        if not free:
            break
        below = {module: needs for module, needs in below.items() if module not in free}
    assert sorted(below) == []


def test_no_folder_holds_too_many_files_and_tests_stand_in_the_folder_of_what_they_test():
    tests = ROOT / "tests" / "python"
    for top in (PACKAGE, ROOT / "tests"):
        for folder in {path.parent for path in top.rglob("*.py")}:
            assert len(list(folder.glob("*.py"))) <= MOST_FILES, folder
    folders = {path.parent.relative_to(tests) for path in tests.rglob("test_*.py")}
    assert folders <= {path.parent.relative_to(PACKAGE) for path in MODULES.values()}


@pytest.mark.parametrize(
    ("room", "source"),
    [
        ("analysis", "from xplane_bridge.bags import Bags"),
        ("analysis", "import rospy"),
        ("analysis", "def f():\n    from sensor_msgs.msg import Joy"),
        ("bags", "if TYPE_CHECKING:\n    from xplane_bridge.emulator.flight import earth"),
        ("emulator/datarefs", "from xplane_bridge.emulator.simulator import Simulator"),
        ("emulator/datarefs", "from ..simulator import Simulator"),
        ("emulator/flight", "from ..wire import server"),
        ("emulator", "from xplane_bridge.msg import FlightState"),
        ("protocol", "import xplane_bridge.errors"),
        ("cli", "from support.nodes.tx_fixtures import ROLL"),
        ("doctor", "from xplane_bridge.emulator.wire.server import Server"),
        ("eye", "from xplane_bridge import msg"),
    ],
)
def test_a_planted_import_is_found(room, source):
    module = f"xplane_bridge.{room.replace('/', '.')}.planted"
    assert [name for name in imported(source, module, is_package=False) if forbidden(room, name)]


@pytest.mark.parametrize(
    ("room", "source"),
    [
        ("analysis", "from xplane_bridge import __version__"),
        ("bags", "from . import units"),
        ("emulator/datarefs", "from ..flight import earth, flight_model"),
        ("cli", "import rospy"),
        ("analysis", "import numpy as np"),
    ],
)
def test_what_the_table_allows_passes(room, source):
    module = f"xplane_bridge.{room.replace('/', '.')}.planted"
    assert not [name for name in imported(source, module, is_package=False) if forbidden(room, name)]
