"""What X-Plane says about itself."""

from __future__ import annotations

from typing import Any, Dict, List

from xplane_bridge.doctor import names
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, warning

_OLDEST = 110000


def version_text(version: int) -> str:
    """As X-Plane writes it: 115501 is 11.55."""
    return f"{version // 10000}.{version // 100 % 100:02d} ({version})"


def version(evidence: Evidence) -> List[Finding]:
    """Whether the bridge serves this version."""
    value = evidence.answers.values.get(names.VERSION)
    if value is None:
        return []
    number = int(value)
    if number == 0:
        text = "X-Plane says version 0: it has not started completely"
        return [note("version", text, "wait until the flight is loaded", version=0)]
    if number < _OLDEST:
        text = f"X-Plane {version_text(number)} is older than 11"
        return [warning("version", text, "the bridge is made for X-Plane 11 and 12", version=number)]
    return [ok("version", f"X-Plane is version {version_text(number)}", version=number)]


def state(evidence: Evidence) -> List[Finding]:
    """Paused, in replay, or standing still."""
    first, values = evidence.answers.first, evidence.answers.values
    if names.RUNNING_TIME not in values:
        return []
    time_s = values[names.RUNNING_TIME]
    facts: Dict[str, Any] = {"sim_time_s": time_s}
    if values.get(names.PAUSED):
        return [note("paused", "X-Plane is paused: values come, but do not change", **facts)]
    if values.get(names.REPLAY):
        return [note("replay", "X-Plane shows a replay: commands have no effect", **facts)]
    if time_s == first[names.RUNNING_TIME]:
        text = f"X-Plane answers, but its time stands at {time_s:g} s: it is loading or in a menu"
        return [note("time-stands", text, "wait, or close the menu", **facts)]
    return []
