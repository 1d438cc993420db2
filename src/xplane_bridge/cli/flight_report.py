"""flight_report: one HTML page about a recorded flight."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Sequence, Union

from xplane_bridge.bags import Bags
from xplane_bridge.cli.entry import guarded
from xplane_bridge.errors import XplaneBridgeError

if TYPE_CHECKING:
    from xplane_bridge.plotting.spec import PathFigure, TimeFigure


class ReportError(XplaneBridgeError):
    """The report cannot be written."""


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(prog="flight_report", description="Makes one self-contained HTML page about a flight.")
    p.add_argument("bags", nargs="+", metavar="BAG", help="the flight's bag, its split bags, or a folder of them")
    p.add_argument("-o", "--output", default="report.html", metavar="FILE", help="default: %(default)s")
    p.add_argument(
        "--labels", type=Path, metavar="FILE", help="draw these labels into ten images (label_images makes them)"
    )
    p.add_argument("--png", metavar="DIR", help="also write each figure as a PNG there")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    args = parser().parse_args(argv)
    path = write_report(args.bags, Path(args.output), Path(args.png) if args.png else None, args.labels)
    print(path)
    return 0


def write_report(
    bag_paths: Sequence[str | Path], output: Path, png: Optional[Path] = None, labels: Optional[Path] = None
) -> Path:
    """Write the report of one flight; the function behind the program, for other programs.

    Args:
        bag_paths: The flight's bag or split bags.
        output: The HTML file.
        png: Folder for the figures as PNG; none when omitted.
        labels: File of labels to draw into images.

    Returns:
        The file written.

    Raises:
        BagError: The bags cannot be read.
        LabelError: The labels cannot be read, or are of another recording.
        PageError: `output` is a recording.
        ReportError: The file cannot be written; or it is, and shows no flight, because no flight state was recorded.
    """
    from xplane_bridge.bags.columns import ColumnFile
    from xplane_bridge.bags.flight import read_flight
    from xplane_bridge.labels.recording import labels_of
    from xplane_bridge.plotting import report, static
    from xplane_bridge.plotting.page_file import refuse_recordings, write_page

    def save(figure: Union[TimeFigure, PathFigure]) -> None:
        if png is not None:
            static.save(figure, flight.start, png / f"{figure.key}.png")

    with Bags(list(bag_paths)) as bags:
        refuse_recordings(output, bags.paths)
        known = labels_of(bags, labels) if labels else None
        try:
            for folder in (output.parent, png):
                if folder is not None:
                    folder.mkdir(parents=True, exist_ok=True)
            flight = read_flight(bags, ColumnFile(output.parent))
            write_page(output, report.build(bags, flight, known, save))
        except OSError as error:
            msg = f"{error.filename or output}: {error.strerror}"
            raise ReportError(msg) from None
    if "state" not in flight.tables:
        names = ", ".join(str(path) for path in bag_paths)
        msg = (
            f"{names}: no flight state in it, so {output} shows no flight; "
            "record flight_state (launch/record.launch does) while link_state says connected"
        )
        raise ReportError(msg)
    return output
