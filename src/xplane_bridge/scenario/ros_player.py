"""Plays a scenario from outside, through the bridge.

Stick and handles become commands or a joystick; modes, failures and excitations become requests and service calls.
"""

from __future__ import annotations

import dataclasses
import math
import queue
import threading
import time
from typing import Any, Callable, Dict, List, Optional, Tuple

from xplane_bridge.constants import FlightMode, words
from xplane_bridge.errors import is_number
from xplane_bridge.scenario.command_fields import fill_fields
from xplane_bridge.scenario.late_actions import late_entry, late_text
from xplane_bridge.scenario.player import Action, Commands, FlightSample, Player
from xplane_bridge.scenario.schema import HANDLE_FIELDS, Scenario, ScenarioError
from xplane_bridge.scenario.stall_warnings import RATE, awaits_stall
from xplane_bridge.scenario.taps import Taps
from xplane_bridge.scenario.traffic import ScenarioTraffic
from xplane_bridge.scenario.tx_services import (
    AGAIN_S,
    CHANGE_WAIT_S,
    SERVICE_WAIT_S,
    ChangeUnderWayError,
    Outcomes,
    TxServices,
)
from xplane_bridge.scenario.virtual_stick import VirtualStick

#: Rate of the stick's messages [1/s]; they go on between flight states, as a real stick's do.
STICK_RATE = 50.0
_BLIND_S = 1.0  # without a flight state, after which the stick is let go: tx_node's failsafe knows better
MODE_WAIT_S = 15.0  #: for a mode to be shown
_PAUSE_S = 5.0  # of a pause, of wall time, after which it is worth a warning
MODE_NAMES = words(FlightMode)


def sample_of(state: Any, mode: int, stall_warning: bool) -> FlightSample:
    """The player's view of a FlightState; what is unknown there is NaN here, and no condition on it holds."""
    rates, degrees = state.angular_velocity, math.degrees
    return FlightSample(
        state.roll_deg, state.pitch_deg, state.heading_true_deg, state.altitude_msl, state.altitude_agl,
        state.vertical_speed, state.calibrated_airspeed, state.alpha_deg, state.beta_deg,
        degrees(rates.x), degrees(rates.y), degrees(rates.z), state.load_factor_normal,
        state.on_ground, stall_warning, mode,
    )  # fmt: skip


def command_values(commands: Commands) -> Dict[str, float]:
    """Stick, throttle and handles as fields of ControlCommand; nothing else is commanded."""
    values = dict(commands.stick)
    if commands.throttle is not None:
        values["throttle"] = commands.throttle
    for handle, value in commands.handles.items():
        values.update(dict.fromkeys(HANDLE_FIELDS[handle], value))
    return values


def mode_has_not_come(mode: str) -> str:
    """What is said of a mode that was asked for in vain."""
    return f"mode {mode} was asked for, but control/mode did not show it in {MODE_WAIT_S:g} s"


class ScenarioClock:
    """Scenario time from flight states: simulator time that goes on over epochs and stands in pauses."""

    def __init__(self) -> None:
        self.now = 0.0  #: [s]
        self._last: Optional[Tuple[int, float]] = None

    def update(self, epoch: int, sim_time: float) -> float:
        """Takes a state's `epoch` and `sim_time_unwrapped` [s]; gives the scenario time [s]."""
        if self._last is not None and self._last[0] == epoch:
            self.now += max(0.0, sim_time - self._last[1])
        self._last = (epoch, sim_time)
        return self.now


class RosPlayer:
    """Plays one scenario in the ROS node of this process.

    Args:
        scenario: What to play.
        namespace: Of the bridge, e.g. "/xplane".
        stick: The device to play as, on `joy`; None: commands on `control/manual`.
        say: Called with a line on each event.
    """

    _link_wait_s = 15.0  # for X-Plane's link, where tx_node has none
    _change_wait_s = CHANGE_WAIT_S

    def __init__(
        self,
        scenario: Scenario,
        namespace: str,
        stick: Optional[VirtualStick] = None,
        say: Callable[[str], None] = print,
    ) -> None:
        self._player = Player(scenario)
        self._namespace = namespace.rstrip("/")
        self._stick = stick
        if stick is not None:
            stick.provide_buttons(scenario)
        self._say = say
        self._clock = ScenarioClock()
        self._begin: Optional[Dict[str, float]] = None
        self._labels: Dict[str, float] = {}
        self._lock = threading.Lock()
        self._commands: Optional[Commands] = None
        self._heard = -math.inf  # when the last flight state came
        self._paused: Optional[float] = None  # when the pause that goes on began
        self._said_paused = False
        self._mode: Optional[int] = None
        self._sees_stall = awaits_stall(scenario)
        self._stall = False
        self._traffic = ScenarioTraffic()
        self._sequence = 0
        self._mode_sequence = int(time.time())  # the next run is heard by the tx_node that heard this one
        self._taps = Taps()
        # Modes and excitations keep their order, and do not wait until X-Plane has shown the others.
        self._of_pilot: queue.Queue[Optional[Action]] = queue.Queue()
        self._of_others: queue.Queue[Optional[Action]] = queue.Queue()
        self._served = threading.Lock()  # tx_node serves one call after the other
        self._outcomes = Outcomes(self._fail_at, self._change_wait_s)
        self._services = TxServices(self._namespace, self._link_wait_s, say, self._outcomes)
        self._commanded = threading.Event()
        self._late: List[Dict[str, Any]] = []
        self._finished = threading.Event()
        self._error: Optional[str] = None

    def run(self) -> None:
        """Plays to the end.

        Raises:
            ScenarioError: Something the scenario asked for was refused or did not come about.
        """
        self._play(self._advertise())
        if self._error is not None:
            raise ScenarioError(self._error)
        if not self._has_ended():
            raise ScenarioError(f"{self._player.scenario.name}: ended by ROS after {self._clock.now:.1f} s")

    def _has_ended(self) -> bool:
        """Without an error, and with all changes reported that were asked for."""
        return self._finished.is_set() and not self._outcomes.pending() and self._error is None

    def _advertise(self) -> Any:
        """Gives the publisher of stick or commands."""
        import rospy
        from sensor_msgs.msg import Joy
        from std_msgs.msg import String

        from xplane_bridge.msg import ControlCommand, ModeRequest, TrafficCommand

        topic = self._namespace + "/"
        self._label_publisher = rospy.Publisher(topic + "scenario/label", String, queue_size=10, latch=True)
        self._mode_publisher = rospy.Publisher(topic + "control/mode_request", ModeRequest, queue_size=10)
        if any(kind == "traffic" for event in self._player.scenario.events for kind, _ in event.actions):
            self._traffic_publisher = self._publisher(topic + "traffic/command", TrafficCommand)
        if self._stick is None:
            return self._publisher(topic + "control/manual", ControlCommand)
        return self._publisher(topic + "joy", Joy)

    def _publisher(self, topic: str, message_type: Any) -> Any:
        """A publisher of stick, commands or other aircraft."""
        import rospy

        return rospy.Publisher(topic, message_type, queue_size=1, tcp_nodelay=True)

    def _play(self, publisher: Any) -> None:
        if self._sees_stall and not self._warnings_rate():
            return
        import rospy

        from xplane_bridge.msg import ControlMode, FlightState, WarningState

        self._listen_to_events()
        topic = self._namespace + "/"
        rospy.Subscriber(topic + "control/mode", ControlMode, self._on_mode)
        rospy.Subscriber(topic + "mission/warnings", WarningState, self._on_warnings)
        rospy.Subscriber(topic + "flight_state", FlightState, self._on_state, tcp_nodelay=True)
        queues = (self._of_pilot, self._of_others)
        workers = [threading.Thread(target=self._act_all, args=(actions,), daemon=True) for actions in queues]
        for worker in workers:
            worker.start()
        while not rospy.is_shutdown() and not self._finished.is_set():
            self._publish(publisher)
            self._finished.wait(1.0 / STICK_RATE)
        for actions in queues:
            actions.put(None)

        def acting() -> bool:
            return any(worker.is_alive() for worker in workers) or (self._error is None and self._outcomes.pending())

        # What the last events asked for is still seen through, while the stick is held.
        while not rospy.is_shutdown() and (acting() or (self._taps.pending and self._to_send() is not None)):
            self._publish(publisher)
            time.sleep(1.0 / STICK_RATE)

    def _listen_to_events(self) -> None:
        import rospy

        from xplane_bridge.msg import EventList

        rospy.Subscriber(self._namespace + "/events", EventList, self._outcomes.take)

    def _warnings_rate(self) -> float:
        """At which rx_node asks for warnings [1/s]; fails, and returns 0, where it asks for none."""
        import rospy

        name = self._namespace + "/rx_node/rates/warnings"
        rate = rospy.get_param(name, RATE)
        if is_number(rate) and rate > 0:
            return float(rate)
        self.fail(
            f"{self._player.scenario.name} waits for stall_warning, but {name} is {rate!r}, by which no warnings come; "
            "expected 1 to 1000: set it in rx_node's parameters (rates: warnings)"
        )
        return 0.0

    # --- in -----------------------------------------------------------------------------------------------------------

    def _on_mode(self, message: Any) -> None:
        self._mode = message.mode

    def _on_warnings(self, message: Any) -> None:
        self._stall = message.stall >= 0.5

    def _on_state(self, state: Any) -> None:
        self._heard = time.monotonic()
        if self._finished.is_set():
            return
        self._watch_pause(state)
        try:
            self._play_on(state)
        except Exception as error:  # rospy would log it, and the stick stay where it is
            self._fail_at(self._clock.now, repr(error))
            raise

    def _watch_pause(self, state: Any) -> None:
        """Says once of a pause that lasts, perhaps the scenario's own, that events wait for its end."""
        if not state.paused or self._outcomes.pending():  # reset_flight pauses X-Plane, and lets it go on
            self._paused = None
        elif self._paused is None:
            self._paused = self._heard
        elif self._heard - self._paused > _PAUSE_S and not self._said_paused:
            self._said_paused = True
            self._say(
                f"warning: X-Plane is paused, and scenario time stands at {self._clock.now:.1f} s: let it go on, as "
                f"with rosservice call {self._namespace}/tx_node/pause false"
            )

    def _fail_at(self, at: float, error: str) -> None:
        """Ends it with an error of what happened at this scenario time [s]."""
        self.fail(f"{self._player.scenario.name}, at {at:.1f} s: {error}")

    def fail(self, error: str) -> None:
        """Ends it with an error; the first one counts."""
        self._error = self._error or error
        self._finished.set()

    def _play_on(self, state: Any) -> None:
        now = self._clock.update(state.epoch, state.sim_time_unwrapped)
        if self._begin is None:
            self._begin = {"epoch": int(state.epoch), "sim_time_unwrapped": float(state.sim_time_unwrapped)}
            self._say(f"playing {self._player.scenario.name}")
        with self._lock:
            self._commands = commands = self._player.step(now, sample_of(state, self._mode or 1, self._stall))
            if self._stick is not None:
                self._take_taps(commands)
        for action in commands.actions:
            if action.kind == "traffic":
                self._traffic.begin(action.value, state, now)
            elif action.kind == "label":
                self._show_label(action)
            else:
                self._put(action)
        self._send_traffic(state, now)
        if commands.finished:
            self._finished.set()

    def _show_label(self, action: Action) -> None:
        self._labels.setdefault(action.value, action.time)
        self._label_publisher.publish(str(action.value))
        self._say(f"{action.time:6.1f} s  {action.value}")

    def _put(self, action: Action) -> None:
        (self._of_pilot if action.kind in ("mode", "excitation") else self._of_others).put(action)

    def _take_taps(self, commands: Commands) -> None:
        """Keeps what is tapped in one step only: the stick's messages have another rate than the states."""
        for button in commands.taps:
            self._taps.add(button)
        commands.buttons -= commands.taps

    def _send_traffic(self, state: Any, now: float) -> None:
        if self._traffic.due(now):
            message = self._traffic_publisher.data_class(**self._traffic.command(now))
            message.header.stamp = state.header.stamp
            self._traffic_publisher.publish(message)

    # --- out ----------------------------------------------------------------------------------------------------------

    def _to_send(self) -> Optional[Commands]:
        """What the stick shows now; None when it is not held: nothing is known yet, or not any more."""
        with self._lock:
            return self._commands if time.monotonic() - self._heard < _BLIND_S else None

    def _publish(self, publisher: Any) -> None:
        import rospy

        commands = self._to_send()
        if commands is None:
            return
        message = self._message(publisher, commands, time.monotonic())
        message.header.stamp = rospy.get_rostime()
        heard = publisher.get_num_connections() > 0
        publisher.publish(message)
        if heard:
            self._commanded.set()

    def _message(self, publisher: Any, commands: Commands, now: float) -> Any:
        """Stick or commands; `now` [s] is of the clock by which buttons are tapped."""
        message = publisher.data_class()
        if self._stick is None:
            self._sequence += 1
            message.sequence = self._sequence
            fill_fields(message, command_values(commands))
        else:
            pressed, released = self._taps.look(now)
            shown = dataclasses.replace(commands, buttons=(commands.buttons - released) | pressed)
            message.axes, message.buttons = self._stick.joy(shown)
        return message

    def _act_all(self, actions: queue.Queue[Optional[Action]]) -> None:
        while True:
            action = actions.get()
            if action is None or self._error is not None:
                return
            try:
                if action.kind == "excitation":  # it is added to a command
                    self._commanded.wait(SERVICE_WAIT_S)
                self._act_in_time(action)
            except ScenarioError as error:
                self._fail_at(action.time, str(error))
                return
            except BaseException as error:  # a thread of its own must not die unheard
                self.fail(f"{action.kind}: {error!r}")
                raise

    def _act_in_time(self, action: Action) -> None:
        """Carries it out, once tx_node is not at another change any more."""
        deadline = time.monotonic() + self._change_wait_s
        while True:
            try:
                return self._act(action)
            except ChangeUnderWayError:
                if self._error is not None or time.monotonic() >= deadline:
                    raise
            time.sleep(AGAIN_S)

    def _act(self, action: Action) -> None:
        if action.kind == "mode":
            self._request_mode(action.value)
            self._note_time(action, self._clock.now)
            return
        with self._served:
            begun = self._clock.now
            self._services.carry_out(action)
        self._note_time(action, begun)

    def _note_time(self, action: Action, begun: float) -> None:
        """Keeps that an action, begun at this scenario time [s], comes late, if it does."""
        entry = late_entry(action, begun)
        if entry is not None:
            self._late.append(entry)
            self._say(late_text(entry))

    def _request_mode(self, wanted: int) -> None:
        mode = MODE_NAMES[wanted]
        deadline = time.monotonic() + MODE_WAIT_S

        def wait_for(condition: Callable[[], bool]) -> None:
            while not condition():
                if time.monotonic() > deadline:
                    raise ScenarioError(mode_has_not_come(mode))
                time.sleep(0.01)

        wait_for(lambda: self._mode is not None)
        if self._stick is None:
            import rospy

            from xplane_bridge.msg import ModeRequest

            wait_for(lambda: self._mode_publisher.get_num_connections() > 0)
            self._mode_sequence += 1
            request = ModeRequest(sequence=self._mode_sequence, mode=wanted, requester=rospy.get_name())
            request.header.stamp = rospy.get_rostime()
            self._mode_publisher.publish(request)
        else:
            self._tap(self._stick, mode)
        wait_for(lambda: self._mode == wanted)

    def _tap(self, stick: VirtualStick, mode: str) -> None:
        button = stick.mode_button(mode, MODE_NAMES.get(self._mode or 0, ""))
        if button is not None:
            self._taps.add(button)

    # --- afterwards ---------------------------------------------------------------------------------------------------

    def report(self) -> Dict[str, Any]:
        """When what happened, for a file: of numbers and texts."""
        return {
            "scenario": self._player.scenario.name,
            "begin": self._begin,
            "labels": self._labels,
            "late": self._late,
            "duration": self._clock.now,
            "finished": self._has_ended(),
            "error": self._error,
        }
