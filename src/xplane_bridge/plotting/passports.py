"""How flights were made, as tables of a page: of one flight, and what differs between several."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Optional, Sequence

from xplane_bridge.bags.passport import LONGEST, shortened
from xplane_bridge.plotting.page import missing, rows_table

if TYPE_CHECKING:
    from xplane_bridge.bags.passport import Passport

_NONE = "the recording has no topic experiment: it was made before version 0.2.0, or without it"


def passport_section(passports: Sequence[Passport]) -> str:
    """Show how a flight was made; where that has changed in flight, as of its end, and what has changed."""
    if not passports:
        return missing(_NONE)
    last = passports[-1]
    rows = [(html.escape(name), _cell(value)) for name, value in last.lines().items() if value]
    short = [row for row in rows if row[0] in last.others]
    settings = [row for row in rows if row[0] in last.settings]
    parameters = [row for row in rows if row not in short and row not in settings]
    text = rows_table(("", ""), short)
    text += "<h3>Set in X-Plane</h3>" + rows_table(("dataref", "value"), settings)
    text += (
        f"<details><summary>{len(parameters)} parameters</summary>"
        + rows_table(("parameter", "value"), parameters)
        + "</details>"
    )
    if len(passports) > 1:
        names = ["at the start", *[f"then ({k})" for k in range(1, len(passports))]]
        text += "<h3>Changed in flight</h3>" + differences_table(names, passports)
    return text


def differences_table(names: Sequence[str], passports: Sequence[Optional[Passport]]) -> str:
    """Show the lines in which passports differ, one column per flight; None: that flight has none."""
    if all(passport is None for passport in passports):
        return missing(_NONE)
    lines = [{} if passport is None else passport.lines() for passport in passports]
    keys = list(dict.fromkeys(key for each in lines for key in each))
    rows = []
    for key in keys:
        values = [each.get(key) for each in lines]
        if len(set(values)) > 1:
            cells = [
                '<span class="missing">none</span>' if text is None else html.escape(text) for text in shortened(values)
            ]
            rows.append((html.escape(key), *cells))
    if not rows:
        return '<p class="good">Nothing: all were made alike.</p>'
    return rows_table(("what", *names), rows)


def _cell(text: str) -> str:
    shown = text if len(text) <= LONGEST else text[:LONGEST] + " \u2026"
    return html.escape(shown).replace("\n", "<br>")
