"""Flies a campaign into a folder: parts, resumption, and who flies.

The folder holds `campaign.json` (what is flown, and a fingerprint of what it is flown with), `parts/` (a Parquet file
for each few flights, written under another name and renamed when whole) and, at the end, `table.parquet`. Nothing else
is remembered: what has no part is flown, whatever was killed when.
"""

from __future__ import annotations

import fcntl
import json
import os
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator, List, Sequence, Tuple

import pandas as pd

from xplane_bridge.analysis.intervals import wilson
from xplane_bridge.campaign.definition import Campaign, parse_campaign
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.campaign.fingerprint import Fingerprint, differences, fingerprint
from xplane_bridge.campaign.rows import Row, fly_rows
from xplane_bridge.compiled import require

#: Flights of one task and one part: long enough to hide what a task costs, short enough to lose little.
CHUNK = 10
CAMPAIGN, PARTS, TABLE = "campaign.json", "parts", "table.parquet"

Chunk = Tuple[int, int]  #: first flight, count
#: Flies chunks of a campaign in any order and gives the rows of each. One that flies elsewhere has a `fingerprint` too:
#: of what it flies with there.
Executor = Callable[[Campaign, Sequence[Chunk]], Iterator[List[Row]]]


def in_process(campaign: Campaign, chunks: Sequence[Chunk]) -> Iterator[List[Row]]:
    """Flies in this process, one chunk after the other."""
    for first, count in chunks:
        yield fly_rows(campaign.document, first, count)


class CampaignFolder:
    """A campaign's folder, with exclusive use of it while flights are written.

    Args:
        folder: Made where it does not exist.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)

    def load(self) -> Campaign:
        """The campaign that has been flown into the folder.

        Raises:
            CampaignError: There is none, or it cannot be flown from here.
        """
        try:
            document = json.loads((self.folder / CAMPAIGN).read_text(encoding="utf-8"))["campaign"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise CampaignError(f"{self.folder}: holds no campaign ({error}); fly one into it first") from None
        return parse_campaign(document)

    def fly(self, campaign: Campaign, executor: Executor, progress: Callable[[int], None]) -> pd.DataFrame:
        """Flies what is missing, and writes the table.

        Args:
            campaign: What to fly; a folder that has flights is flown on as `load` gives it.
            executor: Who flies.
            progress: Called with how many further flights have a row.

        Raises:
            CampaignError: The folder is another campaign's, in use, or cannot be written.
        """
        require("a campaign")
        try:
            (self.folder / PARTS).mkdir(parents=True, exist_ok=True)
            with self._locked():
                self._claim(campaign, getattr(executor, "fingerprint", fingerprint)(campaign))
                campaign = self.load()  # draws go to parameters by their order: that of the flights that are there
                for left in (self.folder / PARTS).glob("*.tmp"):
                    left.unlink()
                table = self._fly_rounds(campaign, executor, progress)
                self._write(table, self.folder / TABLE)
                return table
        except OSError as error:
            raise CampaignError(f"{error.filename or self.folder}: {error.strerror or error}") from None

    def table(self) -> pd.DataFrame:
        """All rows there are, sorted by flight."""
        parts = sorted((self.folder / PARTS).glob("*.parquet"))
        if not parts:
            raise CampaignError(f"{self.folder}: has no flights yet")
        rows = pd.concat([pd.read_parquet(path) for path in parts], ignore_index=True)
        return rows.sort_values("flight", kind="stable").reset_index(drop=True)

    # ---- one run

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with (self.folder / ".lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise CampaignError(f"{self.folder}: another run_campaign is flying into it") from None
            yield

    def _claim(self, campaign: Campaign, flies_with: Fingerprint) -> None:
        path = self.folder / CAMPAIGN
        wanted = {"campaign": campaign.document, "flown_with": flies_with}
        if path.is_file():
            saved = json.loads(path.read_text(encoding="utf-8"))
            if saved.get("campaign") != json.loads(json.dumps(campaign.document)):
                raise CampaignError(f"{self.folder}: holds flights of another campaign; give another folder with -o")
            changed = differences(saved["flown_with"], flies_with)
            if changed:
                raise CampaignError(
                    f"{self.folder}: its flights were flown with another {changed}, with which the same seed may give "
                    "other bits; fly on with what they were flown with, or give another folder with -o"
                )
            return
        _replace(path, lambda new: new.write_text(json.dumps(wanted, indent=1) + "\n", encoding="utf-8"))

    def _fly_rounds(self, campaign: Campaign, executor: Executor, progress: Callable[[int], None]) -> pd.DataFrame:
        """Without `stop` one round; with it one for each look, flown whole: the same rows with every executor."""
        every = campaign.stop.every if campaign.stop else campaign.flights
        for start in range(0, campaign.flights, every):
            end = min(start + every, campaign.flights)
            chunks = [(first, min(CHUNK, end - first)) for first in range(start, end, CHUNK)]
            missing = [chunk for chunk in chunks if not self._part(chunk).is_file()]
            progress(end - start - sum(count for _, count in missing))
            for rows in executor(campaign, missing):
                self._write(pd.DataFrame(rows), self._part((rows[0]["flight"], len(rows))))
                progress(len(rows))
            table = self.table()
            # Of an interrupted run, not those of later rounds: each look sees what an uninterrupted one sees.
            table = table[table["flight"] < end]
            if campaign.stop and narrow_enough(campaign, table):
                break
        return table

    def _part(self, chunk: Chunk) -> Path:
        return self.folder / PARTS / f"flights-{chunk[0]:08d}-{chunk[1]:04d}.parquet"

    def _write(self, table: pd.DataFrame, path: Path) -> None:
        _replace(path, lambda new: table.to_parquet(new, index=False))


def narrow_enough(campaign: Campaign, table: pd.DataFrame) -> bool:
    """Whether the interval that `stop` names is as narrow as it wants."""
    stop = campaign.stop
    if stop is None:
        return False
    column = table["passed"] if stop.criterion == "all" else table[f"met_{stop.criterion}"]
    low, high = wilson(int(column.sum()), len(column))
    return high - low <= stop.width


def _replace(path: Path, write: Callable[[Path], Any]) -> None:
    """Writes beside it, makes sure it is on the disk, and renames: it is there whole or not at all."""
    new = path.with_name(path.name + ".tmp")
    write(new)
    with new.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(new, path)
