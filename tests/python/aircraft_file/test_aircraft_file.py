"""aircraft_config: what it sees of the emulator's aircraft, and the file that becomes of it."""

from __future__ import annotations

from typing import Any, Dict

import pytest
import yaml

from support.simulator.emulator_fixture import EmulatorFixture
from support.simulator.name_check import Use, problems
from xplane_bridge.aircraft_file import observed
from xplane_bridge.aircraft_file.observed import DESCRIPTION, ICAO, NotSeenError, Observed, taken, texts_of
from xplane_bridge.aircraft_file.text import Facts, likely_failsafe, likely_kind, likely_name, yaml_of
from xplane_bridge.cli.aircraft.aircraft_config import Asker, UnansweredError, facts_of, parser, write
from xplane_bridge.compiled import core
from xplane_bridge.in_process.aircraft import arbiter_options
from xplane_bridge.resources import config_file
from xplane_bridge.xplane_names import VERSIONS, first_version

FLEET = sorted(path.stem for path in config_file("aircraft", "README.md").parent.glob("*.yaml"))


def text(name: str, words: str) -> Dict[str, float]:
    return {f"{name}[{i}]": float(ord(letter)) for i, letter in enumerate(words)}


def asker(*options: str, ask: Any = None) -> Asker:
    return Asker(parser().parse_args(options), ask)


def seen_in_emulator(aircraft: str, version: int, number: int) -> Observed:
    """As the program gets it, but in frames that are flown on request."""
    paths = [*observed.SCALARS, *texts_of(number)]
    values: Dict[str, float] = {}
    with EmulatorFixture(aircraft=aircraft, version=str(version)) as emulator:
        emulator.step(3)
        for first in range(0, len(paths), 100):  # so many requests are read in one frame
            some = paths[first : first + 100]
            values.update(zip(some, emulator.read(*some)))
    return taken(number, values)


@pytest.mark.parametrize(
    ("aircraft", "version", "kind", "surfaces", "flaps", "retracts"),
    [
        ("fixed_wing", 11, "fixed_wing", ("ailerons", "elevators", "rudder", "speed brakes"), True, True),
        ("multirotor", 12, "multirotor", (), False, False),
        ("tiltrotor", 12, "tiltrotor", ("ailerons", "elevators", "rudder"), True, True),
    ],
)
def test_the_file_of_an_emulated_aircraft_is_the_shipped_one_in_what_matters(
    aircraft: str, version: int, kind: str, surfaces: tuple, flaps: bool, retracts: bool
) -> None:
    seen = seen_in_emulator(aircraft, version, version * 10000)
    assert (likely_kind(seen), seen.surfaces) == (kind, surfaces)
    assert (bool(seen.flap_detents), seen.retracts, seen.reverses) == (flaps, retracts, False)
    assert seen.path == (f"Aircraft/xplane_bridge/{aircraft}/{aircraft}.acf" if version == 12 else "")
    written = yaml.safe_load(yaml_of(seen, facts_of(seen, asker("--yes", "--name", aircraft))))
    shipped = yaml.safe_load(config_file("aircraft", f"{aircraft}.yaml").read_text(encoding="utf-8"))
    assert set(written["identity"]) <= set(shipped["identity"])
    assert len(written["identity"]) == 1
    for key in ("name", "engines", "failsafe", "excitation"):
        assert written[key] == shipped[key], key
    assert written.get("surfaces") == shipped.get("surfaces")
    assert set(written["channels"]) == set(shipped["channels"])
    for channel, values in shipped["channels"].items():
        for key, value in values.items():
            # The hover's lever depends on height: 0.41 at 500 m, 0.43 at the emulator's 1000 m.
            near = value if isinstance(value, str) else pytest.approx(value, abs=0.025)
            assert written["channels"][channel][key] == near, (channel, key)


def test_a_helicopter_is_flown_on_by_the_joystick() -> None:
    seen = Observed(icao="S76", description="S-76C", engines=2, helicopter=True)
    facts = facts_of(seen, asker("--yes"))
    assert (facts.name, facts.kind, facts.failsafe) == ("s_76c", "helicopter", "manual")
    assert yaml.safe_load(yaml_of(seen, facts))["channels"] == {"throttle": {"failsafe": "manual"}}
    assert likely_failsafe("fixed_wing") == "neutral"


def test_texts_end_at_their_zero_and_what_cannot_be_printed_is_a_question_mark() -> None:
    values = {**text(ICAO, "BE58"), **text(DESCRIPTION, "Bar\non"), observed.ENGINES: 2.0}
    values[f"{ICAO}[5]"] = 65.0  # behind the end
    seen = taken(115501, values)
    assert (seen.icao, seen.description, seen.path) == ("BE58", "Bar?on", "")
    seen = taken(115501, {**text(DESCRIPTION, " My Glider "), observed.ENGINES: 1.0})
    assert seen.description == " My Glider", "as tx_node reads it"
    with pytest.raises(NotSeenError, match="load one"):
        taken(115501, {})


@pytest.mark.parametrize(
    ("seen", "line"),
    [
        (Observed(icao="BE58"), "identity: [BE58]\n"),
        (Observed(icao="738"), 'identity: ["738"]\n'),  # not a number
        (Observed(icao="NO"), 'identity: ["NO"]\n'),  # not false
        (Observed(description="Aerolite 103"), 'identity: ["Aerolite 103"]    # its description'),
        (Observed(), "identity: []    # nothing to know it by"),
    ],
)
def test_an_aircraft_is_known_by_its_code_else_by_its_description(seen: Observed, line: str) -> None:
    content = yaml_of(seen, Facts("x", "fixed_wing"))
    assert line in content
    identity = seen.icao or seen.description
    assert yaml.safe_load(content)["identity"] == ([identity] if identity else [])


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("citation_x", "name: citation_x\n"),
        ("s-76", "name: s-76\n"),
        ("737", 'name: "737"\n'),
        ("747_8", 'name: "747_8"\n'),  # 7478 to YAML
        ("007", 'name: "007"\n'),
        ("on", 'name: "on"\n'),
        ("no", 'name: "no"\n'),
        ("null", 'name: "null"\n'),
        ("-", 'name: "-"\n'),
        ("2020-13-01", 'name: "2020-13-01"\n'),  # a day that there is not
        ("0x_", 'name: "0x_"\n'),  # a number without digits
    ],
)
def test_a_name_is_a_text_whatever_yaml_takes_it_for(name: str, line: str) -> None:
    content = yaml_of(Observed(icao="BE58"), facts_of(Observed(icao="BE58"), asker("--yes", "--name", name)))
    assert line in content
    assert yaml.safe_load(content)["name"] == name


def test_a_description_of_digits_makes_a_name_that_is_a_text() -> None:
    seen = Observed(icao="B748", description="747-8")
    assert yaml.safe_load(yaml_of(seen, facts_of(seen, asker("--yes"))))["name"] == "747_8"


def test_a_hover_is_seen_only_while_it_is_flown() -> None:
    flown = {observed.ENGINES: 4.0, observed.HEIGHT: 20.0, observed.GROUND_SPEED: 0.1, observed.CLIMB: -0.1}
    flown[observed.LEVER] = 0.55
    assert taken(115501, flown).hover == 0.55
    for path, value in ((observed.HEIGHT, 0.5), (observed.GROUND_SPEED, 2.0), (observed.CLIMB, -2.0)):
        assert taken(115501, {**flown, path: value}).hover is None


def test_no_question_is_asked_where_there_is_no_terminal_or_yes_was_given() -> None:
    seen = Observed(icao="QUAD", description="Quad", engines=4)
    with pytest.raises(UnansweredError, match="name of the aircraft: X-Plane does not show it; give --name, or --yes"):
        facts_of(seen, asker())
    with pytest.raises(UnansweredError, match=r"give --hover-throttle$"):
        facts_of(seen, asker("--yes"))
    facts = facts_of(seen, asker("--yes", "--hover-throttle", "0.6"))
    assert (facts.name, facts.kind, facts.hover_throttle) == ("quad", "multirotor", 0.6)
    with pytest.raises(UnansweredError, match="--name: 'a b': expected letters"):
        facts_of(seen, asker("--yes", "--name", "a b", "--hover-throttle", "0.6"))


def test_questions_are_asked_again_until_the_answer_can_be(capsys: Any) -> None:
    typed = iter(["my plane", "mine", "", "zero", "hold", "yes"])
    prompts = []

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        return next(typed)

    seen = Observed(icao="C750", description="Citation X", engines=2, reverses=True, surfaces=("ailerons",))
    facts = facts_of(seen, asker(ask=ask))
    assert facts == Facts("mine", "fixed_wing", "hold", None, True)
    assert prompts[0] == "name of the aircraft (--name) [citation_x]: "
    assert capsys.readouterr().out.count("expected") == 2
    content = yaml.safe_load(yaml_of(seen, facts))
    assert (content["reverse_thrust"], content["channels"]["throttle"]) == (True, {"failsafe": "hold"})
    assert likely_name(Observed()) == "my_aircraft"


def test_a_file_that_is_there_is_kept(tmp_path: Any) -> None:
    path = tmp_path / "mine.yaml"
    write(path, "a", False)
    with pytest.raises(UnansweredError, match="is there already; give --output FILE for another, or --force"):
        write(path, "b", False)
    assert path.read_text() == "a"
    write(path, "b", True)
    assert path.read_text() == "b"
    with pytest.raises(UnansweredError, match="cannot be written"):
        write(tmp_path / "no" / "mine.yaml", "b", True)


def test_what_is_asked_for_exists_in_every_version_that_is_asked() -> None:
    uses = [Use("aircraft_config", path, "read") for path in (observed.VERSION, *observed.SCALARS)]
    for version in VERSIONS:
        uses += [Use("aircraft_config", path, "read", (version,)) for path in texts_of(first_version(version))]
    assert problems(uses, {}) == []


@pytest.mark.parametrize("stem", FLEET)
def test_every_shipped_file_makes_an_arbiter(stem: str) -> None:
    content = config_file("aircraft", f"{stem}.yaml").read_text(encoding="utf-8")
    document = yaml.safe_load(content)
    assert document["name"] == stem
    assert document["identity"]
    assert all(isinstance(code, str) and len(code) <= 4 for code in document["identity"])
    if core is None:
        pytest.skip("the compiled module is not there")
    core.ControlArbiter(arbiter_options(stem), 0.0)


def test_the_default_fleets_are_there_with_their_sources() -> None:
    fleet = [stem for stem in FLEET if stem not in ("fixed_wing", "multirotor", "tiltrotor")]
    assert len(fleet) >= 8
    for stem in fleet:
        content = config_file("aircraft", f"{stem}.yaml").read_text(encoding="utf-8")
        assert "ICAO code by public sources:" in content
        assert "Not verified" in content


def test_the_conversion_of_an_option_says_what_it_expects() -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(["--hover-throttle", "2"])
    with pytest.raises(SystemExit):
        parser().parse_args(["--port", "70000"])
