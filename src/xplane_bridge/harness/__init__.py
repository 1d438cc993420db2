"""Starts X-Plane's stand-in, a ROS master and the bridge, waits for what they say, and ends them in good order.

Used by scripts/demo, run_scenario and the node tests. Every process has a log file, a process group of its own, and
ends with the program that started it, also when that one is killed.
"""

from xplane_bridge.harness.emulator import EmulatorProcess
from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ros import RosMaster, ros_environment, roslaunch

__all__ = [
    "EmulatorProcess",
    "HarnessError",
    "ManagedProcess",
    "RosMaster",
    "ros_environment",
    "roslaunch",
    "wait_until",
]
