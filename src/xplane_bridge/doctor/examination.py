"""Makes all observations, as many as possible at once, and runs all checks on them."""

from __future__ import annotations

import os
import threading
import time
from typing import Any, Callable, Dict, List, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor.checks import CHECKS
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, problem
from xplane_bridge.doctor.observe import (
    beacons,
    computer,
    data_output,
    journals,
    joysticks,
    ports,
    ros,
    simulator,
    target,
    windows,
)
from xplane_bridge.doctor.observe.clock import ClockWatcher
from xplane_bridge.doctor.settings import Settings

#: Each of the two rounds of observations gets so long [s]; the second needs to know where X-Plane is.
_ROUND_S = 6.0
#: An observation that is to end takes less than this [s]: it ends its subscriptions in batches.
_END_S = 1.0
#: Observations whose names say too little to users.
_SAID = {
    "answers": "X-Plane",
    "data": "Data Output",
    "display": "the X display",
    "holders": "which programs hold ports",
    "ros": "the ROS master",
    "target": "the address of X-Plane's computer",
}


def examine(settings: Settings) -> Evidence:
    """Looks at everything; takes a few seconds, at most 15.

    Args:
        settings: What to examine.
    """
    unfinished: Dict[str, str] = {}
    with ClockWatcher() as clock:
        first = _Round(
            {
                "computer": (computer.observe, settings.proc, settings.etc),
                "beacons": (beacons.listen, settings.beacon_group, settings.beacon_port, settings.listen_s),
                "ros": (ros.observe, settings.environment, settings.namespace),
                "journals": (journals.read, settings.journal_folder, settings.proc),
                "display": (windows.observe, settings.environment.get("DISPLAY", ""), settings.is_wanted_title),
                "joysticks": (joysticks.observe, settings.devices, settings.proc),
            }
        )
        seen = first.results(unfinished)
        parameters = seen["ros"].parameters if "ros" in seen else {}
        heard = seen.get("beacons", beacons.BeaconWatch())
        where = _Round({"target": (target.choose, settings, parameters, heard)}, limit_s=1.5).results(unfinished)
        chosen = where.get("target", target.Target(settings.host, "", settings.port))
        ending = threading.Event()
        second = _Round(_second_round(settings, chosen, _data_port(parameters), ending.is_set))
        try:
            seen.update(second.results(unfinished))
        finally:  # by Ctrl-C as well: X-Plane would go on sending to a port that no program has
            ending.set()
            second.join("answers", _END_S)
    return Evidence(
        settings=settings,
        target=chosen,
        data_port=_data_port(parameters),
        clock=clock.result,
        unfinished=unfinished,
        **seen,
    )


def judge(evidence: Evidence) -> List[Finding]:
    """What all checks say to what was observed, in the order of the report."""
    findings = [
        finding
        for check, needed in CHECKS
        if not evidence.unfinished.keys() & needed  # what was not seen is not judged
        for finding in check(evidence)
    ]
    for what, why in evidence.unfinished.items():
        text = f"{_SAID.get(what, what)} could not be looked at: {why}"
        remedy = "try again; a name server that does not answer may be the reason"
        findings.append(problem("unfinished", text, remedy, what=what, why=why))
    return findings


def _data_port(parameters: Dict[str, Any]) -> int:
    """Where the nodes receive Data Output rows: as configured, else config/common.yaml's default."""
    port = parameters.get("data_port")
    return port if isinstance(port, int) and 0 < port < 65536 else protocol.DATA_TARGET_PORT


def _second_round(
    settings: Settings, chosen: target.Target, data_port: int, ends: Callable[[], bool]
) -> Dict[str, Tuple[Any, ...]]:
    looked_at = {protocol.DATA_SOURCE_PORT, data_port, settings.beacon_port}
    listened_to = [data_port]
    if chosen.here:
        looked_at.add(chosen.port)
    elif chosen.address:
        # Where X-Plane runs, this port is its own, and must stay free for it.
        listened_to.append(protocol.DATA_SOURCE_PORT)
    jobs: Dict[str, Tuple[Any, ...]] = {
        "holders": (_holders_but_us, looked_at, settings),
        "data": (data_output.watch, listened_to, settings.answer_s),
    }
    if chosen.address:
        jobs["answers"] = (simulator.ask, chosen.address, chosen.port, settings.answer_s, ends)
    return jobs


def _holders_but_us(looked_at: Any, settings: Settings) -> Dict[int, List[ports.Holder]]:
    found = ports.holders(looked_at, settings.proc)
    return {port: [each for each in group if each.pid != os.getpid()] for port, group in found.items()}


class _Round:
    """Observations that run at the same time, each in a thread, as most of them wait.

    Args:
        jobs: Function and arguments of each, by name.
        limit_s: When it is not waited for any longer [s].
    """

    def __init__(self, jobs: Dict[str, Tuple[Any, ...]], limit_s: float = _ROUND_S) -> None:
        self._end = time.monotonic() + limit_s
        self._results: Dict[str, Any] = {}
        self._errors: Dict[str, str] = {}
        self._threads = {
            name: threading.Thread(target=self._run, args=(name, *job), daemon=True) for name, job in jobs.items()
        }
        for thread in self._threads.values():
            thread.start()

    def results(self, unfinished: Dict[str, str]) -> Dict[str, Any]:
        """Waits for them; names in `unfinished` those without a result, and why."""
        for name, thread in self._threads.items():
            thread.join(max(0.0, self._end - time.monotonic()))
            if name not in self._results:
                unfinished[name] = self._errors.get(name, "it took too long")
        return {name: self._results[name] for name in self._threads if name not in unfinished}

    def join(self, name: str, limit_s: float) -> None:
        """Waits for the end of one of them, where there is such a one, for some time [s] at most."""
        if name in self._threads:
            self._threads[name].join(limit_s)

    def _run(self, name: str, function: Callable[..., Any], *arguments: Any) -> None:
        try:
            self._results[name] = function(*arguments)
        except Exception as error:  # one observation that fails must not take the others with it
            self._errors[name] = f"{type(error).__name__}: {error}"
