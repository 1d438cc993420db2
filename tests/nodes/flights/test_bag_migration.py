"""ROS's own tools bring a recording of version 0.1.0 to today's messages by the package's rules."""

import math
import subprocess
from pathlib import Path

import rosbag
from xplane_bridge.msg import EngineStates, SimStatus

ROOT = Path(__file__).resolve().parents[3]
OLD = ROOT / "tests/data/bags/every_topic_0.1.0.bag"
RULES = ROOT / "migration/0.1.0.bmr"


def tool(*arguments):
    command = ["rosbag", *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.stdout


def messages(path):
    """By topic, as (type's checksum, message), in the order of recording."""
    found = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, message, _ in bag.read_messages():
            found.setdefault(topic, []).append(message)
    return found


def test_a_recording_of_0_1_0_is_fixed_and_keeps_its_values(tmp_path):
    assert "rules missing" in tool("check", "--noplugins", OLD)
    assert "Bag is ready to be migrated" in tool("check", "--noplugins", OLD, RULES)
    fixed = tmp_path / "fixed.bag"
    assert "Bag migrated successfully" in tool("fix", "--noplugins", OLD, fixed, RULES)
    before, after = messages(OLD), messages(fixed)
    assert before.keys() == after.keys()
    for topic, old in before.items():
        assert len(after[topic]) == len(old) > 0
        for was, now in zip(old, after[topic]):
            for name in was.__slots__:
                assert repr(getattr(was, name)) == repr(getattr(now, name)), f"{topic}: {name}"
    engines, sim = after["/xplane/mission/engines"][0], after["/xplane/mission/sim"][0]
    assert engines._md5sum == EngineStates._md5sum
    assert sim._md5sum == SimStatus._md5sum
    assert all(math.isnan(value) for value in (*engines.magnetos, *engines.gauge_in_celsius))
    assert sim.frames_missed == 0
