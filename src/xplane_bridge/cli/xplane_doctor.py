"""The doctor's command line; docs/doctor.md describes it."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from xplane_bridge.cli.entry import guarded
from xplane_bridge.doctor import report
from xplane_bridge.doctor.examination import examine, judge
from xplane_bridge.doctor.settings import Settings


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Examines the link to X-Plane and what belongs to it, and says what was found.

    Returns:
        0 where all is well, 1 where there are findings; argparse ends with 2 where the arguments are wrong.
    """
    given = _parser().parse_args(argv)
    settings = Settings(host=given.host, port=given.port, namespace=given.namespace, window_title=given.window_title)
    findings = judge(examine(settings))
    print(report.as_json(findings) if given.json else report.as_text(findings))
    return report.exit_code(findings)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="xplane_doctor",
        description="Says within 15 s why nothing arrives from X-Plane, or that all is well. Changes nothing.",
        epilog="exit code: 0 all is well, 1 findings, 2 cannot run. docs/doctor.md lists all findings.",
    )
    parser.add_argument(
        "--host", default="", help="X-Plane's computer, name or IPv4 address (default: as the nodes find it)"
    )
    parser.add_argument(
        "--port", type=_port, default=0, help="UDP port X-Plane listens on (default: the beacon's, else 49000)"
    )
    parser.add_argument("--json", action="store_true", help="write the findings as a JSON list")
    parser.add_argument("--namespace", default="/xplane", help="of the bridge's nodes (default: %(default)s)")
    parser.add_argument(
        "--window-title",
        default="",
        metavar="TEXT",
        help="part of the title of X-Plane's window (default: X-System or X-Plane, exactly)",
    )
    return parser


def _port(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) < 65536:
        msg = f"{text!r} is no UDP port; expected 1..65535"
        raise argparse.ArgumentTypeError(msg)
    return int(text)
