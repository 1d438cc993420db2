"""Rules of the package as a whole: layers, lists kept in step, versions, what git tracks."""

import importlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
from catkin_pkg.changelog import Changelog, populate_changelog_from_rst

import xplane_bridge
from support.room_table import MOST_FILES, ROOT, not_needed, require_floors, room_table


def sources(*folders, suffixes=(".hpp", ".cpp")):
    """All files below these folders with these suffixes."""
    return sorted(p for folder in folders for p in (ROOT / folder).rglob("*") if p.suffix in suffixes)


def includes(path):
    """What a C++ file includes, in the form it is written."""
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE)


def without_comments(text):
    """A C++ source without its comments."""
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def git(*arguments):
    # A clone of another user's (sudo, containers) is not to be refused.
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)


def tracked_files():
    listing = git("ls-files", "-z")
    if listing.returncode != 0:
        pytest.fail("git ls-files failed: the test needs a git clone")
    return [ROOT / name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]


# ----------------------------------------------------------------------------------------------------------- rooms

ROS_HEADER = re.compile(
    r"^(ros|roscpp|rosconsole|tf2?|tf2_\w+|actionlib|diagnostic_\w+|image_transport|cv_bridge|camera_info_manager|"
    r"(\w+_msgs|std_srvs)|xplane_bridge/[A-Z]\w*\.h)(/|$)|^xplane_bridge/[A-Z]\w*\.h$"
)
GRAPHICS_HEADER = re.compile(r"^(opencv|opencv2|X11|xcb|turbojpeg)([/.]|$)")
OUR_HEADER = re.compile(r"^xplane_bridge/([a-z/]+)/\w+\.hpp$")
TREES = ("include/xplane_bridge", "lib", "tests/cpp")


def room_of(path):
    """The room of a file below one of TREES."""
    tree = next(tree for tree in TREES if (ROOT / tree) in path.parents)
    return path.parent.relative_to(ROOT / tree).as_posix()


def forbidden(room, header, table):
    """Whether a file of this room may not include this header."""
    ours = OUR_HEADER.search(header)
    if ours:
        return ours.group(1) != room and ours.group(1) not in table[room]
    ros_allowed = room.startswith("nodes/")
    if ROS_HEADER.search(header):
        return not ros_allowed
    return bool(GRAPHICS_HEADER.search(header)) and not (ros_allowed or room == "vision")


def test_every_include_is_allowed_by_the_room_table():
    table = room_table("C++ rooms")
    wrong = [
        f"{path.relative_to(ROOT)}: {header}"
        for path in sources("include/xplane_bridge", "lib")
        for header in includes(path)
        if forbidden(room_of(path), header, table)
    ]
    assert not wrong


def test_the_room_table_names_the_rooms_there_are_and_they_form_floors():
    table = room_table("C++ rooms")
    assert set(table) == {room_of(path) for path in sources("include/xplane_bridge", "lib")}
    require_floors(table)


def test_the_room_table_allows_nothing_that_no_file_needs():
    table = room_table("C++ rooms")
    used = {room: set() for room in table}
    for path in sources("include/xplane_bridge", "lib"):
        used[room_of(path)] |= {m.group(1) for m in map(OUR_HEADER.search, includes(path)) if m}
    assert not_needed(table, used) == {}


def test_rooms_are_small_and_tests_stand_in_the_room_of_what_they_test():
    table = room_table("C++ rooms")
    for tree in TREES:
        for folder in {path.parent for path in sources(tree)}:
            assert len(list(folder.glob("*.[ch]pp"))) <= MOST_FILES, folder
    tests = sources("tests/cpp")
    assert {room_of(path) for path in tests if path.name.startswith("test_")} <= set(table)


def node_sources():
    return [p for p in sources("include/xplane_bridge", "lib") if room_of(p).startswith(("actuation", "nodes/"))]


def test_the_nodes_name_no_dataref():
    assert node_sources()
    wrong = [
        f"{path.relative_to(ROOT)}: {match}"
        for path in node_sources()
        for match in re.findall(r'"sim/[^"]*"', without_comments(path.read_text(encoding="utf-8")))
    ]
    assert not wrong


@pytest.mark.parametrize(
    ("room", "header"),
    [("core/wire", "ros/ros.h"), ("core/state", "sensor_msgs/Joy.h"), ("core/base", "xplane_bridge/FlightState.h"),
     ("vision", "tf2_ros/transform_broadcaster.h"), ("core/camera", "opencv2/core.hpp"), ("core/wire", "xcb/xcb.h"),
     ("core/link", "xplane_bridge/nodes/base/base_node.hpp"), ("core/camera", "xplane_bridge/vision/window.hpp"),
     ("core/wire", "xplane_bridge/core/link/journal.hpp"), ("nodes/rx", "xplane_bridge/nodes/tx/tx_node.hpp")],
)  # fmt: skip
def test_the_rules_know_what_they_forbid(room, header):
    table = room_table("C++ rooms")
    assert forbidden(room, header, table)
    allowed = ("xplane_bridge/core/base/bytes.hpp", "Eigen/Core", "vector", "sys/socket.h", "nlohmann/json.hpp")
    assert not any(forbidden("core/wire", name, table) for name in allowed)


# ----------------------------------------------------------------------------------------------------- one clock

HOST_TIME = re.compile(
    r"hostClock\(|\b(?:steady|system|high_resolution)_clock\b"
    r"|\b(?:clock_gettime|gettimeofday|nanosleep|usleep|pthread_cond_timedwait)\b"
    r"|\btime\((?:nullptr|NULL|0)\)|\b(?:Wall|Steady)?Time::now\b|\b(?:Wall|Steady)Timer\b"
    r"|\bcreate(?:Wall|Steady)?Timer\b|\b(?:Wall)?Rate [a-z]\w*\(|\bsleep_(?:for|until)\b"
    r"|(?:\.|->)(?:wait_for|wait_until|sleep)\("
)

# Source: why, and what it uses. Everything else asks the clock it is given (BaseNode::clock()), so that a node can go
# by the simulator's.
MAY_USE_HOST_TIME = {
    "include/xplane_bridge/core/base/clock.hpp": ("what the host's clock is", {"hostClock("}),
    "lib/core/base/clock.cpp": (
        "reads the host's clock, and waits by it for clocks that run by themselves",
        {"hostClock(", "clock_gettime", "pthread_cond_timedwait"},
    ),
    "include/xplane_bridge/nodes/base/base_node.hpp": (
        "makes the node's clock; also for the stop, which must not hang with the node's clock",
        {"hostClock("},
    ),
    "lib/core/wire/capture_hub.cpp": ("lets a replay that is over not run hot", {"sleep_for"}),
    "lib/core/wire/replay_hub.cpp": ("lets a replay that is over not run hot", {"sleep_for"}),
    "lib/nodes/base/base_node_wire.cpp": ("waits until a replay is to begin", {"sleep_for"}),
    "lib/nodes/base/base_node.cpp": (
        "waits for the master before there is a node, and for roscpp to send the last words",
        {"sleep_for"},
    ),
    "lib/nodes/recorder/lockstep_recorder.cpp": ("names a file by the date, as rosbag does", {"time(nullptr)"}),
    "include/xplane_bridge/nodes/tx/heartbeat.hpp": ("shows the guardian that tx_node runs", {"SteadyTimer"}),
    "lib/nodes/tx/heartbeat.cpp": ("the same, also while the node's clock stands", {"createSteadyTimer"}),
    "lib/actuation/guardian.cpp": (
        "a process of its own, which releases whatever clock the node had, and the beat that it compares with that",
        {"hostClock("},
    ),
    "lib/vision/video_source.cpp": ("devices and files play in the host's time", {"steady_clock", "sleep_until"}),
    "lib/vision/x11_window_source.cpp": ("windows are drawn in the host's time", {"steady_clock"}),
}


def test_only_the_listed_sources_use_the_hosts_time():
    found = {
        path.relative_to(ROOT).as_posix(): set(HOST_TIME.findall(without_comments(path.read_text(encoding="utf-8"))))
        for path in sources("include/xplane_bridge", "lib")
    }
    assert {path: uses for path, uses in found.items() if uses} == {
        path: uses for path, (_, uses) in MAY_USE_HOST_TIME.items()
    }


def test_the_pattern_finds_what_it_is_to_find():
    for use in (
        "core::Clock clock = core::hostClock();",
        "const auto now = std::chrono::steady_clock::now();",
        "message.header.stamp = ros::Time::now();",
        "ros::Time(ros::WallTime::now().toSec())",
        "timers_.push_back(handle_.createSteadyTimer(period, callback));",
        "std::this_thread::sleep_for(std::chrono::milliseconds(10));",
        "changed_.wait_for(lock, longest, over);",
        "future.wait_until(deadline);",
        "ros::Rate rate(50.0);",
        "ros::WallDuration(0.1).sleep();",
        "clock_gettime(CLOCK_MONOTONIC, &now);",
    ):
        assert HOST_TIME.search(use), use
    for other in (
        "changed_.waitUntil(&lock, deadline, done);",
        "clock().steady_ns()",
        "stampNow()",
        "double rate(int)",
    ):
        assert not HOST_TIME.search(other), other


ROS_IMPORT = re.compile(
    r"(import|from)\s+(rospy|roslib|rosbag|rosgraph|roslaunch|tf2?|\w+_msgs|xplane_bridge\.(msg|srv))\b"
)


def test_python_imports_ros_only_inside_functions():
    wrong = [
        f"{path.relative_to(ROOT)}: {line}"
        for path in sources("src/xplane_bridge", suffixes=(".py",))
        for line in path.read_text(encoding="utf-8").splitlines()
        if ROS_IMPORT.match(line)
    ]  # fmt: skip
    assert not wrong


def test_only_bags_reads_bags():
    wrong = [
        str(path.relative_to(ROOT))
        for path in sources("src/xplane_bridge", suffixes=(".py",))
        if path.parent != ROOT / "src/xplane_bridge/bags"
        and re.search(r"^\s*(import|from)\s+rosbags\b.*Reader", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert not wrong


# ----------------------------------------------------------------------------------------------------------- lists


@pytest.mark.parametrize(
    ("command", "folder", "suffix"), [("add_message_files", "msg", ".msg"), ("add_service_files", "srv", ".srv")]
)
def test_cmake_lists_every_message_and_service(command, folder, suffix):
    cmake = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    listed = re.search(command + r"\(FILES([^)]*)\)", cmake).group(1).split()
    assert listed == sorted(p.name for p in (ROOT / folder).glob("*" + suffix))


def launchers():
    return {
        p.name: re.search(r'^ +launch\("([\w.]+)"\)', p.read_text(encoding="utf-8"), re.MULTILINE).group(1)
        for p in (ROOT / "scripts").iterdir()
        if p.is_file() and "from launcher import launch" in p.read_text(encoding="utf-8")
    }


def test_every_launcher_starts_a_program_that_exists():
    assert launchers()
    for name, module in launchers().items():
        assert callable(importlib.import_module(f"xplane_bridge.cli.{module}").main), name


def test_pip_installs_the_same_programs():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    section = re.search(r"^\[project\.scripts\]\n(.*?)^\[", project, re.MULTILINE | re.DOTALL).group(1)
    scripts = dict(re.findall(r'^(\w+) = "xplane_bridge\.cli\.([\w.]+):main"$', section, re.MULTILINE))
    assert scripts == launchers()


def test_launch_files_say_the_same_of_a_parameter():
    """roslaunch can include a file, not the text of its argument: the copies must agree."""
    texts = {}
    for path in sorted((ROOT / "launch").glob("*.launch")):
        for arg in ElementTree.parse(path).getroot().findall("arg"):
            text, config, _ = arg.get("doc", "").partition("; config: as in")
            if config:
                texts.setdefault(arg.get("name"), set()).add(text.replace("driver xplane: ", ""))
    assert len(texts["port"]) == 1
    assert texts.pop("display_delay") == {  # a second camera's is of its own window
        "[s] from a simulator frame to its picture",
        "[s] from a simulator frame to its picture in this window",
    }
    assert {name: said for name, said in texts.items() if len(said) > 1} == {}


def test_every_launch_argument_is_documented():
    wrong = []
    for path in (ROOT / "launch").glob("*.launch"):
        root = ElementTree.parse(path).getroot()
        wrong += [f"{path.name}: {arg.get('name')}" for arg in root.findall("arg") if not arg.get("doc")]
    assert not wrong


def test_both_example_controllers_fly_the_same_test():
    files = [ROOT / "docs/examples" / name / "test/flies.yaml" for name in ("controller_py", "controller_cpp")]
    assert files[0].read_bytes() == files[1].read_bytes()


# ------------------------------------------------------------------------------------------------- version, changelog


def test_the_version_is_the_same_everywhere():
    version = ElementTree.parse(ROOT / "package.xml").getroot().findtext("version")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert re.search(r'^version = "([^"]+)"', project, re.MULTILINE).group(1) == version
    assert xplane_bridge.__version__ == version


def test_the_changelog_is_as_rep_132_wants_it():
    text = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    # The parser passes over what is not released yet; it is to be right as well.
    text = text.replace("Forthcoming\n-----------", "999.0.0 (2099-12-31)\n--------------------")
    changelog = Changelog("xplane_bridge")
    populate_changelog_from_rst(changelog, text)
    assert list(changelog.foreach_version())
    for version, _, entries in changelog.foreach_version():
        assert entries, f"section {version} is empty"


# ------------------------------------------------------------------------------------------------------------- git


def test_sources_in_lib_are_not_ignored():
    # Popular .gitignore templates ignore lib/, which holds C++ sources here.
    for path in ("lib/core/base/new.cpp", "lib/nodes/rx/new.cpp", "lib/vision/new.cpp", "src/xplane_bridge/new.py"):
        assert git("check-ignore", "-q", path).returncode == 1, path
    assert git("check-ignore", "-q", "build/x").returncode == 0


def test_no_file_names_a_path_of_one_machine():
    pattern = re.compile(r"(?<![\w.$}])/(home|root|Users)/(?!(u|user|me)\b)\w+")  # but for made-up users
    wrong = []
    for path in tracked_files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        wrong += [f"{path.relative_to(ROOT)}: {match.group(0)}" for match in pattern.finditer(text)]
    assert not wrong


def test_files_end_with_a_newline_and_lines_without_spaces():
    wrong = []
    text_suffixes = {
        ".py",
        ".hpp",
        ".cpp",
        ".txt",
        ".cmake",
        ".yaml",
        ".toml",
        ".md",
        ".rst",
        ".msg",
        ".srv",
        ".launch",
        ".xml",
    }
    for path in tracked_files():
        if path.suffix not in text_suffixes or path.stat().st_size == 0:
            continue
        text = path.read_text(encoding="utf-8")
        if not text.endswith("\n") or re.search(r"[ \t]+$", text, re.MULTILINE) or "\r" in text:
            wrong.append(str(path.relative_to(ROOT)))
    assert not wrong


# ------------------------------------------------------------------------------------------------------------- sizes


def data_members(header):
    """Names of the data members of the only class in a header."""
    body = without_comments(header).split("private:", 1)[1]
    return re.findall(r"^  [^()\n]*?\b(\w+_)(?: = [^;]*|\{[^;]*\})?;", body, re.MULTILINE)


def test_data_members_are_found():
    lines = ["void f(int a_);", "int one_ = 0;  // two_", "std::map<int, int> two_;", "X three_{1};"]
    assert data_members("class A {\n private:\n  " + "\n  ".join(lines) + "\n};") == ["one_", "two_", "three_"]


def test_tx_node_is_topics_services_and_diagnostics_only():
    """What it does beyond that stands in classes of actuation/, which are tested without ROS, and beside it."""
    files = [file for file in (ROOT / "lib").rglob("*.cpp") if "TxNode::" in file.read_text(encoding="utf-8")]
    assert [file.name for file in files] == ["tx_node.cpp"]
    assert len(files[0].read_text(encoding="utf-8").splitlines()) < 300
    header = ROOT / "include" / "xplane_bridge" / "nodes" / "tx" / "tx_node.hpp"
    members = data_members(header.read_text(encoding="utf-8"))
    assert "actuation_" in members
    assert len(members) < 20


#: Longer than others may be: tables, and what is made.
TABLES = {
    "migration/0.1.0.bmr",
    "migration/0.1.0.txt",
    "src/xplane_bridge/emulator/aircraft/fixed_wing/fixed_wing.xml",
    "src/xplane_bridge/xplane_names/commands.txt",
    "src/xplane_bridge/xplane_names/datarefs.txt",
}
MOST_LINES = 500
SOURCES = {
    "",
    ".py",
    ".cpp",
    ".hpp",
    ".cmake",
    ".txt",
    ".sh",
    ".bash",
    ".launch",
    ".msg",
    ".srv",
    ".xml",
    ".yaml",
    ".toml",
}


def test_no_source_is_long_but_tables():
    files = [path for path in tracked_files() if path.suffix in SOURCES | {".bmr"} and "data" not in path.parts]
    assert len(files) > 500
    lines = {path.relative_to(ROOT).as_posix(): len(path.read_bytes().splitlines()) for path in files}
    assert {name: count for name, count in lines.items() if count > MOST_LINES and name not in TABLES} == {}
    assert {name for name in TABLES if lines[name] <= MOST_LINES} == set()


def test_the_compiled_modules_entry_is_visible_to_every_python():
    """Headers from Python 3.9 on say so themselves; before, an entry that is hidden with all else is no module."""
    text = (ROOT / "lib/bindings/module.cpp").read_text(encoding="utf-8")
    assert 'extern "C" __attribute__((visibility("default"))) PyObject* PyInit__core();' in text
