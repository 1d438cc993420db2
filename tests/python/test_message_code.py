"""What cmake/message_code makes of msg/, srv/ and lib/core/state/sources.txt, and what it refuses."""

from __future__ import annotations

import itertools
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = "lib/core/state/sources.txt"


@pytest.fixture(name="copy")
def fixture_copy(tmp_path):
    """A copy of all that the program reads, to be changed."""
    for folder in ("cmake", "migration", "msg", "srv"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "lib/core/state").mkdir(parents=True)
    shutil.copy(ROOT / SOURCES, tmp_path / SOURCES)
    (tmp_path / "src/xplane_bridge").mkdir(parents=True)
    return tmp_path


def run(root, *arguments):
    command = [sys.executable, "-B", root / "cmake/message_code", *arguments]
    return subprocess.run([str(c) for c in command], stderr=subprocess.PIPE, text=True, check=False)


def change(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_the_committed_constants_are_up_to_date(copy):
    assert run(copy, "python").returncode == 0
    made = (copy / "src/xplane_bridge/constants.py").read_text(encoding="utf-8")
    assert made == (ROOT / "src/xplane_bridge/constants.py").read_text(encoding="utf-8"), (
        "run python3 cmake/message_code python"
    )


def test_the_committed_migration_is_up_to_date(copy):
    assert run(copy, "migration").returncode == 0
    for name in ("migration/0.1.0.bmr", "src/xplane_bridge/bags/later_fields.py"):
        made = (copy / name).read_text(encoding="utf-8")
        assert made == (ROOT / name).read_text(encoding="utf-8"), "run python3 cmake/message_code migration"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("float32 fuel_total", "float32 fuel_sum"),  # another name
        ("float32 fuel_total", "float64 fuel_total"),  # another type
        ("float32[9] fuel_tank ", "float32 first\nfloat32[9] fuel_tank "),  # another place
    ],
)
def test_a_change_that_recordings_do_not_survive_is_refused(copy, old, new):
    change(copy / "msg/FuelState.msg", old, new)
    change(copy / SOURCES, "\nfuel_total ", "\nfuel_sum " if "sum" in new else "\nfuel_total ")
    if "first" in new:
        change(copy / SOURCES, "\nfuel_tank ", "\nfirst | - | sim/a/b | |\nfuel_tank ")
    done = run(copy, "migration")
    assert done.returncode == 1
    assert re.search("FuelState: recordings have .* write new fields at the end", done.stderr)


ENGINES = "msg/EngineStates.msg"
N2 = "float32[8] n2 "


@pytest.mark.parametrize(
    ("file", "old", "new", "complaint"),
    [
        (ENGINES, N2, f"float32[8] n3  # [%]\n{N2}", "EngineStates: n3 has no line in lib/core/state/sources.txt"),
        (ENGINES, N2, "# ", r"EngineStates has no field n2 \(did you mean n1\?\): correct the name"),
        (SOURCES, "\nn2  ", "\nn1  ", "EngineStates.*n1 has 2 lines|EngineStates: n2 has no line"),
        (ENGINES, "VALID_ALL = 2147483647", "VALID_ALL = 7", "EngineStates: VALID_ALL is 7, expected 2147483647"),
        ("msg/FuelState.msg", "VALID_ALL = 15", "VALID_ALL = 3", "FuelState: VALID_ALL is 3, expected 15"),
        (SOURCES, "| CG  ", "| CGG ", "FuelState has no bit VALID_CGG"),
        (SOURCES, "| CG  ", "| -   ", "FuelState: no field counts for VALID_CG"),
        (SOURCES, "62.0 (lb)", "62.0 (lbs)", r"sources.txt:\d+: unit lbs: expected one of .*lb"),
        (SOURCES, "62.0 (lb)", "62,0 (lb)", r"sources.txt:\d+: no row.slot.*: 62,0"),
        (SOURCES, "; 12: -", "; 12", r"sources.txt:\d+: expected datarefs in the order of their versions.*: 12$"),
        (SOURCES, "; 12: -", "; 12.8: -", r"sources.txt:\d+: expected datarefs in the order.*: 12.8: -"),
        (SOURCES, "; 12: -", "; 12: sim/b; 12.08: sim/c", r"sources.txt:\d+: expected at most 2 datarefs"),
        (SOURCES, "; 12: -", "; 12.08: sim/b; 12: sim/c", r"sources.txt:\d+: expected .* order .*: 12: sim/c"),
        (SOURCES, "| 62.0 (lb) |", "|", r"sources.txt:\d+: expected `field \| validity"),
        (SOURCES, "| computed LOAD |", "| computed LOAD | sim/a/b", "a computed field has no dataref and no row"),
        ("srv/SetMode.srv", "uint8 AUTO = 2", "uint8 AUTO = 3", "SetMode has the constants .*AUTO', 3"),
        ("msg/ControlCommand.msg", "uint32 FLAPS ", "uint32 FLAP ", "ControlCommand.flaps: expected a range .*one bit"),
        ("msg/AppliedCommand.msg", "float32 flaps ", "float32 flap ", "AppliedCommand has no field flaps .did you"),
        ("srv/SetFailure.srv", "# surfaces: stuck", "# stuck", "SetFailure.kind: no words of the form"),
        ("msg/FuelState.msg", "float32 fuel_total", "float32 fuel-total", r"FuelState.msg:\d+: neither a field nor"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_what_to_do(copy, file, old, new, complaint):
    change(copy / file, old, new)
    done = run(copy, "core", copy / "include")
    assert done.returncode == 1
    assert re.search(complaint, done.stderr), done.stderr
    assert done.stderr.startswith("message_code: ")
    assert len(done.stderr.splitlines()) == 1


def test_a_plain_field_is_two_lines(copy):
    # A number of FlightState and an array of a mission message: all that is made of them follows from the two lines.
    change(copy / "msg/FlightState.msg", "float32 air_density ",
           "float32 wet_bulb  # [degC] sim/weather/wet\nfloat32 air_density ")  # fmt: skip
    change(copy / SOURCES, "\nair_density ", "\nwet_bulb | ATMOSPHERE | sim/weather/wet | 6.4 |\nair_density ")
    change(copy / "msg/FuelState.msg", "float32 fuel_total ", "float32[2] pump  # [deg] 0..360\nfloat32 fuel_total ")
    change(copy / SOURCES, "\nfuel_total ", "\npump | FUEL | sim/fuel/pump[*] (lb) | |\nfuel_total ")
    include = copy / "include"
    assert run(copy, "core", include).returncode == 0
    assert run(copy, "nodes", include, copy).returncode == 0
    state = include / "xplane_bridge/core/state"
    assert "float wet_bulb = kNaNf;  ///< [degC] sim/weather/wet\n" in (state / "flight_state.hpp").read_text()
    assert "takeField(in.wet_bulb, s.wet_bulb);" in (state / "flight_inputs.hpp").read_text()
    assert "std::array<float, 2> pump = nanArray<2>();" in (state / "mission_state.hpp").read_text()
    made = (copy / "state_messages.cpp").read_text()
    assert made.count("putField(state.wet_bulb, &message->wet_bulb);") == 1
    assert made.count("blend.linear(&FlightState::wet_bulb);") == 1
    assert made.count("putField(state.pump, &message->pump);") == 1
    # The whole table with them is C++ that compiles.
    table = copy / "table.cpp"
    table.write_text('#include "xplane_bridge/core/state/field_lines.hpp"\n')
    eigen = subprocess.run(["pkg-config", "--cflags-only-I", "eigen3"], stdout=subprocess.PIPE, text=True, check=False)
    flags = ["-std=c++17", "-fsyntax-only", f"-I{include}", f"-I{ROOT / 'include'}", *eigen.stdout.split()]
    subprocess.run(["c++", *flags, str(table)], check=True)


def test_a_dataref_holds_until_the_version_of_the_next(copy):
    change(copy / SOURCES, "sim/time/paused |", "sim/a (s); 11.55: -; 12.08: sim/b |")
    change(copy / SOURCES, "[wire units]\n", "[wire units]\ns = 1.0\n")
    assert run(copy, "core", copy / "include").returncode == 0
    made = (copy / "include/xplane_bridge/core/state/field_lines.hpp").read_text()
    assert '{{{"sim/a", {"s", 1.0, 0.0}, {0, 115500}}, {"sim/b", {}, {120800}}}}' in made


# --- the sources in the messages' comments ---


def expand(pattern):
    """`a{b,c}[*]`, `a{1..4}`: what it stands for, elements left out."""
    ranges = re.sub(
        r"\{(\d)\.\.(\d)\}", lambda m: "{" + ",".join("123456789"[int(m[1]) - 1 : int(m[2])]) + "}", pattern
    )
    parts = [p.strip("{}").split(",") for p in re.split(r"(\{[^}]*\})", ranges.replace("[*]", ""))]
    return {"".join(choice) for choice in itertools.product(*parts)}


def received_fields():
    """Every line of the sources that is received: message, field, dataref of X-Plane 11, row of X-Plane 11."""
    message = ""
    for line in (ROOT / SOURCES).read_text(encoding="utf-8").splitlines():
        section = re.match(r"\[(\w+): ", line)
        cells = [cell.strip() for cell in line.split("|")]
        if section:
            message = section[1]
        elif (
            len(cells) == 5
            and message
            and not line.startswith("#")
            and cells[1].split()[0] not in ("input", "computed")
        ):
            dataref = "" if re.match(r"[\d.]+: ", cells[2]) else re.split(r"[ ;]", cells[2])[0]
            yield message, re.match(r"\w+", cells[0])[0], dataref, re.split(r"[ ;]", cells[3])[0]


def comment_of(message, field):
    text = (ROOT / f"msg/{message}.msg").read_text(encoding="utf-8")
    return re.search(rf"^[\w/]+(?:\[\d+\])?\s+{field}\s*# ?(.*)$", text, re.MULTILINE)[1]


@pytest.mark.parametrize(("message", "field", "dataref", "row"), received_fields())
def test_every_field_names_its_source_in_its_message(message, field, dataref, row):
    """The two places of a field name the same source: two lines of one of them that were swapped differ here."""
    comment = comment_of(message, field)
    if field == "sim_time" and message != "FlightState":
        return  # "see FlightState"
    named, _, numbers = comment.partition("| row ")
    path = re.search(r"(?:sim/|\.\.\.)[^\s;]*", named)
    if dataref and field not in ("calibrated_airspeed", "equivalent_airspeed"):
        assert path, f"msg/{message}.msg: {field} names no dataref; {SOURCES} has {dataref}"
        wanted, given = expand(dataref), expand(path[0])
        if path[0].startswith("..."):  # as the line above, with another end
            assert {name.rpartition("_")[2] for name in wanted} == {name.rpartition("_")[2] for name in given}
        else:
            assert wanted == given
    if row:
        assert numbers, f"msg/{message}.msg: {field} names no row; {SOURCES} has {row}"
        first = re.match(r"\d+(\.\d)?", numbers)[0]
        assert row.split("-")[0] in (first, first + ".0")
