"""A Python without the modules that other systems do not have."""

from __future__ import annotations

#: What Windows has not, and all of ROS: to import them is an error.
ABSENT = ("fcntl", "termios", "pwd", "resource", "grp", "rospy", "rosbag", "roslib", "genpy", "xplane_bridge.msg")

#: To be run first, in a process of its own.
WITHOUT_THEM = f"""
import importlib, sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name in {ABSENT!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
for name in {ABSENT!r}:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Absent())
"""
