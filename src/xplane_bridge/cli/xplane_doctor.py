"""The doctor's command line; docs/setups/doctor.md describes it."""

from __future__ import annotations

import argparse
from typing import List, Optional, Sequence

from xplane_bridge.cli.entry import guarded, udp_port
from xplane_bridge.doctor import report
from xplane_bridge.doctor.conformance import program
from xplane_bridge.doctor.examination import examine, judge
from xplane_bridge.doctor.settings import Settings
from xplane_bridge.topics import NAMESPACE, absolute


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Examines the link to X-Plane and what belongs to it, and says what was found.

    Returns:
        0 where all is well or the card was flown, 1 where there are findings, 2 where it cannot run; argparse ends with
        2 where the arguments are wrong.
    """
    parser = _parser()
    given = parser.parse_args(argv)
    if not given.conformance and (given.only or given.yes):
        parser.error("--only and --yes belong to --conformance")
    settings = Settings(host=given.host, port=given.port, namespace=given.namespace, window_title=given.window_title)
    if given.conformance:
        return program.main(settings, given.only, given.yes)
    findings = judge(examine(settings))
    print(report.as_json(findings) if given.json else report.as_text(findings))
    return report.exit_code(findings)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="xplane_doctor",
        description="Says within 15 s why nothing arrives from X-Plane, or that all is well. Changes nothing, but with "
        "--conformance, which flies a card of two minutes that finds out what only a live X-Plane can settle.",
        epilog="exit code: 0 all is well, 1 findings, 2 cannot run. docs/setups/doctor.md lists all findings.",
    )
    parser.add_argument(
        "--host", default="", help="X-Plane's computer, name or IPv4 address (default: as the nodes find it)"
    )
    parser.add_argument(
        "--port",
        type=udp_port,
        default=0,
        help="UDP port X-Plane listens on (default: the nodes', the beacon's, or 49000)",
    )
    parser.add_argument("--json", action="store_true", help="write the findings as a JSON list")
    parser.add_argument("--namespace", type=absolute, default=NAMESPACE, help="of the nodes (default: %(default)s)")
    parser.add_argument(
        "--window-title",
        default="",
        metavar="TEXT",
        help="part of the title of X-Plane's window (default: X-System or X-Plane, exactly)",
    )
    card = parser.add_argument_group("conformance")
    card.add_argument("--conformance", action="store_true", help="fly the card, after a question")
    card.add_argument(
        "--only", type=_ids, default=[], metavar="ID,...", help="these questions of the card (default: all)"
    )
    card.add_argument("--yes", action="store_true", help="fly without asking")
    return parser


def _ids(text: str) -> List[str]:
    return [each.strip() for each in text.split(",") if each.strip()]
