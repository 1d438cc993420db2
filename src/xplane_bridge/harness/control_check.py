"""Judges who flew in a recorded flight: stick and controller, the changes between them, and a stuck surface."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import numpy as np

from xplane_bridge.analysis.commands import of_controls
from xplane_bridge.bags import Bags, Table
from xplane_bridge.constants import CommandSource, FlightMode
from xplane_bridge.harness.flight_check import CheckError, Verdict
from xplane_bridge.topics import NAMESPACE

#: Who commands, in AppliedCommand.
_SOURCE_OF = {FlightMode.MANUAL: CommandSource.MANUAL, FlightMode.AUTO: CommandSource.AUTO}
#: Sources change within so long of a change of mode [s].
_SETTLED_S = 0.3
#: A controller that flies for less has not flown [s].
_SHORTEST_AUTO_S = 1.0
_SOURCE_SHARE = 0.95
#: Of two commands within one frame X-Plane shows the later one.
_READ_BACK_SHARE = 0.5
#: What a stuck surface may be off [deg], and how much its counterpart must move to show that the rest flies on [deg].
_STUCK_TOLERANCE_DEG = 0.1
_MOVES_DEG = 2.0


class Spell(NamedTuple):
    """A time in one mode."""

    mode: int
    start: float  #: [s]
    end: float  #: [s]
    asked_by: str
    reason: str


def spells(modes: Table, end: float) -> List[Spell]:
    """The times in each mode, from the messages of control/mode (which repeat) up to `end` [s]."""
    changes: List[Tuple[float, int, str, str]] = []
    for time, mode, who, why in zip(modes.time / 1e9, modes["mode"], modes["requested_by"], modes["reason"]):
        if not changes or changes[-1][1] != int(mode):
            changes.append((float(time), int(mode), str(who), str(why)))
    ends = [change[0] for change in changes[1:]] + [end]
    return [Spell(mode, time, until, who, why) for (time, mode, who, why), until in zip(changes, ends)]


def check_stick(joy: Table, manual: Table, applied: Table, states: Table) -> Verdict:
    """The stick's messages became commands, and X-Plane showed those that were sent, as far as it had frames for them.

    Args:
        joy: joy.
        manual: control/manual.
        applied: control/applied.
        states: flight_state, one for each frame.
    """
    if not len(joy) or not len(manual) or not len(applied):
        text = f"{len(joy)} messages of the joystick, {len(manual)} commands from it, {len(applied)} sent"
        return Verdict("stick", False, text)
    sent = applied["source"] == CommandSource.MANUAL
    sequences = np.unique(applied["sequence"][sent])
    shown = np.unique(applied["sequence"][sent & applied["read_back"].astype(bool)])
    # Frames while the stick flew: those to which the newest command sent was the stick's.
    newest = np.searchsorted(applied.time, states.time, side="right") - 1
    frames = int(np.count_nonzero(sent[newest[newest >= 0]]))
    wanted = int(_READ_BACK_SHARE * min(len(sequences), frames))
    text = f"{len(joy)} messages of the joystick, {len(sequences)} commands of it sent, {len(shown)} seen in X-Plane "
    text += f"within {frames} frames (wanted {wanted})"
    return Verdict("stick", 0 < len(shown) >= wanted, text)


def check_modes(modes: Table, applied: Table, joystick: str) -> Verdict:
    """A controller flew, engaged by the joystick's button, and the stick got the aircraft back; the commands agree.

    Args:
        modes: control/mode.
        applied: control/applied.
        joystick: name of the mapper's node.
    """
    end = float(applied.time[-1]) / 1e9
    flown = spells(modes, end)
    long = [spell.end - spell.start > _SHORTEST_AUTO_S for spell in flown]
    automatic = [k for k, spell in enumerate(flown) if spell.mode == FlightMode.AUTO and long[k]]
    automatic = [k for k in automatic if flown[k].asked_by == joystick]
    if not automatic:
        return Verdict("modes", False, f"no automatic flight of {_SHORTEST_AUTO_S:g} s that {joystick} asked for")
    back = [flown[k + 1] for k in automatic if k + 1 < len(flown)]
    if not back:
        return Verdict("modes", False, "the automatic flight was never ended by the stick")
    time = applied.time / 1e9
    right = total = 0
    for spell in flown:
        within = (time > spell.start + _SETTLED_S) & (time < spell.end) & of_controls(applied.columns)
        if spell is flown[-1]:
            within &= applied["source"] != CommandSource.FAILSAFE  # the end: the stick falls silent
        right += int(np.count_nonzero(applied["source"][within] == _SOURCE_OF[FlightMode(spell.mode)]))
        total += int(np.count_nonzero(within))
    share = right / max(total, 1)
    auto_s = sum(flown[k].end - flown[k].start for k in automatic)
    text = f"{auto_s:.1f} s automatic, engaged by the joystick; back by {', '.join(sorted({how(s) for s in back}))}; "
    text += f"{share:.1%} of the commands from whose turn it was (wanted {_SOURCE_SHARE:.0%})"
    return Verdict("modes", share >= _SOURCE_SHARE, text)


def how(spell: Spell) -> str:
    """What ended the mode before, in a word or two."""
    return "moving the stick" if "take-over" in spell.reason else "its button"


def check_stuck(failures: Table, surfaces: Table, element: Tuple[str, int, int], name: str, value: float) -> Verdict:
    """A surface stands where it is stuck while its counterpart moves, and is repaired at the end.

    Args:
        failures: failures/state.
        surfaces: mission/surfaces.
        element: column, index of the stuck surface in it, and of its counterpart.
        name: of the failure.
        value: [deg] at which it is stuck.
    """
    stuck = np.array([
        any(n == name and confirmed for n, confirmed in zip(names, confirmations))
        for names, confirmations in zip(failures["names"], failures["confirmed"])
    ])  # fmt: skip
    if not stuck.any():
        return Verdict("failure", False, f"{name} was never confirmed as broken")
    if len(failures["names"][-1]):
        return Verdict("failure", False, f"still broken at the end: {', '.join(failures['names'][-1])}")
    first, last = failures.time[np.flatnonzero(stuck)[[0, -1]]]
    within = (surfaces.time >= first) & (surfaces.time <= last)
    column, own, other = element
    off = np.abs(surfaces[column][within, own] - value)
    moved = float(np.ptp(surfaces[column][within, other])) if within.any() else 0.0
    worst = float(off.max()) if within.any() else float("nan")
    text = f"{name} {worst:.2f} deg off {value:g} deg at most, for {(last - first) / 1e9:.1f} s (wanted "
    text += f"{_STUCK_TOLERANCE_DEG:g} deg), its counterpart moved by {moved:.1f} deg; repaired"
    return Verdict("failure", worst <= _STUCK_TOLERANCE_DEG and moved >= _MOVES_DEG, text)


def played_labels(bags: Bags) -> Dict[str, float]:
    """What the scenario has said it does, and when first [s]."""
    topic = f"{NAMESPACE}/scenario/label"
    if topic not in bags.topics or not bags.topics[topic].count:
        return {}
    table = bags.read(topic)
    labels: Dict[str, float] = {}
    for time, label in zip(table.time / 1e9, table["data"]):
        labels.setdefault(str(label), float(time))
    return labels


def judge_control(bag: Path, back_by: str, stuck: str, repaired: str) -> List[Verdict]:
    """All checks of a flight by joystick and controller. What the flight was too short for is said.

    Args:
        bag: the recording.
        back_by: label of the scenario at which the stick has got the aircraft back from the controller.
        stuck: label at which the left aileron is stuck at 5 deg.
        repaired: label at which it has been repaired.

    Raises:
        BagError: The bag cannot be read.
        CheckError: Nothing was commanded in it.
    """
    with Bags(bag) as bags:
        missing = [
            t for t in ("flight_state", "joy", "control/manual", "control/applied", "control/mode") if not _has(bags, t)
        ]
        if missing:
            raise CheckError(f"{bag}: nothing on {', '.join(missing)}")
        labels = played_labels(bags)
        applied = bags.read(f"{NAMESPACE}/control/applied")
        joy, manual = bags.read(f"{NAMESPACE}/joy"), bags.read(f"{NAMESPACE}/control/manual")
        verdicts = [check_stick(joy, manual, applied, bags.read(f"{NAMESPACE}/flight_state", ["sim_time"]))]
        if back_by in labels:
            modes = bags.read(f"{NAMESPACE}/control/mode")
            verdicts.append(check_modes(modes, applied, f"{NAMESPACE}/joystick_mapper_node"))
        else:
            verdicts.append(Verdict("modes", True, "the flight ended before automatic flight was over", judged=False))
        if repaired in labels:
            failures = bags.read(f"{NAMESPACE}/failures/state")
            surfaces = bags.read(f"{NAMESPACE}/mission/surfaces")
            verdicts.append(check_stuck(failures, surfaces, ("aileron1", 2, 3), "aileron1_wing2_left", 5.0))
        else:
            began = "ended with it broken" if stuck in labels else "was too short for it (the mixing is learnt first)"
            verdicts.append(Verdict("failure", True, f"stuck left aileron: the flight {began}", judged=False))
    return verdicts


def _has(bags: Bags, topic: str) -> bool:
    name = f"{NAMESPACE}/{topic}"
    return name in bags.topics and bool(bags.topics[name].count)
