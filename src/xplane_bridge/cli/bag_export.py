"""bag_export: flights from bags to tables, arrays, trajectories and image data sets."""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from typing import Mapping, Optional, Sequence

from tqdm import tqdm

from xplane_bridge.cli.entry import guarded, number, positive
from xplane_bridge.export import campaign, made
from xplane_bridge.export.flight import ExportError
from xplane_bridge.export.formats import ALIASES, FORMATS, Job
from xplane_bridge.export.pictures import Options
from xplane_bridge.labels import table

#: What of a format (`Format.options`) an option is for.
_NEEDED = {
    "rate": "rate",
    "topics": "topics",
    "labels": "labels",
    "split_by": "dataset",
    "train_share": "dataset",
    "seed": "dataset",
    "camera": "dataset",
    "keep_bad_frames": "dataset",
}


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="bag_export",
        description="Exports flights. Every BAG is a flight; a folder of split bags is one flight too.",
        epilog="An export that was cut off goes on where it stopped when the same command is given again.",
    )
    p.add_argument("bags", nargs="*", metavar="BAG", help=".bag files, or folders of split bags")
    p.add_argument("-o", "--output", default="export", metavar="DIR", help="where to write (default: %(default)s)")
    names = ", ".join(f"{alias} is {name}" for alias, name in ALIASES.items())
    p.add_argument("--format", choices=(*FORMATS, *ALIASES), default="csv", help=f"default: %(default)s; {names}")
    p.add_argument("--verify", action="store_true", help="compare DIR with its manifest instead of exporting")
    table = p.add_argument_group("tables, arrays and trajectories")
    table.add_argument(
        "--rate", type=positive, metavar="HZ", help="one uniform time base; default: samples as recorded"
    )
    table.add_argument(
        "--topics",
        nargs="+",
        metavar="TOPIC",
        help="csv, parquet: further topics, newest value in each row; npz, mat, mcap, ros2: these topics only, not all",
    )
    data = p.add_argument_group("image data sets")
    # These defaults are not argparse's: what was given is refused where a format has no use of it.
    usual = Options()
    data.add_argument("--split-by", choices=("time", "flight"), help=f"default: {usual.split_by}")
    data.add_argument(
        "--train-share",
        type=number("a share from 0 to 1", 0.0, 1.0),
        metavar="0..1",
        help=f"default: {usual.train_share}",
    )
    data.add_argument("--seed", type=int, help=f"of the draw of --split-by flight (default: {usual.seed})")
    data.add_argument(
        "--labels",
        type=Path,
        metavar="FILE",
        help="labels of the pictures, made by label_images; for several flights the folder with their "
        "NAME.labels.jsonl, NAME as in DIR (default: none are exported)",
    )
    data.add_argument(
        "--camera",
        nargs="+",
        metavar="NAME",
        help="export these cameras' pictures, as camera.launch names them; camera is the bridge's own (default: all)",
    )
    data.add_argument(
        "--keep-bad-frames",
        action="store_true",
        default=None,
        help="keep frames whose quality bits say they are bad",
    )
    run = p.add_argument_group("how to run")
    run.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (default: all cores)"
    )
    run.add_argument("--scheduler", metavar="ADDRESS", help="run on this Dask cluster instead, e.g. tcp://host:8786")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    p = parser()
    args = p.parse_args(argv)
    args.format = ALIASES.get(args.format, args.format)
    output = Path(args.output)
    if args.verify:
        problems = campaign.verify(output)
        print("\n".join(problems) if problems else f"{output}: all files are as the manifest says")
        return 1 if problems else 0
    if not args.bags:
        p.error("no BAG given")
    if args.jobs < 1:
        p.error(f"--jobs {args.jobs}: at least 1 process is needed")
    for option, needed in _NEEDED.items():
        if getattr(args, option) is not None and needed not in FORMATS[args.format].options:
            having = ", ".join(name for name, form in FORMATS.items() if needed in form.options)
            p.error(f"--{option.replace('_', '-')} is not for {args.format}; it is for {having}")
    if args.seed is not None and args.split_by != "flight":
        p.error(f"--seed {args.seed}: nothing is drawn without --split-by flight: the first part of each flight trains")
    jobs = _jobs(args, output)
    campaign.make_folder(output)
    run = (
        partial(campaign.run_dask, address=args.scheduler)
        if args.scheduler
        else partial(campaign.run_local, workers=args.jobs)
    )
    if FORMATS[args.format].annotated and args.labels is None:
        print(f"no labels are exported: {args.format} gets them by --labels, label_images makes them", file=sys.stderr)
    failed = 0
    outcomes = campaign.export(jobs, run)
    bar = tqdm(outcomes, total=len(jobs), unit="flight", disable=not sys.stderr.isatty())
    for outcome in bar:
        for warning in outcome.warnings:
            bar.write(f"{outcome.name}: {warning}", file=sys.stderr)
        if outcome.record is None:
            failed += 1
            bar.write(f"{outcome.name}: {outcome.error}", file=sys.stderr)
        else:
            bar.write(f"{outcome.name}: {_summary(outcome)}", file=sys.stdout)
    print(f"{len(jobs) - failed} of {len(jobs)} flights exported to {output}")
    return 1 if failed else 0


def _jobs(args: argparse.Namespace, output: Path) -> list[Job]:
    chosen = {
        "keep_bad": args.keep_bad_frames,
        "train_share": args.train_share,
        "split_by": args.split_by,
        "seed": args.seed,
        "cameras": tuple(sorted(set(args.camera or ()))),
    }
    dataset = Options(**{name: value for name, value in chosen.items() if value is not None})
    topics = tuple(args.topics or ())
    named = campaign.flights(args.bags)
    training = _training(named, dataset, output, args.format)
    jobs = []
    for name, bags in sorted(named.items()):
        labels, digest = _labels(args, name, named)
        job = Job(name, bags, str(output.resolve()), args.format, args.rate, topics, dataset, name in training)
        jobs.append(job._replace(labels=labels, labels_sha256=digest))
    return jobs


def _training(named: Mapping[str, Sequence[str]], dataset: Options, output: Path, form: str) -> set[str]:
    """Draw the flights that train, over those that the folder has too; says which of these change their split."""
    if dataset.split_by != "flight":
        return set()
    there = made.sides(output, form)
    training = campaign.choose_training({*named, *there}, dataset)
    for name, trained in sorted(there.items()):
        if trained != (name in training):
            old, new = ("train", "validation") if trained else ("validation", "train")
            stays = "" if name in named else ", and stays there: give all flights in one command"
            print(
                f"{name}: the draw over all {form} flights of {output} puts it into {new}; it was exported into "
                f"{old}{stays}",
                file=sys.stderr,
            )
    return training


def _labels(args: argparse.Namespace, name: str, flights: Mapping[str, Sequence[str]]) -> tuple[str, str]:
    """Give the file of a flight's labels and its SHA-256; empty without.

    Raises:
        ExportError: One file for several flights.
        LabelError: It cannot be read.
    """
    if args.labels is None:
        return "", ""
    path = args.labels
    if path.is_dir():
        own = path / f"{name}{table.ENDING}"
        # label_images calls it as the first bag; of several flights with bags of one name it would be of any of them.
        written = path / table.beside(Path(flights[name][0])).name
        alike = sum(table.beside(Path(bags[0])).name == written.name for bags in flights.values())
        path = written if not own.exists() and written.exists() and alike == 1 else own
    elif len(flights) > 1:
        msg = f"--labels {path}: a file for {len(flights)} flights; expected the folder with one for each"
        raise ExportError(msg)
    return str(path.resolve()), table.digest(path)


def _summary(outcome: campaign.Outcome) -> str:
    assert outcome.record is not None
    counts = dict(outcome.record["counts"])
    left_out = counts.pop("left_out", {})
    objects = counts.pop("objects", {})
    text = ", ".join(f"{value} {key}" for key, value in counts.items())
    if objects:
        text += ": " + ", ".join(f"{value} {key}" for key, value in objects.items())
    if left_out:
        text += "; left out: " + ", ".join(f"{value} {key}" for key, value in left_out.items())
    return text + (" (made earlier)" if outcome.reused else "")
