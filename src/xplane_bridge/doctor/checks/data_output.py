"""Data Output: the ports it needs, and who else uses it."""

from __future__ import annotations

from typing import List, Sequence

from xplane_bridge import protocol
from xplane_bridge.doctor import names
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding, note, warning

_OWN = protocol.DATA_SOURCE_PORT
#: The node that receives rows; as a program it has this name.
_RECEIVER = "rx_node"


def sending_port(evidence: Evidence) -> List[Finding]:
    """Port 49001 is X-Plane's: it sends from it, and must be the only one on its computer to have it."""
    findings = []
    others = [holder for holder in evidence.holders.get(_OWN, ()) if not holder.is_xplane]
    if others:
        text = (
            f"{', '.join(map(str, others))} holds UDP port {_OWN}, from which X-Plane sends Data Output on its computer"
        )
        remedy = (
            f"end it, or let it listen to another port (usual: {protocol.DATA_TARGET_PORT}) and name that in X-Plane"
        )
        findings.append(warning("port-49001-taken", text, remedy, programs=[str(each) for each in others]))
    for (port, address), rows in sorted(evidence.data.rows.items()):
        if port == _OWN:
            text = f"X-Plane at {address} sends Data Output to port {_OWN} here, on which the bridge never listens"
            remedy = f"give X-Plane another port (Settings > Data Output; usual: {protocol.DATA_TARGET_PORT})"
            findings.append(warning("data-to-49001", text, remedy, address=address, rows=rows))
    return findings


def receiving_port(evidence: Evidence) -> List[Finding]:
    """The port on which `transport: data` receives."""
    port = evidence.data_port
    if port == _OWN:
        remedy = f"give another data_port, such as {protocol.DATA_TARGET_PORT}"
        return [warning("data-port", f"data_port is {_OWN}, which is X-Plane's own", remedy, port=port)]
    others = [holder for holder in evidence.holders.get(port, ()) if holder.program != _RECEIVER]
    if not others:
        return []
    text = f"{', '.join(map(str, others))} holds UDP port {port}: transport `data` cannot receive there"
    remedy = "end it, or give the nodes another data_port; transport `rref` does not need it"
    return [warning("data-port-taken", text, remedy, port=port, programs=[str(each) for each in others])]


def rows(evidence: Evidence) -> List[Finding]:
    """Rows that come unasked, or go elsewhere: X-Plane has only one target for them."""
    findings = []
    for (port, address), received in sorted(evidence.data.rows.items()):
        if port != _OWN:
            text = f"Data Output rows {_list(received)} come from {address} to port {port}, unasked by any node here"
            remedy = (
                "a second client or X-Plane's Data Output screen has made this computer the target: switch it off "
                "there; it does not disturb transport `rref`, but transport `data` would take the target over"
            )
            findings.append(warning("unasked-data", text, remedy, port=port, address=address, rows=received))
    selected = [
        index
        for index in range(protocol.ROW_COUNT)
        if evidence.answers.values.get(names.data_row(index)) not in (None, 0)
    ]
    ours = any(entry.purpose == "data_output" for journal in evidence.journals for entry in journal.entries)
    if selected and not findings and not ours:
        rate = evidence.answers.values.get(names.DATA_RATE)
        text = f"X-Plane sends Data Output rows {_list(selected)} to somewhere else"
        if rate:
            text += f", {rate:g} times a second"
        remedy = "leave transport at `rref`: `data` would take the only target from that client"
        findings.append(note("data-elsewhere", text, remedy, rows=selected, rate_hz=rate))
    return findings


def _list(rows_: Sequence[int]) -> str:
    shown = ", ".join(map(str, rows_[:12]))
    return shown + (f" and {len(rows_) - 12} more" if len(rows_) > 12 else "")
