"""apt.dat as X-Plane reads it, and what is said of a broken one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from xplane_bridge.labels.apt import AptError, read_airport

if TYPE_CHECKING:
    from pathlib import Path

#: Row 100 of an airport like KMWH's: displaced thresholds of 300 and 120 m, which are not elevations in feet.
ROW = (
    "100 45.72 2 1 0.25 1 3 1 09L 47.20000000 -119.35000000 300.00 61.00 3 0 0 1 "
    "27R 47.20000000 -119.31000000 120.00 0.00 2 5 1 0"
)
FILE = f"""I
1100 Version - data cycle 2013.10

1   1185 0 0 KAAA First airport
{ROW}
110 1 0.25 0.00 apron
111 47.1 -119.3
1302 icao_code KICA

16 10 0 0 WATR Sea base
101 49.0 0 08 35.0 -119.0 26 35.0 -119.1
17 100 0 0 HELI Pad
102 H1 35.0 -119.0 0.0 10.0 10.0 1 0 0 0.0 0
1   200 0 0 KAAA Second of the same name
100 30 1 0 0.25 0 0 0 01 47.0 -119.0 0 0 0 0 0 0 19 47.02 -119.0 0 0 0 0 0 0
99
"""


def written(tmp_path: Path, text: str, name: str = "apt.dat") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_first_match_counts_and_lengths_are_metres_but_for_the_elevation(tmp_path: Path) -> None:
    airport = read_airport([written(tmp_path, FILE)], "kaaa")
    assert (airport.ident, airport.name, airport.version) == ("KAAA", "First airport", 1100)
    assert airport.elevation == pytest.approx(1185 * 0.3048)
    (runway,) = airport.runways
    assert (runway.width, runway.surface) == (45.72, 2)
    left, right = runway.ends
    assert left == ("09L", 47.2, -119.35, 300.0, 61.0)
    assert right == ("27R", 47.2, -119.31, 120.0, 0.0)


@pytest.mark.parametrize("version", [1000, 1050, 1130, 1150, 1200])
def test_versions_line_ends_and_byte_order_marks(tmp_path: Path, version: int) -> None:
    text = "\ufeff" + FILE.replace("1100", str(version)).replace("\n", "\r\n")
    assert read_airport([written(tmp_path, text)], "KAAA").version == version


def test_an_icao_code_of_the_metadata_counts_too(tmp_path: Path) -> None:
    assert read_airport([written(tmp_path, FILE)], "KICA").ident == "KAAA"


def test_a_heliport_with_the_code_does_not_hide_the_airport_of_that_name(tmp_path: Path) -> None:
    heliport = "17 10 0 0 XHEL Heliport of it\n1302 icao_code KAAA\n\n"
    at = FILE.index("1   1185")
    airport = read_airport([written(tmp_path, FILE[:at] + heliport + FILE[at:])], "KAAA")
    assert (airport.ident, airport.name) == ("KAAA", "First airport")
    with pytest.raises(AptError, match=r"line 4: XHEL has no land runway"):
        read_airport([written(tmp_path, FILE[:at] + heliport + "99\n")], "KAAA")


def test_files_are_looked_through_in_their_order(tmp_path: Path) -> None:
    mine = written(tmp_path, FILE.replace("First airport", "Mine"), "mine.dat")
    other = written(tmp_path, FILE.replace("KAAA", "KBBB"), "other.dat")
    default = written(tmp_path, FILE)
    assert read_airport([other, mine, default], "KAAA").name == "Mine"
    assert read_airport([other, default, mine], "KAAA").name == "First airport"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("I\n1100", "1100"), "line 1: '1100 Version - data cycle 2013.10'; expected I or A"),
        (("1100 V", "850 V"), "line 2: version '850'; versions 1000 to 1200"),
        (("300.00 61.00", "300.00"), "line 5: a runway of 25 fields; expected 26"),
        (("47.20000000 -119.35", "97.2 -119.35"), "line 5: latitude [deg] '97.2'; expected a number from -90 to 90"),
        (("300.00 61.00", "3O0 61.00"), "line 5: displaced threshold [m] '3O0'"),
        (("300.00", "2950.0"), "leave nothing of its 3025 m"),
        (("-119.31000000", "-118.00000000"), "runway 09L/27R is 102"),
        (("45.72", "nan"), "line 5: width [m] 'nan'"),
        (("1   1185 0 0", "1   high 0 0"), "line 4: elevation [ft] 'high'"),
        ((ROW, "130 boundary"), "KAAA has no land runway"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    assert change[0] in FILE
    with pytest.raises(AptError) as error:
        read_airport([written(tmp_path, FILE.replace(change[0], change[1], 1))], "KAAA")
    assert said in str(error.value)
    assert str(tmp_path / "apt.dat") in str(error.value)


def test_a_file_that_is_cut_off_is_no_airport(tmp_path: Path) -> None:
    whole = read_airport([written(tmp_path, FILE)], "KAAA")
    assert whole.runways
    cut = written(tmp_path, FILE[: FILE.index("110 1 0.25")])
    with pytest.raises(AptError, match="cut off within KAAA"):
        read_airport([cut], "KAAA")


def test_an_airport_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(AptError, match=r"no airport KZZZ among 4; .*Global Airports"):
        read_airport([written(tmp_path, FILE)], "KZZZ")
    with pytest.raises(AptError, match="No such file"):
        read_airport([tmp_path / "missing.dat"], "KAAA")
    with pytest.raises(AptError, match="an empty file"):
        read_airport([written(tmp_path, "")], "KAAA")
