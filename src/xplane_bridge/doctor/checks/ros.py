"""ROS: the master, this computer's name in ROS, and the bridge's nodes."""

from __future__ import annotations

from typing import List

from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, ok, problem, warning
from xplane_bridge.doctor.observe.computer import is_loopback, is_own

#: What ROS's own setup.bash sets: says nothing of what the user wants.
_DEFAULTS = ("http://localhost:11311", "http://127.0.0.1:11311")


def master(evidence: Evidence) -> List[Finding]:
    """Whether the ROS master answers."""
    ros = evidence.ros
    facts = {"uri": ros.uri, "address": ros.address}
    if not ros.uri:
        return [note("no-ros", "ROS_MASTER_URI is not set here: ROS was not looked at", "source ROS's setup.bash")]
    if ros.malformed:
        text = f"ROS_MASTER_URI is {ros.uri!r}; expected http://HOST:PORT"
        return [problem("master-uri", text, "export ROS_MASTER_URI=http://HOST:11311", **facts)]
    if ros.answered:
        return [ok("master", f"the ROS master answers at {ros.uri}", **facts)]
    if not ros.address:
        remedy = "use the IPv4 address of the master's computer, or add the name to /etc/hosts"
        return [problem("master-unknown-host", f"no ROS master at {ros.uri}: {ros.error}", remedy, **facts)]
    if ros.here and ros.refused and ros.uri.rstrip("/") in _DEFAULTS:
        text = f"no ROS master runs at {ros.uri} yet"
        return [note("no-master-yet", text, "roslaunch starts one", **facts)]
    remedy = (
        "start roscore (or roslaunch) there, or correct ROS_MASTER_URI"
        if ros.here or ros.refused
        else "check address, cable and firewall of the master's computer (TCP), or correct ROS_MASTER_URI"
    )
    return [problem("no-master", f"no ROS master answers at {ros.uri}: {ros.error}", remedy, **facts)]


def own_name(evidence: Evidence) -> List[Finding]:
    """ROS_HOSTNAME, else ROS_IP, is where other nodes look for the nodes of this computer."""
    ros = evidence.ros
    if not ros.uri:
        return []
    findings = []
    ours = ", ".join(evidence.computer.addresses) or "none but the loopback's"
    if ros.hostname and ros.ip and ros.hostname_address != ros.ip and ros.hostname != ros.ip:
        text = f"ROS_HOSTNAME ({ros.hostname}) and ROS_IP ({ros.ip}) differ; ROS takes ROS_HOSTNAME"
        findings.append(warning("ros-names-differ", text, "unset ROS_HOSTNAME", hostname=ros.hostname, ip=ros.ip))
    name, value = ("ROS_HOSTNAME", ros.hostname) if ros.hostname else ("ROS_IP", ros.ip)
    address = ros.hostname_address if ros.hostname else ros.ip
    facts = {"variable": name, "value": value, "address": address, "own": evidence.computer.addresses}
    far = bool(ros.address) and not ros.here
    if not value:
        return [*findings, *_unnamed(evidence, ours)]
    if not address:
        text = f"ROS_HOSTNAME is {value}, a name that not even this computer knows: topics are listed but never arrive"
        findings.append(problem("ros-name-unknown", text, f"export ROS_IP instead (here: {ours})", **facts))
    elif not _is_ipv4(address) or not is_own(address):
        text = f"{name} is {value}, which is no address of this computer ({ours}): topics are listed but never arrive"
        findings.append(problem("ros-name-not-here", text, f"export {name} as one of: {ours}", **facts))
    elif far and is_loopback(address):
        text = f"{name} is {value}, which other computers take for themselves, but the ROS master is at {ros.host}"
        findings.append(problem("ros-name-loopback", text, f"export {name} as one of: {ours}", **facts))
    return findings


def _unnamed(evidence: Evidence, ours: str) -> List[Finding]:
    """Neither is set: ROS gives the others this computer's name."""
    ros, computer = evidence.ros, evidence.computer
    if not ros.address or ros.here:
        return []
    why = "" if ros.hostname_address else ", which not even this computer knows"
    text = (
        f"the ROS master is on another computer ({ros.host}), and neither ROS_IP nor ROS_HOSTNAME is set: others are "
        f"given the name {computer.name}{why}; where they do not know it, topics are listed but never arrive"
    )
    return [warning("ros-name-unset", text, f"export ROS_IP as one of: {ours}", name=computer.name)]


def nodes(evidence: Evidence) -> List[Finding]:
    """Whether the bridge's nodes run, and can be reached where they say."""
    ros, namespace = evidence.ros, evidence.settings.namespace
    if not ros.answered:
        return []
    if not ros.nodes:
        remedy = "roslaunch xplane_bridge bridge.launch"
        return [note("no-nodes", f"no node of the bridge runs below {namespace}", remedy, namespace=namespace)]
    findings = []
    for node in ros.nodes:
        if node.error:
            text = f"{node.name} says it is at {node.uri}, but cannot be reached there from here: {node.error}"
            remedy = "set ROS_IP on that node's computer and start it anew; if it has crashed: rosnode cleanup"
            findings.append(problem("node-unreachable", text, remedy, node=node.name, uri=node.uri))
    reached = [node.name for node in ros.nodes if not node.error]
    if reached:
        findings.append(ok("nodes", f"nodes that can be reached: {', '.join(reached)}", nodes=reached))
    return findings


def _is_ipv4(text: str) -> bool:
    parts = text.split(".")
    return len(parts) == 4 and all(part.isdigit() and int(part) < 256 for part in parts)
