"""Words what was found: lines for people, JSON for programs."""

from __future__ import annotations

import json
from typing import List, Sequence

from xplane_bridge.doctor.finding import Finding


def as_text(findings: Sequence[Finding]) -> str:
    """A line for each finding, with its remedy, and a last one with the verdict."""
    lines = [_line(finding) for finding in findings]
    count = sum(finding.severity.counts for finding in findings)
    verdict = "all is well" if count == 0 else "1 finding" if count == 1 else f"{count} findings"
    return "\n".join([*lines, verdict])


def as_json(findings: Sequence[Finding]) -> str:
    """A JSON list of the findings."""
    fields: List[object] = [
        {
            "id": finding.id,
            "severity": finding.severity.value,
            "text": finding.text,
            "remedy": finding.remedy,
            "facts": finding.facts,
        }
        for finding in findings
    ]
    return json.dumps(fields, indent=2)


def exit_code(findings: Sequence[Finding]) -> int:
    """0 where all is well, 1 where there is something to do."""
    return int(any(finding.severity.counts for finding in findings))


def _line(finding: Finding) -> str:
    # One line a finding, whatever titles, names and system messages are in it.
    text = f"{finding.text} -> {finding.remedy}" if finding.remedy else finding.text
    return f"{finding.severity.value + ':':<9}{' '.join(text.split())}"
