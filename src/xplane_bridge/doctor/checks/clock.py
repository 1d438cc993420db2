"""The system's clock, by which ROS stamps."""

from __future__ import annotations

from typing import List

from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, warning

#: [s] What synchronisation does gently stays far below this between two looks.
_STEP_S = 0.01


def clock(evidence: Evidence) -> List[Finding]:
    """Steps of the clock during the examination, and whether something keeps it right."""
    watch = evidence.clock
    facts = {"step_s": watch.step_s, "watched_s": watch.watched_s, "synchronised": watch.synchronised}
    if abs(watch.step_s) > _STEP_S:
        text = (
            f"the system's clock stepped by {watch.step_s:+.3f} s within {watch.watched_s:.0f} s: stamps jump with it"
        )
        remedy = (
            "let one program set it, gently (chrony without makestep; in virtual machines the host's or the guest's)"
        )
        return [warning("clock-step", text, remedy, **facts)]
    if watch.synchronised is False:
        text = "nothing synchronises this computer's clock; it matters where stamps of two computers are compared"
        return [note("clock-free", text, "sudo apt-get install chrony on both", **facts)]
    return [ok("clock", f"the system's clock did not step within {watch.watched_s:.0f} s", **facts)]
