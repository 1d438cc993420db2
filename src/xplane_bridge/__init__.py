"""X-Plane to ROS 1 bridge: the Python side (emulator, bag analysis, test harness). No ROS import anywhere below."""

import logging

__version__ = "0.1.0"

logging.getLogger(__name__).addHandler(logging.NullHandler())
