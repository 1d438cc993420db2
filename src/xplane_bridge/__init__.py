"""X-Plane to ROS 1 bridge: the Python side (emulator, bag analysis, test harness). No ROS import anywhere below."""

import logging
from pkgutil import extend_path

__version__ = "0.2.0"
# The generated messages and the compiled module lie in a folder of this name elsewhere on the path. Either may be found
# first: a new process may be given the path in another order.
__path__ = extend_path(__path__, __name__)

logging.getLogger(__name__).addHandler(logging.NullHandler())
