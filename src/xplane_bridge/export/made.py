"""What a folder of exports holds already: its manifest, and a record of each flight and format."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Iterator, Optional, Sequence, Tuple

from xplane_bridge.export.flight import ExportError
from xplane_bridge.export.formats import ALIASES, Job

SCHEMA = 2  #: of the manifest and of the records; 1 knew one format a folder
MANIFEST = "manifest.json"
RECORDS = ".flights"
#: A bag of a flight: path, size, time of change [ns].
Source = Tuple[str, int, int]


def refuse_foreign(final: Path, job: Job, sources: Sequence[Source]) -> None:
    """Raise `ExportError` when something is there that is not on the record of this flight's earlier export.

    Also where that format has the same bag under another name: its pictures would train and validate.
    """
    own = False
    for form, flight, made in records(Path(job.output)):
        same = _share_a_bag(made["key"]["sources"], sources)
        if any(name.split("/")[0] == final.name for name in made["record"]["files"]):
            if (form, flight) != (job.format, job.name):
                msg = f"{final} belongs to the {form} export of {flight}; give another folder with -o"
                raise ExportError(msg)
            if not same and os.path.lexists(final):
                bags = ", ".join(path for path, *_ in made["key"]["sources"])
                msg = (
                    f"{final} is the export of another flight, {bags}; expected none but earlier ones of "
                    f"{', '.join(job.bags)}: give another folder with -o, or move it away"
                )
                raise ExportError(msg)
            own = True
        elif same and form == job.format:
            msg = (
                f"{', '.join(job.bags)}: a bag of it is exported to {job.output} as {flight} already, and would be "
                f"there twice as {job.name}: give all flights to a new folder with -o"
            )
            raise ExportError(msg)
    if os.path.lexists(final) and not own:
        msg = (
            f"{final} is there already, made by no export that this folder has a record of; expected nothing of that "
            f"name, for the {job.format} export of {job.name}: give another folder with -o, or move it away"
        )
        raise ExportError(msg)


def _share_a_bag(some: Sequence[Source], others: Sequence[Source]) -> bool:
    """Returns whether a bag is in both: at the same place, or moved, with its name, size and time of change."""

    def marks(sources: Sequence[Source]) -> set[object]:
        places = {Path(path).resolve() for path, _, _ in sources}
        return {*places, *((Path(path).name, size, changed) for path, size, changed in sources)}

    return bool(marks(some) & marks(others))


def records(output: Path) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Give format, flight, and key and record, of everything exported to the folder.

    Raises:
        ExportError: A file there is no record.
    """
    for path in sorted((output / RECORDS).glob("*/*.json")):
        content = read_record(path)
        if content is not None and content["key"]["schema"] == SCHEMA:
            form = path.parent.name
            yield ALIASES.get(form, form), path.stem, content


def sides(output: Path, form: str) -> dict[str, bool]:
    """Give the flights that the folder has in a format, each whole in one split, and whether each trains.

    Raises:
        ExportError: A file of the records is none.
    """
    found = {name: made["record"].get("parameters") for own, name, made in records(output) if own == form}
    trains = {name: given.get("train_flight") for name, given in found.items() if isinstance(given, dict)}
    return {name: side for name, side in trains.items() if isinstance(side, bool)}


def read_record(path: Path) -> Optional[dict[str, Any]]:
    """Read what is kept of a flight's export; None where there is nothing, or no JSON.

    Raises:
        ExportError: It is something else.
    """
    content = _read_json(path)
    if content is None:
        return None
    key, record = (content.get(name) if isinstance(content, dict) else None for name in ("key", "record"))
    if not (
        isinstance(key, dict)
        and isinstance(key.get("schema"), int)
        and isinstance(key.get("sources"), list)
        and all(
            isinstance(source, list) and [type(part) for part in source] == [str, int, int] for source in key["sources"]
        )
        and _has_files(record)
    ):
        msg = f"{path}: no record of a flight's export; expected one that bag_export wrote: move this file away"
        raise ExportError(msg)
    return dict(content)


def _has_files(record: object) -> bool:
    """Returns whether a record, or a manifest, has names and checksums of files."""
    return isinstance(record, dict) and isinstance(record.get("files"), dict)


def read_manifest(output: Path) -> Optional[dict[str, Any]]:
    """Read the folder's manifest, of this or an earlier version; None without.

    Raises:
        ExportError: A file of that name is something else.
    """
    path = output / MANIFEST
    if not os.path.lexists(path):
        return None
    content = _read_json(path)
    if isinstance(content, dict) and isinstance(content.get("schema"), int) and "xplane_bridge" in content:
        exports = content.get("exports") if content["schema"] >= SCHEMA else {}
        if isinstance(content.get("files", {}), dict) and isinstance(exports, dict):
            flights = exports.values()
            if all(isinstance(each, dict) and all(map(_has_files, each.values())) for each in flights):
                return content
    remedy = "give another folder with -o, or move it away"
    msg = f"{path}: no manifest of an export; expected none, or one that bag_export wrote: {remedy}"
    raise ExportError(msg)


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
