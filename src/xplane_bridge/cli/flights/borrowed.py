"""What a program has taken of a running bridge is given back however the program ends by itself."""

from __future__ import annotations

import math
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any, Callable, List, Optional, TypeVar

from xplane_bridge.errors import XplaneBridgeError

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: [s] in which a service answers: more than tx_node and rx_node wait for X-Plane.
_ANSWER_S = 30.0
_POLL_S = 0.1
#: [s] for which ROS's shutdown is held up at most: two services may be asked.
_HELD_S = 3 * _ANSWER_S

T = TypeVar("T")


class ReplayError(XplaneBridgeError):
    """What was recorded cannot be played, or what was taken for that is not given back."""


def answered(service: str, call: Callable[[], T], timeout: float = _ANSWER_S) -> T:
    """What a service answers. Signals do not cut the call short, and a node that hangs does not hold this program.

    Args:
        service: its name, for the error.
        call: asks it.
        timeout: [s]

    Raises:
        ReplayError: Its node is gone, or has not answered.
    """
    answers: List[T] = []
    problems: List[str] = []

    def ask() -> None:
        try:
            answers.append(call())
        except Exception as error:  # of rospy's, of the socket's and of the master's kinds
            problems.append(str(error) or type(error).__name__)

    asking = threading.Thread(target=ask, name=service, daemon=True)
    asking.start()
    asking.join(timeout)
    if answers:
        return answers[0]
    raise ReplayError(f"{service}: {problems[0] if problems else f'its node has not answered within {timeout:g} s'}")


class Borrowed:
    """Gives back, at the end of a `with` block, what the program has taken of a bridge, whatever ends the block.

    Within it Ctrl-C, SIGTERM, SIGHUP and ROS's request to end only end `wait()`; they act as they would have, the
    signals by the handlers from before, once it is given back: until then rospy's node is usable.

    Args:
        program: its name, for messages.
        rospy: the module; its node was made with `disable_signals`.
        give_back: called once, at the end. It raises a ReplayError that says what stays, and how to release it; where
            the block has ended by something else, this is a line on stderr.
    """

    def __init__(self, program: str, rospy: Any, give_back: Callable[[], None]) -> None:
        self._program, self._rospy, self._give_back = program, rospy, give_back
        self._before: List[Any] = []
        self._signal: Optional[int] = None
        self._ended_by = ""
        self._taken, self._done = False, threading.Event()

    def __enter__(self) -> Borrowed:
        self._rospy.on_shutdown(self._on_shutdown)
        self._before = [signal.signal(number, self._on_signal) for number in _SIGNALS]
        self._taken = True
        if self._ended_by or self._rospy.is_shutdown():  # before anything was taken
            self._done.set()
            self._act_on_signals()
            raise ReplayError(f"ended by {self._ended_by or 'ROS'}")
        return self

    def __exit__(self, _kind: object, ended_by: Optional[BaseException], _trace: object) -> None:
        problem: Optional[ReplayError] = None
        try:
            self._give_back()
        except ReplayError as error:
            problem = error
        finally:
            self._done.set()
        if problem is not None and (ended_by is not None or self._signal is not None):
            print(f"{self._program}: {problem}", file=sys.stderr)
        self._act_on_signals()
        if problem is not None and ended_by is None:
            raise problem

    def wait(self, event: threading.Event, timeout: float = math.inf) -> bool:
        """Waits for an event; returns whether it came.

        Args:
            event: waited for.
            timeout: [s]

        Raises:
            ReplayError: The program is to end.
        """
        deadline = time.monotonic() + timeout
        while not self._ended_by:
            left = deadline - time.monotonic()
            if event.wait(max(0.0, min(_POLL_S, left))):
                return True
            if left <= 0.0:
                return False
        raise ReplayError(f"ended by {self._ended_by}")

    def _on_signal(self, number: int, _frame: Optional[FrameType]) -> None:
        self._signal = self._signal or number
        self._ended_by = self._ended_by or signal.Signals(number).name

    def _on_shutdown(self) -> None:
        """In a thread of ROS's, whose shutdown waits for it."""
        self._ended_by = self._ended_by or "ROS"
        if self._taken:
            self._done.wait(_HELD_S)

    def _act_on_signals(self) -> None:
        for number, handler in zip(_SIGNALS, self._before):
            signal.signal(number, handler)
        if self._signal is not None:
            signal.raise_signal(self._signal)
