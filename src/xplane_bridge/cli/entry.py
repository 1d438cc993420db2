"""The one place where command-line programs turn exceptions into a line and an exit code."""

from __future__ import annotations

import argparse
import atexit
import functools
import importlib
import logging
import math
import os
import re
import signal
import sys
import threading
from contextlib import contextmanager
from typing import Any, Callable, Iterator, List, Optional, Sequence, Type

from xplane_bridge.errors import XplaneBridgeError

Main = Callable[..., int]

#: A value below zero, or that begins with one: -1920,0 or -30/-20.
_BELOW_ZERO = re.compile(r"-\.?\d")
#: How long init_node may go on after a signal [s]: long for a master that answers.
_INIT_S = 0.5


@contextmanager
def writing(kind: Type[XplaneBridgeError], subject: object, remedy: str) -> Iterator[None]:
    """Writes a file or makes a folder; where that cannot be, raises an error of this kind: subject, cause; remedy."""
    try:
        yield
    except OSError as error:
        raise kind(f"{subject}: {error.strerror or error}; {remedy}") from None


def guarded(main: Main) -> Main:
    """Wrap a program's `main(argv=None) -> exit code`.

    An error that the user can put right is one line on stderr and exit code 1; Ctrl-C is 130; a reader that closed the
    pipe is 0. Anything else is a fault of ours and keeps its traceback. Warnings of the package are lines on stderr.
    """

    @functools.wraps(main)
    def wrapped(argv: Optional[Sequence[str]] = None) -> int:
        package = logging.getLogger("xplane_bridge")
        for handler in [each for each in package.handlers if isinstance(each, logging.NullHandler)]:
            package.removeHandler(handler)  # it keeps a library silent, and with it what a program has to say
        try:
            return main(argv)
        except XplaneBridgeError as error:
            print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
            return 1
        except KeyboardInterrupt:
            return 130
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0

    return wrapped


def number(expected: str, low: float = -math.inf, high: float = math.inf) -> Callable[[str], float]:
    """Make the type of an option that takes a finite number.

    Args:
        expected: What the error calls it, e.g. "a share from 0 to 1".
        low: Smallest number.
        high: Largest number.
    """

    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and low <= value <= high):
            raise argparse.ArgumentTypeError(f"{text}: expected {expected}")
        return value

    return convert


def with_values_below_zero(arguments: Sequence[str]) -> List[str]:
    """Joins such values to the options before them: argparse takes what is no plain number for another option."""
    joined: List[str] = []
    for argument in arguments:
        option = joined[-1] if joined else ""
        if _BELOW_ZERO.match(argument) and re.fullmatch(r"--[^=]+", option):
            joined[-1] = f"{option}={argument}"
        else:
            joined.append(argument)
    return joined


#: The type of an option that takes a time or a rate.
positive = number("a number above 0", low=sys.float_info.min)


def udp_port(text: str) -> int:
    """The type of an option that takes a UDP port."""
    if not text.isdecimal() or not 0 < int(text) < 65536:
        msg = f"{text!r} is no UDP port; expected 1..65535"
        raise argparse.ArgumentTypeError(msg)
    return int(text)


class NoRosError(XplaneBridgeError):
    """A program that is a ROS node was started where there is no ROS."""


def rospy_module() -> Any:
    """The module rospy.

    Raises:
        NoRosError: It is not there.
    """
    try:
        return importlib.import_module("rospy")
    except ModuleNotFoundError:
        msg = "rospy is not there: source ROS's setup.bash (on Debian: apt-get install python3-rospy)"
        raise NoRosError(msg) from None


def ros_arguments(argv: Optional[Sequence[str]]) -> list[str]:
    """Give the arguments without those that roslaunch adds (`__name:=...`)."""
    given = list(sys.argv[1:] if argv is None else argv)
    return [word for word in given if ":=" not in word]


def start_node(name: str, namespace: Optional[str] = None, **options: Any) -> Any:
    """Make this process a ROS node; gives rospy.

    Args:
        name: Of the node.
        namespace: Of the bridge, below which the node registers: one of the same name ends another's. It does not hold
            against `__name` and `__ns` on the command line, of which roslaunch gives one. None: ROS_NAMESPACE.
        **options: For rospy.init_node. Unless `disable_signals`, SIGINT and SIGTERM end ROS, and the process with 130
            while init_node still waits for the master.

    Raises:
        NoRosError: rospy is not there, or ROS ended while the master was waited for.
    """
    rospy = rospy_module()
    if namespace is not None and not {"__name", "__ns"}.intersection(rospy.names.get_mappings()):
        # init_node refuses a name with a namespace, and rospy reads ROS_NAMESPACE only while it is imported.
        rospy.names._set_caller_id(f"{namespace.rstrip('/')}/unnamed")
    initialised = threading.Event()
    if not options.pop("disable_signals", False):
        _end_on_signals(rospy, initialised)
    try:
        rospy.init_node(name, disable_signals=True, **options)
        initialised.set()
    except rospy.exceptions.ROSInitException as error:
        msg = f"no ROS master at {os.environ.get('ROS_MASTER_URI', '(ROS_MASTER_URI is not set)')}: {error}"
        raise NoRosError(msg) from None
    return rospy


def _end_on_signals(rospy: Any, initialised: threading.Event) -> None:
    """End ROS on a thread of its own.

    rospy's handler does it on the main thread, whatever that is at: where it holds a lock, as within a call of the
    master, it would wait for itself for ever. While init_node waits for a master, it holds a lock that the end of ROS
    takes as well: there is nothing to sign off from yet, and the process ends.
    """
    reader, writer = os.pipe()
    came: List[int] = []

    def end() -> None:
        os.read(reader, 1)
        if not initialised.wait(_INIT_S):
            os._exit(130)
        rospy.signal_shutdown(f"signal {came[0]}")

    def on_signal(number: int, _frame: Any) -> None:
        came.append(number)
        os.write(writer, b"!")

    ending = threading.Thread(target=end, daemon=True)
    ending.start()
    # The node says good-bye to the master before the process ends.
    atexit.register(lambda: ending.join() if came else None)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
