"""The file of labels: read line by line, whole before it has its name, refused in words."""

from __future__ import annotations

import os
import threading
import tracemalloc
from pathlib import Path
from typing import Any, Dict, Iterator

import pytest

from xplane_bridge.labels import table

OBJECTS = [{"kind": "runway", "points": {str(k): {"u": k / 7.0, "v": -k / 3.0} for k in range(40)}}]


def frames(count: int) -> Iterator[Dict[str, Any]]:
    for camera in ("camera", "belly"):
        for k in range(count // 2):
            line = {"camera": camera, "stamp_ns": 10**18 + k, "width": 640, "height": 480, "objects": OBJECTS}
            yield {**line, "number": k}


def test_each_picture_has_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.labels.jsonl"
    assert table.write(path, lambda: {"airport": "XEMU"}, frames(40)) == 40
    labels = table.read(path)
    assert labels.about == {"labels": table.SCHEMA, "airport": "XEMU"}
    assert labels.cameras == ["camera", "belly"]
    keys = [(camera, 10**18 + k) for camera in ("camera", "belly") for k in range(20)]
    assert list(labels.frames) == keys
    assert len(labels.frames) == 40
    for key in reversed(keys):
        assert labels.frames[key]["camera"] == key[0]
        assert labels.frames[key]["number"] == key[1] - 10**18
    assert labels.frames == {(f["camera"], f["stamp_ns"]): f for f in frames(40)}
    assert ("camera", 5) not in labels.frames
    assert labels.frames.get(("other", 10**18)) is None


def test_reading_and_writing_take_hardly_more_memory_for_more_pictures(tmp_path: Path) -> None:
    peaks = []
    for count in (100, 100, 1100):
        path = tmp_path / f"{count}.labels.jsonl"
        tracemalloc.start()
        table.write(path, dict, frames(count))
        assert sum(len(frame["objects"]) for frame in table.read(path).frames.values()) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert len(path.read_bytes()) > 1_000_000
    assert peaks[2] - peaks[1] < 300 * 1000, peaks  # bytes a picture


def test_a_pipe_is_written_to_and_a_link_is_followed(tmp_path: Path) -> None:
    pipe, link, file = (tmp_path / name for name in ("pipe", "link", "folder/f.labels.jsonl"))
    os.mkfifo(pipe)
    file.parent.mkdir()
    link.symlink_to(file)
    got: list[str] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_text()), daemon=True)
    reader.start()
    for path in (pipe, link, link):
        table.write(path, dict, [])
    reader.join(10.0)
    assert pipe.is_fifo()
    assert link.is_symlink()
    assert got == [file.read_text()] == ['{"labels":2}\n']
    assert os.listdir(tmp_path / "folder") == [file.name]


def test_what_ends_in_an_error_leaves_nothing(tmp_path: Path) -> None:
    def nothing_to_say() -> Dict[str, Any]:
        raise table.LabelError("no picture")

    with pytest.raises(table.LabelError, match="no picture"):
        table.write(tmp_path / "a.labels.jsonl", nothing_to_say, [])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[1]",
        '{"labels": 1}\n',
        '{"labels": 2}\n{"camera": "a", "stamp',
        '{"labels": 2}\n{"camera": "a"}\n',
        '{"labels": 2}\n[1]\n',
        "\xff",
    ],
)
def test_what_is_no_file_of_labels_is_refused_in_words(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.labels.jsonl"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(table.LabelError, match="no labels of this version; label_images writes them anew"):
        table.read(path)
    with pytest.raises(table.LabelError, match="No such file or directory; label_images writes it"):
        table.read(tmp_path / "b.labels.jsonl")


@pytest.mark.parametrize(
    "changes",
    [
        {"width": None},
        {"height": "480"},
        {"height": 0},
        {"objects": None},
        {"objects": {}},
        {"objects": ["runway"]},
        {"objects": [{"box": [0, 0, 1, 1]}]},
        {"stamp_ns": "x"},
    ],
)
def test_a_line_of_something_else_is_refused_by_its_number(tmp_path: Path, changes: Dict[str, Any]) -> None:
    path = tmp_path / "a.labels.jsonl"
    first, second = frames(2)
    changed = {name: value for name, value in {**second, **changes}.items() if value is not None}
    table.write(path, dict, [first, changed])
    said = "line 3: expected camera, stamp_ns, width, height, objects of a picture: no labels of this version; label_"
    with pytest.raises(table.LabelError, match=f"^{path}: {said}"):
        table.read(path)
