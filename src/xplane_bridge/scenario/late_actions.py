"""Actions of a scenario that are carried out later than their event, where criteria count from the event's label."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional

from xplane_bridge.scenario.player import Action

_LATE_S = 0.2


def late_entry(action: Action, now: float) -> Optional[Dict[str, Any]]:
    """What `played.json` has of an action that is carried out at scenario time `now` [s]; None in good time."""
    late = now - action.time
    if late <= _LATE_S:
        return None
    return {"action": action.kind, "value": action.value, "time": action.time, "late": late}


def late_text(entry: Mapping[str, Any]) -> str:
    """Such an entry as a warning."""
    return f"warning: {entry['action']} of {entry['time']:.1f} s was carried out {entry['late']:.1f} s late"
