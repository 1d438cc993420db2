"""The bridge in lock-step with a simulator of this process, and a node of this process that answers every frame."""

from __future__ import annotations

import os
import queue
import shutil
import tempfile
from itertools import count
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any, Mapping, Optional

import yaml

from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ros import MasterInUse, RosMaster, roslaunch
from xplane_bridge.lockstep import Participant, advertise
from xplane_bridge.resources import config_file
from xplane_bridge.scenario.command_fields import fill_fields

_START_S, _ANSWER_S = 60.0, 60.0
_LOOK_S = 0.25  # between two looks at whether the nodes still run
#: A caller may think about its answer for as long as it likes.
_WATCHDOG_S = 86400.0
_numbers = count(1)


class LockstepBridge:
    """`bridge.launch` with its shipped configuration, in mode AUTO, one start after the other.

    The ROS master is the one that this process uses; where it is no node yet, it becomes one under a master of its own,
    which lives as long as the process.
    """

    _master: Optional[RosMaster] = None  # of the process, started by the first of these
    _bridge: ManagedProcess
    _participant: Participant
    _publisher: Any
    name: str  #: namespace of the newest start

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="xplane_bridge_")
        self._runs = False
        self._states: queue.Queue[Any] = queue.Queue()
        self._answers: queue.Queue[Any] = queue.Queue()

    def begin(self, port: int, aircraft: str) -> Any:
        """Starts the nodes; gives the first FlightState, of frame 1, before any command.

        Args:
            port: UDP port of a simulator on this machine that waits.
            aircraft: Stem of a file in config/aircraft.

        Raises:
            HarnessError: They do not come up.
        """
        self.end()
        self._join_ros()
        import rospy
        from std_srvs.srv import Trigger

        from xplane_bridge.msg import ControlCommand
        from xplane_bridge.srv import SetMode

        self.name = name = f"lockstep_{os.getpid()}_{next(_numbers)}"
        self._states, self._answers = queue.Queue(), queue.Queue()
        states, answers = self._states, self._answers

        def answer(state: Any) -> Any:
            states.put(state)
            return answers.get()

        topic = f"/{name}/control/auto"
        publisher = advertise(topic, ControlCommand)
        self._participant = Participant(answer, publisher, f"/{name}")
        self._publisher = publisher
        self._bridge = roslaunch(
            MasterInUse(),
            Path(self._folder.name),
            "bridge.launch",
            name=name,
            ns=name,
            common_config=self._configuration(name, rospy.get_name()),
            host="127.0.0.1",
            port=port,
            aircraft=aircraft,
            capture=False,
        )
        self._bridge.start()
        self._runs = True
        wait_until(self._ready, _START_S, f"the nodes of {name}")
        try:
            rospy.wait_for_service(f"/{name}/lockstep/run", _START_S)
            rospy.ServiceProxy(f"/{name}/lockstep/run", Trigger)()
            first = self._next()
            mode = rospy.ServiceProxy(f"/{name}/tx_node/set_mode", SetMode)(mode=SetMode._request_class.AUTO)
        except rospy.ROSException as error:
            raise HarnessError(self._bridge.describe(str(error))) from None
        if not mode.success:
            raise HarnessError(self._bridge.describe(f"set_mode: {mode.result.message}"))
        return first

    def answer(self, command: Mapping[str, Any]) -> Any:
        """Answers the newest state with fields of ControlCommand; gives the next state.

        Raises:
            HarnessError: The nodes have ended, or no state comes.
        """
        from xplane_bridge.msg import ControlCommand

        message = ControlCommand()
        fill_fields(message, command)
        self._answers.put(message)
        return self._next()

    def end(self) -> None:
        """Ends the nodes; may be called again."""
        if not self._runs:
            return
        self._runs = False
        self._bridge.stop()
        self._participant.close()
        self._answers.put(None)  # the callback that still waits for an answer
        self._publisher.unregister()

    def close(self) -> None:
        """Ends the nodes and removes their logs."""
        self.end()
        self._folder.cleanup()

    def _join_ros(self) -> None:
        if LockstepBridge._master is None and not _is_node():
            folder = tempfile.mkdtemp(prefix="xplane_bridge_master_")
            LockstepBridge._master = master = RosMaster(Path(folder))
            # Unlike atexit also at the end of a process that multiprocessing has started; higher priorities first.
            Finalize(None, master.stop, exitpriority=1)
            Finalize(None, shutil.rmtree, args=(folder,), exitpriority=0)
            master.start()
            master.use_here()
            import rospy

            rospy.init_node("answerer", anonymous=True, disable_signals=True)

    def _configuration(self, name: str, participant: str) -> Path:
        common = yaml.safe_load(config_file("common.yaml").read_text(encoding="utf-8"))
        lockstep = {"enabled": True, "participants": [participant], "hold": True, "watchdog": _WATCHDOG_S}
        common.update(listen_for_beacon=False, lockstep={**common["lockstep"], **lockstep})
        path = Path(self._folder.name) / f"{name}.yaml"
        path.write_text(yaml.safe_dump(common), encoding="utf-8")
        return path

    def _ready(self) -> bool:
        self._bridge.check_running()
        return self._participant.connected and self._publisher.get_num_connections() > 0

    def _next(self) -> Any:
        waited = 0.0
        while waited < _ANSWER_S:
            try:
                return self._states.get(timeout=_LOOK_S)
            except queue.Empty:
                waited += _LOOK_S
                self._bridge.check_running()
        raise HarnessError(self._bridge.describe(f"no flight state within {_ANSWER_S:g} s"))


def _is_node() -> bool:
    try:
        import rospy
    except ImportError:  # ROS comes with the master's environment
        return False
    return bool(rospy.core.is_initialized())
