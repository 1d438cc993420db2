"""Is X-Plane there, and do its answers get here."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence

from xplane_bridge.doctor.checks import hints
from xplane_bridge.doctor.checks.simulator import version_text
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, problem, warning
from xplane_bridge.doctor.observe.beacons import Sighting
from xplane_bridge.doctor.observe.computer import is_same_computer
from xplane_bridge.doctor.observe.target import Chosen, distinct


def beacons(evidence: Evidence) -> List[Finding]:
    """Who announces itself, and whether that could be heard at all."""
    watch = evidence.beacons
    group = f"{evidence.settings.beacon_group}:{evidence.settings.beacon_port}"
    if watch.error:
        who = ", ".join(map(str, evidence.holders.get(evidence.settings.beacon_port, ())))
        text = f"X-Plane's beacon cannot be heard: {group} cannot be listened to: {watch.error}"
        remedy = f"end {who}, which holds the port and does not share it" if who else "check the network"
        return [warning("beacon-not-heard", text, remedy + "; or give host:= to every launch file", error=watch.error)]
    findings = []
    for seen, addresses in distinct(watch.sightings):
        text = f"X-Plane {version_text(seen.version)} announces itself: {_name(seen)}, port {seen.port}"
        if len(addresses) > 1:
            text += f", heard under {len(addresses)} addresses: {', '.join(addresses)}"
        findings.append(
            ok("beacon", text, addresses=addresses, port=seen.port, version=seen.version, name=seen.computer)
        )
    for seen in watch.sightings:
        if not seen.flies:
            text = f"{_name(seen)}, port {seen.port}, announces itself, but shows views or plans only"
            findings.append(note("beacon-of-a-display", text, address=seen.address, port=seen.port))
    if watch.odd:
        text = f"{watch.odd} datagrams on {group} are no beacons of X-Plane"
        findings.append(note("odd-beacon", text, count=watch.odd))
    if not distinct(watch.sightings):
        findings.append(_no_beacon(evidence, group))
    return findings


def _no_beacon(evidence: Evidence, group: str) -> Finding:
    text = f"no X-Plane announces itself on {group} (listened on {', '.join(evidence.beacons.interfaces)})"
    facts: Dict[str, Any] = {"interfaces": evidence.beacons.interfaces}
    if evidence.answers.any and evidence.target.chosen is Chosen.ASSUMED:
        remedy = f"give host:={evidence.target.host} to every launch file: without a beacon nothing is found"
        return warning("no-beacon", f"{text}, though {evidence.target} answers", remedy, **facts)
    if evidence.answers.any:
        return note("no-beacon", f"{text}; it is not needed, as the host is given", **facts)
    return note("no-beacon", text, hints.multicast(evidence), **facts)


def several(evidence: Evidence) -> List[Finding]:
    """More than one X-Plane, and neither option nor parameter names one."""
    found = distinct(evidence.beacons.sightings)
    if len(found) < 2:
        return []
    text = those_of([seen for seen, _ in found])
    facts: Dict[str, Any] = {
        "simulators": [{"address": seen.address, "port": seen.port, "name": seen.computer} for seen, _ in found]
    }
    if evidence.target.chosen in (Chosen.OPTION, Chosen.PARAMETER):
        return [note("several-simulators", f"{text}; {evidence.target} is examined", **facts)]
    remedy = (
        "the nodes wait until one is named: give host:= and port:= to every launch file; to this program, --host and "
        f"--port (examined here: {evidence.target})"
    )
    return [problem("several-simulators", text, remedy, **facts)]


def those_of(found: Sequence[Sighting]) -> str:
    """That several X-Planes announce themselves, and which."""
    those = ", ".join(f"{_name(seen)} port {seen.port} (version {version_text(seen.version)})" for seen in found)
    return f"{len(found)} X-Planes announce themselves: {those}"


def answer(evidence: Evidence) -> List[Finding]:
    """Whether X-Plane answers, and the likeliest reason why not."""
    target, answers = evidence.target, evidence.answers
    facts = {"host": target.host, "address": target.address, "port": target.port, "chosen_by": target.chosen.value}
    if not target.address:
        remedy = "correct the name, give the IPv4 address, or add the name to /etc/hosts"
        return [problem("unknown-host", f"the name {target.host} has no address: {target.error}", remedy, **facts)]
    if answers.any:
        return [ok("answer", f"X-Plane answers on {target}", **facts)]
    nothing = f"nothing answers on {target}"
    other = [holder for holder in evidence.holders.get(target.port, ()) if not holder.is_xplane] if target.here else []
    if other:
        remedy = "end that program, or let X-Plane listen elsewhere (Settings > Network) and give port:="
        text = f"{nothing}: {', '.join(map(str, other))} holds the port on this computer, not X-Plane"
        return [problem("port-taken", text, remedy, programs=[str(each) for each in other], **facts)]
    announced = _announced_elsewhere(evidence)
    if announced is not None:
        return [announced]
    if target.chosen is Chosen.ASSUMED:
        text = f"no X-Plane announces itself on the network, and {nothing}"
        return [problem("no-simulator", text, f"start X-Plane; {hints.elsewhere(evidence)}", **facts)]
    if answers.refused:
        text = f"{nothing}: the computer is there, but nothing listens on the port (or its firewall rejects it)"
        remedy = "start X-Plane there, or give the port that Settings > Network shows (port:=, --port)"
        return [problem("nothing-listens", text, remedy, **facts)]
    if answers.unreachable:
        text = f"{nothing}: there is no way to that computer ({answers.unreachable})"
        return [problem("no-route", text, "check address, cable, Wi-Fi and VPN", **facts)]
    if _announced(evidence, target.port) is not None:
        text = f"{nothing}, though X-Plane announces itself there: a firewall or X-Plane itself drops what it is asked"
        return [problem("dropped", text, hints.permissions(evidence), **facts)]
    remedy = f"start X-Plane on {target.host}, check the address; {hints.permissions(evidence)}"
    return [problem("no-answer", f"{nothing}, and no beacon comes from there", remedy, **facts)]


def answering_address(evidence: Evidence) -> List[Finding]:
    """Answers that come from another address or port than was asked."""
    target = evidence.target
    findings = []
    for address, port in sorted(evidence.answers.sources):
        facts: Dict[str, Any] = {"asked": target.address, "asked_port": target.port, "from": address, "from_port": port}
        if address != target.address and not (target.here and is_same_computer(address, target.address)):
            text = f"answers come from {address}, but {target.address} is configured: X-Plane's computer has both"
            remedy = f"give host:={address} to every launch file"
            findings.append(warning("other-address", text, remedy, **facts))
        elif port != target.port:
            text = f"answers come from port {port}, but port {target.port} was asked: a proxy or NAT is between"
            findings.append(note("other-port", text, **facts))
    return findings


def _announced_elsewhere(evidence: Evidence) -> Optional[Finding]:
    """The finding that the beacon says another port, or comes from another computer, than what is asked."""
    target = evidence.target
    facts = {"address": target.address, "port": target.port}
    if _announced(evidence, target.port) is not None:
        return None
    here = _announced(evidence)
    if here is not None:
        text = f"nothing answers on {target}: X-Plane at {here.address} listens on port {here.port}"
        remedy = f"give port:={here.port} to every launch file, or leave host and port to the beacon"
        return problem("wrong-port", text, remedy, announced_port=here.port, **facts)
    found = distinct(evidence.beacons.sightings)
    if not found:
        return None
    places = ", ".join(f"{seen.address}:{seen.port}" for seen, _ in found)
    text = f"nothing answers on {target}, but X-Plane announces itself at {places}"
    remedy = (
        f"give host:={found[0][0].address} port:={found[0][0].port} to every launch file, or leave both to the beacon"
    )
    return problem("wrong-host", text, remedy, announced=[f"{s.address}:{s.port}" for s, _ in found], **facts)


def _announced(evidence: Evidence, port: int = 0) -> Optional[Sighting]:
    """The X-Plane that announces itself on the examined computer, on a certain port if one is given."""
    for seen, addresses in distinct(evidence.beacons.sightings):
        on_it = any(is_same_computer(address, evidence.target.address) for address in addresses)
        if on_it and port in (0, seen.port):
            return seen
    return None


def _name(seen: Sighting) -> str:
    return f"{seen.computer} ({seen.address})" if seen.computer else seen.address
