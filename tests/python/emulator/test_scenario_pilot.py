"""What the emulator's pilot refuses before it flies, and where it starts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Iterator, List

import pytest

from support.room_table import ROOT
from support.simulator.emulator_bench import row
from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.options import parse
from xplane_bridge.emulator.scenario_pilot import SYSTEMS, ScenarioPilot, failure_leaves
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.scenario import Scenario, ScenarioError, parse_scenario
from xplane_bridge.xplane_names import NEWEST


def scenario(*events: dict) -> Scenario:
    return parse_scenario({"name": "t", "events": list(events)})


def test_pilot_refuses_what_it_cannot_do() -> None:
    with pytest.raises(ScenarioError, match="surfaces fail through tx_node"):
        ScenarioPilot(
            scenario({"at": 0, "failure": {"name": "aileron1_wing2_left", "kind": "stuck", "value": 5}}), NEWEST["11"]
        )
    for more in ({"kind": "reduced", "value": 0.5}, {"value": 1}):
        with pytest.raises(ScenarioError, match=r"engine_1.*expected kind failed, and no value: a system works"):
            ScenarioPilot(scenario({"at": 0, "failure": {"name": "engine_1", **more}}), NEWEST["11"])


def test_a_system_fails_as_by_tx_node() -> None:
    """The names, their number and the datarefs of lib/core/failures/failures.cpp."""
    text = (ROOT / "lib/core/failures/failures.cpp").read_text(encoding="utf-8")
    counts = {name: int(count) for name, count in re.findall(r'^ +\{"(\w+)", (\d),', text, re.MULTILINE)}
    assert set(SYSTEMS) == {f"{name}_{i + 1}" for name, count in counts.items() for i in range(count)}
    for leaves in SYSTEMS.values():
        assert all(failure_leaves(leaf) == (leaf,) for leaf in leaves)
    assert SYSTEMS["engine_1"] == ("rel_engfai0",)
    assert (SYSTEMS["bus_1"], SYSTEMS["bus_6"]) == (("rel_esys",), ("rel_esys6",))
    assert SYSTEMS["gyro_2"] == ("rel_cop_ahz", "rel_cop_dgy")
    pilot = ScenarioPilot(
        scenario({"at": 0, "failure": {"name": "gyro_1"}}, {"at": 1, "failure": {"name": "gyro_1", "clear": True}},
                 {"at": 2, "failure": {"name": "gyro_1"}}, {"at": 3, "clear_failures": True}),
        NEWEST["11"],
    )  # fmt: skip
    names = [f"sim/operation/failures/{leaf}" for leaf in ("rel_ss_ahz", "rel_ss_dgy")]
    frame = Simulator(create_model, "fixed_wing").frame
    for time, value in enumerate((6.0, 0.0, 6.0, 0.0)):
        assert set(pilot(float(time), frame).datarefs) == {(name, value) for name in names}


@pytest.mark.parametrize("name", ["engine_9", "engine_12", "generator_9", "bus_7", "gyro_3", "rel_nonsense", "wing"])
def test_the_pilot_refuses_a_failure_that_no_x_plane_has(name: str) -> None:
    with pytest.raises(ScenarioError, match=rf"failure '{name}': expected engine_1\.\.8, bus_1\.\.6, .* or a rel_\*"):
        ScenarioPilot(scenario({"at": 0, "failure": {"name": name}}), NEWEST["11"])


@pytest.mark.parametrize("version", ["11", "12"])
def test_the_pilot_refuses_a_failure_of_another_x_plane(version: str) -> None:
    asked = scenario({"at": 0, "failure": {"name": "rel_fcon_ailn_1_lft_mxup"}})
    if version == "12":
        ScenarioPilot(asked, NEWEST[version])
        return
    with pytest.raises(ScenarioError, match=rf"or a rel_\* dataref that X-Plane {NEWEST[version]} has"):
        ScenarioPilot(asked, NEWEST[version])


@pytest.mark.parametrize("version", ["11", "12"])
def test_the_pilot_takes_every_system_in_every_x_plane(version: str) -> None:
    for name in SYSTEMS:
        ScenarioPilot(scenario({"at": 0, "failure": {"name": name}}), NEWEST[version])


@pytest.mark.parametrize("target", ["throttle", "aileron1_wing2_left", "roll,pitch"])
def test_the_emulators_pilot_refuses_excitations_that_it_does_not_fly(target: str) -> None:
    excitation = {"kind": "multisine", "amplitude": 0.1, "duration": 2}
    for axis in ("roll", "pitch", "yaw"):
        ScenarioPilot(scenario({"at": 0, "excitation": {**excitation, "target": axis}}), NEWEST["11"])
    with pytest.raises(ScenarioError, match=r"excitation.*: the emulator's pilot moves .*; tx_node moves"):
        ScenarioPilot(scenario({"at": 0, "excitation": {**excitation, "target": target}}), NEWEST["11"])


@pytest.mark.parametrize(
    ("given", "start"),
    [
        ("", (-10.0, 20.0, 2000.0, 270.0, 60.0, False)),
        ("--alt 1500 --lat 5 --speed 70", (5.0, 20.0, 1500.0, 270.0, 70.0, False)),
        ("--start ground --lon 21 --heading 10", (-10.0, 21.0, 2000.0, 10.0, 60.0, True)),
    ],
)
def test_a_flight_starts_as_its_scenario_says_where_the_command_line_says_nothing(
    tmp_path: Path, given: str, start: tuple
) -> None:
    text = """
name: far
start: {latitude: -10, longitude: 20, altitude: 2000, heading: -90, speed: 60}
aerodrome: {latitude: -10.1, longitude: 20.1, heading: 45}
events: [{at: 0, hold: {roll: 0}}]
"""
    (tmp_path / "far.yaml").write_text(text, encoding="utf-8")
    words = f"--port 0 --bind 127.0.0.1 --no-beacon --stepped --model kinematic --pilot {tmp_path / 'far.yaml'} {given}"
    emulator = Emulator(parse(words.split()))
    began, home = emulator.sim.initial, emulator.sim.home
    emulator.close()
    found = (began.latitude_deg, began.longitude_deg, began.altitude_m, began.heading_deg, began.airspeed_mps)
    assert (*found, began.on_ground) == start
    assert (home.latitude_deg, home.longitude_deg, home.heading_deg) == (-10.1, 20.1, 45.0)
    assert emulator.options.aerodrome == (-10.1, 20.1, 45.0)


def test_a_scenario_may_start_on_the_ground(tmp_path: Path) -> None:
    (tmp_path / "taxi.yaml").write_text("name: taxi\nstart: {on_ground: true}\nevents: [{at: 0, hold: {roll: 0}}]\n")
    words = ["--port", "0", "--bind", "127.0.0.1", "--no-beacon", "--stepped", "--pilot", str(tmp_path / "taxi.yaml")]
    for more, on_ground in ((), True), (("--start", "air"), False):
        emulator = Emulator(parse([*words, *more]))
        emulator.close()
        assert emulator.sim.initial.on_ground is on_ground
        assert emulator.sim.initial.latitude_deg == 37.4602


CONTROLS, OVERRIDE = "sim/cockpit2/controls/", "sim/operation/override/override_joystick"
TRIM, FLAPS = CONTROLS + "elevator_trim", CONTROLS + "flap_ratio"
THROTTLE = "sim/cockpit2/engine/actuators/throttle_ratio"


@pytest.fixture(name="flown")
def fixture_flown(tmp_path: Path) -> Iterator[EmulatorFixture]:
    """The pilot sets handles at once, and another trim after a second."""
    path = tmp_path / "handles.yaml"
    path.write_text(
        """
name: handles
events:
  - {at: 0, stick: {throttle: 0.7}, handles: {trim_pitch: 0.1, flaps: 0.5}}
  - {at: 1, handles: {trim_pitch: 0.3}}
"""
    )
    with EmulatorFixture(aircraft="fixed_wing", pilot=path) as emulator:
        emulator.step(2)
        assert emulator.read(TRIM, FLAPS, THROTTLE) == pytest.approx([0.1, 0.5, 0.7])
        yield emulator


@pytest.mark.parametrize("overrides", [[""], ["_pitch", "_roll", "_heading"]])
def test_the_pilot_leaves_trims_and_handles_to_who_takes_the_stick(
    flown: EmulatorFixture, overrides: List[str]
) -> None:
    flown.write({**{OVERRIDE + each: 1.0 for each in overrides}, TRIM: -0.2, FLAPS: 0.0})
    flown.step(90)
    assert flown.read(TRIM, FLAPS) == pytest.approx([-0.2, 0.0])
    flown.write({OVERRIDE + each: 0.0 for each in overrides})
    assert flown.read(TRIM, FLAPS) == pytest.approx([0.3, 0.5])


def test_the_pilot_leaves_a_trim_where_a_failure_has_moved_it(flown: EmulatorFixture) -> None:
    runaway = "sim/operation/failures/rel_elv_trim_run"
    flown.write({runaway: 6.0})
    flown.step(20)
    flown.write({runaway: 0.0})
    (moved,) = flown.read(TRIM)
    assert moved == pytest.approx(0.1 + 0.05 * 20 / 60, abs=0.002)
    flown.step(5)
    assert flown.read(TRIM) == [moved]


def test_data_rows_hold_levers_and_handles_against_the_pilot(flown: EmulatorFixture) -> None:
    client = flown.client()
    for packet in (row(25, 0.2, 0.2), row(13, -0.4, -999.0, -999.0, 1.0)):
        client.send(packet)
    flown.step(90)
    assert flown.read(THROTTLE, TRIM, FLAPS) == pytest.approx([0.2, -0.4, 1.0])
    for index in (13, 25):
        client.send(row(index))
    assert flown.read(THROTTLE, TRIM, FLAPS) == pytest.approx([0.7, 0.3, 0.5])
