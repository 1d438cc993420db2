"""What keeps datagrams from arriving, in words, by operating system."""

from __future__ import annotations

from xplane_bridge.doctor.evidence import Evidence

#: Of X-Plane's computer, whose system is not known from here.
_FAR = (
    "X-Plane 12: switch on Settings > Network > Accept incoming connections; Windows: make its network a private one "
    "and allow X-Plane in private networks in the firewall; macOS: allow X-Plane under Privacy & Security > Local "
    "Network; Linux: allow UDP port {port} in the firewall"
)


#: Why X-Plane on the Windows that this Linux runs in may be silent.
_WSL = "Windows' firewall counts the network of WSL2 as a public one"


def permissions(evidence: Evidence) -> str:
    """What X-Plane's computer and this one may have to permit."""
    target, computer = evidence.target, evidence.computer
    hints = []
    if target.here:
        hints.append("X-Plane 12: Settings > Network > Accept incoming connections")
    else:
        hints.append("on X-Plane's computer: " + _FAR.format(port=target.port))
    if computer.wsl:
        hints.append(f"{_WSL}: allow X-Plane there too")
    elif computer.system == "Darwin":
        hints.append("here: allow the terminal under Privacy & Security > Local Network")
    elif computer.system == "Windows":
        hints.append("here: allow Python in private networks in the firewall")
    if computer.firewall:
        hints.append(f"here: {computer.firewall} is on: sudo ufw allow proto udp from {target.address}")
    return "; ".join(hints)


def multicast(evidence: Evidence) -> str:
    """Why beacons may not get here."""
    computer = evidence.computer
    if computer.wsl:
        return "WSL2 gets no multicast unless mirrored networking is on"
    if computer.firewall:
        port = evidence.settings.beacon_port
        return f"{computer.firewall} is on here and drops multicast: sudo ufw allow proto udp to any port {port}"
    return "multicast does not cross routers, most VPNs, containers without the host's network, and some Wi-Fi"


def elsewhere(evidence: Evidence) -> str:
    """How to reach an X-Plane on another computer whose beacon is not heard."""
    if evidence.computer.wsl:
        windows = evidence.computer.gateway or "the address that ipconfig shows there"
        return f"if it runs on Windows: give host:={windows} to every launch file (try it: --host {windows}). {_WSL}"
    return "if it runs on another computer: give host:=ADDRESS to every launch file (try it: --host ADDRESS)"
