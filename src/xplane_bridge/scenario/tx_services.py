"""The services of tx_node that a scenario calls, and what becomes of what they accept."""

from __future__ import annotations

import math
import threading
import time
from typing import Any, Callable, Dict, Tuple

from xplane_bridge.constants import ResultCode
from xplane_bridge.scenario.player import Action
from xplane_bridge.scenario.resets import reset_request
from xplane_bridge.scenario.schema import ScenarioError
from xplane_bridge.scenario.world import disturbance_request, time_request, weather_request, wind_request

SERVICE_WAIT_S = 15.0  #: for a service to be there
AGAIN_S = 0.1  #: after a refusal for want of a link, or while a change is under way
#: For tx_node's report of a change, counted from the one before it; more than its own `load_timeout`.
CHANGE_WAIT_S = 150.0
_NOT_BROKEN = "is not broken"  # in the answer of clear_failures
_UNDER_WAY = "is under way: wait for its event"  # in that of disturb
_CHANGES = ("reset", "wind", "weather", "time")  # accepted, with the outcome on `events`


class ChangeUnderWayError(ScenarioError):
    """The call is to be made again: tx_node has not ended a change that was asked for before."""


class Outcomes:
    """Waits for the events that report what has become of accepted changes. Thread-safe.

    Args:
        failed: Called with the time of the action [s] and a text for each change that has not come about, before it
            ceases to be pending.
        wait_s: For the next report; infinite: tx_node's own time-outs are enough.
    """

    def __init__(self, failed: Callable[[float, str], None], wait_s: float) -> None:
        self._failed = failed
        self._wait_s = wait_s
        self._lock = threading.Lock()
        self._awaited: Dict[int, Tuple[float, str]] = {}  # by number: time of the action [s], what it is
        self._reported: Dict[int, Any] = {}  # the last events by number: one may come before the call returns
        self._deadline = math.inf

    def expect(self, number: int, action_time: float, what: str) -> None:
        """Waits for the event of this number."""
        with self._lock:
            self._awaited[number] = (action_time, what)
            self._deadline = time.monotonic() + self._wait_s
            self._compare()

    def take(self, message: Any) -> None:
        """Takes an EventList."""
        reported = {event.number: event for event in message.events}
        with self._lock:
            begun_anew = max(reported, default=0) < max(self._reported, default=0)
            self._reported = reported
            if begun_anew:
                self._give_up("tx_node was started anew, and does not report event {}")
            self._compare()

    def pending(self) -> bool:
        """Whether a report is still to come; after the deadline, those that have not come have failed."""
        with self._lock:
            if time.monotonic() > self._deadline:
                self._give_up(
                    f"tx_node has not reported event {{}} within {self._wait_s:g} s: see whether it still runs"
                )
            return bool(self._awaited)

    def _give_up(self, why: str) -> None:
        """With the lock held; the number is put into the text."""
        for number, (action_time, what) in self._awaited.items():
            self._failed(action_time, f"{what}: {why.format(number)}")
        self._awaited.clear()

    def _compare(self) -> None:
        """With the lock held."""
        for number in sorted(self._awaited.keys() & self._reported.keys()):
            action_time, what = self._awaited.pop(number)
            self._deadline = time.monotonic() + self._wait_s
            event = self._reported[number]
            if not event.success:
                self._failed(action_time, f"{what}: {event.text}")


class TxServices:
    """What a scenario's actions ask of tx_node.

    Args:
        namespace: Of the bridge, without a slash at its end.
        link_wait_s: For X-Plane's link, where tx_node has none.
        say: Called with a line on what is done otherwise than asked for.
        outcomes: Wait for what is accepted.
    """

    def __init__(self, namespace: str, link_wait_s: float, say: Callable[[str], None], outcomes: Outcomes) -> None:
        self._namespace = namespace
        self._link_wait_s = link_wait_s
        self._say = say
        self._outcomes = outcomes

    def carry_out(self, action: Action) -> None:
        """Calls the service of an action.

        Raises:
            ChangeUnderWayError: It is to be called again.
            ScenarioError: It was refused, or cannot be called.
        """
        calls: Dict[str, Callable[[Any], Any]] = {
            "failure": self._failure,
            "clear_failures": self._clear_failures,
            "excitation": self._excitation,
            "reset": self._reset,
            "wind": self._wind,
            "disturb": self._disturb,
            "weather": self._weather,
            "time": self._time,
            "dataref": self._datarefs,
            "command": self._command,
        }
        response = calls[action.kind](action.value)
        if action.kind in _CHANGES:
            self._outcomes.expect(response.event_number, action.time, action.kind)

    def set_mode(self, mode: int, name: str) -> None:
        """Asks for a mode by the service, in the frame of the call.

        Raises:
            ScenarioError: It was refused, or cannot be called.
        """
        from xplane_bridge.srv import SetMode

        self._call("set_mode", SetMode, f"mode {name}", mode=mode)

    def _call(self, service: str, service_type: Any, what: str, **fields: Any) -> Any:
        """Gives the response. Where tx_node has no link, as when a frame is late, it does nothing: then again."""
        import rospy

        name = f"{self._namespace}/tx_node/{service}"
        deadline = time.monotonic() + self._link_wait_s
        said = False
        while True:
            try:
                rospy.wait_for_service(name, SERVICE_WAIT_S)
                response = rospy.ServiceProxy(name, service_type)(**fields)
            except (rospy.ROSException, rospy.ServiceException) as error:
                raise ScenarioError(f"{what}: {name} cannot be called: {error}") from None
            if response.success:
                return response
            if _UNDER_WAY in response.result.message:
                raise ChangeUnderWayError(f"{what}: {response.result.message}")
            unlinked = response.result.code == ResultCode.NO_LINK
            # What is not broken needs no repair, and without a link it is repaired as soon as that is back.
            done = service == "clear_failures" and (unlinked or _NOT_BROKEN in response.result.message)
            if (unlinked or done) and not said:
                said = True
                self._say(f"{what}: {response.result.message}")
            if done:
                return response
            if not unlinked or time.monotonic() >= deadline:
                raise ScenarioError(f"{what}: {response.result.message}")
            time.sleep(AGAIN_S)

    def _failure(self, value: Dict[str, Any]) -> None:
        from xplane_bridge.srv import ClearFailures, SetFailure

        name = value["name"]
        if value["clear"]:
            self._call("clear_failures", ClearFailures, f"repairing {name}", names=[name])
            return
        number = value["value"]
        self._call(
            "set_failure",
            SetFailure,
            f"failure of {name}",
            name=name,
            kind=value["kind"],
            has_value=number is not None,
            value=0.0 if number is None else number,
        )

    def _clear_failures(self, _: Any) -> None:
        from xplane_bridge.srv import ClearFailures

        self._call("clear_failures", ClearFailures, "repairing everything", names=[], include_simulator=False)

    def _excitation(self, value: Dict[str, Any]) -> None:
        from xplane_bridge.srv import InjectExcitation

        self._call(
            "inject_excitation",
            InjectExcitation,
            f"excitation of {value['target']}",
            kind=value["kind"],
            target=value["target"],
            amplitude=value["amplitude"],
            duration=value["duration"],
            frequency_min=value["frequency"],
            frequency_max=value["frequency_end"],
            seed=value["seed"],
        )

    def _reset(self, value: Dict[str, Any]) -> Any:
        from xplane_bridge.srv import ResetFlight

        return self._call("reset_flight", ResetFlight, "reset", **reset_request(value))

    def _wind(self, value: Dict[str, float]) -> Any:
        from xplane_bridge.srv import SetWind

        return self._call("set_wind", SetWind, "wind", **wind_request(value))

    def _disturb(self, value: Dict[str, Any]) -> None:
        from xplane_bridge.srv import SetDisturbance

        self._call("disturb", SetDisturbance, f"disturbance {value['kind']}", **disturbance_request(value))

    def _weather(self, value: Dict[str, Any]) -> Any:
        from xplane_bridge.srv import SetWeather, SetWeatherRequest

        return self._call("set_weather", SetWeather, "weather", **weather_request(value, SetWeatherRequest))

    def _time(self, value: Dict[str, float]) -> Any:
        from xplane_bridge.srv import SetTime, SetTimeRequest

        return self._call("set_time", SetTime, "time", **time_request(value, SetTimeRequest))

    def _datarefs(self, values: Dict[str, float]) -> None:
        from xplane_bridge.srv import SetDataref

        for path, number in values.items():
            self._call("set_dataref", SetDataref, f"dataref {path}", name=path, values=[number])

    def _command(self, name: str) -> None:
        from xplane_bridge.srv import RunCommand

        self._call("run_command", RunCommand, f"command {name}", name=name)
