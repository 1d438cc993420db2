"""Plays a scenario in lock-step: each frame is answered, and all times and deadlines are the simulator's."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Any, Callable, Deque, Optional, Tuple

from xplane_bridge import lockstep
from xplane_bridge.lockstep import ModeInStep, Participant, TopicInStep
from xplane_bridge.scenario.player import Action, Commands
from xplane_bridge.scenario.ros_player import MODE_NAMES, MODE_WAIT_S, RosPlayer, mode_has_not_come
from xplane_bridge.scenario.schema import ScenarioError
from xplane_bridge.scenario.stall_warnings import RATE, age_ns
from xplane_bridge.scenario.tx_services import ChangeUnderWayError

_POLL_S = 0.2


class LockstepPlayer(RosPlayer):
    """Plays one scenario in the ROS node of this process, which is a participant; at the end the flight is held.

    Args:
        *args: As of RosPlayer.
        check: Called in the first frame; its error ends the flight.
        **kwargs: As of RosPlayer.
    """

    _link_wait_s = 0.0  # no frame comes while this node has not answered one
    _change_wait_s = math.inf  # tx_node's own time-outs end a change, by simulated time

    def __init__(self, *args: Any, check: Callable[[], None], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._check: Optional[Callable[[], None]] = check
        self._failure_of_check: Optional[BaseException] = None
        self._due: Deque[Action] = deque()
        self._awaited: Optional[Tuple[int, float]] = None  # mode, and the time [s] by which it must have come
        self._ending = threading.Event()
        variables = {c.variable for event in self._player.scenario.events for c in event.when}
        self._sees_mode = self._stick is not None or "mode" in variables
        self._warnings_age_ns = age_ns(RATE)

    def _publisher(self, topic: str, message_type: Any) -> Any:
        return lockstep.advertise(topic, message_type)

    def _play(self, publisher: Any) -> None:
        if self._sees_stall and not self._find_warnings_age():
            return
        import rospy
        from std_srvs.srv import Trigger

        from xplane_bridge.msg import WarningState
        from xplane_bridge.srv import LockstepStep

        self._listen_to_events()
        service = self._namespace + "/lockstep/"
        self._out = publisher
        self._hold = rospy.ServiceProxy(service + "hold", Trigger)
        self._modes = ModeInStep(self._namespace) if self._sees_mode else None
        warnings = self._namespace + "/mission/warnings"
        self._warnings = TopicInStep(warnings, WarningState) if self._sees_stall else None
        self._participant = Participant(self._answer, publisher, self._namespace)
        self._say(f"ready for {self._player.scenario.name}")
        while not rospy.is_shutdown() and not self._ending.wait(_POLL_S):
            pass
        if self._failure_of_check is not None:
            raise self._failure_of_check
        if self._error is None and self._ending.is_set():
            # No frames more; it is answered when the last answer of this node has come.
            rospy.ServiceProxy(service + "step", LockstepStep)(frames=0)
            if self._outcomes.pending():
                self._say("warning: what was asked for last was still under way at the end; see `events`")

    def _has_ended(self) -> bool:
        """A report that is still to come is not awaited: in which frame it is heard depends on the computer."""
        return self._finished.is_set() and self._error is None

    def _find_warnings_age(self) -> bool:
        """Follows the rate at which rx_node asks for warnings; returns False where it asks for none."""
        rate = self._warnings_rate()
        if rate > 0.0:
            self._warnings_age_ns = age_ns(rate)
        return rate > 0.0

    def fail(self, error: str) -> None:
        """Ends it with an error; the frame stays unanswered."""
        super().fail(error)
        self._ending.set()

    # --- a frame ------------------------------------------------------------------------------------------------------

    def _answer(self, state: Any) -> Any:
        if self._ending.is_set():
            return None
        try:
            return self._play_frame(state)
        except ScenarioError as error:
            self._fail_at(self._clock.now, str(error))
            raise
        except Exception as error:  # rospy would log it, and the frame never be answered
            self._fail_at(self._clock.now, repr(error))
            raise

    def _play_frame(self, state: Any) -> Any:
        self._look_around(state)
        if not self._finished.is_set():
            self._play_on(state)
        # What is held down in the first message of a stick counts as not pressed.
        if self._stick is None or state.header.stamp != self._first:
            self._act_on()
        assert self._commands is not None
        message = self._message(self._out, self._commands, self._clock.now)
        if self._finished.is_set() and not self._due and self._awaited is None:
            self._hold()
            self._ending.set()
        return message

    def _look_around(self, state: Any) -> None:
        if self._check is not None:
            check, self._check = self._check, None
            try:
                check()
            except BaseException as error:
                self._failure_of_check = error
                raise
            self._first = state.header.stamp
        if self._modes is not None:
            self._mode = self._modes.at(state)
        if self._warnings is not None:
            horizon = type(state.header.stamp)(nsecs=state.header.stamp.to_nsec() - self._warnings_age_ns)
            last = self._warnings.before(horizon) if horizon > self._first else None
            self._stall = last is not None and last.stall >= 0.5

    # --- actions ------------------------------------------------------------------------------------------------------

    def _put(self, action: Action) -> None:
        self._due.append(action)

    def _act_on(self) -> None:
        """What has become due, in its order.

        A mode that a button asks for is awaited before the next. A disturbance for which a change has to end is asked
        for in each frame: tx_node's answer belongs to the frame, whereas an event comes whenever it comes.
        """
        if self._awaited is not None:
            mode, latest = self._awaited
            if self._mode == mode:
                self._awaited = None
            elif self._clock.now > latest:
                raise ScenarioError(mode_has_not_come(MODE_NAMES[mode]))
        while self._due and self._awaited is None:
            try:
                self._act(self._due[0])
            except ChangeUnderWayError:
                return
            self._due.popleft()

    def _take_taps(self, commands: Commands) -> None:
        """Leaves them in their step: each is answered by a message."""

    def _request_mode(self, wanted: int) -> None:
        if self._stick is not None:
            self._tap(self._stick, MODE_NAMES[wanted])
            self._awaited = (wanted, self._clock.now + MODE_WAIT_S)
            return
        self._services.set_mode(wanted, MODE_NAMES[wanted])
