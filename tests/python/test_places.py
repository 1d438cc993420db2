"""Where things are written: the table of CONTRIBUTING.md, topics, and words that documents explain."""

from __future__ import annotations

import ast
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest

from support.room_table import ROOT
from xplane_bridge.constants import EXCITATION_KINDS, FAILURE_KINDS
from xplane_bridge.topics import TOPICS

PRODUCT = ("msg", "srv", "lib", "include", "launch", "src", "cmake", "config")
#: Written apart, made, X-Plane's own names, rooms that fly single aircraft, or configuration: a new channel needs
#: nothing there. Counted in a row that names a file of it.
NOT_COUNTED = (
    "config",
    *(
        f"src/xplane_bridge/{name}"
        for name in ("emulator", "constants.py", "xplane_names", "aircraft_file", "controllers", "gym")
    ),
)


def changes():
    """The rows of the table: the words of the example, and the files."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("\n## Where a change goes\n")[1]
    rows = [line.strip("|").split("|") for line in text.split("\n## ")[0].splitlines() if line.startswith("| ")]
    return [
        pytest.param(re.findall(r"`([^`]+)`", words), set(re.findall(r"`([^`]+)`", files)), id=change.strip())
        for change, words, files in rows[1:]
    ]


@pytest.mark.parametrize(("words", "files"), changes())
def test_the_files_of_a_change_are_those_that_have_its_example(words, files):
    patterns = [part for word in words for part in ("-e", word)]
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), "grep", "-lwF", *patterns, "--"]
    tests = {file for file in files if file.startswith("tests/")}
    left_out = [f":!{place}" for place in NOT_COUNTED if not any(file.startswith(f"{place}/") for file in files)]
    where = (*PRODUCT, *tests, ":!*.md", *left_out)
    found = subprocess.run([*command, *where], stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    assert set(found) == files
    texts = [(ROOT / file).read_text(encoding="utf-8") for file in files]
    assert [word for word in words if not any(word in text for text in texts)] == []


def test_the_table_has_the_changes_that_are_asked_for_most():
    named = {row.id for row in changes()}
    assert named >= {"a topic", "a launch argument", "an aircraft of the emulator", "an export format"}


def test_documents_explain_every_kind():
    surfaces, scenarios = (ROOT / "docs/control/surfaces.md", ROOT / "config/scenarios/README.md")
    for document, kinds in ((surfaces, FAILURE_KINDS), (scenarios, (*FAILURE_KINDS, *EXCITATION_KINDS))):
        words = document.read_text(encoding="utf-8")
        assert [kind for kind in kinds if not re.search(rf"\b{re.escape(kind)}\b", words)] == [], document


# ---------------------------------------------------------------------------------------------------------- topics


def cpp_topics(verb):
    """Topics that the nodes have, and their types: those of BaseNode's functions and of a handle's."""
    found = {}
    for path in sorted((ROOT / "lib/nodes").rglob("*.cpp")):
        text = path.read_text(encoding="utf-8")
        for msgtype, topic in re.findall(rf'\b{verb}(?:Topic|InFrames)?<([\w:]+)>\(\s*"([^"]+)"\s*,', text):
            package, _, name = msgtype.rpartition("::")
            found[topic] = f"{package or 'xplane_bridge'}/{name}"
    assert found
    return found


def groups():
    """`mission/<group>` of each group of lib/core/state/sources.txt, and its type."""
    text = (ROOT / "lib/core/state/sources.txt").read_text(encoding="utf-8")
    sections = re.findall(r"^\[(\w+): (\w+), ", text, re.MULTILINE)
    return {f"mission/{group}": f"xplane_bridge/{message}" for message, group in sections if group != "flight"}


#: Of the bridge's namespace, advertised by others than its nodes: controllers, the scenario's player.
FROM_OUTSIDE = {"control/auto", "traffic/command", "scenario/label"}


def test_the_nodes_advertise_the_topics_of_the_list_with_their_types():
    advertised = {**cpp_topics("advertise"), **groups()}
    assert advertised == {topic: msgtype for topic, msgtype in TOPICS.items() if topic not in FROM_OUTSIDE}


def test_the_nodes_subscribe_to_topics_of_the_list():
    subscribed = cpp_topics("subscribe")
    assert {topic: TOPICS.get(topic) for topic in subscribed} == subscribed
    assert set(subscribed) >= FROM_OUTSIDE - {"scenario/label"}


def test_all_topics_but_raw_pictures_are_recorded():
    launch = ElementTree.parse(ROOT / "launch/record.launch").getroot()
    recorded = next(arg.get("default") for arg in launch.findall("arg") if arg.get("name") == "topics").split()
    assert recorded == [
        *(topic for topic in TOPICS if topic != "camera/image_raw"),
        "/tf",
        "/tf_static",
        "/diagnostics",
    ]


# ------------------------------------------------------------------------------------------------------- overrides


def test_the_panic_tool_knows_every_override_that_the_bridge_sets():
    """scripts/release_overrides runs without the package: its list is its own."""
    tool = (ROOT / "scripts/release_overrides").read_text(encoding="utf-8")
    known = {path for path, _ in ast.literal_eval(re.search(r"^KNOWN = (\[.*?^\])", tool, re.MULTILINE | re.DOTALL)[1])}
    named = set()
    for path in (ROOT / "lib").rglob("*.cpp"):
        named |= set(re.findall(r'"(sim/operation/override/override_\w*[a-z])"', path.read_text(encoding="utf-8")))
    # The whole stick is what other clients and earlier versions take.
    known.remove("sim/flightmodel/engine/ENGN_thro_override")  # which set_dataref holds
    assert known == named | {"sim/operation/override/override_joystick"}


def test_the_earth_and_the_units_are_written_once():
    """In Python. Controllers are copied, and the analysis imports nothing but the messages' words."""
    written = re.compile(r"\b6378145\b|(?<![\w.])(?:9\.80665|0\.3048)\b(?!\))|1852(?:\.0)? / 3600")
    own = {
        "src/xplane_bridge/units.py",
        "src/xplane_bridge/controllers/geometry.py",
        "src/xplane_bridge/analysis/consistency.py",
    }
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "src").rglob("*.py")
        if written.search(path.read_text(encoding="utf-8"))
    }
    assert found == own


#: Topics of mavros, which its relay publishes.
OF_MAVROS = {"global_position/rel_alt", "global_position/compass_hdg"}


def test_python_programs_name_topics_of_the_list_only():
    roots = "|".join(sorted({topic.split("/")[0] for topic in TOPICS if "/" in topic}))
    named = {
        node.value.strip("/")
        for path in (ROOT / "src").rglob("*.py")
        if path.name != "topics.py"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if re.fullmatch(rf"/?(?:{roots})(?:/[a-z_]+)+", node.value)
    }
    assert named >= {"control/manual", "control/auto", "mission/surfaces"}
    assert named - set(TOPICS) == OF_MAVROS
