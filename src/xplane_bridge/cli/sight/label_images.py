"""label_images: what lies where in a flight's pictures, as a file beside the bag."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from xplane_bridge.bags import Bags
from xplane_bridge.cli.entry import guarded, number, positive
from xplane_bridge.labels.apt import read_airport
from xplane_bridge.labels.flight import Options, label_flight
from xplane_bridge.labels.heights import read_table
from xplane_bridge.labels.table import LabelError, beside
from xplane_bridge.plotting.page_file import refuse_recordings


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="label_images",
        description=(
            "Labels a flight's pictures with runways, horizon, sun and other aircraft, by the camera's measured pose: "
            "FLIGHT.labels.jsonl beside the bag, which bag_export and flight_report take with --labels."
        ),
        epilog="docs/pictures/labels.md describes what is in the file, and how sure it is.",
    )
    p.add_argument("bags", nargs="+", metavar="BAG", help="the flight's bag, its split bags, or a folder of them")
    p.add_argument(
        "--apt",
        nargs="+",
        required=True,
        metavar="FILE",
        help="X-Plane's apt.dat; several in the order of scenery_packs.ini, the first that has the airport counts",
    )
    p.add_argument("--airport", required=True, metavar="ICAO", help="identifier of the airport")
    p.add_argument("--heights", type=Path, metavar="CSV", help="of runway ends: lines like 15L, 12.3 (metres MSL)")
    p.add_argument(
        "--standing-height",
        type=number("metres from 0 to 30", 0.0, 30.0),
        metavar="M",
        help="of the centre of gravity, parked, for heights measured in flight (default: 1, doubted by 1.5)",
    )
    p.add_argument(
        "--map-sigma",
        type=positive,
        default=Options().map_sigma,
        metavar="M",
        help="how well apt.dat says where runways are drawn (default: %(default)s)",
    )
    p.add_argument(
        "--span",
        type=positive,
        default=Options().span,
        metavar="M",
        help="of other aircraft, whose size X-Plane does not show: how large their boxes are (default: %(default)s)",
    )
    p.add_argument(
        "--flat-world",
        action="store_true",
        help="for the emulator, whose ground is drawn flat around the middle of the first runway",
    )
    p.add_argument(
        "--camera",
        nargs="+",
        default=[],
        metavar="NAME",
        help="label these cameras' pictures, as camera.launch names them; camera is the bridge's own (default: all)",
    )
    p.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: beside the (first) bag")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    args = parser().parse_args(argv)
    airport = read_airport(args.apt, args.airport)
    heights = read_table(args.heights, airport) if args.heights else {}
    with Bags(args.bags) as bags:
        path = args.output or beside(bags.paths[0])
        refuse_recordings(path, bags.paths)
        if path.resolve() in {Path(file).resolve() for file in (*args.apt, args.heights) if file}:
            raise LabelError(f"{path}: a file of --apt or --heights itself is there; expected another file to write to")
        options = Options(args.flat_world, args.map_sigma, args.standing_height, args.span)
        count, flight = label_flight(bags, path, airport, heights, options, args.camera)
    about = flight.about()
    print(f"{path}: {count} pictures labelled; {airport.ident} of {airport.file}")
    if len(about["cameras"]) > 1:
        print("of cameras: " + ", ".join(f"{name} {flight.labelled[name]}" for name in about["cameras"]))
    for line in about["heights"]:
        print(f"height of runway {line}")
    if not about["sun"]:
        print("no sun: record sun_pitch_degrees and sun_heading_degrees (docs/pictures/labels.md says how)")
    if flight.traffic.recorded:
        print(f"other aircraft: known in {count - flight.others_unknown} of {count} pictures")
    else:
        print("no other aircraft: record traffic/state (launch/record.launch does)")
    for reason, pictures in sorted(flight.left_out.items()):
        print(f"left out: {pictures}: {reason}")
    return 0
