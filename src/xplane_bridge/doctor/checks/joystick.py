"""Joysticks."""

from __future__ import annotations

from typing import List

from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, warning


def joystick(evidence: Evidence) -> List[Finding]:
    """Which joysticks are there, and whether they may be read."""
    if not evidence.joysticks.supported:
        return []
    if not evidence.joysticks.found:
        text = f"no joystick is plugged in ({evidence.settings.devices}/js*)"
        return [note("no-joystick", text)]
    findings = []
    for each in evidence.joysticks.found:
        text = f"joystick {each.device}" + (f": {each.name}" if each.name else "")
        facts = {"device": each.device, "name": each.name, "event": each.event}
        remedy = "sudo usermod -aG input $USER, then log in anew"
        if not each.readable:
            findings.append(warning("joystick-denied", f"{text} may not be read by this user", remedy, **facts))
        elif not each.event_readable:
            text += f" serves driver:=joy only: driver:=sdl reads {each.event}, which this user may not read"
            remedy += "; in a container: start it with --device /dev/input"
            findings.append(warning("joystick-event-denied", text, remedy, **facts))
        else:
            findings.append(ok("joystick", text, **facts))
    return findings
