"""A control law as a ROS node: a command for each flight state, while the right aircraft is loaded."""

from __future__ import annotations

import logging
import os
from typing import Any, List, Mapping, Optional, Protocol, Sequence

from xplane_bridge import lockstep
from xplane_bridge.cli.bridge.loaded_aircraft import AircraftError, LoadedAircraft
from xplane_bridge.cli.bridge.waiting import wait_for_service, wait_for_state
from xplane_bridge.constants import FlightMode
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.scenario.command_fields import fill_fields

_LOG = logging.getLogger(__name__)
#: Groups of FlightState that a law may look at.
_NEEDED = ("POSITION", "AGL", "ATTITUDE", "RATES", "VELOCITY", "AIR_VELOCITY", "AIRSPEEDS", "CONTROLS", "CONTACT")
_REMEDY = "fly another controller, or this one all the same with --any-aircraft"


class Law(Protocol):
    """What flies: the same as in campaigns (docs/experiments/campaigns.md)."""

    def fly(self, state: Any) -> Mapping[str, Any]:
        """Fields of ControlCommand for a FlightState; empty: none for now."""


class EngageError(XplaneBridgeError):
    """tx_node refused mode AUTO."""


class LawError(XplaneBridgeError):
    """The law raised an exception, or gave what is no command."""


class FlownLaw:
    """The node's side of a law.

    Args:
        law: What flies; its `restart`, if it has one, is called while another source does.
        program: Name of the node, for messages.
        namespace: Of the bridge, without a slash at its end.
        aircraft: Stems of files in config/aircraft; empty: any.
        remedy: What to do about another aircraft.
        needed: Groups of FlightState without which it does not fly.
    """

    def __init__(
        self,
        law: Law,
        program: str,
        namespace: str,
        aircraft: Sequence[str],
        remedy: str = _REMEDY,
        needed: Sequence[str] = _NEEDED,
    ) -> None:
        self._law, self._program, self._namespace, self._needed = law, program, namespace, needed
        self._refused: List[str] = []
        self._error: Optional[XplaneBridgeError] = None
        self._mode = 0
        self._began = False
        self._topic = f"{namespace}/control/auto"
        self._aircraft = LoadedAircraft(namespace, program, aircraft, remedy, self._refuse)

    def run(self, engage: bool) -> None:
        """Flies until ROS ends, in lock-step as one of its participants; asks for AUTO where `engage` says so.

        Raises:
            AircraftError: Another aircraft is loaded.
            EngageError: AUTO was refused.
            LawError: The law failed.
        """
        import rospy

        if lockstep.is_on(self._namespace):
            self._take_part(engage)
        else:
            self._fly(engage)
        rospy.spin()
        if self._error is not None:
            raise self._error
        if self._refused:
            raise AircraftError(self._refused[0])

    def _take_part(self, engage: bool) -> None:
        """Answers every frame of lock-step from now on."""
        from xplane_bridge.msg import ControlCommand

        modes = lockstep.ModeInStep(self._namespace)
        first = True

        def answer(state: Any) -> Any:
            nonlocal first
            self._mode = modes.at(state)
            if first:
                first = False
                try:
                    self._aircraft.check()
                    if engage:
                        self._engage()
                except XplaneBridgeError as error:
                    self._end_by(error)
            return self.command(state)

        publisher = lockstep.advertise(self._topic, ControlCommand)
        lockstep.Participant(answer, publisher, self._namespace)

    def _fly(self, engage: bool) -> None:
        """Commands from now on, as states come."""
        import rospy

        from xplane_bridge.msg import ControlCommand, ControlMode, FlightState

        self._aircraft.check()
        wait_for_state(self._namespace, self._program)
        topic = f"{self._namespace}/"
        publisher = rospy.Publisher(self._topic, ControlCommand, queue_size=1, tcp_nodelay=True)

        def on_mode(message: Any) -> None:
            self._mode = message.mode

        def on_state(state: Any) -> None:
            command = self.command(state)
            if command is not None:
                publisher.publish(command)

        rospy.Subscriber(topic + "control/mode", ControlMode, on_mode, queue_size=1)
        rospy.Subscriber(topic + "flight_state", FlightState, on_state, queue_size=1, tcp_nodelay=True)
        if engage:
            self._engage()

    def command(self, state: Any) -> Optional[Any]:
        """The ControlCommand for a FlightState; None while the law has nothing to fly by, and once it has failed."""
        try:
            return self._commanded(state)
        except Exception as error:
            # The traceback is for its author, in the file that rospy logs to; the line at the end says where that is.
            _LOG.error("%s: what it flies has failed", self._program, exc_info=True)
            what = f"{type(error).__name__}: {' '.join(str(error).split())}"
            log = os.environ.get("ROS_LOG_FILENAME", "")
            where = f"; the traceback is in {log}" if log else ""
            self._end_by(LawError(f"at {state.sim_time_unwrapped:.2f} s of simulator time: {what}{where}"))
            return None

    def _commanded(self, state: Any) -> Optional[Any]:
        from xplane_bridge.msg import ControlCommand

        needed = sum(getattr(state, f"VALID_{group}") for group in self._needed)
        if state.paused or state.valid & needed != needed or self._refused:
            return None
        restart = getattr(self._law, "restart", None)
        if self._mode != FlightMode.AUTO and restart is not None:
            restart()
        values = self._law.fly(state)
        if not values:
            return None
        command = ControlCommand(sequence=state.frame_count)
        command.header.stamp = state.header.stamp
        fill_fields(command, values)
        if not self._began:
            self._began = True
            print(f"commanding on {self._topic}", flush=True)
        return command

    def _end_by(self, error: XplaneBridgeError) -> None:
        self._error = error
        self._refuse(str(error))

    def _refuse(self, text: str) -> None:
        import rospy

        self._refused.append(text)
        rospy.signal_shutdown(text)

    def _engage(self) -> None:
        import rospy

        from xplane_bridge.srv import SetMode

        service = f"{self._namespace}/tx_node/set_mode"
        wait_for_service(service, self._program)
        answer = rospy.ServiceProxy(service, SetMode)(mode=FlightMode.AUTO)
        if not answer.success:
            raise EngageError(f"mode AUTO was refused: {answer.result.message}")
