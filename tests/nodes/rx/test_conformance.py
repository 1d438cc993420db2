"""The card and the nodes: what it refutes, they do otherwise; and the whole card, with a window."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import call, tx_params
from xplane_bridge import protocol
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.resources import program

ROWS = ("row1-hours", "row16", "row17-axes", "row20", "row115-bits", "row116-modes", "row28-unit")
POSITION = "sim/flightmodel/position/"
GENERATOR_OF_2, GENERATOR_OFF = "sim/cockpit2/electrical/generator_on[1]", "sim/cockpit2/annunciators/generator_off[{}]"
ALTITUDE_HOLD, CAPTURED = "sim/cockpit2/autopilot/altitude_hold_status", 2.0
PROPELLER_COMMAND = 1 << 2  # of EngineStates.valid
ACCEPTED = 1
ATTEMPTS = 4


def doctor(world, *words, **environment):
    """Flies the card against the world's X-Plane; gives the lines that it says."""
    command = [sys.executable, program("xplane_doctor"), "--host", "127.0.0.1", "--port", str(world.xplane.port)]
    done = subprocess.run(
        [*command, "--conformance", "--yes", *words],
        env={**world.env, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=600.0,  # a hang; the whole card takes minutes where other programs run
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def pilot_file(world, bank):
    file = world.folder / "pilot.yaml"
    file.write_text(f"name: turn\nevents: [{{at: 0, hold: {{roll: {bank}, altitude: 1000, speed: 72}}}}]\n", "utf-8")
    return file


def log_of(world):
    return "\n".join(path.read_text(encoding="utf-8", errors="replace") for path in Path(world.folder).rglob("*.log"))


def verdicts(lines):
    return dict(re.fullmatch(r"([a-z0-9-]+): (confirmed|refuted|not testable) \(.*\)", line).groups() for line in lines)


def settle(world, wanted, found=None, **environment):
    """Flies the card until it has these verdicts, by question; again where not: on a busy machine the simulator may be
    silent for longer than a question looks.
    """
    found = dict(found or {})
    for _ in range(ATTEMPTS):
        open_ = [question for question in wanted if found.get(question) != wanted[question]]
        if not open_:
            break
        found.update(verdicts(doctor(world, "--only", ",".join(open_), **environment)))
    assert found == wanted


def test_rows_that_are_otherwise_are_not_used(world):
    from xplane_bridge.msg import FlightState, SimStatus

    world.xplane = world.emulator(
        "--no-beacon", "--version", "12", "--pilot", pilot_file(world, 25), "--otherwise", ",".join(ROWS)
    )
    wire = world.wire(world.xplane.port)
    settle(world, dict.fromkeys(ROWS, "refuted"))
    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    states, status = world.watch("flight_state", FlightState), world.watch("mission/sim", SimStatus)
    world.start("rx_node", {"configure_xplane": True})
    wanted = FlightState.VALID_RATES | FlightState.VALID_POSITION
    turn = states.wait_for(lambda s: s.valid & wanted == wanted and 24.0 < s.roll_deg < 26.0, WAIT_S)
    # A level turn: the heading turns with g tan(bank) / V, of which pitch and yaw get their parts.
    bank = math.radians(turn.roll_deg)
    turning = 9.80665 * math.tan(bank) / turn.ground_speed
    assert turn.angular_velocity.y == pytest.approx(turning * math.sin(bank), abs=0.015)
    assert turn.angular_velocity.z == pytest.approx(turning * math.cos(bank), abs=0.015)
    assert abs(turn.angular_velocity.x) < 0.05
    assert turn.roll_deg == pytest.approx(wire.read(POSITION + "true_phi"), abs=1.0)
    assert turn.pitch_deg == pytest.approx(wire.read(POSITION + "true_theta"), abs=0.15)
    assert turn.position_source != FlightState.POSITION_FLOAT32
    assert turn.latitude == pytest.approx(wire.read(POSITION + "latitude"), abs=0.01)
    # The first may be of the time before X-Plane's version was known.
    zulu = status.wait_for(lambda s: 0.0 < s.zulu_time < 86400.0).zulu_time
    assert zulu == pytest.approx(wire.read("sim/time/zulu_time_sec"), abs=20.0)
    assert "row16 is refuted: rates are taken from datarefs, not from row 16" in log_of(world)


def test_without_the_file_those_rows_mislead(world):
    from xplane_bridge.msg import FlightState

    world.xplane = world.emulator(
        "--no-beacon", "--version", "12", "--pilot", pilot_file(world, 25), "--otherwise", ",".join(ROWS)
    )
    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    states = world.watch("flight_state", FlightState)
    world.start("rx_node", {"configure_xplane": True})
    turn = states.wait_for(lambda s: s.valid & FlightState.VALID_RATES and s.roll_deg > 20.0, WAIT_S)
    assert turn.angular_velocity.z < 0.01, "radians a second taken for degrees"


@pytest.mark.parametrize("has_file", [True, False])
def test_systems_whose_rows_are_otherwise_are_right_by_the_file_and_wrong_without(world, has_file):
    from xplane_bridge.msg import AutopilotState, EngineStates, WarningState

    rows = ("row28-unit", "row115-bits", "row116-modes")
    world.xplane = world.emulator(
        "--no-beacon", "--version", "12", "--pilot", pilot_file(world, 0), "--otherwise", ",".join(rows)
    )
    if has_file:
        settle(world, dict.fromkeys(rows, "refuted"))
    wire = world.wire(world.xplane.port)
    wire.send(protocol.DrefWrite(GENERATOR_OF_2, 0.0), protocol.CommandRequest("sim/autopilot/altitude_hold"))
    wire.wait_until_reads(GENERATOR_OFF.format(1), 1.0)
    wire.wait_until_reads(ALTITUDE_HOLD, CAPTURED)
    assert wire.read(GENERATOR_OFF.format(0)) == 0.0
    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    engines, warnings = world.watch("mission/engines", EngineStates), world.watch("mission/warnings", WarningState)
    autopilot = world.watch("mission/autopilot", AutopilotState)
    world.start("rx_node", {"configure_xplane": True})
    propellers = engines.wait_for(lambda e: e.count == 2 and e.valid & PROPELLER_COMMAND, WAIT_S).propeller_command[:2]
    lights = warnings.wait_for(lambda w: w.valid & WarningState.VALID_ENGINES, WAIT_S).generator_off[:2]
    held = autopilot.wait_for(lambda a: a.valid & AutopilotState.VALID_MODES, WAIT_S).altitude_hold_status
    governed = [wire.read(f"sim/flightmodel/engine/ENGN_prop[{engine}]") for engine in range(2)]
    assert min(governed) > 100.0, "rad/s of governors in flight"
    if has_file:
        assert propellers == pytest.approx(governed, rel=0.02)
        assert (lights, held) == ((0.0, 1.0), CAPTURED)
        for refuted in rows:
            assert re.search(rf"{refuted} is refuted: .* taken from datarefs", log_of(world))
    else:
        assert max(propellers) <= math.pi / 30.0 + 1e-6, "a ratio taken for rpm"
        assert (lights, held) == ((0.0, 0.0), 1.0), "one light taken for a bit by engine, on taken for armed"


def test_a_vehs_that_moves_nothing_is_not_sent(world):
    from xplane_bridge.msg import EventList

    world.xplane = world.emulator("--no-beacon", "--version", "12", "--otherwise", "vehs")
    assert verdicts(doctor(world, "--only", "vehs")) == {"vehs": "refuted"}
    events = world.watch("events", EventList)
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params(load_timeout=30.0))
    events.wait_for(lambda e: any("aircraft:" in event.text for event in e.events))
    there = {"latitude": 47.2, "longitude": 8.3, "altitude_msl": 1500.0, "heading_true_deg": 250.0}
    answer = call(world, "reset_flight", "ResetFlight", true_airspeed=75.0, **there)
    assert answer.result.code == ACCEPTED, answer.result.message
    reported = events.wait_for(lambda e: any(event.number == answer.event_number for event in e.events), WAIT_S)
    assert next(event for event in reported.events if event.number == answer.event_number).success
    assert "vehs is refuted: flights are placed by PREL, not by VEHS" in log_of(world)
    world.xplane.stop()
    ignored = re.search(r'^STOPPED .*"version": (\d+)', log_of(world), re.MULTILINE)
    assert ignored is not None
    assert int(ignored.group(1)) == 2, "the doctor's two, and none of tx_node's"


def test_a_file_of_another_version_is_ignored_with_a_warning(world):
    from xplane_bridge.msg import LinkState

    file = world.folder / "other.yaml"
    text = '{"format": "xplane_bridge conformance", "version": 1, "xplane_version": 120012, "questions": {}}'
    file.write_text(text, encoding="utf-8")
    world.xplane = world.emulator("--no-beacon", "--version", "12")
    world.set_param("conformance_file", str(file))
    links = world.watch("link_state", LinkState)
    world.start("rx_node")
    links.wait_for(lambda state: state.state == LinkState.CONNECTED)
    assert re.search(r"other\.yaml is for X-Plane 120012, this is 122015: ignored", log_of(world))


@pytest.mark.parametrize("switches", ["", "window-changes"])
def test_the_whole_card_on_the_ground_with_a_window(world, monkeypatch, switches):
    with VirtualDisplay(world.folder) as display:
        monkeypatch.setenv("DISPLAY", display.display)
        words = ["--start", "ground", "--window", "320x240", *(["--otherwise", switches] if switches else [])]
        world.xplane = world.emulator("--no-beacon", "--version", "12", *words)
        if switches:
            settle(world, {switches: "refuted"}, DISPLAY=display.display)
            return
        from xplane_bridge.doctor.conformance.questions import CARD

        found = verdicts(doctor(world, DISPLAY=display.display))
        assert list(found) == [question.id for question in CARD]
        settle(world, dict.fromkeys(found, "confirmed"), found, DISPLAY=display.display)
    assert world.wire(world.xplane.port).read("sim/flightmodel/failures/onground_any") == 1.0
