"""Many flights, exported side by side: here in processes, or on a Dask cluster; the same files either way.

An export folder holds one entry per flight and format, a data card (README.md), ``data.yaml`` of all flights in YOLO's
format, and ``manifest.json``: versions, parameters, counts, and the SHA-256 of every file exported there. A flight is
built under a temporary name and renamed when whole, so that an export that was cut off goes on where it stopped:
flights whose record in ``.flights/<format>/`` fits the bags and parameters are not made again. What no record names, or
another flight's, is never overwritten.
"""

from __future__ import annotations

import errno
import hashlib
import json
import logging
import os
import random
import shutil
import sqlite3
import threading
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator, NamedTuple, Optional, Sequence

from xplane_bridge import __version__
from xplane_bridge.bags import BagError, Bags
from xplane_bridge.dask_scheduler import connected, watched
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.export.cameras import camera_rows
from xplane_bridge.export.card import CARD, card
from xplane_bridge.export.flight import ExportError, frame_quality
from xplane_bridge.export.formats import ALIASES, FORMATS, Job
from xplane_bridge.export.made import MANIFEST, RECORDS, SCHEMA, read_manifest, read_record, records, refuse_foreign
from xplane_bridge.export.yolo_yaml import DATA_YAML, of_all_flights
from xplane_bridge.whole_file import replaced

if TYPE_CHECKING:
    from xplane_bridge.export.pictures import Options


class Outcome(NamedTuple):
    """What became of a job."""

    name: str
    record: Optional[dict[str, Any]]  #: the flight's part of the manifest
    error: str  #: empty, or one line
    reused: bool  #: an earlier run had made it
    warnings: tuple[str, ...] = ()  #: what there is to know about its recording, each a line


def flights(arguments: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Name the flights given on a command line: a bag is a flight, a folder of (split) bags is one too.

    Returns:
        Unique name to bag paths; names take as many parent folders as are needed to be unique.

    Raises:
        BagError: A folder without bags.
        ExportError: The same bag twice, also in two flights, or two of one name whatever folders it takes.
    """
    paths = [Path(argument).resolve() for argument in arguments]
    for path in paths:
        if paths.count(path) > 1:
            msg = f"{path} is given twice"
            raise ExportError(msg)
    names: dict[str, Path] = {}
    parts = {path: _parts(path) for path in paths}
    for path, own in parts.items():
        others = [other for key, other in parts.items() if key != path]
        depth = 1
        while depth < len(own) and any(other[-depth:] == own[-depth:] for other in others):
            depth += 1
        name = "_".join(own[-depth:]).replace("/", "")
        if name in names:
            msg = (
                f"{names[name]} and {path} would both be exported as {name}; expected flights of different names: "
                "rename one, or export them one after the other to folders of their own (-o)"
            )
            raise ExportError(msg)
        names[name] = path
    found = {name: tuple(str(p) for p in Bags(path).paths) for name, path in names.items()}
    flight_of: dict[Path, Path] = {}
    for name, bags in found.items():
        for bag in {Path(path).resolve() for path in bags}:
            if bag in flight_of:
                msg = f"{bag} is of two of the given flights, {flight_of[bag]} and {names[name]}; give one of them"
                raise ExportError(msg)
            flight_of[bag] = names[name]
    return found


def _parts(path: Path) -> list[str]:
    """Of which a flight's name is made, from the end."""
    return [*path.parent.parts, path.stem if path.suffix == ".bag" else path.name]


def choose_training(names: Iterable[str], options: Options) -> set[str]:
    """Choose the flights that train, with ``split_by="flight"``: a seeded draw, at least one flight on each side."""
    ordered = sorted(names)
    random.Random(options.seed).shuffle(ordered)
    count = round(len(ordered) * options.train_share)
    if len(ordered) > 1 and 0 < options.train_share < 1:
        count = min(max(count, 1), len(ordered) - 1)
    return set(ordered[:count])


def export_flight(job: Job) -> Outcome:
    """Export one flight; the one function that local processes and cluster workers run."""
    with _warnings() as found:
        outcome = _outcome(job)
    return outcome._replace(warnings=tuple(dict.fromkeys(found)))


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect the package's warnings: a worker may have no handler that prints them, or its own machine's stderr."""
    found: list[str] = []
    thread = threading.get_ident()  # a Dask worker may export several flights at once, each on its own thread

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.thread == thread:
                found.append(record.getMessage())

    collector = Collector(logging.WARNING)
    package = logging.getLogger("xplane_bridge")
    package.addHandler(collector)
    try:
        yield found
    finally:
        package.removeHandler(collector)


def _outcome(job: Job) -> Outcome:
    output = Path(job.output)
    record_file = output / RECORDS / job.format / f"{job.name}.json"
    try:
        key = _key(job)
        old = read_record(record_file)
        if old and old["key"] == key and all((output / f).is_file() for f in old["record"]["files"]):
            return Outcome(job.name, old["record"], "", True)
        record = _export(job, output, key, record_file)
        for alias in (alias for alias, name in ALIASES.items() if name == job.format):
            _remove(output / RECORDS / alias / record_file.name)  # of an earlier version, made anew
        return Outcome(job.name, record, "", False)
    except XplaneBridgeError as error:
        return Outcome(job.name, None, str(error), False)
    except (OSError, sqlite3.OperationalError) as error:
        return Outcome(job.name, None, _not_written(error, output / f"{job.name}{FORMATS[job.format].ending}"), False)
    except Exception as error:  # of a library that writes a format: the other flights, and the manifest, are made
        said = " ".join(f"{type(error).__name__}: {error}".split())
        return Outcome(job.name, None, f"the {job.format} export failed: {said}; try another --format", False)


def _not_written(error: Exception, final: Path) -> str:
    """Say what could not be written, and the system's reason; of a full disk Python says no name, SQLite no reason."""
    given = getattr(error, "filename", None)
    name = Path(given) if isinstance(given, str) else final
    if _part(final) in (name, *name.parents):
        name = final  # where it is built goes with it
    return f"{name}: {getattr(error, 'strerror', None) or error}"


def _export(job: Job, output: Path, key: dict[str, Any], record_file: Path) -> dict[str, Any]:
    form = FORMATS[job.format]
    final = output / f"{job.name}{form.ending}"
    _refuse_recordings(final, job)
    refuse_foreign(final, job, key["sources"])
    folder = _part(final)
    _remove(folder)
    try:
        with Bags(job.bags) as bags:
            folder.mkdir(parents=True)
            counts = form.write(bags, folder / final.name, job)
            about: dict[str, Any] = {
                "topics": {t: [info.msgtype, info.count] for t, info in bags.topics.items() if info.count}
            }
            if form.frames:
                names = job.dataset.cameras if "dataset" in form.options else ()
                about["quality"] = frame_quality(bags, names)
                about["cameras"] = [row.plain() for row in camera_rows(bags, names)]
        made = folder / final.name
        files = _files(made, final.name) if made.is_dir() else [final.name]
        record = {
            "xplane_bridge": __version__,
            "bags": [Path(path).name for path in job.bags],
            "parameters": job.parameters,
            "counts": counts,
            **about,
            "files": {name: _sha256(folder / name) for name in files},
        }
        _remove(final)
        # Before the result: killed between the two, the next run must know what it finds as its own.
        record_file.parent.mkdir(parents=True, exist_ok=True)
        _write_json(record_file, {"key": key, "record": record})
        os.replace(made, final)
    finally:
        _remove(folder)
    return record


def _part(final: Path) -> Path:
    """Where a result is built, under its own name already: some formats write it into their files."""
    return final.with_name(f".{final.name}.part")


def _refuse_recordings(final: Path, job: Job) -> None:
    """Raise `ExportError` when what would be replaced is, or holds, a bag of the flight."""
    place = final.resolve()
    for bag in map(Path, job.bags):
        if any(final in (path, *path.parents) or place in (path, *path.parents) for path in (bag, bag.resolve())):
            msg = (
                f"{bag}: the {job.format} export of this bag would replace {final}, where the bag itself lies; "
                "give another folder with -o"
            )
            raise ExportError(msg)


def run_local(jobs: Sequence[Job], workers: int) -> Iterator[Outcome]:
    """Export in parallel processes, yielding each outcome as it comes; the flights of a pool that broke have failed."""
    if workers == 1 or len(jobs) == 1:
        yield from map(export_flight, jobs)
        return
    with ProcessPoolExecutor(max_workers=min(workers, len(jobs))) as pool:
        futures: dict[Future[Outcome], Job] = {}
        for job in jobs:
            try:
                futures[pool.submit(export_flight, job)] = job
            except BrokenProcessPool:
                yield _lost(job)
        for future in as_completed(futures):
            try:
                yield future.result()
            except BrokenProcessPool:
                yield _lost(futures[future])


def _lost(job: Job) -> Outcome:
    error = (
        "a process of the export was killed, perhaps for want of memory; give the command again, with fewer --jobs or "
        "Dask workers"
    )
    return Outcome(job.name, None, error, False)


def run_dask(jobs: Sequence[Job], address: str) -> Iterator[Outcome]:
    """Export on a running Dask cluster whose workers see the same paths.

    The flights of a worker that was killed, again and again, have failed.

    Raises:
        SchedulerError: Nothing answers at the address, dask.distributed is not installed, or the scheduler ended.
    """
    with connected(address) as client, watched(client):
        from distributed import KilledWorker
        from distributed import as_completed as completed

        futures = {client.submit(export_flight, job, pure=False): job for job in jobs}
        for future in completed(list(futures)):
            try:
                yield future.result()
            except KilledWorker:
                yield _lost(futures[future])


def export(jobs: Sequence[Job], run: Callable[[Sequence[Job]], Iterator[Outcome]]) -> Iterator[Outcome]:
    """Run all jobs, then write the manifest of all that the folder holds.

    Args:
        jobs: One a flight, all to the same output folder.
        run: `run_local` or `run_dask`, bound to its own arguments.

    Yields:
        Every outcome, as it comes.

    Raises:
        ExportError: The manifest, or another file of all flights, cannot be written, or a file of that name, or of a
            record's, is none.
    """
    output = Path(jobs[0].output)
    read_manifest(output)  # as the records: refused before the work, not behind it
    list(records(output))
    yield from run(jobs)
    exports: dict[str, dict[str, Any]] = {}
    for form, flight, made in records(output):
        exports.setdefault(form, {})[flight] = made["record"]
    counts = {
        form: {"flights": len(flights), "files": sum(len(record["files"]) for record in flights.values())}
        for form, flights in exports.items()
    }
    content = {"schema": SCHEMA, "xplane_bridge": __version__, "counts": counts, "exports": exports}
    try:
        content["files"] = _write_shared(output, exports)
        _write_json(output / MANIFEST, content)
    except OSError as error:
        msg = f"{error.filename or output / MANIFEST}: {error.strerror}"
        raise ExportError(msg) from None


def _write_shared(output: Path, exports: dict[str, dict[str, Any]]) -> dict[str, str]:
    """Write what is of all flights, but not over files that no export has written, or that a user has changed.

    Returns:
        Name and SHA-256 of each for the manifest.
    """
    files: dict[str, str] = dict((read_manifest(output) or {}).get("files", {}))
    texts = {CARD: card(__version__, exports)} if exports else {}
    if "yolo" in exports:
        texts[DATA_YAML] = of_all_flights(__version__, exports["yolo"])
    for name, text in texts.items():
        path = output / name
        if not os.path.lexists(path) or (path.is_file() and _sha256(path) == files.get(name)):
            _write_text(path, text)
            files[name] = _sha256(path)
    return files


def make_folder(output: Path) -> None:
    """Make the export's folder, before hours of work find that there is none.

    Raises:
        ExportError: It cannot be made, or not be written to.
    """
    try:
        output.mkdir(parents=True, exist_ok=True)
        if not os.access(output, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        msg = f"{output}: {error.strerror}; -o takes a folder that can be written, or the name of a new one"
        raise ExportError(msg) from None


def verify(output: Path) -> list[str]:
    """Compare an export with its manifest.

    Returns:
        One line a difference: missing, changed and surplus files; empty when all is as recorded.

    Raises:
        ExportError: No manifest there.
    """
    manifest = read_manifest(output)
    if manifest is None or manifest["schema"] != SCHEMA:
        msg = f"{output}: no readable {MANIFEST} of this version; export first"
        raise ExportError(msg)
    problems = []
    known = {MANIFEST, CARD, DATA_YAML}  # the latter two may be a user's own, which no export has written
    records = [manifest, *(record for flights in manifest["exports"].values() for record in flights.values())]
    for name, checksum in (item for record in records for item in record.get("files", {}).items()):
        known.add(name)
        path = output / name
        if not path.is_file():
            problems.append(f"missing: {name}")
        elif _sha256(path) != checksum:
            problems.append(f"changed: {name}")
    for name in sorted(_files(output, "")):
        if name not in known and not name.startswith(RECORDS + "/"):
            problems.append(f"not in the manifest: {name}")
    return problems


def _key(job: Job) -> dict[str, Any]:
    """All that decides the content of a flight's files; an earlier export with the same key is good."""
    sources = []
    for path in job.bags:
        try:
            status = os.stat(path)
        except OSError as error:
            msg = f"{path}: {error.strerror}"
            raise BagError(msg) from None
        sources.append([path, status.st_size, status.st_mtime_ns])
    return {
        "schema": SCHEMA,
        "xplane_bridge": __version__,
        "sources": sources,
        "parameters": job.parameters,
    }


def _files(folder: Path, name: str) -> Iterator[str]:
    """Name the files in a folder and below, with slashes: as texts, for paths take ten times the memory.

    Args:
        folder: Where.
        name: What their names begin with.
    """
    with os.scandir(folder) as entries:
        for entry in entries:
            own = f"{name}/{entry.name}" if name else entry.name
            if entry.is_dir(follow_symlinks=False):
                yield from _files(Path(entry.path), own)
            elif entry.is_file():
                yield own


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    elif os.path.lexists(path):
        path.unlink()


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return digest.hexdigest()


def _write_json(path: Path, content: Any) -> None:
    with replaced(path) as file:
        json.dump(content, file, indent=1, sort_keys=True)
        file.write("\n")


def _write_text(path: Path, text: str) -> None:
    with replaced(path) as file:
        file.write(text)
