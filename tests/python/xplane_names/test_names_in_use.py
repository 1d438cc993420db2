"""Every dataref and command that the package uses is one of X-Plane's, in each version that it is used with."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from support.simulator import failure_name_lines, name_check
from support.simulator.name_check import Use, problem, problems, uses_in_dump, word_problem, words_in
from xplane_bridge import xplane_names
from xplane_bridge.doctor import names as doctor_names
from xplane_bridge.eye import names as eye_names
from xplane_bridge.xplane_names import VERSIONS

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = ROOT / ".workspace/devel/lib/xplane_bridge/simulator_names"

#: Paths that are used although a list speaks against it, and why.
EXCEPTIONS = {
    "sim/cockpit2/autopilot/airspeed_dial_kts_mach": "knots or Mach, distinguished by size and made m/s after decoding",
    **{
        f"sim/cockpit2/radios/actuators/com{number}_{standby}frequency_hz_833": "kHz in the newest list and in panels"
        for number in (1, 2)
        for standby in ("", "standby_")
    },
    **{
        f"sim/cockpit2/radios/actuators/adf{number}_{standby}frequency_hz": "kHz in public panels: 375 for 375 kHz"
        for number in (1, 2)
        for standby in ("", "standby_")
    },
    **{
        f"sim/weather/region/{name}_speed_msc[{layer}]": "the list of 2026 corrects kts to m/s"
        for name in ("wind", "shear")
        for layer in range(13)
    },
    **{f"sim/weather/cloud_type[{layer}]": "an enumeration" for layer in range(3)},
    **{f"sim/weather/aircraft/cloud_type[{layer}]": "an enumeration, blended" for layer in range(3)},
    **{f"sim/weather/aircraft/cloud_coverage_percent[{layer}]": "a part of 1" for layer in range(3)},
}

#: Words in sources and texts that are no names of X-Plane's, and why.
NO_NAMES = {
    "sim/a": "made up, in tests of the syntax of paths",
    "sim/b": "made up, in tests of the syntax of sources",
    "sim/c": "made up, in tests of the syntax of sources",
    "sim/weather/wet": "made up, in tests of the syntax of sources",
    "sim/fuel/pump": "made up, in tests of the syntax of sources",
    "sim/a/b": "made up, in tests of the syntax of paths",
    "sim/a/lever": "made up, in a test of the release worker",
    "sim/x/y": "made up, in a comment on the syntax of paths",
    "sim/none": "a name that X-Plane does not have, in tests",
    "sim/no/such": "a name that X-Plane does not have, in tests",
    "sim/no/such/dataref": "a name that X-Plane does not have, in tests",
    "sim/no/such_dataref": "a name that X-Plane does not have, in tests",
    "sim/no/such_command": "a name that X-Plane does not have, in tests",
    "sim/operation/failures/rel_inver0": "a name that X-Plane does not have, in tests",
    "sim/operation/failures/rel_fcon_flap_1_lft_cntr": "a name that X-Plane does not have, in tests",
    "sim/operation/override/override_joystik": "a name that X-Plane does not have, in tests",
    "sim/operation/failures/rel_nothing": "a name that X-Plane does not have, in tests",
    "sim/operation/failures/rel_of_another_version": "a name that X-Plane does not have, in tests",
    "sim/flightmodel/engine/ENGN_thro_override[1]": "an element of a scalar, in tests",
    "sim/time/sim_speed[1]": "an element of a scalar, in tests",
    "sim/flightmodel/position/local_v": "the axis is put behind it, in a test",
    "sim/weather/shear_speed_kt": "[layer] is put behind it, in a test",
    "sim/weather/turbulence": "[layer] is put behind it, in a test",
}


@pytest.fixture(name="dump", scope="module")
def fixture_dump():
    if not (ROOT / ".workspace").is_dir():
        pytest.skip("nothing is built here")
    if not PROGRAM.is_file():
        pytest.fail(f"{PROGRAM} is missing: build it with scripts/setup --test")
    numbers = [str(xplane_names.first_version(version)) for version in VERSIONS]
    return subprocess.run([str(PROGRAM), *numbers], stdout=subprocess.PIPE, text=True, check=True).stdout


# --- C++ ---


def test_the_cpp_tables_use_what_each_version_has(dump):
    uses = uses_in_dump(dump)
    assert len(uses) > 1000
    assert problems(uses, EXCEPTIONS) == []


def test_no_exception_is_superfluous(dump):
    paths = {use.path for use in uses_in_dump(dump) if problem(use)}
    assert set(EXCEPTIONS) - paths == set()


def test_the_dump_has_every_name_that_the_cpp_sources_spell(dump):
    """Or else, what a source spells is a dataref of every version that is only read."""
    printed = {line.split("\t")[2] for line in dump.splitlines()}
    missing = [
        Use(str(path.relative_to(ROOT)), literal, "read")
        for folder in ("include", "lib")
        for path in sorted((ROOT / folder).rglob("*.[ch]pp"))
        for literal in re.findall(r'"(sim/[^"{]*)', without_comments(path.read_text(encoding="utf-8")))
        if not any(name.startswith(literal.split("[")[0]) for name in printed)
    ]
    assert len(missing) < 3
    assert problems(missing, {}) == []


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def test_the_cpp_table_of_failures_is_that_of_the_lists():
    text = failure_name_lines.rendered()
    assert failure_name_lines.FILE.read_text(encoding="utf-8") == text, "write it with failure_name_lines.py"


# --- Python, configuration, texts ---


def test_every_name_in_sources_configuration_and_texts_is_one_of_x_planes():
    wrong, seen = [], set()
    for path in tracked_texts():
        for word in words_in(path.read_text(encoding="utf-8")):
            base = re.split(r"[\[{]", word)[0]
            seen.update((word, base))
            if not NO_NAMES.keys() & {word, base} and word_problem(word):
                wrong.append(f"{path.relative_to(ROOT)}: {word}: {word_problem(word)}")
    assert wrong == []
    assert set(NO_NAMES) - seen == set()


def tracked_texts():
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), "ls-files", "-z"]
    listing = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    suffixes = {".py", ".cpp", ".hpp", ".md", ".yaml", ".rst", ".msg", ".srv", ".launch", ".json", ""}
    for name in listing.split("\0"):
        path = ROOT / name
        if name and path.suffix in suffixes and path.is_file() and path != Path(__file__):
            yield path


def test_what_the_doctor_reads_is_in_every_version():
    names = [
        path
        for value in vars(doctor_names).values()
        for path in ([value] if isinstance(value, str) else value if isinstance(value, tuple) else [])
        if isinstance(path, str) and path.startswith("sim/")
    ]
    assert len(names) > 20
    assert problems([Use("doctor", name, "read") for name in names], {}) == []


def test_what_the_eye_reads_and_writes_is_in_every_version():
    uses = [Use("eye", name, "read") for name in eye_names.SUBSCRIBED]
    assert problems([*uses, Use("eye", eye_names.FIELD_OF_VIEW, "write")], {}) == []


def test_what_release_overrides_writes_can_be_written_in_every_version():
    text = (ROOT / "scripts/release_overrides").read_text(encoding="utf-8")
    names = {word for word in words_in(text) if not word.endswith("/")}
    assert len(names) >= 8
    how = {"sim/time/paused": "read", "sim/operation/pause_toggle": "command"}
    assert set(how) < names
    assert problems([Use("release_overrides", name, how.get(name, "write")) for name in sorted(names)], {}) == []


# --- the check itself ---


@pytest.mark.parametrize(
    ("use", "complaint"),
    [
        (Use("", "sim/time/pause", "read"), "there is no such dataref (list of 11.40)"),
        (Use("", "sim/operation/pause_on", "command"), "there is no such command (list of 11.40)"),
        (Use("", "sim/aircraft/view/acf_ui_name[0]", "read"), "there is no such dataref (list of 11.40)"),
        (Use("", "sim/flightmodel/engine/ENGN_thro[8]", "read"), "it has 8 elements (list of 11.40)"),
        (Use("", "sim/flightmodel/engine/ENGN_thro", "read", size=16), "it has 8 elements, not 16 (list of 11.40)"),
        (Use("", "sim/time/paused[1]", "read"), "it is not an array (list of 11.40)"),
        (Use("", "sim/time/paused", "write"), "it cannot be written (list of 11.40)"),
        (Use("", "sim/cockpit2/autopilot/servos_on", "write", ("12.10", "11.55")), "it cannot be written"),
        (
            Use("", "sim/cockpit2/gauges/indicators/altitude_ft_pilot", "read", unit="m"),
            "its unit is 'feet', taken as 'm'",
        ),
        (Use("", "sim/operation/failures/rel_prpsep0", "write", ("12.08", "12.00")), "no such dataref (list of 12.00)"),
        (Use("", "sim/made/up"), "there is no such dataref"),
    ],
)
def test_each_kind_of_mistake_is_found(use, complaint):
    assert complaint in problem(use)


@pytest.mark.parametrize(
    "use",
    [
        Use("", "sim/operation/pause_on", "command", ("12.10",)),
        Use("", "sim/operation/pause_on"),
        Use("", "sim/flightmodel/engine/ENGN_thro[8]", "write", ("12.08", "12.10")),
        Use("", "sim/weather/wind_speed_kt[0]", "write", unit="kt", versions=("11.40", "11.55", "12.00")),
        Use("", "sim/time/paused[0]", "read"),
        Use("", "sim/flightmodel/engine/ENGN_power", "read", unit="W"),  # the list gives no unit
    ],
)
def test_what_is_right_passes(use):
    assert problem(use) == ""


@pytest.mark.parametrize(
    "line",
    [
        "114000\tread\tsim/flightmodel2/position/pressure_altitude\tft",
        "122015\tcommand\tsim/operation/pause_o\t",
        "120000\twrite\tsim/flightmodel2/misc/cg_offset_z\t",
        "114000\tread\tsim/cockpit2/electrical/bus_volts[6]\tV",
        "114000\twrite\tsim/cockpit2/electrical/bus_volts[5]\tV",
        "114000\tread\tsim/cockpit2/electrical/bus_volts[5]\tA",
    ],
)
def test_a_mistake_in_the_dump_is_found(line):
    good = "114000\tread\tsim/cockpit2/electrical/bus_volts[5]\tV"
    assert problems(uses_in_dump(good), {}) == []
    assert len(problems(uses_in_dump(f"{good}\n{line}\n"), {})) == 1
    assert problems(uses_in_dump(line), {line.split("\t")[2]: "a reason"}) == []


@pytest.mark.parametrize(
    ("text", "words", "good"),
    [
        ("see `sim/time/paused`.", ["sim/time/paused"], True),
        ("see `sim/time/pause`.", ["sim/time/pause"], False),
        ("`sim/operation/override/*`", ["sim/operation/override/"], True),
        ('"sim/operation/overide/" + name', ["sim/operation/overide/"], False),
        ("sim/flightmodel/position/local_{x,y,z}", ["sim/flightmodel/position/local_{x,y,z}"], True),
        ('f"sim/weather/turbulence[{layer}]"', ["sim/weather/turbulence[{layer}]"], True),
        ('name: "sim/flightmodel/engine/ENGN_thro[0:16]"', ["sim/flightmodel/engine/ENGN_thro[0:16]"], True),
        ('name: "sim/flightmodel/engine/ENGN_thro[0:17]"', ["sim/flightmodel/engine/ENGN_thro[0:17]"], False),
        ("sim/network/dataout/data_to_internet[i]", ["sim/network/dataout/data_to_internet[i]"], True),
        ("protocol/sim/time", [], True),
    ],
)
def test_words_of_texts_are_judged(text, words, good):
    assert words_in(text) == words
    assert all(not word_problem(word) for word in words) is good


def test_no_spelling_of_the_lists_stands_for_two_units():
    # a clock's three hands are in three units, each of which has its own line
    vague = ("h, min, s", "-", "0, 1", "0..1", "0..1.5", "-0.5..1", "-1..1", "deg magnetic")
    spelt = [spelling for unit, spellings in name_check.UNITS.items() if unit not in vague for spelling in spellings]
    assert len(set(spelt)) == len(spelt)
