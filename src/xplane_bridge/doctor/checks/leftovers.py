"""What a bridge, or another program, has left switched over in X-Plane."""

from __future__ import annotations

from typing import List, Sequence

from xplane_bridge.doctor import names
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, problem, warning
from xplane_bridge.doctor.observe.computer import is_same_computer
from xplane_bridge.doctor.observe.journals import Entry, Journal, Owner

_RELEASE = "scripts/release_overrides"


def journals(evidence: Evidence) -> List[Finding]:
    """Changes in X-Plane that the bridge has noted and not undone."""
    findings = []
    for journal in evidence.journals:
        if journal.error:
            text = f"the journal {journal.file} cannot be understood: {journal.error}"
            remedy = f"run {_RELEASE} --all --host {journal.host} --port {journal.port}, then delete it"
            findings.append(warning("journal-damaged", text, remedy, file=str(journal.file)))
        for owner in Owner:
            entries = [entry for entry in journal.entries if entry.owner is owner]
            if entries:
                findings.append(_left(evidence, journal, owner, entries))
    return findings


def _left(evidence: Evidence, journal: Journal, owner: Owner, entries: List[Entry]) -> Finding:
    """The finding about one journal's entries of owners that are all alike."""
    who = ", ".join(dict.fromkeys(f"{entry.node} (process {entry.pid})" for entry in entries))
    what = ", ".join(_short(entry.id) for entry in entries)
    where = f"X-Plane at {journal.host}:{journal.port}"
    facts = {"file": str(journal.file), "host": journal.host, "port": journal.port, "entries": [e.id for e in entries]}
    if owner is Owner.RUNS:
        return ok("journal", f"{who} runs and has changed in {where}: {what}", **facts)
    if owner is Owner.ELSEWHERE:
        computers = ", ".join(dict.fromkeys(entry.computer for entry in entries))
        text = f"{who} on {computers} has changed in {where}: {what}; from here it is not seen whether it runs"
        return note("journal-elsewhere", text, f"if it does not: {_RELEASE} there", **facts)
    if owner is Owner.STOPPED:
        text = f"{who} is stopped (a signal or a debugger), but holds in {where}: {what}"
        pids = " ".join(dict.fromkeys(str(entry.pid) for entry in entries))
        return problem("owner-stopped", text, f"kill -CONT {pids}, or kill -9 {pids} and {_RELEASE}", **facts)
    on = [path for path in _overrides_on(evidence) if _is_examined(evidence, journal) and _has(entries, path)]
    shown = f"; X-Plane still shows {', '.join(map(_short, on))}" if on else ""
    text = f"{who} has ended without undoing in {where}: {what}{shown}"
    remedy = f"run {_RELEASE}, or start that node again: it undoes this first"
    return problem("leftovers", text, remedy, still_on=on, **facts)


def overrides(evidence: Evidence) -> List[Finding]:
    """Overrides that are on in X-Plane though no journal here has them."""
    known = [j for j in evidence.journals if _is_examined(evidence, j)]
    on = [path for path in _overrides_on(evidence) if not any(_has(j.entries, path) for j in known)]
    findings = []
    of_bridge = [path for path in on if path in names.BRIDGE_OVERRIDES]
    if of_bridge:
        text = f"X-Plane shows {', '.join(map(_short, of_bridge))}, in no journal here: its pilot has no control there"
        remedy = (
            "another program, the aircraft's plugin, or a bridge on another computer has set it; if none has: "
            f"{_RELEASE} --all --host {evidence.target.address} --port {evidence.target.port}"
        )
        findings.append(warning("overrides-on", text, remedy, overrides=of_bridge))
    if names.PATH_OVERRIDE in on:
        text = (
            "X-Plane's flight model is switched off for the user's aircraft (override_planepath): commands move nothing"
        )
        remedy = "end the program that moves the aircraft, or load the aircraft anew"
        findings.append(warning("flight-model-off", text, remedy))
    rest = [path for path in on if path in names.OTHER_OVERRIDES]
    if rest:
        text = f"X-Plane shows {', '.join(map(_short, rest))}: an aircraft's plugin or another program has set it"
        findings.append(note("other-overrides", text, overrides=rest))
    return findings


def _overrides_on(evidence: Evidence) -> List[str]:
    return [path for path in names.OVERRIDES if evidence.answers.values.get(path)]


def _is_examined(evidence: Evidence, journal: Journal) -> bool:
    """Whether a journal is about the X-Plane that was asked."""
    if journal.port != evidence.target.port or not evidence.target.address:
        return False
    # One computer's X-Plane is reached by its own addresses and by the loopback's, whichever the node was given.
    return is_same_computer(journal.host, evidence.target.address)


def _has(entries: Sequence[Entry], path: str) -> bool:
    return any(entry.id.endswith(path) for entry in entries)


def _short(name: str) -> str:
    """`override_joystick` of `override:sim/operation/override/override_joystick`, `subscriptions` of a node's."""
    if name.startswith("subscriptions:"):
        return "subscriptions"
    return name.rpartition("/")[2]
