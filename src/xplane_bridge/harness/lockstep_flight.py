"""A flight in lock-step: what is started otherwise, and how it begins and ends."""

from __future__ import annotations

import contextlib
import math
import tempfile
import threading
import time
import xmlrpc.client
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Dict, Iterator, List

import yaml

from xplane_bridge.harness.processes import HarnessError, wait_until
from xplane_bridge.harness.running_flight import RunningFlight
from xplane_bridge.resources import config_file
from xplane_bridge.topics import NAMESPACE

#: Name of the recorder's node, which answers every frame of a recorded flight.
RECORDER = "record"

_CONNECTED_TIMEOUT_S = 60.0
_PLAYER_ENDS_S = 30.0
_RECORDED_S = 60.0
_RECORDED_TOO = ("/tf", "/tf_static")  # outside the namespace
_QUIET_S = 1.0  # without a flight state, while the simulator stands: all that was sent has come


@dataclass
class Lockstep:
    """How to fly in lock-step (docs/experiments/lockstep.md)."""

    participants: List[str] = field(default_factory=list)  #: names of nodes that answer every frame
    stick: str = ""  #: the one of them that publishes joy
    speed: float = 0.0  #: times real time at most; 0: as fast as it goes
    fps: float = 60.0  #: frames per simulated second
    options: Dict[str, Any] = field(default_factory=dict)  #: further ones of the section `lockstep`

    def recorded(self) -> Lockstep:
        """The same with a recorder that the flight waits for (record.launch, `lockstep:=true`)."""
        return replace(self, participants=[*self.participants, RECORDER])

    def emulator_options(self) -> List[str]:
        """Options of xplane_emulator."""
        pace = ["--pace", f"{self.speed:g}"] if self.speed else []
        return ["--stepped", "lockstep", *pace]

    @contextlib.contextmanager
    def common_config(self) -> Iterator[Path]:
        """The shared parameters as a file, for launch files; without a space in its path, which those cannot take."""
        content = yaml.safe_load(config_file("common.yaml").read_text(encoding="utf-8"))
        section = {"enabled": True, "hold": True, "participants": self.participants, "stick": self.stick}
        content["lockstep"].update({**section, **self.options})
        with tempfile.TemporaryDirectory(prefix="xplane_bridge_") as folder:
            file = Path(folder) / "common.yaml"
            file.write_text(yaml.safe_dump(content), encoding="utf-8")
            yield file


def wait_for_bridge(flight: RunningFlight) -> None:
    """Waits until rx_node is there, and with it the parameters.

    Raises:
        HarnessError: It does not come.
    """

    def there() -> bool:
        flight.bridge.check_running()
        with contextlib.suppress(OSError, xmlrpc.client.Error):
            return f"{NAMESPACE}/lockstep/done" in flight.master.graph(NAMESPACE).publishers
        return False

    wait_until(there, _CONNECTED_TIMEOUT_S, f"{NAMESPACE}/lockstep/done of rx_node")


class LockstepRun:
    """Flies a flight whose programs were all started: begins when all programs are connected to each other.

    Args:
        flight: what runs.
        lockstep: how.
        duration: [s] of simulated time after which it is held at the latest.
        recording: name of the recorder's file.
    """

    def __init__(self, flight: RunningFlight, lockstep: Lockstep, duration: float, recording: str) -> None:
        self._flight = flight
        self._lockstep = lockstep
        self._recording = recording
        self._frames = math.ceil(duration * lockstep.fps - 1e-6)
        self._answer: Any = None
        self._error = ""
        self._began = self._took = 0.0
        self._thread = threading.Thread(target=self._step, daemon=True)

    def begin(self) -> None:
        """Waits until no program will miss a message, and lets the flight begin.

        Raises:
            HarnessError: A program does not appear.
        """
        missing = "answer of the nodes"

        def ready() -> bool:
            nonlocal missing
            self._check()
            with contextlib.suppress(OSError, xmlrpc.client.Error):
                missing = self._missing()
            return not missing

        try:
            wait_until(ready, _CONNECTED_TIMEOUT_S, "connections of all nodes")
        except HarnessError as error:
            raise HarnessError(f"{error}; there is still to come: {missing}") from None
        self._began = time.monotonic()
        self._thread.start()

    def _check(self) -> None:
        self._flight.emulator.check_running()
        self._flight.bridge.check_running()
        for program in self._flight.programs.values():
            program.check_running()

    def _missing(self) -> str:
        graph = self._flight.master.graph(NAMESPACE, *_RECORDED_TOO)
        answering = graph.publishers.get(f"{NAMESPACE}/lockstep/done", set())
        nodes = {*self._lockstep.participants, "rx_node"}
        absent = sorted(name for name in nodes if not any(("/" + node).endswith("/" + name) for node in answering))
        listening = graph.subscribers.get(f"{NAMESPACE}/flight_state", set())
        if absent:
            return f"lockstep/done of {', '.join(absent)}"
        writing = self._flight.master.ros_home / f"{self._recording}.active"
        if not (any(node.endswith(f"/{RECORDER}") for node in listening) and writing.is_file()):
            return "the recorder"
        return ", ".join(f"{topic} from {a} to {b}" for topic, a, b in sorted(graph.unconnected()))

    def _step(self) -> None:
        import rospy

        from xplane_bridge.srv import LockstepStep

        try:
            self._answer = rospy.ServiceProxy(f"{NAMESPACE}/lockstep/step", LockstepStep)(frames=self._frames)
        except rospy.ServiceException as error:
            self._error = str(error)
        self._took = time.monotonic() - self._began

    @property
    def over(self) -> bool:
        """Whether the flight is held again."""
        return not self._thread.is_alive()

    def end(self, player: str) -> str:
        """Waits for the player's end, where it is that which has ended the flight, and until all has been recorded.

        Args:
            player: Name of that program; empty: there is none.

        Returns:
            A line on how fast it was.

        Raises:
            HarnessError: It was not flown.
        """
        self._thread.join(_PLAYER_ENDS_S)
        if self._answer is None or not self._answer.success:
            raise HarnessError(self._flight.bridge.describe(f"has ended the flight: {self._error}"))
        if player and self._answer.flown < self._frames:
            program = self._flight.programs[player]
            wait_until(lambda: not program.running, _PLAYER_ENDS_S, f"end of {player}, which holds the flight")
            if program.returncode != 0:
                raise HarnessError(program.describe(f"ended with status {program.returncode}"))
        states = -1
        while states != self._flight.states:
            states = self._flight.states
            time.sleep(_QUIET_S)
        # Before the bridge, which lets the simulator go when it ends.
        self._flight.master.end_node(f"{NAMESPACE}/{RECORDER}")
        recording = self._flight.master.ros_home / self._recording
        wait_until(recording.is_file, _RECORDED_S, f"end of the recording {recording}")
        sim = self._answer.sim_time
        return f"{self._answer.flown} frames, {sim:.1f} s, in {self._took:.1f} s: {sim / self._took:.1f} x real time"
