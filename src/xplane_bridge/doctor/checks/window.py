"""X-Plane's window, from which capture_node takes its pictures."""

from __future__ import annotations

from typing import List

from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, warning
from xplane_bridge.doctor.observe.windows import Window

#: [s] Longer than a frame of the default image rate (30 /s): pictures would be lost.
_SLOW_GRAB_S = 1 / 30
_MOST_TITLES = 12


def window(evidence: Evidence) -> List[Finding]:
    """Whether X-Plane's window is on this display, or which windows are."""
    display = evidence.display
    if evidence.target.address and not evidence.target.here:
        text = "X-Plane runs on another computer: its window is there, and so must capture_node be"
        return [note("window-elsewhere", text, "docs/setups/two_machines.md")]
    if not display.name:
        return [note("no-display", "DISPLAY is not set: windows were not looked at", "export DISPLAY=:0")]
    if display.error:
        text = f"the X display {display.name} cannot be looked at: {display.error}"
        return [warning("display", text, "correct DISPLAY (xdpyinfo tries it)", display=display.name)]
    found = [each for each in display.windows if evidence.settings.is_wanted_title(each.title)]
    if found:
        return _found(display.name, found)
    titles = list(dict.fromkeys(each.title for each in display.windows))
    shown = ", ".join(f'"{title}"' for title in titles[:_MOST_TITLES]) or "none"
    more = f" and {len(titles) - _MOST_TITLES} more" if len(titles) > _MOST_TITLES else ""
    wanted = " or ".join(f'"{title}"' for title in evidence.settings.window_titles)
    text = f"no window titled {wanted} on {display.name}; the titles there are: {shown}{more}"
    facts = {"display": display.name, "titles": titles, "wanted": list(evidence.settings.window_titles)}
    if not evidence.answers.any:
        return [note("no-window", text, "start X-Plane", **facts)]
    remedy = "give capture_node window/title, or DISPLAY the display that X-Plane is on"
    return [warning("no-window", text, remedy, **facts)]


def _found(display: str, found: List[Window]) -> List[Finding]:
    # X-Plane's own window where it says whose it is, else the largest: as capture_node takes it.
    best = max(found, key=lambda each: (each.program.startswith("X-Plane"), each.shown, each.width * each.height))
    owner = f" of {best.program}" if best.program else ""
    text = f'window "{best.title}"{owner} on {display}, {best.width}x{best.height}'
    facts = {"title": best.title, "program": best.program, "width": best.width, "height": best.height}
    if not best.shown:
        return [warning("window-hidden", f"{text}, is minimised: its picture stands still", "show it", **facts)]
    if best.grab_s is None:
        return [ok("window", text, **facts)]
    took = f"{text}, read in {best.grab_s * 1e3:.1f} ms through the display's socket"
    facts["grab_s"] = best.grab_s
    if best.grab_s > _SLOW_GRAB_S:
        remedy = "make the window smaller, or lower max_rate; capture_node's shared memory saves a part of it"
        return [warning("slow-grab", f"{took}: longer than a frame at 30 /s", remedy, **facts)]
    return [ok("window", took, **facts)]
