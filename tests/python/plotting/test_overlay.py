"""Labels drawn into pictures, and the section of the report that shows them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from support.flights.drawn_approach import write_approach
from support.flights.export_flight import write_flight
from support.white_lines import airport_file
from xplane_bridge.cli import flight_report
from xplane_bridge.cli.sight import label_images
from xplane_bridge.labels import table
from xplane_bridge.plotting.overlay import draw

if TYPE_CHECKING:
    from pathlib import Path

GREEN, YELLOW, RED = (60, 220, 60), (0, 215, 255), (40, 60, 255)


def point(u: float, v: float, state: str = "visible") -> dict:
    return {"u": u, "v": v, "state": state, "sigma_px": 0.5, "coarse": False, "distance_m": 100.0}


def places(picture: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    """Columns and rows of the pixels of a colour."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - colour).max(axis=2) < 40)
    return np.stack((columns, rows), axis=1)


def test_lines_lie_where_the_labels_say_in_a_picture_drawn_larger() -> None:
    sun = {"kind": "sun", "centre": [60.0, 30.0], "box": [50.0, 20.0, 70.0, 40.0], "sigma_px": 0.1, "coarse": False}
    frame = {"width": 320, "height": 240, "objects": [sun]}
    black = np.zeros((240, 320, 3), np.uint8)
    big = draw(black, frame)
    assert big.shape == (720, 960, 3)
    assert not black.any(), "it is drawn into a copy"
    found = places(big, YELLOW)
    # The centre of pixel 50 lies at 151 of pixels three times smaller: 3 * (50 + 0.5) - 0.5.
    assert found.min(axis=0).tolist() == [151, 61]
    assert found.max(axis=0).tolist() == [211, 121]


def test_a_runway_of_which_a_part_lies_behind_the_camera() -> None:
    names = ("threshold_near_left", "threshold_near_right", "threshold_far_left", "threshold_far_right")
    points = {name: point(100.0 + 20.0 * k, 90.0) for k, name in enumerate(names)}
    points["threshold_near_left"] = point(0.0, 0.0, "behind")
    points.update({name: point(100.0, 100.0) for name in ("TL", "TR", "BL", "BR")})
    runway = {"kind": "runway", "points": points, "polygon": [[90, 80], [200, 80], [200, 180]], "centre_line": []}
    big = draw(np.zeros((480, 960, 3), np.uint8), {"width": 960, "height": 480, "objects": [runway]})
    red = places(big, RED)
    assert red[:, 0].min() >= 139, "the far threshold alone"
    assert red[:, 0].max() <= 161
    assert len(places(big, GREEN)) > 100


def test_the_report_shows_ten_pictures_with_their_sigmas(tmp_path: Path) -> None:
    bag = write_approach(tmp_path / "flight.bag", 13)
    assert label_images.main([str(bag), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]) == 0
    labels = table.beside(bag)
    assert flight_report.main([str(bag), "--labels", str(labels), "-o", str(tmp_path / "with.html")]) == 0
    page = (tmp_path / "with.html").read_text(encoding="utf-8")
    section = page[page.index('<section id="labels">') :]
    assert section.count('alt="picture with labels"') == 10
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", section)[:10]
    assert captions[0].startswith("0.0 s &middot; runway 15 at 901 m: ")
    assert "heights of runways: 15/33: apt.dat" in section
    assert flight_report.main([str(bag), "-o", str(tmp_path / "without.html")]) == 0
    assert '<section id="labels">' not in (tmp_path / "without.html").read_text(encoding="utf-8")


def test_labels_of_another_flight_and_none_at_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_approach(tmp_path / "flight.bag", 1)
    assert label_images.main([str(bag), "--apt", str(airport_file()), "--airport", "XEMU"]) == 0
    other = write_flight(tmp_path / "other.bag", 1.0, offset=50.0)
    output = tmp_path / "report.html"
    assert flight_report.main([str(other), "--labels", str(table.beside(bag)), "-o", str(output)]) == 1
    said = f"labels of another recording, made from flight.bag; expected those of {other}, but "
    assert f"{table.beside(bag)}: {said}" in capsys.readouterr().err
    assert not output.exists()
    assert flight_report.main([str(bag), "--labels", str(tmp_path / "none.jsonl"), "-o", str(output)]) == 1
    assert "none.jsonl: No such file or directory; label_images writes it" in capsys.readouterr().err
