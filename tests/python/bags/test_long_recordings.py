"""Recordings are read, exported and reported in pieces: memory hardly follows their length."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path
from typing import Callable, Dict

import numpy as np
import pytest

from support.flights.long_recording import READERS, peak_mb, write_long_recording
from xplane_bridge.bags import Bags
from xplane_bridge.bags.columns import ColumnFile
from xplane_bridge.cli import bag_export, flight_report

MEGABYTES = 500.0  #: that an hour may take
SECONDS = (5.0, 12.0)
#: What hides growth in short flights: several chunks of a recording at a time, each of about a megabyte, or pictures.
LONGER_SECONDS = (30.0, 60.0)
WARMING_UP = 0.5  #: [s] a flight that has everything loaded before it is counted
#: [kB] a second of flight adds at most: index, stamps, a column or two; all columns of flight_state alone are 31.
MOST_GROWTH = 40.0
#: [kB] likewise, where lists of messages are written, too: /diagnostics as it was recorded is 25.
MOST_GROWTH_WITH_LISTS = 65.0
#: [kB] likewise, of what copies pictures or messages: the index, and names and checksums of files; 11 and 14.
MOST_GROWTH_OF_COPIES = 20.0


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Dict[float, Path]:
    """The same flight, in all lengths."""
    folder = tmp_path_factory.mktemp("recordings")
    paths = {seconds: folder / f"{seconds:g}.bag" for seconds in (WARMING_UP, *SECONDS, *LONGER_SECONDS)}
    for seconds, path in paths.items():
        write_long_recording(path, seconds)
    return paths


def export(form: str) -> Callable[[Path, Path], None]:
    def run(bag: Path, folder: Path) -> None:
        assert bag_export.main([str(bag), "-o", str(folder), "--jobs", "1", "--format", *form.split()]) == 0

    return run


def report(bag: Path, folder: Path) -> None:
    assert flight_report.main([str(bag), "-o", str(folder / "report.html")]) == 0


def pieces(bag: Path, _: Path) -> None:
    with Bags(bag) as bags:
        for topic in bags.topics:
            if "image_raw" not in topic:
                assert sum(len(piece) for piece in bags.pieces(topic)) == bags.topics[topic].count


COPIES = ("coco", "mcap")
_FORMATS = ("csv", "csv --rate 100", "parquet", "npz", "mat", "tum", "euroc", *COPIES)
PROGRAMS = {form: export(form) for form in _FORMATS}
PROGRAMS.update(report=report, pieces=pieces)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_longer_flight_takes_hardly_more_memory(
    tmp_path: Path, recordings: Dict[float, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pieces are made so small that the short flight already has several; what Python and NumPy allocate is counted."""
    monkeypatch.setattr("xplane_bridge.bags._PIECE_MESSAGES", 100)
    monkeypatch.setattr("xplane_bridge.export.tables._PIECE_ROWS", 100)
    monkeypatch.setattr("xplane_bridge.export.pictures._PIECE_ROWS", 20)
    monkeypatch.setattr("xplane_bridge.export.arrays._PIECE_BYTES", 10000)
    monkeypatch.setattr("xplane_bridge.plotting.interactive.MAX_POINTS", 200)
    PROGRAMS[name](recordings[WARMING_UP], tmp_path / "first")
    peaks = []
    lengths = LONGER_SECONDS if name in ("report", *COPIES) else SECONDS
    for seconds in lengths:
        gc.collect()
        tracemalloc.start()
        PROGRAMS[name](recordings[seconds], tmp_path / f"{seconds:g}")
        peaks.append(tracemalloc.get_traced_memory()[1] / 1e3)
        tracemalloc.stop()
    most = MOST_GROWTH_WITH_LISTS if name in ("npz", "mat", "pieces") else MOST_GROWTH
    most = MOST_GROWTH_OF_COPIES if name in COPIES else most
    assert peaks[1] - peaks[0] < most * (lengths[1] - lengths[0]), peaks


def test_columns_in_a_file_are_those_in_memory(tmp_path: Path, recordings: Dict[float, Path]) -> None:
    with Bags([recordings[SECONDS[0]], recordings[SECONDS[0]]]) as bags:  # every message twice: they are put in order
        for topic in bags.topics:
            memory, stored = bags.read(topic), bags.read(topic, store=ColumnFile(tmp_path))
            assert list(stored.columns) == list(memory.columns)
            np.testing.assert_array_equal(stored.time, memory.time)
            for name, column in memory.columns.items():
                assert stored[name].dtype == column.dtype
                for one, other in zip(stored[name], column):
                    np.testing.assert_array_equal(one, other)
            if topic.endswith("flight_state"):
                turned = stored.columns.in_order(np.arange(len(stored))[::-1])
                np.testing.assert_array_equal(turned["roll_deg"], memory["roll_deg"][::-1])
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_named(tmp_path: Path, recordings: Dict[float, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    file = ColumnFile(tmp_path)
    monkeypatch.setattr(file, "_file", type("Full", (), {"seek": full})())
    with Bags(recordings[SECONDS[0]]) as bags, pytest.raises(OSError, match="No space left on device") as caught:
        bags.read("/xplane/odom", store=file)
    assert caught.value.filename == str(tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize("name", READERS)
def test_an_hour_of_all_topics_and_pictures_is_read_within_its_memory(tmp_path: Path, name: str) -> None:
    """What a minute more takes, times the minutes of an hour; `scripts/bench bag_memory` measures the hour itself.

    So does this of a report: its first minutes take more than later ones, until its figures have all their points.
    """
    minutes = (60.0,) if name == "report" else (4.0, 8.0)
    peaks = []
    for length in minutes:
        bag = tmp_path / f"{length:g}.bag"
        assert write_long_recording(bag, 60.0 * length) > 60e6 * length
        peaks.append(peak_mb(name, bag, tmp_path / "out"))
        bag.unlink()
    assert peaks[0] + (60.0 - minutes[0]) * (peaks[-1] - peaks[0]) / 4.0 < MEGABYTES
