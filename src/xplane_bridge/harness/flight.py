"""One recorded flight: X-Plane's stand-in, a ROS master, the bridge and a bag, from start to orderly end."""

from __future__ import annotations

import threading
import time
import xmlrpc.client
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Callable, Dict, List, Optional

from xplane_bridge.harness.emulator import EmulatorProcess
from xplane_bridge.harness.lockstep_flight import Lockstep, LockstepRun, wait_for_bridge
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ros import RosMaster, roslaunch
from xplane_bridge.harness.running_flight import RunningFlight
from xplane_bridge.topics import NAMESPACE

_READY_TIMEOUT_S = 60.0
_RECORDING = "flight.bag"
_COMMANDS = tuple(f"{NAMESPACE}/control/{kind}" for kind in ("auto", "surfaces"))  #: where a controller commands
_SILENCE_S = 10.0  # without a flight state for this long, a flight has failed
_STANDING_S = 180.0  # likewise without simulator time; longer than tx_node's load_timeout, of 120 s


@dataclass
class FlightPlan:
    """What is to be flown and recorded, and how."""

    output: Path  #: folder of everything that is written
    duration: float  #: [s] of flight to record, of the simulator's time
    aircraft: str = "fixed_wing"
    transport: str = "rref"
    emulator_options: List[str] = field(default_factory=list)
    launch_args: Dict[str, Any] = field(default_factory=dict)
    #: Programs that fly beside the bridge, by name (of their logs): started once states flow, in the given order.
    programs: Dict[str, List[str]] = field(default_factory=dict)
    #: The one of `programs` whose end is the end of the recording, before `duration` at the latest; empty: none.
    player: str = ""
    #: For those of `programs` that the next one has to wait for: what they write when they are ready, as a pattern.
    ready: Dict[str, str] = field(default_factory=dict)
    #: The one of `programs` that commands: unless it says in `ready` when, the next one waits until it is connected.
    controller: str = ""
    #: Silences that belong to the plan, e.g. a restart of the emulator, are not failures.
    silence_allowed: float = _SILENCE_S  #: [s]
    #: In lock-step; the player ends the flight by holding it then.
    lockstep: Optional[Lockstep] = None
    #: How it was asked for, by which it can be flown again: experiment/flight of the passport.
    experiment: Dict[str, Any] = field(default_factory=dict)
    #: What starts the emulator, before its options; empty: xplane_emulator.
    emulator_command: List[str] = field(default_factory=list)

    @property
    def bag(self) -> Path:
        """The recording."""
        return self.output / _RECORDING

    @property
    def truth(self) -> Path:
        """What the emulator really flew, frame by frame."""
        return self.output / "truth.csv"

    @property
    def played(self) -> Path:
        """When what of a scenario happened, as its player writes it."""
        return self.output / "played.json"

    @property
    def scores(self) -> Path:
        """The criteria of a scenario, measured."""
        return self.output / "scores.json"

    @property
    def report(self) -> Path:
        """The page that draws the recording."""
        return self.output / "report.html"

    @property
    def logs(self) -> Path:
        """Folder of the logs of all programs."""
        return self.output / "logs"

    @property
    def draws(self) -> bool:
        """Whether the emulator shows a window."""
        return any(option.partition("=")[0] == "--window" for option in self.emulator_options)

    def make_folders(self) -> None:
        """Makes the folders that are to be written to.

        Raises:
            HarnessError: They cannot be made, or nothing can be written into one that is there.
        """
        folder = self.output
        try:
            self.logs.mkdir(parents=True, exist_ok=True)
            for folder in (self.output, self.logs):
                with TemporaryFile(dir=folder):
                    pass
        except OSError as error:
            raise HarnessError(
                f"{folder} cannot be written to: {error.strerror}; --output takes a folder of yours or a new name"
            ) from None

    def remove_old(self) -> None:
        """Removes all that an earlier flight has left in these folders, but for its logs."""
        unfinished = self.logs.glob(f"ros/{_RECORDING}*")  # of a flight that was broken off
        for old in (self.bag, self.truth, self.played, self.scores, self.report, *unfinished):
            if old.exists():
                old.unlink()


Observer = Callable[[RunningFlight], None]


def _ignore(_: object) -> None:
    """Ignores the text it is given."""


def fly(
    plan: FlightPlan,
    observer: Observer = _ignore,
    say: Callable[[str], None] = _ignore,
    afterwards: Observer = _ignore,
) -> None:
    """Flies `plan`; afterwards its bag and its truth file are complete and nothing that was started still runs.

    Args:
        plan: the flight.
        observer: called about ten times a second while it is recorded; may stop and restart the emulator.
        say: called with a line on what happens.
        afterwards: called when the bridge has ended while the emulator still runs.

    Raises:
        HarnessError: A program failed, or flight states stopped coming, or the simulator's time stood still.
    """
    plan.make_folders()
    plan.remove_old()
    with ExitStack() as stack:
        say("starting the emulator")
        options = ["--aircraft", plan.aircraft, "--truth", str(plan.truth.resolve()), *plan.emulator_options]
        launch_args = dict(plan.launch_args)
        lockstep = None if plan.lockstep is None else plan.lockstep.recorded()
        if lockstep is not None:
            options += lockstep.emulator_options()
            launch_args["common_config"] = stack.enter_context(lockstep.common_config())
            launch_args["lockstep"] = True
        emulator = EmulatorProcess(plan.logs, options, command=plan.emulator_command)
        stack.enter_context(emulator)
        say(f"starting ROS and the bridge (X-Plane's port: {emulator.port})")
        master = RosMaster(plan.logs)
        stack.enter_context(master)
        if lockstep is not None:
            master.set_param("/use_sim_time", True)
        if plan.experiment:
            master.set_param(f"{NAMESPACE}/experiment/flight", plan.experiment)
        bridge = roslaunch(
            master,
            plan.logs,
            "demo.launch",
            name="bridge",
            host="127.0.0.1",
            port=emulator.port,
            transport=plan.transport,
            aircraft=plan.aircraft,
            data_port=free_udp_port(),
            listen_for_beacon=False,
            bag=_RECORDING,  # in ROS_HOME: a path with a space in it cannot be passed through a launch file
            **launch_args,
        )
        stack.enter_context(bridge)
        flight = RunningFlight(emulator, master, bridge)
        stack.enter_context(_StateListener(flight, lockstep is not None))
        if lockstep is None:
            _wait_for_state(flight)
        else:
            wait_for_bridge(flight)
        for name, command in plan.programs.items():
            flight.programs[name] = ManagedProcess(name, command, plan.logs, env=master.env)
            stack.enter_context(flight.programs[name])
            if name in plan.ready:
                flight.programs[name].wait_for_line(plan.ready[name], _READY_TIMEOUT_S)
            elif name == plan.controller and lockstep is None:
                _wait_for_controller(flight, flight.programs[name])
        say(f"flying; to watch, in a second shell: export ROS_MASTER_URI={master.uri}")
        if lockstep is None:
            _record(plan, flight, observer)
        else:
            say(_fly_in_lockstep(plan, lockstep, flight, observer))
        say("ending the recording")
        bridge.stop()  # first: the recording is not to show a stick that has fallen silent
        if bridge.returncode != 0:
            raise HarnessError(bridge.describe(f"ended with status {bridge.returncode}"))
        afterwards(flight)
        for program in reversed(list(flight.programs.values())):
            program.stop()
        recording = master.ros_home / _RECORDING
        if not recording.is_file():
            msg = f"the recorder has not finished {recording}; logs: {plan.logs}"
            raise HarnessError(msg)
        recording.replace(plan.bag)


def _wait_for_state(flight: RunningFlight) -> None:
    def state_or_failure() -> bool:
        flight.emulator.check_running()
        flight.bridge.check_running()
        return flight.states > 0

    try:
        wait_until(state_or_failure, _READY_TIMEOUT_S, f"message on {NAMESPACE}/flight_state")
    except HarnessError as error:
        raise HarnessError(flight.bridge.describe(str(error))) from None


def _wait_for_controller(flight: RunningFlight, controller: ManagedProcess) -> None:
    """Waits until states reach a controller and its commands tx_node: begun sooner, a scenario would be flown late."""

    def connected() -> bool:
        flight.emulator.check_running()
        flight.bridge.check_running()
        controller.check_running()
        with suppress(OSError, xmlrpc.client.Error):
            graph = flight.master.graph(NAMESPACE)
            nodes = set().union(*(graph.publishers.get(topic, set()) for topic in _COMMANDS))
            return bool(nodes) and not any(a in nodes or b in nodes for _, a, b in graph.unconnected())
        return False

    wait_until(connected, _READY_TIMEOUT_S, f"node that commands on {' or '.join(_COMMANDS)}; log: {controller.log}")


def _record(plan: FlightPlan, flight: RunningFlight, observer: Observer) -> None:
    last_new = last_moved = time.monotonic()
    seen, counted = 0, 0.0
    flight.count_time()
    while flight.elapsed < plan.duration:
        flight.bridge.check_running()
        if _is_over(plan, flight):
            return
        now = time.monotonic()
        flight.count_time()
        if flight.states != seen:
            seen, last_new = flight.states, now
        elif now - last_new > plan.silence_allowed:
            raise HarnessError(
                flight.emulator.describe(f"or the bridge is silent: no flight state for {now - last_new:.0f} s")
            )
        if flight.elapsed > counted:
            counted, last_moved = flight.elapsed, now
        elif now - last_moved > _STANDING_S:  # states repeat in a pause
            raise HarnessError(
                f"X-Plane's time has stood still for {now - last_moved:.0f} s, {counted:.1f} s into the flight: it is "
                f"paused, or its sim_speed is 0; expected {_STANDING_S:g} s at most. No event at a later time comes "
                "in a pause: leave out what pauses, or let another program end it"
            )
        observer(flight)
        time.sleep(0.1)


def _fly_in_lockstep(plan: FlightPlan, lockstep: Lockstep, flight: RunningFlight, observer: Observer) -> str:
    """Flies it; gives a line on how fast it was. Silence is tx_node's to judge."""
    run = LockstepRun(flight, lockstep, plan.duration, _RECORDING)
    run.begin()
    while not run.over and not _is_over(plan, flight):
        flight.bridge.check_running()
        flight.count_time()
        observer(flight)
        time.sleep(0.1)
    return run.end(plan.player)


def _is_over(plan: FlightPlan, flight: RunningFlight) -> bool:
    """Whether the player has ended; any other program that has, and a player that failed, is an error."""
    for name, program in flight.programs.items():
        if program.running:
            continue
        if name == plan.player and program.returncode == 0:
            return True
        raise HarnessError(program.describe(f"ended with status {program.returncode}"))
    return False


class _StateListener:
    """Counts flight states. rospy is imported and used only here, in the program's one ROS node.

    In lock-step, where each listener to every frame slows the flight down, the states of mission/sim.
    """

    def __init__(self, flight: RunningFlight, in_lockstep: bool) -> None:
        self._flight = flight
        self._in_lockstep = in_lockstep
        self._subscriber: Any = None

    def __enter__(self) -> _StateListener:
        self._flight.master.use_here()
        import rospy

        from xplane_bridge.msg import FlightState, SimStatus

        if not rospy.core.is_initialized():
            options = {"anonymous": True, "disable_signals": True, "disable_rosout": True}
            rospy.init_node("xplane_bridge_observer", disable_rostime=self._in_lockstep, **options)
        topic, message = ("mission/sim", SimStatus) if self._in_lockstep else ("flight_state", FlightState)
        self._subscriber = rospy.Subscriber(f"{NAMESPACE}/{topic}", message, self._received, tcp_nodelay=True)
        return self

    def _received(self, state: Any) -> None:
        self._flight.last = state
        self._flight.states += 1

    def __exit__(self, *_: object) -> None:
        # Unregistering asks the master, which may be gone by now; that must not hold up the end.
        done = threading.Thread(target=self._subscriber.unregister, daemon=True)
        done.start()
        done.join(2.0)
